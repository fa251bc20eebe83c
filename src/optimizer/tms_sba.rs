//! TMS-SBA: the bat algorithm with truncated-mean stabilisation, Algorithm 2 of the paper.
//!
//! The spherical coding is part of the objective; here a bat is a point in a box. All bats of an iteration use the
//! same best position and are evaluated together.

use super::ranking::Ranking;
use super::{
    Algorithm, Fitness, Objective, Optimizer, Parameter, Random, Settings, Swarm, parameter,
    share_of,
};

/// The entry in the table of algorithms.
pub(super) const ALGORITHM: Algorithm = Algorithm {
    name: "tms-sba",
    title: "Spherical-vector bat algorithm with truncated-mean stabilisation",
    source: "An Improved Spherical Vector and Truncated Mean Stabilization Based Bat Algorithm for UAV Path Planning, IEEE Access, 2023",
    parameters: &PARAMETERS,
    start: |settings, objective| Box::new(TmsSba::start(settings, objective)),
};

/// The constants; those of the truncated mean come last.
pub(super) const PARAMETERS: [Parameter; 10] = [
    parameter("f_min", 0.0, 0.0, 10.0, "least frequency, Eq. 10"),
    parameter("f_max", 1.0, 0.0, 10.0, "greatest frequency, Eq. 10"),
    parameter(
        "loudness",
        1.0,
        0.0,
        10.0,
        "loudness A at the start, Eq. 13-14",
    ),
    parameter(
        "loudness_decay",
        0.99,
        0.0,
        1.0,
        "factor alpha on the loudness of a bat that improved, Eq. 14",
    ),
    parameter(
        "pulse_rate",
        0.2,
        0.0,
        1.0,
        "pulse rate r0 in the limit, Eq. 15",
    ),
    parameter(
        "pulse_growth",
        0.1,
        0.0,
        10.0,
        "growth iota of the pulse rate, Eq. 15",
    ),
    parameter(
        "walk",
        0.5,
        0.0,
        1.0,
        "size of the local walk at the start, as a share of each range, Eq. 13",
    ),
    parameter(
        "walk_numbers",
        3.0,
        1.0,
        1000.0,
        "how many numbers of a position a local walk changes, on average, Eq. 13",
    ),
    parameter(
        "truncation",
        0.4,
        0.0,
        0.99,
        "share beta of the bats left out of the mean, half at each end, Eq. 24",
    ),
    parameter(
        "expansion",
        1.5,
        1.0,
        10.0,
        "expansion coefficient w of the range that a stagnant swarm is drawn from anew",
    ),
];

/// The swarm has stagnated if the worst bat is nearer to the truncated mean than this fraction of the range in every
/// dimension; the paper compares floats for equality.
const STAGNATION: f64 = 1e-3;

/// Initial fraction of the swarm from which a walk may start.
const ELITE: f64 = 0.2;

/// A running search.
pub(super) struct TmsSba {
    swarm: Swarm,
    random: Random,
    iteration: usize,
    velocities: Vec<f64>,
    loudness: Vec<f64>,
    pulse_rates: Vec<f64>,
    f_min: f64,
    f_max: f64,
    loudness_decay: f64,
    pulse_rate: f64,
    pulse_growth: f64,
    walk: f64,
    walk_numbers: f64,
    truncation: f64,
    expansion: f64,
    candidates: Vec<f64>,
    outcome: Vec<Fitness>,
    ranking: Ranking,
}

impl TmsSba {
    /// Draw and evaluate the initial bats.
    pub(super) fn start(settings: &Settings, objective: &mut dyn Objective) -> Self {
        let [
            f_min,
            f_max,
            loudness,
            loudness_decay,
            pulse_rate,
            pulse_growth,
            walk,
            walk_numbers,
            truncation,
            expansion,
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
            loudness: vec![loudness; swarm.len()],
            pulse_rates: vec![0.0; swarm.len()],
            f_min,
            f_max,
            loudness_decay,
            pulse_rate,
            pulse_growth,
            walk,
            walk_numbers,
            truncation,
            expansion,
            candidates: vec![0.0; swarm.len() * dimension],
            outcome: vec![Fitness::WORST; swarm.len()],
            ranking: Ranking::default(),
            swarm,
        }
    }

    /// Eq. 10-15: one iteration of the bats, before stabilisation.
    pub(super) fn fly(&mut self, objective: &mut dyn Objective, progress: f64) {
        self.iteration += 1;
        self.move_bats(objective, progress);
        self.swarm
            .challenge(objective, &self.candidates, &mut self.outcome);
        self.accept(objective.bounds().dimension());
    }

