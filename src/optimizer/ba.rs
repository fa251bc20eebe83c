//! BA: Yang's bat algorithm.
//!
//! X.-S. Yang, *A new metaheuristic bat-inspired algorithm*, Nature Inspired Cooperative Strategies for Optimization
//! (NICSO 2010), Studies in Computational Intelligence 284; equation numbers refer to that paper. Where it leaves a
//! choice, and for the constants, this follows Yang's later program (MATLAB Central, *The standard bat algorithm*):
//! loudness and pulse rate are common to all bats and change every iteration; a bat that calls walks around the best;
//! a bat accepts an improvement on its own position unless it is loud. All bats of an iteration use the same best
//! position and are evaluated together.
//!
//! Deviations: the velocity attracts, because Eq. 3 as printed flies away from the best unless frequencies are
//! negative, as they are in the program of 2010. The walk of Eq. 5 is scaled by each range, because horizontal and
//! vertical metres need different steps.

use super::{
    Algorithm, Fitness, Objective, Optimizer, Parameter, Random, Settings, Swarm, parameter,
};

/// The entry in the table of algorithms.
pub(super) const ALGORITHM: Algorithm = Algorithm {
    name: "ba",
    title: "Bat algorithm, over Cartesian waypoints",
    source: "X.-S. Yang, A new metaheuristic bat-inspired algorithm, Nature Inspired Cooperative Strategies for Optimization (NICSO), 2010",
    parameters: &PARAMETERS,
    start: |settings, objective| Box::new(Ba::start(settings, objective)),
};

const PARAMETERS: [Parameter; 7] = [
    parameter("f_min", 0.0, 0.0, 10.0, "least frequency, Eq. 2"),
    parameter("f_max", 2.0, 0.0, 10.0, "greatest frequency, Eq. 2"),
    parameter("loudness", 1.0, 0.0, 1.0, "loudness A at the start"),
    parameter(
        "loudness_decay",
        0.97,
        0.0,
        1.0,
        "factor alpha on the loudness in each iteration, Eq. 6",
    ),
    parameter(
        "pulse_rate",
        1.0,
        0.0,
        1.0,
        "pulse rate r0 in the limit, Eq. 6",
    ),
    parameter(
        "pulse_growth",
        0.1,
        0.0,
        10.0,
        "growth gamma of the pulse rate, Eq. 6",
    ),
    parameter(
        "walk",
        0.1,
        0.0,
        1.0,
        "size of the local walk at loudness 1, as a share of each range, Eq. 5",
    ),
];

struct Ba {
    swarm: Swarm,
    random: Random,
    iteration: usize,
    velocities: Vec<f64>,
    loudness: f64,
    f_min: f64,
    f_max: f64,
    loudness_decay: f64,
    pulse_rate: f64,
    pulse_growth: f64,
    walk: f64,
    candidates: Vec<f64>,
    outcome: Vec<Fitness>,
}

impl Ba {
    fn start(settings: &Settings, objective: &mut dyn Objective) -> Self {
        let [
            f_min,
            f_max,
            loudness,
            loudness_decay,
            pulse_rate,
            pulse_growth,
            walk,
        ] = settings.parameters[..]
        else {
            unreachable!("the planner passes one value for each row of PARAMETERS");
        };
        let mut random = Random::new(settings.seed);
        let swarm = Swarm::draw(settings.population, objective, &mut random);
        let dimension = objective.bounds().dimension();
        Self {
            random,
            iteration: 0,
            velocities: vec![0.0; swarm.len() * dimension],
            loudness,
            f_min,
            f_max,
            loudness_decay,
            pulse_rate,
            pulse_growth,
            walk,
            candidates: vec![0.0; swarm.len() * dimension],
            outcome: vec![Fitness::WORST; swarm.len()],
            swarm,
        }
    }

