//! ABC: Karaboga's artificial bee colony.
//!
//! D. Karaboga and B. Basturk, *A powerful and efficient algorithm for numerical function optimization: artificial
//! bee colony (ABC) algorithm*, Journal of Global Optimization 39, 2007. The modification rate, and the choice of
//! sources by onlookers where some are infeasible, follow D. Karaboga and B. Akay, *A modified artificial bee colony
//! (ABC) algorithm for constrained optimization problems*, Applied Soft Computing 11, 2011.
//!
//! The population is the colony: half of it are employed bees, one per food source, and half are onlookers, so that
//! an iteration evaluates as many positions as in the other algorithms, plus an occasional scout. At least two bees
//! are employed if there are two, because a source is searched relative to another.
//!
//! Deviations: the bees of a phase start from the same sources and are evaluated together. The probabilities of
//! sources are scaled by the best nectar and the greatest violation, as nectar is in Karaboga's own program, not by
//! their sums, with which a hundred sources would be chosen nearly equally.

use super::{
    Algorithm, Fitness, Objective, Optimizer, Parameter, Random, Settings, Swarm, parameter,
};

/// The entry in the table of algorithms.
pub(super) const ALGORITHM: Algorithm = Algorithm {
    name: "abc",
    title: "Artificial bee colony, over Cartesian waypoints",
    source: "D. Karaboga and B. Basturk, A powerful and efficient algorithm for numerical function optimization: artificial bee colony (ABC) algorithm, Journal of Global Optimization 39, 2007",
    parameters: &PARAMETERS,
    start: |settings, objective| Box::new(Abc::start(settings, objective)),
};

const PARAMETERS: [Parameter; 2] = [
    parameter(
        "limit",
        1.0,
        0.001,
        100.0,
        "failures after which a source is abandoned, as a multiple of sources times dimensions",
    ),
    // 0 gives the colony of 2007; changing about three numbers of a route of ten waypoints finds feasible ones far
    // more often.
    parameter(
        "modification_rate",
        0.1,
        0.0,
        1.0,
        "chance that a bee changes a number of a source; one number is changed at least",
    ),
];

struct Abc {
    swarm: Swarm,
    random: Random,
    limit: f64,
    modification_rate: f64,
    onlookers: usize,
    /// Failures of each source since its last improvement.
    failures: Vec<u32>,
    /// The source of each candidate.
    origins: Vec<usize>,
    candidates: Vec<f64>,
    outcome: Vec<Fitness>,
}

impl Abc {
    fn start(settings: &Settings, objective: &mut dyn Objective) -> Self {
        let [limit, modification_rate] = settings.parameters[..] else {
            unreachable!("the planner passes one value for each row of PARAMETERS");
        };
        let mut random = Random::new(settings.seed);
        let sources = (settings.population / 2).max(2).min(settings.population);
        let swarm = Swarm::draw(sources, objective, &mut random);
        let dimension = objective.bounds().dimension();
        Self {
            random,
            limit: limit * (sources * dimension) as f64,
            modification_rate,
            onlookers: settings.population - sources,
            failures: vec![0; sources],
            origins: Vec::new(),
            candidates: Vec::new(),
            outcome: Vec::new(),
            swarm,
        }
    }

    /// Eq. 2.2: search around each of `origins`, and keep improvements.
    fn search(&mut self, objective: &mut dyn Objective) {
        let dimension = objective.bounds().dimension();
        self.candidates.resize(self.origins.len() * dimension, 0.0);
        self.outcome.resize(self.origins.len(), Fitness::WORST);
        for (bee, &origin) in self.origins.iter().enumerate() {
            let candidate = &mut self.candidates[bee * dimension..(bee + 1) * dimension];
            let here = self.swarm.position(origin);
            candidate.copy_from_slice(here);
            if self.swarm.len() > 1 {
                // Any source but the own one.
                let other = self.random.below(self.swarm.len() - 1);
                let other = self.swarm.position(other + usize::from(other >= origin));
                let chosen = self.random.below(dimension);
                for dim in 0..dimension {
                    if dim == chosen || self.random.unit() < self.modification_rate {
                        candidate[dim] += self.random.between(-1.0, 1.0) * (here[dim] - other[dim]);
                    }
                }
            }
            objective.bounds().clamp(candidate);
        }
        self.swarm
            .price(objective, &self.candidates, &mut self.outcome);
        for (bee, position) in self.candidates.chunks_exact(dimension).enumerate() {
            let origin = self.origins[bee];
            if self.outcome[bee].beats(&self.swarm.fitness()[origin]) {
                self.swarm.replace(origin, position, self.outcome[bee]);
                self.failures[origin] = 0;
            } else {
                self.failures[origin] += 1;
            }
        }
    }

    /// Every onlooker visits the sources in turn until one attracts it.
    fn choose(&mut self) {
        let appeal = appeal(self.swarm.fitness());
        self.origins.clear();
        let mut source = 0;
        while self.origins.len() < self.onlookers {
            if self.random.unit() < appeal[source] {
                self.origins.push(source);
            }
            source = (source + 1) % appeal.len();
        }
    }

