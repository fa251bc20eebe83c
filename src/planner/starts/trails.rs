//! Ways where there are few: through a fine net of places, over hills at several heights of the band.
//!
//! Where no chain of long legs keeps the limits, over hard ground or among crowded threats, the way is found in small
//! steps: every place is joined to those around it, and over hills some of them are enough lower or higher above the
//! ground that a leg need not climb with it. Of the chain that is found, as many waypoints are kept as the route may
//! have.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::lifted;
use super::net::{self, Found, Spots, Tree};
use super::thin::thin;
use super::vast::Watch;
use crate::cost::Model;
use crate::cost::batch::{LANES, Pricer};
use crate::geometry::Point3;
use crate::planner::price::{pricer, search_tolerance};
use crate::scenario::Scenario;

/// Spots of the net, apart from both ends.
const SPOTS: usize = 1000;

/// Heights of each spot, as shares of the band.
const HEIGHTS: [f64; 1] = [0.5];
const HEIGHTS_OVER_HILLS: [f64; 3] = [1.0 / 6.0, 0.5, 5.0 / 6.0];

/// The net covers all points over which the way is at most this many times the direct one, or more.
const DETOUR: f64 = 1.5;

/// Spots of a net that covers more.
const SPOTS_FAR_ABOUT: usize = 2500;

/// Places are joined to those within this many steps of the net.
const REACH: f64 = 2.1;

/// Up to `count` routes that differ through each of its nets, of at most as many free waypoints as `model` asks for:
/// over what is near to the direct way, or over all that is within `detour` times as far, if that is more.
/// Fewer once `is_over`.
pub(super) fn routes(
    model: &Model,
    detour: Option<f64>,
    count: usize,
    is_over: &dyn Fn() -> bool,
) -> Found {
    let mut found = Found::default();
    for spots in nets(model.scenario, detour.filter(|&detour| detour > DETOUR)) {
        if is_over() {
            break;
        }
        let Some(mut net) = Net::new(model, &spots, is_over) else {
            break;
        };
        found.legs_priced += net.legs_priced;
        let last = net.places.len() - 1;
        let (Some(out), Some(back)) = (net.cheapest(0), net.cheapest(last)) else {
            break;
        };
        let trees = [out, back];
        for chain in net::chains(model, &net.places, &trees, count) {
            if is_over() {
                break;
            }
            let (route, legs_priced) = thin(model, &net.pricer, &chain);
            found.routes.push(route);
            found.legs_priced += legs_priced;
        }
    }
    found
}

/// For long detours, most points may be outside the area: then a finer net finds gaps, and a coarse one more ways that
/// differ.
fn nets(scenario: &Scenario, far_about: Option<f64>) -> Vec<Spots> {
    let Some(detour) = far_about else {
        return vec![net::spots(scenario, SPOTS, DETOUR)];
    };
    let coarse = net::spots(scenario, SPOTS_FAR_ABOUT, detour);
    let within = coarse.points.len();
    if 2 * within > SPOTS_FAR_ABOUT {
        return vec![coarse];
    }
    let count = SPOTS_FAR_ABOUT * SPOTS_FAR_ABOUT / within.max(SPOTS_FAR_ABOUT / 20);
    vec![coarse, net::spots(scenario, count, detour)]
}

/// Places joined by legs.
struct Net<'s> {
    places: Vec<Point3>,
    pricer: Pricer<'s>,
    /// For each place.
    legs: Vec<Vec<Leg>>,
    legs_priced: u64,
    watch: Watch<'s>,
}

#[derive(Clone, Copy)]
struct Leg {
    to: usize,
    /// Cost; infinite where the leg breaks a limit.
    cost: f64,
    /// Whether it is known to keep its heights.
    measured: bool,
}

/// A chain about to end at `place`, which it reaches by leg number `leg` of place `via`.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Arrival {
    /// The bits of its cost, in the same order.
    cost: u64,
    place: usize,
    via: usize,
    leg: usize,
}

