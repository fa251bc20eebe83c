//! Ways along flanks too steep to fly straight up or down: chains through a net of places whose turns the vehicle can
//! fly.
//!
//! On such a flank a leg keeps the band only where it nearly follows the contours, and the cheapest chain of these legs
//! goes to and fro, in turns that hardly any vehicle flies. With turns considered, it winds round the mountain.

mod legs;

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

use super::height::is_steep;
use super::net::{self, Found};
use super::thin::thin;
use crate::cost::{Model, metre};
use crate::geometry::{Point3, Vector2};
use legs::{HEADINGS, Legs};

/// Spots of the net, apart from both ends.
const SPOTS: usize = 2000;

/// Spots of a finer net, where the first has no way though no straight one joins the ends.
const SPOTS_IF_STEEP: usize = 4000;

/// Chains that cost this many times as much as the cheapest are not worth refining.
const WORTHWHILE: f64 = 1.1;

/// Up to `count` routes that differ; none once `is_over`.
pub(super) fn routes(model: &Model, count: usize, is_over: &dyn Fn() -> bool) -> Found {
    let mut found = Found::default();
    let finer = is_steep(model.scenario).then_some(SPOTS_IF_STEEP);
    for spots in std::iter::once(SPOTS).chain(finer) {
        let mut net = Net::new(model, spots);
        if let Some(trees) = net.trees(is_over) {
            for chain in net.chains(model, &trees, count) {
                if is_over() {
                    break;
                }
                let (route, legs_priced) = thin(model, &net.legs.pricer, &chain);
                found.routes.push(route);
                found.legs_priced += legs_priced;
            }
        }
        found.legs_priced += net.legs.count;
        if !found.routes.is_empty() {
            break;
        }
    }
    found
}

/// A net of places, and what chains through it must keep.
struct Net<'s> {
    legs: Legs<'s>,
    /// Cost of a metre.
    metre: f64,
    /// Cosine of the sharpest turn.
    sharpest: f64,
}

impl<'s> Net<'s> {
    fn new(model: &Model<'s>, spots: usize) -> Self {
        let scenario = model.scenario;
        Self {
            legs: Legs::new(model, spots),
            metre: metre(scenario),
            sharpest: scenario.vehicle.sharpest() - 1e-9,
        }
    }

    /// The cheapest chains from the start and from the target; `None` when none joins them.
    fn trees(&mut self, is_over: &dyn Fn() -> bool) -> Option<[Tree; 2]> {
        let places = &self.legs.places;
        let ends = [0, places.len() - 1];
        let target = places[ends[1]];
        let rest: Vec<f64> = places
            .iter()
            .map(|place| self.least(*place, target))
            .collect();
        let from_start = self.cheapest(ends, &rest, is_over)?;
        // Seen from the target, what is left of each way is known now, and fewer places are worth a look.
        let rest: Vec<f64> = (0..rest.len())
            .map(|place| from_start.least(place))
            .collect();
        let from_target = self.cheapest([ends[1], ends[0]], &rest, is_over)?;
        Some([from_start, from_target])
    }

    /// The least cost of any way between two points.
    fn least(&self, from: Point3, to: Point3) -> f64 {
        let way = to - from;
        let climb = libm::hypot(way.z, way.z / self.legs.steepest);
        self.metre * way.norm().max(climb)
    }

    /// The cheapest chains from `source` to `goal`, and over all places on ways hardly more expensive than that; what
    /// the `rest` of a way costs at least is given for each place. `None` when the goal is not reached.
    fn cheapest(
        &mut self,
        [source, goal]: [usize; 2],
        rest: &[f64],
        is_over: &dyn Fn() -> bool,
    ) -> Option<Tree> {
        let mut tree = Tree::new(rest.len(), source);
        let mut closed = vec![false; tree.headings.len()];
        let mut open = BinaryHeap::from([Reverse((0, source * HEADINGS))]);
        let mut worthwhile = f64::INFINITY;
        while let Some(Reverse((whole, state))) = open.pop() {
            let place = state / HEADINGS;
            if f64::from_bits(whole) > worthwhile || is_over() {
                break;
            }
            if std::mem::replace(&mut closed[state], true) {
                continue;
            }
            if place == goal {
                worthwhile = worthwhile.min(WORTHWHILE * tree.chains.costs[state]);
                continue;
            }
            let heading = tree.headings[state];
            for leg in self.legs.from(place) {
                let next = leg.to * HEADINGS + leg.range;
                let cost = tree.chains.costs[state] + leg.cost;
                let whole = cost + rest[leg.to];
                let may_turn = place == source || heading.dot(&leg.heading) >= self.sharpest;
                if cost < tree.chains.costs[next]
                    && may_turn
                    && whole <= worthwhile
                    && !closed[next]
                {
                    tree.chains.costs[next] = cost;
                    tree.headings[next] = leg.heading;
                    tree.chains.before[next] = state;
                    open.push(Reverse((whole.to_bits(), next)));
                }
            }
        }
        (worthwhile.is_finite() && !is_over()).then_some(tree)
    }