    /// Replace the source with the most failures, if they exceed the limit, by a new random one.
    fn scout(&mut self, objective: &mut dyn Objective) {
        let (source, failures) = self
            .failures
            .iter()
            .enumerate()
            .max_by_key(|(_, failures)| **failures)
            .expect("there is a source");
        if f64::from(*failures) <= self.limit {
            return;
        }
        let mut position = vec![0.0; objective.bounds().dimension()];
        objective.draw(&mut self.random, &mut position);
        let mut fitness = [Fitness::WORST];
        self.swarm.price(objective, &position, &mut fitness);
        self.swarm.replace(source, &position, fitness[0]);
        self.failures[source] = 0;
    }
}

/// The probability that each source attracts an onlooker that visits it: from one half upwards by cost for feasible
/// ones, from one half downwards by violation for infeasible ones (Karaboga and Akay).
fn appeal(sources: &[Fitness]) -> Vec<f64> {
    let nectar = |source: &Fitness| {
        if source.cost >= 0.0 {
            1.0 / (1.0 + source.cost)
        } else {
            1.0 - source.cost
        }
    };
    let (mut most_nectar, mut most_violation) = (0.0, 0.0);
    for source in sources {
        if source.is_feasible() {
            most_nectar = nectar(source).max(most_nectar);
        } else {
            most_violation = source.violation.max(most_violation);
        }
    }
    let chance = |source: &Fitness| {
        let chance = if source.is_feasible() {
            0.5 + 0.5 * nectar(source) / most_nectar
        } else {
            0.5 - 0.45 * source.violation / most_violation
        };
        // Infinite figures tell sources apart no more: what a stopped run leaves, and what an objective cannot price.
        if chance.is_nan() { 0.5 } else { chance }
    };
    sources.iter().map(chance).collect()
}

impl Optimizer for Abc {
    fn iterate(&mut self, objective: &mut dyn Objective, _progress: f64) {
        self.origins.clear();
        self.origins.extend(0..self.swarm.len());
        self.search(objective);
        self.choose();
        self.search(objective);
        self.scout(objective);
    }

    fn swarm(&self) -> &Swarm {
        &self.swarm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitness(violation: f64, cost: f64) -> Fitness {
        Fitness { violation, cost }
    }

    #[test]
    fn better_sources_attract_more_and_feasible_ones_most() {
        let sources = [
            fitness(0.0, 1.0),
            fitness(0.0, 3.0),
            fitness(1.0, 0.0),
            fitness(9.0, 0.0),
        ];
        let appeal = appeal(&sources);
        assert!(
            appeal.windows(2).all(|pair| pair[0] > pair[1]),
            "{appeal:?}"
        );
        assert!(appeal[1] > 0.5 && appeal[2] < 0.5 && appeal[3] > 0.0);
        // A cost below zero means even more nectar.
        assert!(super::appeal(&[fitness(0.0, -5.0), fitness(0.0, 0.0)])[1] < 0.7);
        // If nothing could be evaluated, onlookers still choose.
        for nothing in [
            Fitness::WORST,
            fitness(0.0, f64::INFINITY),
            fitness(0.0, f64::NAN),
            fitness(f64::NAN, 1.0),
        ] {
            assert_eq!(super::appeal(&[nothing; 2]), [0.5; 2], "{nothing:?}");
        }
    }

    /// A flat objective: nothing improves, so all sources are abandoned in turn, one per iteration.
    #[test]
    fn a_source_that_fails_too_often_is_abandoned() {
        struct Floor(crate::optimizer::Bounds);
        impl Objective for Floor {
            fn bounds(&self) -> &crate::optimizer::Bounds {
                &self.0
            }
            fn evaluate(&mut self, _: &[f64], fitness: &mut [Fitness]) {
                fitness.fill(Fitness {
                    violation: 0.0,
                    cost: 1.0,
                });
            }
        }
        let mut floor = Floor(crate::optimizer::Bounds {
            lower: vec![0.0; 3],
            upper: vec![1.0; 3],
        });
        let settings = Settings {
            population: 8,
            seed: 2,
            parameters: vec![1.0, 0.0],
        };
        let mut colony = Abc::start(&settings, &mut floor);
        // The limit is 4 sources * 3 dimensions; a source fails about twice per iteration.
        let before: Vec<f64> = colony.swarm.position(0).to_vec();
        for _ in 0..5 {
            colony.iterate(&mut floor, 0.5);
        }
        assert_eq!(colony.swarm.position(0), before);
        assert_eq!(colony.swarm.evaluations(), 4 + 5 * 8);
        for _ in 5..25 {
            colony.iterate(&mut floor, 0.5);
        }
        assert_ne!(colony.swarm.position(0), before);
        assert!(colony.failures.iter().all(|failures| *failures <= 20));
        let scouts = colony.swarm.evaluations() - (4 + 25 * 8);
        assert!((4..=20).contains(&scouts), "{scouts} scouts");
    }
}
