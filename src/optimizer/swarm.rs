//! A population, its fitness, and the best position ever evaluated.

use super::{Fitness, Objective, Random};

/// Positions, stored consecutively, with their fitness.
#[derive(Debug, Clone)]
pub struct Swarm {
    dimension: usize,
    positions: Vec<f64>,
    fitness: Vec<Fitness>,
    best_position: Vec<f64>,
    best_fitness: Fitness,
    evaluations: u64,
}

impl Swarm {
    /// Draw and evaluate `population` members.
    pub fn draw(population: usize, objective: &mut dyn Objective, random: &mut Random) -> Self {
        let dimension = objective.bounds().dimension();
        let mut positions = vec![0.0; population * dimension];
        for position in positions.chunks_exact_mut(dimension) {
            objective.draw(random, position);
        }
        let mut swarm = Self {
            dimension,
            fitness: vec![Fitness::WORST; population],
            best_position: positions[..dimension].to_vec(),
            best_fitness: Fitness::WORST,
            positions: Vec::new(),
            evaluations: 0,
        };
        let mut fitness = vec![Fitness::WORST; population];
        swarm.price(objective, &positions, &mut fitness);
        swarm.positions = positions;
        swarm.fitness = fitness;
        swarm
    }

    /// Number of members.
    #[must_use]
    pub fn len(&self) -> usize {
        self.fitness.len()
    }

    /// Whether it has no members.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.fitness.is_empty()
    }

    /// Position of member `idx`.
    #[must_use]
    pub fn position(&self, idx: usize) -> &[f64] {
        &self.positions[idx * self.dimension..(idx + 1) * self.dimension]
    }

    /// Fitness of all members, in order.
    #[must_use]
    pub fn fitness(&self) -> &[Fitness] {
        &self.fitness
    }

    /// The best position evaluated so far.
    #[must_use]
    pub fn best_position(&self) -> &[f64] {
        &self.best_position
    }

    /// Fitness of the best position.
    #[must_use]
    pub fn best_fitness(&self) -> Fitness {
        self.best_fitness
    }

    /// Number of positions evaluated so far.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Move member `idx` to `position`.
    pub fn replace(&mut self, idx: usize, position: &[f64], fitness: Fitness) {
        self.positions[idx * self.dimension..(idx + 1) * self.dimension].copy_from_slice(position);
        self.fitness[idx] = fitness;
    }

    /// Evaluate and count `positions`, and remember the best.
    pub fn price(
        &mut self,
        objective: &mut dyn Objective,
        positions: &[f64],
        fitness: &mut [Fitness],
    ) {
        objective.evaluate(positions, fitness);
        self.note(positions, fitness);
    }

    /// As [`Swarm::price`], for `positions` that each matter only if they beat the member of the same index. The
    /// fitness of others may be any that does not beat it, either.
    pub fn challenge(
        &mut self,
        objective: &mut dyn Objective,
        positions: &[f64],
        fitness: &mut [Fitness],
    ) {
        objective.evaluate_against(positions, &self.fitness, fitness);
        self.note(positions, fitness);
    }

    fn note(&mut self, positions: &[f64], fitness: &[Fitness]) {
        self.evaluations += fitness.len() as u64;
        for (position, fitness) in positions.chunks_exact(self.dimension).zip(fitness.iter()) {
            if fitness.beats(&self.best_fitness) {
                self.best_fitness = *fitness;
                self.best_position.copy_from_slice(position);
            }
        }
    }

    /// Indices of all members, best first.
    #[must_use]
    pub fn ranking(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by(|&a, &b| self.fitness[a].rank(&self.fitness[b]));
        order
    }
}
