//! The motion shared by the particle swarms: velocities, personal bests, one global best.

use super::{Fitness, Objective, Optimizer, Random, Swarm};

/// Constants of the motion; they distinguish the particle swarms.
#[derive(Debug, Clone)]
pub(super) struct Flight {
    /// Factor on the velocity.
    pub(super) inertia: f64,
    /// Factor on the inertia after each iteration.
    pub(super) damping: f64,
    /// Greatest factor of the attraction to a particle's own best.
    pub(super) cognitive: f64,
    /// Greatest factor of the attraction to the global best.
    pub(super) social: f64,
    /// Greatest velocity in a dimension, as a fraction of its range.
    pub(super) v_max: f64,
    /// Factor on the velocity in a dimension in which a bound stops the particle, -1 to 0.
    pub(super) rebound: f64,
}

/// A running swarm of particles.
pub(super) struct Particles {
    swarm: Swarm,
    random: Random,
    flight: Flight,
    velocities: Vec<f64>,
    /// The best position of each particle, and its fitness.
    memory: Vec<f64>,
    memory_fitness: Vec<Fitness>,
    candidates: Vec<f64>,
    outcome: Vec<Fitness>,
}

impl Particles {
    /// Draw and evaluate the initial particles; they start at rest.
    pub(super) fn start(
        population: usize,
        seed: u64,
        flight: Flight,
        objective: &mut dyn Objective,
    ) -> Self {
        let mut random = Random::new(seed);
        let swarm = Swarm::draw(population, objective, &mut random);
        let positions: Vec<f64> = (0..swarm.len())
            .flat_map(|idx| swarm.position(idx).to_vec())
            .collect();
        Self {
            random,
            flight,
            velocities: vec![0.0; positions.len()],
            memory: positions.clone(),
            memory_fitness: swarm.fitness().to_vec(),
            candidates: positions,
            outcome: swarm.fitness().to_vec(),
            swarm,
        }
    }

    /// Move every particle, attracted by its own best and the global best.
    fn fly(&mut self, objective: &dyn Objective) {
        let bounds = objective.bounds();
        let dimension = bounds.dimension();
        let Flight {
            inertia,
            cognitive,
            social,
            v_max,
            rebound,
            ..
        } = self.flight;
        let best = self.swarm.best_position();
        for (slot, value) in self.candidates.iter_mut().enumerate() {
            let dim = slot % dimension;
            let velocity = &mut self.velocities[slot];
            *velocity = inertia * *velocity
                + cognitive * self.random.unit() * (self.memory[slot] - *value)
                + social * self.random.unit() * (best[dim] - *value);
            let fastest = v_max * bounds.range(dim);
            *velocity = velocity.clamp(-fastest, fastest);
            let free = *value + *velocity;
            *value = free.clamp(bounds.lower[dim], bounds.upper[dim]);
            if free < bounds.lower[dim] || free > bounds.upper[dim] {
                *velocity *= rebound;
            }
        }
    }

    /// Update positions, and the personal bests that improved.
    fn settle(&mut self, dimension: usize) {
        for (idx, position) in self.candidates.chunks_exact(dimension).enumerate() {
            let fitness = self.outcome[idx];
            self.swarm.replace(idx, position, fitness);
            if fitness.beats(&self.memory_fitness[idx]) {
                self.memory_fitness[idx] = fitness;
                self.memory[idx * dimension..(idx + 1) * dimension].copy_from_slice(position);
            }
        }
    }
}

impl Optimizer for Particles {
    fn iterate(&mut self, objective: &mut dyn Objective, _progress: f64) {
        self.fly(objective);
        self.swarm
            .price(objective, &self.candidates, &mut self.outcome);
        self.settle(objective.bounds().dimension());
        self.flight.inertia *= self.flight.damping;
    }

    fn swarm(&self) -> &Swarm {
        &self.swarm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimizer::tests::Line;

    /// Without attraction, a velocity persists between iterations, decreases only by the inertia, and reverses at a
    /// bound.
    #[test]
    fn a_velocity_is_kept_and_rebounds() {
        let flight = Flight {
            inertia: 0.5,
            damping: 0.5,
            cognitive: 0.0,
            social: 0.0,
            v_max: 0.2,
            rebound: -1.0,
        };
        let mut particles = Particles::start(1, 3, flight, &mut Line::new());
        particles.candidates[0] = 0.95;
        particles.velocities[0] = 1.0;
        // 0.5 after the inertia, limited to 0.2, and the bound is 0.05 away.
        particles.iterate(&mut Line::new(), 0.1);
        assert!((particles.velocities[0] + 0.2).abs() < 1e-12);
        assert!((particles.swarm.position(0)[0] - 1.0).abs() < 1e-12);
        // The inertia has halved.
        particles.iterate(&mut Line::new(), 0.2);
        assert!((particles.velocities[0] + 0.05).abs() < 1e-12);
        assert!((particles.swarm.position(0)[0] - 0.95).abs() < 1e-12);
    }

    /// A particle moves on from a worse position, and remembers the better one.
    #[test]
    fn a_memory_outlives_the_place() {
        let flight = Flight {
            inertia: 1.0,
            damping: 1.0,
            cognitive: 0.0,
            social: 0.0,
            v_max: 1.0,
            rebound: 0.0,
        };
        let mut particles = Particles::start(1, 3, flight, &mut Line::new());
        particles.candidates[0] = 0.8;
        particles.velocities[0] = 0.1;
        particles.iterate(&mut Line::new(), 0.1);
        particles.velocities[0] = -0.4;
        particles.iterate(&mut Line::new(), 0.2);
        assert!((particles.swarm.position(0)[0] - 0.5).abs() < 1e-12);
        assert!((particles.memory[0] - 0.9).abs() < 1e-12);
        assert!((particles.swarm.best_position()[0] - 0.9).abs() < 1e-12);
    }
}