impl<'s> Net<'s> {
    /// `None` where there is no time for all its legs.
    fn new(model: &Model<'s>, spots: &Spots, is_over: &'s dyn Fn() -> bool) -> Option<Self> {
        let scenario = model.scenario;
        let tolerance = search_tolerance(model);
        let pricer = pricer(model).verdicts();
        let places = places(model, spots);
        let mut ends = Vec::new();
        let reach = REACH * spots.step;
        for (a, one) in places.iter().enumerate() {
            for (b, other) in places.iter().enumerate().skip(a + 1) {
                let (dx, dy) = (other.x - one.x, other.y - one.y);
                let square = dx * dx + dy * dy;
                if square <= reach * reach && square > 0.0 {
                    ends.push((a, b));
                }
            }
        }
        // A route has one waypoint per certain distance, not one at every place.
        let way = scenario.direct();
        let waypoints = (scenario.planner.waypoints + 1) as f64 / way;
        let own: Vec<f64> = places
            .iter()
            .map(|&place| model.waypoint(place, tolerance).1 * waypoints)
            .collect();
        let mut legs = vec![Vec::new(); places.len()];
        let mut watch = Watch::new(scenario, is_over);
        for ends in ends.chunks(watch.most_unwatched) {
            if !watch.may_go_on(ends.len()) {
                return None;
            }
            let priced = net::priced(&places, ends, |from, to, prices| {
                pricer.legs_at_best(from, to, prices);
            });
            for (&(a, b), leg) in ends.iter().zip(&priced) {
                if !leg.is_feasible() {
                    continue;
                }
                let length = (places[b] - places[a]).norm();
                let cost = leg.cost + 0.5 * (own[a] + own[b]) * length;
                for (at, to) in [(a, b), (b, a)] {
                    legs[at].push(Leg {
                        to,
                        cost,
                        measured: false,
                    });
                }
            }
        }
        Some(Self {
            places,
            pricer,
            legs,
            legs_priced: ends.len() as u64,
            watch,
        })
    }

    /// The cheapest chains from `source`; `None` where there is no time to find them.
    fn cheapest(&mut self, source: usize) -> Option<Tree> {
        let mut tree = Tree::from(source, self.places.len());
        let mut closed = vec![false; self.places.len()];
        let mut open = BinaryHeap::new();
        closed[source] = true;
        self.spread(source, 0.0, &closed, &mut open);
        while let Some(Reverse(first)) = open.pop() {
            if closed[first.place] {
                continue;
            }
            if self.legs[first.via][first.leg].measured {
                let cost = f64::from_bits(first.cost);
                tree.costs[first.place] = cost;
                tree.before[first.place] = first.via;
                closed[first.place] = true;
                self.spread(first.place, cost, &closed, &mut open);
                continue;
            }
            // The next ones in line are measured with it.
            let mut few = vec![first];
            while few.len() < LANES
                && let Some(Reverse(next)) = open.peek()
                && !self.legs[next.via][next.leg].measured
            {
                few.extend(open.pop().map(|Reverse(next)| next));
            }
            few.retain(|next| !closed[next.place]);
            if !self.watch.may_go_on(few.len()) {
                return None;
            }
            self.measure(&few);
            let good = |next: &Arrival| self.legs[next.via][next.leg].cost.is_finite();
            open.extend(few.into_iter().filter(good).map(Reverse));
        }
        Some(tree)
    }

    /// Add the chains that extend from `place` to those that are `open`.
    fn spread(
        &self,
        place: usize,
        cost: f64,
        closed: &[bool],
        open: &mut BinaryHeap<Reverse<Arrival>>,
    ) {
        for (idx, leg) in self.legs[place].iter().enumerate() {
            if !closed[leg.to] && leg.cost.is_finite() {
                open.push(Reverse(Arrival {
                    cost: (cost + leg.cost).to_bits(),
                    place: leg.to,
                    via: place,
                    leg: idx,
                }));
            }
        }
    }

    /// Measure the heights of the last legs of `few`.
    fn measure(&mut self, few: &[Arrival]) {
        let ends: Vec<(usize, usize)> = few
            .iter()
            .map(|next| (next.via.min(next.place), next.via.max(next.place)))
            .collect();
        let heights = net::priced(&self.places, &ends, |from, to, prices| {
            self.pricer.heights_of_legs(from, to, ends.len(), prices);
        });
        for (&(a, b), leg) in ends.iter().zip(&heights) {
            let breaks = !leg.is_feasible();
            for (at, to) in [(a, b), (b, a)] {
                for leg in self.legs[at].iter_mut().filter(|leg| leg.to == to) {
                    leg.measured = true;
                    if breaks {
                        leg.cost = f64::INFINITY;
                    }
                }
            }
        }
    }
}

