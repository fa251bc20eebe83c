//! Chains of no more legs than a route may have, with no turn sharper than the vehicle can fly.
//!
//! The cheapest chain of all may have a leg too many, or bend too sharply; what is left after removing its waypoints
//! may be far from the best way with so few, which can be an entirely different one. Here chains are distinguished by
//! their last leg and by their number of legs: A*, with a lower bound of the rest of the cost for the remaining number
//! of legs, ignoring turns.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Legs between numbered places, of which the first is the start and the last the target.
pub(super) trait Legs {
    /// How many places there are.
    fn places(&self) -> usize;

    /// A lower bound of the cost of the leg from one place to each; infinite where there is none.
    fn onward(&self, from: usize) -> &[f64];

    /// The cost of a leg, where it is only computed when its turn comes.
    fn cost(&mut self, from: usize, to: usize) -> f64 {
        self.onward(from)[to]
    }

    /// Whether the vehicle may turn at the middle one of three places.
    fn may_turn(&self, corner: [usize; 3]) -> bool;
}

/// A chain under construction.
#[derive(Clone, Copy)]
struct Chain {
    place: usize,
    /// Index of the chain that it extends; its own index at the start.
    before: usize,
    legs: usize,
    cost: f64,
}

/// The places of chains of at most `most` legs, the cheapest first, until one that `is_last`, or until `effort` chains
/// have been looked at.
pub(super) fn chains(
    legs: &mut impl Legs,
    (most, effort): (usize, usize),
    mut is_last: impl FnMut(Vec<usize>) -> bool,
) {
    let target = legs.places() - 1;
    let rest = rest(legs, most);
    let mut all = vec![Chain {
        place: 0,
        before: 0,
        legs: 0,
        cost: 0.0,
    }];
    let mut open = BinaryHeap::from([Reverse((rest[most][0].to_bits(), 0))]);
    let mut known = Known::new(target + 1, most);
    for _ in 0..effort {
        let Some(Reverse((_, idx))) = open.pop() else {
            break;
        };
        let chain: Chain = all[idx];
        let before = all[chain.before].place;
        if idx > 0 {
            let is_undercut = known.least(before, &chain) < chain.cost;
            if is_undercut || legs.cost(before, chain.place).is_infinite() {
                continue;
            }
        }
        if chain.place == target {
            if is_last(traced(&all, idx)) {
                break;
            }
            continue;
        }
        let left = most - chain.legs;
        if left == 0 {
            continue;
        }
        let onward = legs.onward(chain.place).iter().zip(&rest[left - 1]);
        for (next, (leg, rest)) in onward.enumerate().skip(1) {
            let further = Chain {
                place: next,
                before: idx,
                legs: chain.legs + 1,
                cost: chain.cost + leg,
            };
            let least = further.cost + rest;
            if least.is_finite()
                && further.cost < known.least(chain.place, &further)
                && (idx == 0 || legs.may_turn([before, chain.place, next]))
            {
                known.note(chain.place, &further);
                open.push(Reverse((least.to_bits(), all.len())));
                all.push(further);
            }
        }
    }
}

/// The costs of known chains, by their last leg and number of legs.
struct Known {
    most: usize,
    /// For each place that chains go on from: by the next place, the cost of the cheapest with at most 0, 1, … legs.
    onward: Vec<Vec<f64>>,
}

impl Known {
    fn new(places: usize, most: usize) -> Self {
        Self {
            most,
            onward: vec![Vec::new(); places],
        }
    }

    /// The cost of the cheapest chain that comes from the place `from` to where `chain` ends, in no more legs.
    fn least(&self, from: usize, chain: &Chain) -> f64 {
        let onward = &self.onward[from];
        let idx = chain.place * (self.most + 1) + chain.legs;
        onward.get(idx).copied().unwrap_or(f64::INFINITY)
    }

    /// Record a `chain` that comes from the place `from`.
    fn note(&mut self, from: usize, chain: &Chain) {
        let (places, counts) = (self.onward.len(), self.most + 1);
        let onward = &mut self.onward[from];
        if onward.is_empty() {
            *onward = vec![f64::INFINITY; places * counts];
        }
        for least in &mut onward[chain.place * counts..][chain.legs..counts] {
            *least = least.min(chain.cost);
        }
    }
}

/// The cost of the cheapest chains from each place to the target with at most 0, 1, … legs, ignoring turns.
fn rest(legs: &impl Legs, most: usize) -> Vec<Vec<f64>> {
    let count = legs.places();
    let mut none = vec![f64::INFINITY; count];
    none[count - 1] = 0.0;
    let mut rest = vec![none];
    for fewer in 0..most {
        let after = &rest[fewer];
        let cheapest = |place: usize| {
            let ways = legs.onward(place).iter().zip(after);
            ways.map(|(leg, rest)| leg + rest)
                .fold(after[place], f64::min)
        };
        let best = (0..count).map(cheapest).collect();
        rest.push(best);
    }
    rest
}

