//! Population searches over a box of real numbers. They know an [`Objective`], not an aircraft.
//!
//! Adding an algorithm is one file beside `tms_sba.rs` and one row of [`ALL`].

mod random;
mod swarm;
mod tms_sba;

pub use random::Random;
pub use swarm::Swarm;

use std::cmp::Ordering;

/// How good a position is, by Deb's rule: less violation first, then less cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitness {
    /// Total violation of the constraints, 0 when feasible.
    pub violation: f64,
    /// To be minimised.
    pub cost: f64,
}

impl Fitness {
    /// Worse than everything.
    pub const WORST: Self = Self {
        violation: f64::INFINITY,
        cost: f64::INFINITY,
    };

    /// The total order of Deb's rule; better is less.
    #[must_use]
    pub fn rank(&self, other: &Self) -> Ordering {
        self.violation
            .total_cmp(&other.violation)
            .then(self.cost.total_cmp(&other.cost))
    }

    /// Whether it is strictly better than `other`.
    #[must_use]
    pub fn beats(&self, other: &Self) -> bool {
        self.rank(other) == Ordering::Less
    }

    /// Whether every constraint is kept.
    #[must_use]
    pub fn is_feasible(&self) -> bool {
        self.violation <= 0.0
    }
}

/// The box that positions are kept in, one interval a dimension.
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

    /// Write a position uniform within the box.
    pub fn draw(&self, random: &mut Random, position: &mut [f64]) {
        for (value, (lower, upper)) in position.iter_mut().zip(self.lower.iter().zip(&self.upper)) {
            *value = random.between(*lower, *upper);
        }
    }

    /// Bring `position` into the box.
    pub fn clamp(&self, position: &mut [f64]) {
        for (value, (lower, upper)) in position.iter_mut().zip(self.lower.iter().zip(&self.upper)) {
            *value = value.clamp(*lower, *upper);
        }
    }
}

/// What is searched.
pub trait Objective {
    /// Where positions may lie.
    fn bounds(&self) -> &Bounds;

    /// Write a start position, by default uniform within the bounds.
    fn draw(&mut self, random: &mut Random, position: &mut [f64]) {
        self.bounds().draw(random, position);
    }

    /// Whether it knows neighbours of a position, see [`Objective::walk`].
    fn walks(&self) -> bool {
        false
    }

    /// Write a neighbour of `base` into `candidate`; `size`, 0 to 1, tells how far it may be.
    fn walk(&mut self, _random: &mut Random, base: &[f64], _size: f64, candidate: &mut [f64]) {
        candidate.copy_from_slice(base);
    }

    /// Price `fitness.len()` positions, laid end to end.
    fn evaluate(&mut self, positions: &[f64], fitness: &mut [Fitness]);
}

/// A running search.
pub trait Optimizer {
    /// Do one iteration; `progress` is the share of the run that is done, 0 to 1.
    fn iterate(&mut self, objective: &mut dyn Objective, progress: f64);

    /// The population and the best position so far.
    fn swarm(&self) -> &Swarm;
}

/// One constant of an algorithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// As in `planner.parameters`.
    pub name: &'static str,
    /// Used when the caller sets none.
    pub default: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// For people.
    pub meaning: &'static str,
}

/// An algorithm by name.
#[derive(Debug, Clone, Copy)]
pub struct Algorithm {
    /// As in `planner.algorithm`.
    pub name: &'static str,
    /// For people.
    pub title: &'static str,
    /// Where it was published.
    pub source: &'static str,
    /// Its constants.
    pub parameters: &'static [Parameter],
    /// Draw and price the first population.
    pub start: fn(&Settings, &mut dyn Objective) -> Box<dyn Optimizer>,
}

/// How to run an algorithm.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Number of bats, particles or bees, >= 1.
    pub population: usize,
    /// Of all its random numbers.
    pub seed: u64,
    /// Value of each parameter, in the order of the algorithm's table.
    pub parameters: Vec<f64>,
}

impl Algorithm {
    /// The values of all parameters, `chosen` where it names one, defaults elsewhere.
    #[must_use]
    pub fn parameters_with(&self, chosen: impl Fn(&str) -> Option<f64>) -> Vec<f64> {
        self.parameters
            .iter()
            .map(|p| chosen(p.name).unwrap_or(p.default))
            .collect()
    }
}

/// Every algorithm; the first is the default.
pub const ALL: &[Algorithm] = &[tms_sba::ALGORITHM];

/// The algorithm of that name.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static Algorithm> {
    ALL.iter().find(|algorithm| algorithm.name == name)
}

/// What every row of the table must do.
#[cfg(test)]
mod tests {
    use super::*;