/// Start, the spots at their heights, target.
fn places(model: &Model, spots: &Spots) -> Vec<Point3> {
    let scenario = model.scenario;
    let heights: &[f64] = if scenario.terrain.is_flat() {
        &HEIGHTS
    } else {
        &HEIGHTS_OVER_HILLS
    };
    let over = |&spot| {
        heights
            .iter()
            .map(move |&share| lifted(scenario, spot, share))
    };
    std::iter::once(scenario.start)
        .chain(spots.points.iter().flat_map(over))
        .chain([scenario.target])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::roadmap;
    use super::*;
    use crate::geometry::Point2;
    use crate::optimizer::Fitness;
    use crate::planner::price::price;
    use crate::planner::tests::{radar, scenario};
    use crate::scenario::{AltitudeBand, Scenario};
    use crate::terrain::{Peak, Peaks, Terrain};

    /// Height, centre and spread of twenty mountains, metres.
    const MOUNTAINS: [[f64; 5]; 20] = [
        [216.0, 132.0, 318.0, 71.0, 124.0],
        [228.0, 889.0, 160.0, 89.0, 86.0],
        [87.0, 750.0, 117.0, 68.0, 123.0],
        [151.0, 132.0, 422.0, 117.0, 72.0],
        [249.0, 574.0, 279.0, 109.0, 70.0],
        [225.0, 226.0, 284.0, 127.0, 71.0],
        [133.0, 259.0, 781.0, 80.0, 130.0],
        [247.0, 181.0, 365.0, 54.0, 90.0],
        [159.0, 753.0, 678.0, 125.0, 60.0],
        [215.0, 290.0, 691.0, 99.0, 63.0],
        [143.0, 317.0, 491.0, 125.0, 111.0],
        [159.0, 814.0, 856.0, 121.0, 72.0],
        [291.0, 847.0, 602.0, 78.0, 118.0],
        [88.0, 232.0, 534.0, 51.0, 112.0],
        [156.0, 830.0, 489.0, 102.0, 125.0],
        [161.0, 644.0, 520.0, 90.0, 51.0],
        [102.0, 660.0, 244.0, 69.0, 103.0],
        [198.0, 792.0, 551.0, 89.0, 78.0],
        [199.0, 809.0, 449.0, 87.0, 111.0],
        [290.0, 212.0, 261.0, 82.0, 96.0],
    ];

    /// Slopes twice as steep as the vehicle climbs; the band is 20 to 120 m above ground.
    fn mountains() -> Scenario {
        let mut scenario = scenario();
        scenario.terrain = Terrain::Peaks(Peaks {
            base: 0.0,
            peaks: MOUNTAINS
                .map(|[height, x, y, along, across]| Peak {
                    center: Point2::new(x, y),
                    height,
                    spread: Point2::new(along, across),
                })
                .to_vec(),
        });
        scenario.threats = vec![
            radar(870.0, 608.0, 44.0),
            radar(376.0, 483.0, 43.0),
            radar(294.0, 377.0, 41.0),
            radar(401.0, 644.0, 58.0),
            radar(720.0, 539.0, 37.0),
            radar(584.0, 515.0, 40.0),
        ];
        for (end, x, y) in [
            (&mut scenario.start, 200.0, 200.0),
            (&mut scenario.target, 800.0, 800.0),
        ] {
            let ground = scenario.terrain.elevation(Point2::new(x, y));
            *end = Point3::new(x, y, ground + 70.0);
        }
        scenario.altitude = AltitudeBand {
            min: 20.0,
            max: 120.0,
        };
        scenario.vehicle.max_climb_deg = 35.0;
        scenario.planner.waypoints = 12;
        scenario
    }

    /// Where the coarse net has no feasible way, the fine one has at least one.
    #[test]
    fn the_fine_net_finds_a_way_through_steep_mountains() {
        let scenario = mountains();
        let model = Model::new(&scenario);
        let can_be_flown = |route: &&Vec<Point3>| price(&model, route).is_feasible();
        let coarse = roadmap::routes(&model, 8, f64::INFINITY, &|| false)
            .0
            .routes;
        assert_eq!(coarse.iter().filter(can_be_flown).count(), 0);
        let fine = routes(&model, None, 8, &|| false).routes;
        assert!(fine.iter().filter(can_be_flown).count() > 0);
        for route in &fine {
            assert!(route.len() <= 14);
            assert_eq!(
                (route[0], route[route.len() - 1]),
                (scenario.start, scenario.target)
            );
        }
    }

    /// Among discs in staggered rows the coarse net has no feasible way, and the fine one has a better one.
    #[test]
    fn the_fine_net_finds_a_better_way_through_a_crowd() {
        let mut scenario = scenario();
        scenario.threats = (0..9)
            .flat_map(|row| (0..8).map(move |column| (f64::from(row), f64::from(column))))
            .map(|(row, column)| {
                let shift = if row % 2.0 > 0.5 { 50.0 } else { 0.0 };
                radar(110.0 + 100.0 * column + shift, 100.0 + 87.0 * row, 28.0)
            })
            .filter(|threat| {
                let crate::threat::Shape::Cylinder(disc) = &threat.shape else {
                    return false;
                };
                [scenario.start, scenario.target]
                    .iter()
                    .all(|end| (end.xy() - disc.center).norm() > 70.0)
            })
            .collect();
        scenario.planner.waypoints = 8;
        // Without a climb at the ends, for which the coarse net has places of its own.
        (scenario.start.z, scenario.target.z) = (100.0, 100.0);
        let model = Model::new(&scenario);
        let best = |found: Found| {
            let priced = found.routes.iter().map(|route| price(&model, route));
            priced.min_by(Fitness::rank).expect("a route")
        };
        let [coarse, fine] = [
            roadmap::routes(&model, 8, f64::INFINITY, &|| false).0,
            routes(&model, None, 8, &|| false),
        ]
        .map(best);
        assert!(!coarse.is_feasible());
        assert!(fine.is_feasible(), "{fine:?}");
        assert!(fine.beats(&coarse), "{coarse:?} {fine:?}");
    }
}