/// The places of a chain.
fn traced(all: &[Chain], mut idx: usize) -> Vec<usize> {
    let mut places = vec![all[idx].place];
    while idx > 0 {
        idx = all[idx].before;
        places.push(all[idx].place);
    }
    places.reverse();
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;
    use crate::optimizer::Random;
    use crate::planner::starts::may_turn;

    const SHARPEST: f64 = 0.0;

    /// Legs between random points, some of which turn out not to exist.
    struct Net {
        points: Vec<Point3>,
        costs: Vec<Vec<f64>>,
        is_there: Vec<Vec<bool>>,
    }

    impl Net {
        fn of(count: usize, seed: u64) -> Self {
            let mut random = Random::new(seed);
            let points: Vec<Point3> = (0..count)
                .map(|_| {
                    let [x, y] = [random.between(0.0, 100.0), random.between(0.0, 100.0)];
                    Point3::new(x, y, 0.0)
                })
                .collect();
            let mut costs = vec![vec![f64::INFINITY; count]; count];
            let mut is_there = vec![vec![true; count]; count];
            for (from, to) in (0..count).flat_map(|from| (1..count).map(move |to| (from, to))) {
                if from != to && random.between(0.0, 1.0) < 0.8 {
                    let longer = random.between(1.0, 3.0);
                    costs[from][to] = longer * (points[to] - points[from]).norm();
                    is_there[from][to] = random.between(0.0, 1.0) < 0.8;
                }
            }
            Self {
                points,
                costs,
                is_there,
            }
        }

        fn price(&mut self, chain: &[usize]) -> f64 {
            chain
                .windows(2)
                .map(|ends| self.cost(ends[0], ends[1]))
                .sum()
        }

        /// The cost of the cheapest completion of `chain`, which itself costs `cost`.
        fn cheapest(&mut self, chain: &mut Vec<usize>, cost: f64, most: usize) -> f64 {
            let last = chain[chain.len() - 1];
            if last + 1 == self.places() {
                return cost;
            }
            let mut best = f64::INFINITY;
            if chain.len() > most {
                return best;
            }
            for next in 1..self.places() {
                let leg = self.cost(last, next);
                let turns = chain.len() < 2 || self.may_turn([chain[chain.len() - 2], last, next]);
                if leg.is_finite() && turns {
                    chain.push(next);
                    best = best.min(self.cheapest(chain, cost + leg, most));
                    chain.pop();
                }
            }
            best
        }
    }

    impl Legs for Net {
        fn places(&self) -> usize {
            self.points.len()
        }

        fn onward(&self, from: usize) -> &[f64] {
            &self.costs[from]
        }

        fn cost(&mut self, from: usize, to: usize) -> f64 {
            if !self.is_there[from][to] {
                self.costs[from][to] = f64::INFINITY;
            }
            self.costs[from][to]
        }

        fn may_turn(&self, corner: [usize; 3]) -> bool {
            may_turn(corner.map(|place| self.points[place]), SHARPEST)
        }
    }

    #[test]
    fn the_first_chain_is_the_cheapest_with_at_most_the_given_legs() {
        let (mut found, mut dearer) = (0, 0);
        for seed in 1..=60 {
            let mut before = f64::INFINITY;
            for most in 1..=5 {
                let mut net = Net::of(8, seed);
                let best = Net::of(8, seed).cheapest(&mut vec![0], 0.0, most);
                let mut first = f64::INFINITY;
                chains(&mut net, (most, 10_000), |chain| {
                    assert!(chain[0] == 0 && chain[chain.len() - 1] == 7);
                    assert!(chain.len() <= most + 1);
                    first = Net::of(8, seed).price(&chain);
                    true
                });
                assert!(
                    first.total_cmp(&best).is_eq() || (first - best).abs() < 1e-9 * best,
                    "{seed}, {most} legs: {first} {best}"
                );
                found += usize::from(best.is_finite());
                dearer += usize::from(before.is_finite() && best < before);
                before = best;
            }
        }
        assert!(found > 100 && dearer > 5, "{found} {dearer}");
    }

    #[test]
    fn chains_come_in_order_of_cost() {
        let mut found = 0;
        for seed in 1..=20 {
            let mut costs = Vec::new();
            chains(&mut Net::of(9, seed), (4, 10_000), |chain| {
                costs.push(Net::of(9, seed).price(&chain));
                costs.len() == 3
            });
            assert!(costs.len() <= 3 && costs.is_sorted(), "{costs:?}");
            found += costs.len();
        }
        assert!(found > 30, "{found}");
    }
}
