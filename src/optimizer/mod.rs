//! Population-based searches over a box of real numbers. They use an [`Objective`] and know nothing of aircraft.
//!
//! A new algorithm needs one file beside `tms_sba.rs` and one row in [`ALL`]; the planner chooses the meaning of its
//! positions by its name, in a table that a test holds complete.

mod abc;
mod ba;
mod particles;
mod pso;
mod random;
mod ranking;
mod sba;
mod spso;
mod swarm;
mod tms_sba;

pub use random::Random;
pub use swarm::Swarm;

use std::cmp::Ordering;

/// Quality of a position by Deb's rule: less violation first, then less cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitness {
    /// Total constraint violation, 0 when feasible.
    pub violation: f64,
    /// To be minimised.
    pub cost: f64,
}

impl Fitness {
    /// Worse than any other.
    pub const WORST: Self = Self {
        violation: f64::INFINITY,
        cost: f64::INFINITY,
    };

    /// Of nothing flown.
    pub const ZERO: Self = Self {
        violation: 0.0,
        cost: 0.0,
    };

    /// The total order of Deb's rule; better is `Less`. What is no number is as bad as what is infinite.
    #[must_use]
    pub fn rank(&self, other: &Self) -> Ordering {
        let ordered = |one: f64, other: f64| amount(one).total_cmp(&amount(other));
        ordered(self.violation, other.violation).then(ordered(self.cost, other.cost))
    }

    /// Whether it is strictly better than `other`.
    #[must_use]
    pub fn beats(&self, other: &Self) -> bool {
        self.rank(other) == Ordering::Less
    }

    /// Whether all constraints are satisfied.
    #[must_use]
    pub fn is_feasible(&self) -> bool {
        self.violation <= 0.0
    }
}

/// Where it is no number, its sign, by which numbers would be ordered, differs from processor to processor.
fn amount(value: f64) -> f64 {
    if value.is_nan() { f64::INFINITY } else { value }
}

/// The box of allowed positions, one interval per dimension.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// Least value of each dimension.
    pub lower: Vec<f64>,
    /// Greatest value of each dimension.
    pub upper: Vec<f64>,
}

impl Bounds {
    /// Number of dimensions.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.lower.len()
    }

    /// Width of dimension `dim`.
    #[must_use]
    pub fn range(&self, dim: usize) -> f64 {
        self.upper[dim] - self.lower[dim]
    }

    /// Write a uniformly random position within the box.
    pub fn draw(&self, random: &mut Random, position: &mut [f64]) {
        for (value, (lower, upper)) in position.iter_mut().zip(self.lower.iter().zip(&self.upper)) {
            *value = random.between(*lower, *upper);
        }
    }

    /// Clamp `position` to the box.
    pub fn clamp(&self, position: &mut [f64]) {
        for (value, (lower, upper)) in position.iter_mut().zip(self.lower.iter().zip(&self.upper)) {
            // Equal to `f64::clamp` without its check that the bounds are in order, so that it vectorises.
            let raised = if *value < *lower { *lower } else { *value };
            *value = if raised > *upper { *upper } else { raised };
        }
    }
}

/// The function to minimise.
pub trait Objective {
    /// The box of allowed positions.
    fn bounds(&self) -> &Bounds;

    /// Write an initial position, by default uniform within the bounds.
    fn draw(&mut self, random: &mut Random, position: &mut [f64]) {
        self.bounds().draw(random, position);
    }

    /// Whether it can generate neighbours of a position; see [`Objective::walk`].
    fn walks(&self) -> bool {
        false
    }

    /// Write a neighbour of `base` into `candidate`; `size`, 0 to 1, limits its distance.
    fn walk(&mut self, _random: &mut Random, base: &[f64], _size: f64, candidate: &mut [f64]) {
        candidate.copy_from_slice(base);
    }

    /// Evaluate `fitness.len()` positions, stored consecutively.
    fn evaluate(&mut self, positions: &[f64], fitness: &mut [Fitness]);

    /// As [`Objective::evaluate`], for positions that matter only if they beat their `rivals`, one for each. A
    /// position that does not beat its rival may get any fitness that does not, either.
    fn evaluate_against(
        &mut self,
        positions: &[f64],
        _rivals: &[Fitness],
        fitness: &mut [Fitness],
    ) {
        self.evaluate(positions, fitness);
    }
}

/// A running search.
pub trait Optimizer {
    /// Do one iteration; `progress` is the completed fraction of the run, 0 to 1.
    fn iterate(&mut self, objective: &mut dyn Objective, progress: f64);

    /// The population and the best position found so far.
    fn swarm(&self) -> &Swarm;
}

/// One constant of an algorithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// As used in `planner.parameters`.
    pub name: &'static str,
    /// Value if the caller sets none.
    pub default: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// Description for the user.
    pub meaning: &'static str,
}

/// An entry in a table of constants.
const fn parameter(
    name: &'static str,
    default: f64,
    min: f64,
    max: f64,
    meaning: &'static str,
) -> Parameter {
    Parameter {
        name,
        default,
        min,
        max,
        meaning,
    }
}

/// An algorithm by name.
#[derive(Debug, Clone, Copy)]
pub struct Algorithm {
    /// As used in `planner.algorithm`.
    pub name: &'static str,
    /// Display name.
    pub title: &'static str,
    /// Publication.
    pub source: &'static str,
    /// Its constants.
    pub parameters: &'static [Parameter],
    /// Draw and evaluate the initial population.
    pub start: fn(&Settings, &mut dyn Objective) -> Box<dyn Optimizer>,
}

/// How to run an algorithm.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Number of bats, particles or bees, >= 1.
    pub population: usize,
    /// Seed of all its random numbers.
    pub seed: u64,
    /// Value of each parameter, in the order of the algorithm's table.
    pub parameters: Vec<f64>,
}

impl Algorithm {
    /// The values of all parameters: those given by `chosen`, otherwise the defaults.
    #[must_use]
    pub fn parameters_with(&self, chosen: impl Fn(&str) -> Option<f64>) -> Vec<f64> {
        self.parameters
            .iter()
            .map(|p| chosen(p.name).unwrap_or(p.default))
            .collect()
    }
}

/// Every algorithm; the first is the default.
pub const ALL: &[Algorithm] = &[
    tms_sba::ALGORITHM,
    sba::ALGORITHM,
    spso::ALGORITHM,
    ba::ALGORITHM,
    pso::ALGORITHM,
    abc::ALGORITHM,
];

/// The algorithm with that name.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static Algorithm> {
    ALL.iter().find(|algorithm| algorithm.name == name)
}

/// As many of `count` as make up `share`, 0 to 1, rounded down.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share below 1 of a count"
)]
pub(crate) fn share_of(count: usize, share: f64) -> usize {
    (count as f64 * share) as usize
}

#[cfg(test)]
mod tests;