    /// Eq. 2-5: every bat flies towards the best, or walks around it.
    fn move_bats(&mut self, objective: &dyn Objective) {
        let bounds = objective.bounds();
        let dimension = bounds.dimension();
        let pulse_rate =
            self.pulse_rate * (1.0 - libm::exp(-self.pulse_growth * self.iteration as f64)); // Eq. 6
        let best = self.swarm.best_position();
        for bat_idx in 0..self.swarm.len() {
            let here = self.swarm.position(bat_idx);
            let bat = bat_idx * dimension..(bat_idx + 1) * dimension;
            let velocity = &mut self.velocities[bat.clone()];
            let candidate = &mut self.candidates[bat];
            let frequency = self.random.between(self.f_min, self.f_max); // Eq. 2
            for dim in 0..dimension {
                velocity[dim] += (best[dim] - here[dim]) * frequency; // Eq. 3
                candidate[dim] = here[dim] + velocity[dim]; // Eq. 4
            }
            if self.random.unit() < pulse_rate {
                for (dim, value) in candidate.iter_mut().enumerate() {
                    let step = self.walk * bounds.range(dim) * self.loudness;
                    *value = best[dim] + self.random.normal() * step; // Eq. 5
                }
            }
            bounds.clamp(candidate);
        }
    }

    /// A bat accepts an improvement, unless it is loud.
    fn accept(&mut self, dimension: usize) {
        for (bat_idx, position) in self.candidates.chunks_exact(dimension).enumerate() {
            let quiet = self.random.unit() >= self.loudness;
            if quiet && self.outcome[bat_idx].beats(&self.swarm.fitness()[bat_idx]) {
                self.swarm.replace(bat_idx, position, self.outcome[bat_idx]);
            }
        }
    }
}

impl Optimizer for Ba {
    fn iterate(&mut self, objective: &mut dyn Objective, _progress: f64) {
        self.iteration += 1;
        self.loudness *= self.loudness_decay; // Eq. 6
        self.move_bats(objective);
        self.swarm
            .price(objective, &self.candidates, &mut self.outcome);
        self.accept(objective.bounds().dimension());
    }

    fn swarm(&self) -> &Swarm {
        &self.swarm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimizer::tests::Line;

    /// Two bats at 0.5 and 0.8, the latter being the best; frequency 0.5, no walk, constant `loudness`.
    fn two_bats(loudness: f64) -> (Line, Ba) {
        let mut line = Line::new();
        let settings = Settings {
            population: 2,
            seed: 1,
            parameters: vec![0.5, 0.5, loudness, 1.0, 0.0, 1.0, 0.0],
        };
        let mut bats = Ba::start(&settings, &mut line);
        let mut fitness = [Fitness::WORST; 2];
        line.evaluate(&[0.5, 0.8], &mut fitness);
        bats.swarm = Swarm::draw(2, &mut line, &mut Random::new(1));
        bats.swarm.replace(0, &[0.5], fitness[0]);
        bats.swarm.replace(1, &[0.8], fitness[1]);
        (line, bats)
    }

    #[test]
    fn a_bat_flies_towards_the_best_and_keeps_its_velocity() {
        let (mut line, mut bats) = two_bats(0.0);
        let best = bats.swarm.best_position()[0];
        let pull = (best - 0.5) * 0.5;
        bats.iterate(&mut line, 0.1);
        assert!((bats.velocities[0] - pull).abs() < 1e-12);
        let here = bats.swarm.position(0)[0];
        assert!((here - 0.5 - pull).abs() < 1e-12);
        let best = bats.swarm.best_position()[0];
        bats.iterate(&mut line, 0.2);
        let velocity = pull + (best - here) * 0.5;
        assert!((bats.velocities[0] - velocity).abs() < 1e-12);
    }

    /// A loud bat stays where it was, but the best position that it visited is kept.
    #[test]
    fn a_loud_bat_accepts_nothing() {
        let (mut line, mut bats) = two_bats(1.0);
        for step in 1..=5 {
            bats.iterate(&mut line, f64::from(step) / 5.0);
        }
        assert!((bats.swarm.position(0)[0] - 0.5).abs() < 1e-12);
        assert!(bats.swarm.best_fitness().cost < 0.1);
    }

    #[test]
    fn a_quiet_bat_never_accepts_what_is_worse() {
        let (mut line, mut bats) = two_bats(0.0);
        let mut before = bats.swarm.fitness().to_vec();
        for step in 1..=30 {
            bats.iterate(&mut line, f64::from(step) / 30.0);
            for (now, before) in bats.swarm.fitness().iter().zip(&before) {
                assert!(!before.beats(now));
            }
            before = bats.swarm.fitness().to_vec();
        }
    }
}
