//! Chains of no more legs than the route may have, none of them turned into more sharply than the vehicle can.
//!
//! The cheapest chain of all may have a leg too many, or bend too sharply; what is left when its waypoints are left
//! out may be far from what so few allow, which is another way altogether. Here chains are told apart by their last
//! leg and by how many they have: A*, with what the rest costs at least with as many legs as are left, turns apart.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::Legs;
use crate::geometry::Point3;

/// Chains of more legs are as good as those of any number.
const MOST_LEGS: usize = 12;

/// Chains looked at, at most.
const EFFORT: usize = 4_000;

/// A chain on its way.
#[derive(Clone, Copy)]
struct Chain {
    place: usize,
    /// The one that it goes on from, of all chains; its own number at the start.
    before: usize,
    legs: usize,
    cost: f64,
}

/// Up to `count` chains of at most `most` legs, none like the one before by `is_like`, the cheapest first.
pub(super) fn chains(
    legs: &mut Legs,
    most: usize,
    count: usize,
    is_like: impl Fn(&[Point3], &[Point3]) -> bool,
) -> Vec<Vec<Point3>> {
    let target = legs.places.len() - 1;
    let most = most.min(MOST_LEGS);
    let rest = rest(legs, most);
    let mut all = vec![Chain {
        place: 0,
        before: 0,
        legs: 0,
        cost: 0.0,
    }];
    let mut open = BinaryHeap::from([Reverse((rest[most][0].to_bits(), 0))]);
    // By the last leg: the fewest legs of those that came first, which were the cheapest.
    let mut known: HashMap<(usize, usize), usize> = HashMap::new();
    let mut found: Vec<Vec<Point3>> = Vec::new();
    for _ in 0..EFFORT {
        let Some(Reverse((_, idx))) = open.pop() else {
            break;
        };
        let chain: Chain = all[idx];
        let before = all[chain.before].place;
        if idx > 0 {
            if !legs.measured[before][chain.place] {
                legs.measure(&[before], chain.place);
            }
            let fewest = known.entry((before, chain.place)).or_insert(usize::MAX);
            if legs.costs[before][chain.place].is_infinite() || *fewest <= chain.legs {
                continue;
            }
            *fewest = chain.legs;
        }
        if chain.place == target {
            let points = traced(&all, idx).map(|place| legs.places[place]);
            let mut points: Vec<Point3> = points.collect();
            points.reverse();
            if !found.iter().any(|other| is_like(&points, other)) {
                found.push(points);
            }
            if found.len() == count {
                break;
            }
            continue;
        }
        let left = most - chain.legs;
        if left == 0 {
            continue;
        }
        let onward = legs.costs[chain.place].iter().zip(&rest[left - 1]);
        for (next, (leg, rest)) in onward.enumerate().skip(1) {
            let cost = chain.cost + leg;
            let least = cost + rest;
            if least.is_finite()
                && (idx == 0
                    || legs.may_turn([before, chain.place, next].map(|place| legs.places[place])))
            {
                open.push(Reverse((least.to_bits(), all.len())));
                all.push(Chain {
                    place: next,
                    before: idx,
                    legs: chain.legs + 1,
                    cost,
                });
            }
        }
    }
    found
}

/// What the cheapest chains from each place to the target cost, of at most 0, 1, … legs, turns apart.
fn rest(legs: &Legs, most: usize) -> Vec<Vec<f64>> {
    let count = legs.places.len();
    let mut none = vec![f64::INFINITY; count];
    none[count - 1] = 0.0;
    let mut rest = vec![none];
    for fewer in 0..most {
        let after = &rest[fewer];
        let cheapest = |row: &Vec<f64>| {
            let ways = row.iter().zip(after).map(|(leg, rest)| leg + rest);
            ways.fold(f64::INFINITY, f64::min)
        };
        let with_one_more = legs.costs.iter().map(cheapest).zip(after);
        let best = with_one_more.map(|(one, other)| one.min(*other)).collect();
        rest.push(best);
    }
    rest
}

/// The places of a chain, from its end.
fn traced(all: &[Chain], mut idx: usize) -> impl Iterator<Item = usize> {
    let mut is_over = false;
    std::iter::from_fn(move || {
        let chain = all[idx];
        let place = (!is_over).then_some(chain.place);
        is_over = idx == 0;
        idx = chain.before;
        place
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Model;
    use crate::planner::tests::{radar, scenario};

    /// Every chain from `chain` on, with what it costs, of at most `most` legs.
    fn every(legs: &Legs, chain: &mut Vec<usize>, cost: f64, most: usize, best: &mut f64) {
        let last = chain[chain.len() - 1];
        if last == legs.places.len() - 1 {
            *best = best.min(cost);
            return;
        }
        if chain.len() > most {
            return;
        }
        for next in 1..legs.places.len() {
            let cost = cost + legs.costs[last][next];
            let turns = chain.len() < 2 || {
                let corner = [chain[chain.len() - 2], last, next];
                legs.may_turn(corner.map(|place| legs.places[place]))
            };
            if cost < *best && turns {
                chain.push(next);
                every(legs, chain, cost, most, best);
                chain.pop();
            }
        }
    }

    #[test]
    fn the_first_chain_is_the_cheapest_of_so_few_legs() {
        let mut scenario = scenario();
        scenario.vehicle.max_turn_deg = 50.0;
        scenario.threats = vec![
            radar(300.0, 330.0, 90.0),
            radar(420.0, 560.0, 110.0),
            radar(620.0, 480.0, 80.0),
            radar(700.0, 730.0, 60.0),
        ];
        let model = Model::new(&scenario);
        let mut places = vec![scenario.start];
        for (row, column) in (0..5).flat_map(|row| (0..5).map(move |column| (row, column))) {
            let (x, y) = (
                150.0 + 150.0 * f64::from(column),
                160.0 + 155.0 * f64::from(row),
            );
            places.push(Point3::new(x, y, 100.0 + f64::from(row)));
        }
        places.push(scenario.target);
        let mut legs = Legs::new(&model, &places, 0.0);
        let price = |legs: &Legs, chain: &[Point3]| -> f64 {
            let number = |point: &Point3| places.iter().position(|place| place == point);
            let numbers: Vec<usize> = chain.iter().filter_map(number).collect();
            let ends = numbers.windows(2);
            ends.map(|ends| legs.costs[ends[0]][ends[1]]).sum()
        };
        let mut costs = Vec::new();
        for most in 1..=6 {
            let found = chains(&mut legs, most, 3, |_, _| false);
            let mut best = f64::INFINITY;
            every(&legs, &mut vec![0], 0.0, most, &mut best);
            let priced: Vec<f64> = found.iter().map(|chain| price(&legs, chain)).collect();
            assert_eq!(best.is_finite(), !found.is_empty(), "{most} legs");
            assert!(priced.is_sorted(), "{priced:?}");
            if let Some(first) = priced.first() {
                assert!(
                    (first - best).abs() < 1e-9 * best,
                    "{most} legs: {first} {best}"
                );
                costs.push(*first);
            }
            assert!(found.iter().all(|chain| chain.len() <= most + 1));
        }
        // The limit tells.
        assert!(
            costs.len() > 1 && costs[0] > 1.01 * costs[costs.len() - 1],
            "{costs:?}"
        );
        let unlike = chains(&mut legs, 6, 3, |_, _| true);
        assert_eq!(unlike.len(), 1);
    }
}