    /// Eq. 10-13: every bat flies towards the best, or walks around it.
    fn move_bats(&mut self, objective: &mut dyn Objective, progress: f64) {
        let dimension = objective.bounds().dimension();
        let mean_loudness = self.loudness.iter().sum::<f64>() / self.loudness.len() as f64;
        // During the run the walk shrinks to a thousandth of its initial size.
        let size = self.walk * libm::pow(1e-3, progress) * mean_loudness;
        let share = self.walk_numbers / dimension as f64;
        let best = self.swarm.best_position();
        // The objective's own walk starts from one of the best few bats; their number decreases.
        let elite = if objective.walks() {
            self.ranking.of(self.swarm.fitness())
        } else {
            &[]
        };
        let n_elite = share_of(elite.len(), ELITE * (1.0 - progress)).max(1);
        for bat_idx in 0..self.swarm.len() {
            let here = self.swarm.position(bat_idx);
            let candidate = &mut self.candidates[bat_idx * dimension..(bat_idx + 1) * dimension];
            let velocity = &mut self.velocities[bat_idx * dimension..(bat_idx + 1) * dimension];
            let frequency = self.random.between(self.f_min, self.f_max); // Eq. 10
            for (velocity, (best, here)) in velocity.iter_mut().zip(best.iter().zip(here)) {
                *velocity += (best - here) * frequency; // Eq. 11, 20
            }
            let walks = self.random.unit() >= self.pulse_rates[bat_idx]; // Eq. 13
            if walks && !elite.is_empty() {
                let base = self.swarm.position(elite[self.random.below(n_elite)]);
                objective.walk(&mut self.random, base, size, candidate);
            } else if walks {
                // Change only a few dimensions: a step in all of them at once rarely improves.
                let chosen = self.random.below(dimension);
                candidate.copy_from_slice(best);
                for (dim, value) in candidate.iter_mut().enumerate() {
                    if dim == chosen || self.random.unit() < share {
                        *value += self.random.normal() * size * objective.bounds().range(dim);
                    }
                }
            } else {
                for (value, (here, velocity)) in candidate.iter_mut().zip(here.iter().zip(velocity))
                {
                    *value = here + *velocity; // Eq. 12, 21
                }
            }
            objective.bounds().clamp(candidate);
        }
    }

    /// Eq. 14-15: a bat that improves moves there, becomes quieter and calls more often.
    fn accept(&mut self, dimension: usize) {
        let pulse_rate =
            self.pulse_rate * (1.0 - libm::exp(-self.pulse_growth * self.iteration as f64));
        for (bat_idx, position) in self.candidates.chunks_exact(dimension).enumerate() {
            if self.outcome[bat_idx].beats(&self.swarm.fitness()[bat_idx]) {
                self.swarm.replace(bat_idx, position, self.outcome[bat_idx]);
                self.loudness[bat_idx] *= self.loudness_decay;
                self.pulse_rates[bat_idx] = pulse_rate;
            }
        }
    }

    /// Eq. 24: the worst bat is replaced by the mean of the middle ones; if they already agree, the swarm is redrawn
    /// from a wider range.
    fn stabilise(&mut self, objective: &mut dyn Objective) {
        let dimension = objective.bounds().dimension();
        let ranking = self.ranking.of(self.swarm.fitness());
        // As truncation < 1, less than half is removed at each end.
        let left_out = share_of(ranking.len(), self.truncation / 2.0);
        let middle = &ranking[left_out..ranking.len() - left_out];
        let mut mean = vec![0.0; dimension];
        for &bat_idx in middle {
            for (sum, value) in mean.iter_mut().zip(self.swarm.position(bat_idx)) {
                *sum += value / middle.len() as f64;
            }
        }
        let worst = ranking[ranking.len() - 1];
        let bounds = objective.bounds();
        let stagnant = (0..dimension).all(|dim| {
            (self.swarm.position(worst)[dim] - mean[dim]).abs() <= STAGNATION * bounds.range(dim)
        });
        if stagnant {
            // The objective's own walks lead out of a stagnated swarm to feasible routes; few routes drawn around the
            // mean would be feasible.
            if !objective.walks() {
                self.reinitialise(objective, &mean);
            }
        } else {
            let mut fitness = [Fitness::WORST];
            self.swarm.price(objective, &mean, &mut fitness);
            self.swarm.replace(worst, &mean, fitness[0]);
        }
    }

    fn reinitialise(&mut self, objective: &mut dyn Objective, mean: &[f64]) {
        let dimension = mean.len();
        let ranking = self.ranking.of(self.swarm.fitness());
        let bounds = objective.bounds();
        // The range that the swarm still covers, widened.
        let reach: Vec<f64> = (0..dimension)
            .map(|dim| {
                let spread = (0..self.swarm.len())
                    .map(|idx| (self.swarm.position(idx)[dim] - mean[dim]).abs())
                    .fold(STAGNATION * bounds.range(dim), f64::max);
                spread * self.expansion
            })
            .collect();
        for &bat_idx in &ranking[1..] {
            let candidate = &mut self.candidates[bat_idx * dimension..(bat_idx + 1) * dimension];
            for (dim, value) in candidate.iter_mut().enumerate() {
                *value = mean[dim] + self.random.between(-1.0, 1.0) * reach[dim];
            }
            bounds.clamp(candidate);
        }
        let best = ranking[0];
        self.candidates[best * dimension..(best + 1) * dimension]
            .copy_from_slice(self.swarm.position(best));
        self.swarm
            .price(objective, &self.candidates, &mut self.outcome);
        self.velocities.fill(0.0);
        for (bat_idx, position) in self.candidates.chunks_exact(dimension).enumerate() {
            self.swarm.replace(bat_idx, position, self.outcome[bat_idx]);
        }
    }
}

impl Optimizer for TmsSba {
    fn iterate(&mut self, objective: &mut dyn Objective, progress: f64) {
        self.fly(objective, progress);
        self.stabilise(objective);
    }

    fn swarm(&self) -> &Swarm {
        &self.swarm
    }
}
