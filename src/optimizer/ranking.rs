//! The ranking of a swarm, updated between iterations.

use std::cmp::Ordering;

use super::Fitness;

/// The members of a swarm from best to worst; ties are ordered by index.
///
/// Few members change between two iterations. They are removed, sorted among themselves and merged with the others,
/// whose order is unchanged.
#[derive(Debug, Clone, Default)]
pub(super) struct Ranking {
    order: Vec<usize>,
    /// The fitness that the order is based on.
    fitness: Vec<Fitness>,
    changed: Vec<usize>,
    /// Whether each member is in `changed`.
    is_changed: Vec<bool>,
    merged: Vec<usize>,
}

impl Ranking {
    /// The order of members with this `fitness`. It does not depend on earlier calls.
    pub(super) fn of(&mut self, fitness: &[Fitness]) -> &[usize] {
        let known = self.fitness.len().min(fitness.len());
        self.fitness.truncate(known);
        self.changed.clear();
        self.is_changed.clear();
        for (idx, (before, now)) in self.fitness.iter_mut().zip(fitness).enumerate() {
            let changes = !is_same(before, now);
            self.is_changed.push(changes);
            if changes {
                *before = *now;
                self.changed.push(idx);
            }
        }
        self.fitness.extend_from_slice(&fitness[known..]);
        self.changed.extend(known..fitness.len());
        self.is_changed.resize(fitness.len(), true);
        if !self.changed.is_empty() || self.order.len() != fitness.len() {
            self.merge();
        }
        &self.order
    }

    fn merge(&mut self) {
        let fitness = &self.fitness;
        let rank = |a: usize, b: usize| fitness[a].rank(&fitness[b]).then(a.cmp(&b));
        self.order
            .retain(|&idx| self.is_changed.get(idx) == Some(&false));
        self.changed.sort_unstable_by(|&a, &b| rank(a, b));
        self.merged.clear();
        let mut kept = self.order.iter().copied().peekable();
        for &next in &self.changed {
            while let Some(before) = kept.next_if(|&idx| rank(idx, next) == Ordering::Less) {
                self.merged.push(before);
            }
            self.merged.push(next);
        }
        self.merged.extend(kept);
        std::mem::swap(&mut self.order, &mut self.merged);
    }
}

/// Bitwise equality, like the order.
fn is_same(one: &Fitness, other: &Fitness) -> bool {
    one.violation.to_bits() == other.violation.to_bits()
        && one.cost.to_bits() == other.cost.to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// However members change, and whether there are more or fewer, the order equals that of a stable sort.
        #[test]
        fn the_order_is_that_of_a_sort(
            rounds in prop::collection::vec(
                prop::collection::vec((0..3_u8, 0..4_u8, any::<bool>()), 0..30),
                1..6,
            ),
        ) {
            let mut ranking = Ranking::default();
            let mut fitness: Vec<Fitness> = Vec::new();
            for round in rounds {
                fitness.resize(round.len(), Fitness::WORST);
                for (own, (violation, cost, changes)) in fitness.iter_mut().zip(round) {
                    if changes {
                        *own = Fitness {
                            violation: f64::from(violation),
                            cost: f64::from(cost),
                        };
                    }
                }
                let mut sorted: Vec<usize> = (0..fitness.len()).collect();
                sorted.sort_by(|&a, &b| fitness[a].rank(&fitness[b]));
                prop_assert_eq!(ranking.of(&fitness), sorted.as_slice());
            }
        }
    }
}