    /// Up to `count` chains that differ, the cheapest first, out of the trees from start and target.
    fn chains(&self, model: &Model, trees: &[Tree; 2], count: usize) -> Vec<Vec<Point3>> {
        let [from_start, from_target] = trees;
        let inner = 1..self.legs.places.len() - 1;
        let over = inner
            .filter_map(|place| self.joined(place, trees))
            .collect();
        let through = |[state, onward]: [usize; 2]| {
            let there = from_start.trace(state).rev();
            there.chain(from_target.trace(onward).skip(1)).collect()
        };
        net::different(model, &self.legs.places, over, through, count)
    }

    /// The cheapest chain over `place`: its cost, and the states in which its halves arrive there.
    fn joined(
        &self,
        place: usize,
        [from_start, from_target]: &[Tree; 2],
    ) -> Option<(f64, [usize; 2])> {
        let states = states_of(place);
        let mut best: Option<(f64, [usize; 2])> = None;
        for state in states.clone() {
            for onward in states.clone() {
                let cost = from_start.chains.costs[state] + from_target.chains.costs[onward];
                let turn = -from_start.headings[state].dot(&from_target.headings[onward]);
                let is_cheaper = best.is_none_or(|(least, _)| cost < least);
                if cost.is_finite() && is_cheaper && turn >= self.sharpest {
                    best = Some((cost, [state, onward]));
                }
            }
        }
        best
    }
}

/// The cheapest chains from one end. Their states are the places with the ranges of headings of arrival.
struct Tree {
    chains: net::Tree,
    /// In which the chain to each state arrives.
    headings: Vec<Vector2>,
}

impl Tree {
    /// Nothing but its beginning, `source`.
    fn new(places: usize, source: usize) -> Self {
        let states = places * HEADINGS;
        let mut chains = net::Tree::from(source * HEADINGS, states);
        // No chain comes back to where it began.
        chains.costs[states_of(source)].fill(0.0);
        Self {
            chains,
            headings: vec![Vector2::zeros(); states],
        }
    }

    /// The least cost of a chain that arrives at `place`.
    fn least(&self, place: usize) -> f64 {
        let costs = self.chains.costs[states_of(place)].iter().copied();
        costs.fold(f64::INFINITY, f64::min)
    }

    /// The places of a chain, back to where it begins.
    fn trace(&self, state: usize) -> impl DoubleEndedIterator<Item = usize> {
        let states = self.chains.trace(state).into_iter();
        states.map(|state| state / HEADINGS)
    }
}

/// The states in which a chain may arrive at `place`.
fn states_of(place: usize) -> Range<usize> {
    place * HEADINGS..(place + 1) * HEADINGS
}

#[cfg(test)]
mod tests {
    use super::super::may_turn_along;
    use super::*;
    use crate::planner::price::price;
    use crate::planner::tests::mountain;
    use crate::planner::{Nobody, plan};

    #[test]
    fn a_steep_mountain_is_left_and_climbed_along_its_flanks() {
        for is_down in [true, false] {
            let scenario = mountain(250.0, is_down);
            let model = Model::new(&scenario);
            let sharpest = scenario.vehicle.sharpest() - 1e-6;
            let mut net = Net::new(&model, SPOTS);
            let trees = net.trees(&|| false).expect("a way is found");
            let chains = net.chains(&model, &trees, 8);
            assert!(chains.len() > 2, "{}", chains.len());
            for chain in &chains {
                assert_eq!(chain[0], scenario.start);
                assert_eq!(chain[chain.len() - 1], scenario.target);
                assert!(may_turn_along(chain, sharpest));
                assert!(price(&model, chain).is_feasible());
            }
            let shortest = scenario.direct();
            let length: f64 = chains[0]
                .windows(2)
                .map(|leg| (leg[1] - leg[0]).norm())
                .sum();
            assert!(length > 1.2 * shortest, "{length}");
            assert!(plan(&scenario, &mut Nobody, &Nobody).feasible);
        }
    }

    /// What the rest of a way costs at least only spares effort.
    #[test]
    fn the_cheapest_chain_is_the_same_without_an_estimate_of_the_rest() {
        let scenario = mountain(250.0, true);
        let model = Model::new(&scenario);
        let mut net = Net::new(&model, 500);
        let places = net.legs.places.len();
        let target = net.legs.places[places - 1];
        let rest = net
            .legs
            .places
            .iter()
            .map(|place| net.least(*place, target));
        let estimates = [rest.collect(), vec![0.0; places]];
        let [with, without] = estimates.map(|rest: Vec<f64>| {
            let tree = net.cheapest([0, places - 1], &rest, &|| false);
            tree.expect("a way is found").least(places - 1)
        });
        assert!((with - without).abs() < 1e-9 * without, "{with} {without}");
    }

    #[test]
    fn a_stop_is_heard() {
        let scenario = mountain(250.0, true);
        let looked = std::cell::Cell::new(0);
        let is_over = || {
            looked.set(looked.get() + 1);
            looked.get() > 100
        };
        let found = routes(&Model::new(&scenario), 8, &is_over);
        assert!(found.routes.is_empty());
        assert!(looked.get() < 110, "{}", looked.get());
    }
}