    /// A standard function, shifted so that its minimum is nowhere special.
    struct Standard {
        bounds: Bounds,
        of: fn(&[f64]) -> f64,
        outside: usize,
    }

    impl Standard {
        fn new(dimension: usize, reach: f64, of: fn(&[f64]) -> f64) -> Self {
            let bounds = Bounds {
                lower: vec![-reach; dimension],
                upper: vec![reach; dimension],
            };
            Self {
                bounds,
                of,
                outside: 0,
            }
        }
    }

    impl Objective for Standard {
        fn bounds(&self) -> &Bounds {
            &self.bounds
        }
        fn evaluate(&mut self, positions: &[f64], fitness: &mut [Fitness]) {
            for (position, fitness) in positions.chunks_exact(self.bounds.dimension()).zip(fitness)
            {
                let mut clamped = position.to_vec();
                self.bounds.clamp(&mut clamped);
                self.outside += usize::from(clamped != position);
                *fitness = Fitness {
                    violation: 0.0,
                    cost: (self.of)(position),
                };
            }
        }
    }

    fn sphere(position: &[f64]) -> f64 {
        position
            .iter()
            .enumerate()
            .map(|(dim, x)| x - dim as f64 * 0.3)
            .map(|offset| offset * offset)
            .sum()
    }

    fn settings(algorithm: &Algorithm, seed: u64) -> Settings {
        Settings {
            population: 30,
            seed,
            parameters: algorithm.parameters_with(|_| None),
        }
    }

    fn run(
        algorithm: &Algorithm,
        objective: &mut Standard,
        seed: u64,
        iterations: usize,
    ) -> Vec<f64> {
        let mut search = (algorithm.start)(&settings(algorithm, seed), objective);
        let mut curve = vec![search.swarm().best_fitness().cost];
        for iteration in 1..=iterations {
            search.iterate(objective, iteration as f64 / iterations as f64);
            curve.push(search.swarm().best_fitness().cost);
        }
        curve
    }

    #[test]
    fn the_best_never_worsens_and_sphere_is_solved_within_the_box() {
        for algorithm in ALL {
            let mut objective = Standard::new(8, 10.0, sphere);
            let curve = run(algorithm, &mut objective, 3, 400);
            assert!(
                curve.windows(2).all(|pair| pair[1] <= pair[0]),
                "{}",
                algorithm.name
            );
            assert!(
                curve[400] < 1e-3,
                "{} ends at {}",
                algorithm.name,
                curve[400]
            );
            assert_eq!(objective.outside, 0, "{} leaves the box", algorithm.name);
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_curve() {
        for algorithm in ALL {
            let curve = |seed| run(algorithm, &mut Standard::new(5, 4.0, sphere), seed, 50);
            assert_eq!(curve(11), curve(11), "{}", algorithm.name);
            assert_ne!(curve(11), curve(12), "{}", algorithm.name);
        }
    }

    #[test]
    fn names_are_unique_and_defaults_lie_in_their_ranges() {
        for algorithm in ALL {
            assert_eq!(
                by_name(algorithm.name).map(|found| found.title),
                Some(algorithm.title)
            );
            for parameter in algorithm.parameters {
                let range = parameter.min..=parameter.max;
                assert!(
                    range.contains(&parameter.default),
                    "{} {}",
                    algorithm.name,
                    parameter.name
                );
            }
        }
        assert_eq!(by_name("simplex").map(|found| found.name), None);
    }

    #[test]
    fn extreme_parameters_and_populations_do_no_harm() {
        for algorithm in ALL {
            let ends: [fn(&Parameter) -> f64; 2] =
                [|parameter| parameter.min, |parameter| parameter.max];
            for end in ends {
                for population in [2, 3, 40] {
                    let mut objective = Standard::new(3, 4.0, sphere);
                    let parameters = algorithm.parameters.iter().map(end).collect();
                    let settings = Settings {
                        population,
                        seed: 5,
                        parameters,
                    };
                    let mut search = (algorithm.start)(&settings, &mut objective);
                    for step in 1..=30 {
                        search.iterate(&mut objective, f64::from(step) / 30.0);
                    }
                    assert!(search.swarm().best_fitness().cost.is_finite());
                    assert_eq!(objective.outside, 0);
                }
            }
        }
    }

    #[test]
    fn less_violation_goes_before_less_cost() {
        let fitness = |violation, cost| Fitness { violation, cost };
        assert!(fitness(0.0, 9.0).beats(&fitness(1.0, 1.0)));
        assert!(fitness(1.0, 1.0).beats(&fitness(1.0, 2.0)));
        assert!(!fitness(0.0, 1.0).beats(&fitness(0.0, 1.0)));
        assert!(fitness(5.0, 5.0).beats(&Fitness::WORST));
    }
}
