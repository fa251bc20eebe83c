//! Ways along flanks too steep to fly straight up or down: chains through a net of places whose turns the vehicle can
//! fly.
//!
//! On such a flank a leg keeps the band only where it nearly follows the contours, and the cheapest chain of these legs
//! goes to and fro, in turns that hardly any vehicle flies. With turns considered, it winds round the mountain.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

use super::net::{self, Found, Spots};
use super::thin::thin;
use super::{is_steep, nearer_end, steepest};
use crate::cost::batch::{LANES, Price, Pricer};
use crate::cost::{Model, metre};
use crate::geometry::{LEVEL, Point2, Point3, Vector2};
use crate::planner::price::PRICED_FROM;
use crate::scenario::Scenario;

/// Spots of the net, apart from both ends.
const SPOTS: usize = 2000;

/// Spots of a finer net, where the first has no way though no straight one joins the ends.
const SPOTS_IF_STEEP: usize = 4000;

/// Heights of each spot, as shares of the band.
const HEIGHTS: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// The net covers all points over which the way is at most this many times as long as the direct one, or as a climb
/// from the height of one end to that of the other.
const DETOUR: f64 = 1.5;

/// Legs are at most this many steps of the net long, seen from above.
const REACH: f64 = 3.7;

/// At each place the cheapest chain is kept for each of these ranges of headings in which it may arrive.
const HEADINGS: usize = 24;

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
            sharpest: libm::cos(scenario.vehicle.max_turn_deg.to_radians()) - 1e-9,
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
        let mut closed = vec![false; tree.costs.len()];
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
                worthwhile = worthwhile.min(WORTHWHILE * tree.costs[state]);
                continue;
            }
            let heading = tree.headings[state];
            for leg in self.legs.from(place) {
                let next = leg.to * HEADINGS + leg.range;
                let cost = tree.costs[state] + leg.cost;
                let whole = cost + rest[leg.to];
                let may_turn = place == source || heading.dot(&leg.heading) >= self.sharpest;
                if cost < tree.costs[next] && may_turn && whole <= worthwhile && !closed[next] {
                    tree.costs[next] = cost;
                    tree.headings[next] = leg.heading;
                    tree.before[next] = state;
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
            let mut chain = from_start.trace(state);
            chain.reverse();
            chain.extend(from_target.trace(onward).into_iter().skip(1));
            chain
        };
        net::different(model, &self.legs.places, over, through, count)
    }

    /// The cheapest chain over `place`: its cost, and the states in which its halves arrive there.
    fn joined(
        &self,
        place: usize,
        [from_start, from_target]: &[Tree; 2],
    ) -> Option<(f64, [usize; 2])> {
        let states = place * HEADINGS..(place + 1) * HEADINGS;
        let mut best: Option<(f64, [usize; 2])> = None;
        for state in states.clone() {
            for onward in states.clone() {
                let cost = from_start.costs[state] + from_target.costs[onward];
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

/// The legs between places that break no limit.
struct Legs<'s> {
    /// Start, the spots at their heights, target.
    places: Vec<Point3>,
    /// For each spot, the numbers of those to which legs lead; start and target are the first and the last spot.
    near: Vec<Vec<usize>>,
    /// From each place, once they have been priced.
    known: Vec<Option<Vec<Leg>>>,
    /// How many were priced.
    count: u64,
    pricer: Pricer<'s>,
    /// Half the cost of each place as a waypoint, for each metre of a leg that begins or ends there.
    own: Vec<f64>,
    /// Metres climbed per metre seen from above, at most.
    steepest: f64,
}

#[derive(Clone, Copy)]
struct Leg {
    to: usize,
    heading: Vector2,
    range: usize,
    cost: f64,
}

impl<'s> Legs<'s> {
    fn new(model: &Model<'s>, spots: usize) -> Self {
        let scenario = model.scenario;
        let tolerance = model.tolerance.scaled(PRICED_FROM);
        let steepest = steepest(scenario);
        let way = scenario.target - scenario.start;
        let direct = way.xy().norm().max(LEVEL);
        let length = direct.max(way.z.abs() / steepest);
        let Spots { points, step } = net::spots(scenario, spots, DETOUR * length / direct);
        let over = |&spot| HEIGHTS.map(|share| place(scenario, spot, share));
        let places: Vec<Point3> = std::iter::once(scenario.start)
            .chain(points.iter().flat_map(over))
            .chain([scenario.target])
            .collect();
        // A route has one waypoint per certain distance, not one at every place.
        let waypoints_per_m = (scenario.planner.waypoints + 1) as f64 / length;
        let own = |&place| 0.5 * model.waypoint(place, tolerance).1 * waypoints_per_m;
        Self {
            near: near(scenario, &points, REACH * step),
            known: vec![None; places.len()],
            count: 0,
            pricer: Pricer::new(model, scenario.planner.quadrature, tolerance).verdicts(),
            own: places.iter().map(own).collect(),
            steepest: steepest * (1.0 + 1e-9),
            places,
        }
    }

    /// The legs from `place`.
    fn from(&mut self, place: usize) -> &[Leg] {
        if self.known[place].is_none() {
            self.known[place] = Some(self.priced(place));
        }
        self.known[place].as_deref().unwrap_or_default()
    }

    fn priced(&mut self, from: usize) -> Vec<Leg> {
        let may_climb = |to: usize| {
            let leg = self.places[to] - self.places[from];
            let level = leg.xy().norm();
            level > LEVEL && leg.z.abs() <= self.steepest * level
        };
        let spots = &self.near[spot_of(from)];
        let ends: Vec<(usize, usize)> = spots
            .iter()
            .flat_map(|&spot| self.places_over(spot))
            .filter(|&to| may_climb(to))
            .map(|to| (from, to))
            .collect();
        let [starts, targets] = net::rows(&self.places, &ends);
        let mut prices = vec![Price::ZERO; starts.len()];
        self.pricer
            .first_legs(&starts, &targets, ends.len(), &mut prices);
        self.count += ends.len() as u64;
        let legs = ends.iter().enumerate().filter_map(|(idx, &(from, to))| {
            let (price, lane) = (&prices[idx / LANES], idx % LANES);
            let way = self.places[to] - self.places[from];
            let heading = way.xy().normalize();
            (price.violation[lane] <= 0.0).then(|| Leg {
                to,
                heading,
                range: range(heading),
                cost: price.cost[lane] + (self.own[from] + self.own[to]) * way.norm(),
            })
        });
        legs.collect()
    }

    /// The places over a spot.
    fn places_over(&self, spot: usize) -> Range<usize> {
        let from = (spot * HEIGHTS.len() + 1).saturating_sub(HEIGHTS.len());
        let last = self.places.len();
        if spot == 0 {
            0..1
        } else {
            from..(from + HEIGHTS.len()).min(last)
        }
    }
}

/// The number of the spot of a place.
fn spot_of(place: usize) -> usize {
    place.div_ceil(HEIGHTS.len())
}

/// `spot` at that share of the band's height, or as near to it as one straight leg to the nearer end allows where that
/// keeps the band.
fn place(scenario: &Scenario, spot: Point2, share: f64) -> Point3 {
    let band = scenario.altitude;
    let ground = scenario.terrain.elevation(spot);
    let wanted = ground + band.min + share * (band.max - band.min);
    let near = nearer_end(scenario, spot);
    let reach = (spot - near.xy()).norm() * steepest(scenario);
    let reached = wanted.clamp(near.z - reach, near.z + reach).max(ground);
    let is_outside = reached > ground + band.max;
    Point3::new(spot.x, spot.y, if is_outside { wanted } else { reached })
}

/// For each of start, `spots` and target, those others that are at most `reach` metres away.
fn near(scenario: &Scenario, spots: &[Point2], reach: f64) -> Vec<Vec<usize>> {
    let spots: Vec<Point2> = std::iter::once(scenario.start.xy())
        .chain(spots.iter().copied())
        .chain([scenario.target.xy()])
        .collect();
    let is_near = |one: Point2, other: Point2| (one - other).norm_squared() <= reach * reach;
    let others = |(idx, &spot): (usize, &Point2)| {
        let near = (0..spots.len()).filter(|&other| other != idx && is_near(spot, spots[other]));
        near.collect()
    };
    spots.iter().enumerate().map(others).collect()
}

/// The cheapest chains from one end. Their states are the places with the ranges of headings of arrival.
struct Tree {
    /// Of each state; infinite where no chain arrives.
    costs: Vec<f64>,
    /// In which each chain arrives.
    headings: Vec<Vector2>,
    /// The state before each; where there is none, itself.
    before: Vec<usize>,
}

impl Tree {
    /// Nothing but its beginning, `source`.
    fn new(places: usize, source: usize) -> Self {
        let states = places * HEADINGS;
        let mut costs = vec![f64::INFINITY; states];
        // No chain comes back to where it began.
        costs[source * HEADINGS..(source + 1) * HEADINGS].fill(0.0);
        Self {
            costs,
            headings: vec![Vector2::zeros(); states],
            before: (0..states).collect(),
        }
    }

    /// The least cost of a chain that arrives at `place`.
    fn least(&self, place: usize) -> f64 {
        let states = &self.costs[place * HEADINGS..(place + 1) * HEADINGS];
        states.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The places of a chain, back to where it begins.
    fn trace(&self, mut state: usize) -> Vec<usize> {
        let mut chain = vec![state / HEADINGS];
        while self.before[state] != state {
            state = self.before[state];
            chain.push(state / HEADINGS);
        }
        chain
    }
}

/// The number of the range of a heading.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "from 0 to the number of ranges"
)]
fn range(heading: Vector2) -> usize {
    let turns = libm::atan2(heading.y, heading.x) / std::f64::consts::TAU;
    (turns * HEADINGS as f64)
        .round()
        .rem_euclid(HEADINGS as f64) as usize
        % HEADINGS
}

#[cfg(test)]
mod tests {
    use super::super::may_turn_along;
    use super::*;
    use crate::planner::price::price;
    use crate::planner::tests::scenario;
    use crate::planner::{Nobody, plan};
    use crate::scenario::Seeding;
    use crate::terrain::{Peak, Peaks, Terrain};

    /// From the top of a mountain, 400 m high, to the plain before it, or up; its flanks are three times as steep as
    /// the vehicle can fly.
    fn mountain(is_down: bool) -> Scenario {
        let mut scenario = scenario();
        scenario.threats.clear();
        let peak = Peak {
            center: Point2::new(400.0, 500.0),
            height: 400.0,
            spread: Point2::new(250.0, 220.0),
        };
        scenario.terrain = Terrain::Peaks(Peaks {
            base: 0.0,
            peaks: vec![peak],
        });
        (scenario.altitude.min, scenario.altitude.max) = (30.0, 120.0);
        scenario.vehicle.max_climb_deg = 25.0;
        scenario.planner.waypoints = 16;
        scenario.planner.seeding = Seeding::Tangent;
        scenario.planner.polish = true;
        let on_ground = |x, y| {
            let at = Point2::new(x, y);
            Point3::new(x, y, scenario.terrain.elevation(at))
        };
        let ends = [on_ground(400.0, 500.0), on_ground(950.0, 600.0)];
        [scenario.start, scenario.target] = if is_down { ends } else { [ends[1], ends[0]] };
        scenario
    }

    #[test]
    fn a_steep_mountain_is_left_and_climbed_along_its_flanks() {
        for is_down in [true, false] {
            let scenario = mountain(is_down);
            let model = Model::new(&scenario);
            let sharpest = libm::cos(scenario.vehicle.max_turn_deg.to_radians()) - 1e-6;
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
            let shortest = (scenario.target - scenario.start).norm();
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
        let scenario = mountain(true);
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
        let scenario = mountain(true);
        let looked = std::cell::Cell::new(0);
        let is_over = || {
            looked.set(looked.get() + 1);
            looked.get() > 100
        };
        let found = routes(&Model::new(&scenario), 8, &is_over);
        assert!(found.routes.is_empty());
        assert!(looked.get() < 110, "{}", looked.get());
    }

    #[test]
    fn places_of_a_spot_belong_to_it() {
        let scenario = mountain(true);
        let legs = Legs::new(&Model::new(&scenario), 100);
        let spots = legs.near.len();
        let all: Vec<usize> = (0..spots).flat_map(|spot| legs.places_over(spot)).collect();
        assert_eq!(all, (0..legs.places.len()).collect::<Vec<_>>());
        for spot in 0..spots {
            assert!(legs.places_over(spot).all(|place| spot_of(place) == spot));
        }
    }
}
