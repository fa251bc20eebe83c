//! Threats that can be passed above or below, and routes that pass them so.

use super::steepest;
use crate::cost::Model;
use crate::geometry::{Point2, Point3, Rect, Segment};
use crate::planner::price::price;
use crate::scenario::Scenario;
use crate::threat::Threat;

/// A leg at the height of a base touches it; metres below, it does not.
pub(super) const TOUCH: f64 = 1e-3;

/// Waypoints are added to a route while it has less than this many times those that may be flown, and [`LEAST_ROOM`]: of
/// more of them none is kept.
const ROOM: usize = 2;

/// See [`ROOM`].
const LEAST_ROOM: usize = 64;

/// Whether the altitude band reaches above the top of `threat`, or below its base, somewhere over it.
pub(super) fn passable(scenario: &Scenario, threat: &Threat) -> bool {
    let (lowest, highest) = heights(scenario, threat);
    threat.top.is_some_and(|top| top <= highest) || threat.base.is_some_and(|base| base > lowest)
}

/// The least and the greatest height in the frame at which a route may pass over the middle and the corners of the box
/// around `threat`.
fn heights(scenario: &Scenario, threat: &Threat) -> (f64, f64) {
    let extent = threat.extent();
    let middle = nalgebra::center(&extent.min, &extent.max);
    let corners = [
        middle,
        extent.min,
        extent.max,
        Point2::new(extent.min.x, extent.max.y),
        Point2::new(extent.max.x, extent.min.y),
    ];
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    for at in corners {
        let ground = scenario.terrain.elevation(scenario.area.nearest(at));
        lowest = lowest.min(ground + scenario.altitude.min);
        highest = highest.max(ground + scenario.altitude.max);
    }
    (lowest, highest)
}

/// `route` with additional waypoints, and others moved up or down, where legs run through threats that can be passed
/// above or below; once `is_over`, only past those threats that were looked at.
pub(super) fn lifted_over(
    model: &Model,
    mut route: Vec<Point3>,
    is_over: &dyn Fn() -> bool,
) -> Vec<Point3> {
    let scenario = model.scenario;
    let threats = scenario.threats.iter();
    for threat in threats.filter(|threat| passable(scenario, threat)) {
        if is_over() {
            break;
        }
        let extent = threat.extent();
        let mut leg = 0;
        while leg + 1 < route.len() {
            let is_near = Rect::around([route[leg].xy(), route[leg + 1].xy()])
                .is_some_and(|bounds| bounds.meets(&extent));
            leg += 1;
            if is_near {
                leg += pass(model, threat, &mut route, leg - 1);
            }
        }
    }
    route
}

/// The part of `leg` within `threat`, all of it up to an end that is as good as within.
fn span(threat: &Threat, leg: &Segment) -> Option<(f64, f64)> {
    let hair = TOUCH / leg.horizontal_length().max(TOUCH);
    let (from, to) = threat.span(leg)?;
    Some((
        if from < hair { 0.0 } else { from },
        if to > 1.0 - hair { 1.0 } else { to },
    ))
}

/// Lead the leg of `route` that begins with waypoint `first` past `threat`; returns how many waypoints are added to it.
fn pass(model: &Model, threat: &Threat, route: &mut Vec<Point3>, first: usize) -> usize {
    let leg = Segment {
        a: route[first],
        b: route[first + 1],
    };
    let is_through = threat.clearance(&leg).is_some_and(|clear| clear < 0.0);
    let Some((from, to)) = is_through.then(|| span(threat, &leg)).flatten() else {
        return 0;
    };
    let Some(level) = Level::past(model.scenario, threat, leg.at(0.5 * (from + to)).z) else {
        return 0;
    };
    // Where a waypoint lies within the threat, it is moved itself.
    let moved = [from <= 0.0, to >= 1.0];
    let before = route.len();
    let past = |moved: [bool; 2], way: Vec<Point3>| {
        let mut past = route.clone();
        let ends = [first, first + 1].into_iter().zip(moved);
        for (idx, _) in ends.filter(|(idx, moved)| *moved && *idx > 0 && idx + 1 < before) {
            past[idx].z = level.beyond(past[idx].z);
        }
        let onward = past.split_off(first + 1);
        past.extend(way.into_iter().chain(onward));
        let next = first + 1 + past.len() - before;
        level.reach(model.scenario, &mut past, first, next);
        past
    };
    let by_its_ends = past([true; 2], Vec::new());
    let room = LEAST_ROOM.max(ROOM * model.scenario.planner.waypoints);
    *route = if before < room {
        let [one, both] = level.ways(&leg, (from, to)).map(|way| past(moved, way));
        cheapest(model, route, [one, both, by_its_ends])
    } else {
        by_its_ends
    };
    route.len() - before
}

/// The cheapest of `ways`, each of which is `route` but for a part.
fn cheapest(model: &Model, route: &[Point3], ways: [Vec<Point3>; 3]) -> Vec<Point3> {
    // Of all, the same waypoints before and after are left out, but for one on either side.
    let (mut before, mut after) = (route.len() - 1, route.len() - 1);
    for way in &ways {
        before = before.min(alike(route.iter(), way.iter()));
        after = after.min(alike(route.iter().rev(), way.iter().rev()));
    }
    let after = after.min(route.len() - before);
    let part = |way: &Vec<Point3>| price(model, &way[before - 1..way.len() + 1 - after]);
    let ranked = ways.into_iter().map(|way| (part(&way), way));
    let best = ranked.min_by(|(one, _), (other, _)| one.rank(other));
    best.expect("there are three").1
}

/// How many points are the same before the first that is not.
fn alike<'r>(
    one: impl Iterator<Item = &'r Point3>,
    other: impl Iterator<Item = &'r Point3>,
) -> usize {
    one.zip(other)
        .take_while(|(one, other)| one == other)
        .count()
}

/// The height at which a threat is passed.
#[derive(Clone, Copy)]
struct Level {
    z: f64,
    is_above: bool,
}

impl Level {
    /// Above or below `threat`, whichever is nearer to `z`.
    fn past(scenario: &Scenario, threat: &Threat, z: f64) -> Option<Self> {
        let (lowest, highest) = heights(scenario, threat);
        let above = threat
            .top
            .filter(|top| *top <= highest)
            .map(|z| Self { z, is_above: true });
        let below = threat.base.filter(|base| *base > lowest).map(|base| Self {
            z: base - TOUCH,
            is_above: false,
        });
        let away = |level: &Self| (level.z - z).abs();
        [above, below]
            .into_iter()
            .flatten()
            .min_by(|one, other| away(one).total_cmp(&away(other)))
    }

    /// `z` if it is past the threat, else the level.
    fn beyond(&self, z: f64) -> f64 {
        if self.is_above {
            z.max(self.z)
        } else {
            z.min(self.z)
        }
    }

    /// The waypoints that may be added to `leg`, of which the part `span` is within the threat: only one, in the middle and
    /// so far past the level that both legs keep it, which cannot be where the part begins or ends with the leg; or one at
    /// each end of that part.
    fn ways(&self, leg: &Segment, (from, to): (f64, f64)) -> [Vec<Point3>; 2] {
        let at = |share: f64, z: f64| {
            let at = leg.at(share);
            Point3::new(at.x, at.y, z)
        };
        let is_inner = |share: &f64| *share > 0.0 && *share < 1.0;
        let ends = [from, to].into_iter().filter(is_inner);
        let both = ends.map(|share| at(share, self.z)).collect();
        let middle = 0.5 * (from + to);
        // A leg from `side` at height z, a whole `way` from the middle, must be at the level where the part begins or
        // ends: (1 - share) peak + share z = level, with the share of the way on which it is within.
        let peak = |side: f64, way: f64| {
            let share = 0.5 * (to - from) / way;
            (self.z - share * side) / (1.0 - share)
        };
        let peaks = [peak(leg.a.z, middle), peak(leg.b.z, 1.0 - middle)];
        let peak = peaks.into_iter().fold(self.z, |peak, z| {
            if self.is_above {
                peak.max(z)
            } else {
                peak.min(z)
            }
        });
        let one = (from > 0.0 && to < 1.0).then(|| at(middle, peak));
        [one.into_iter().collect(), both]
    }

    /// Move the free waypoints of `route` before `first` and after `last` up, or down, until the vehicle can climb from
    /// one to the next.
    fn reach(&self, scenario: &Scenario, route: &mut [Point3], first: usize, last: usize) {
        let (target, steepest) = (route.len() - 1, steepest(scenario));
        let mut bring = |idx: usize, from: usize| {
            let climb = (route[idx].xy() - route[from].xy()).norm() * steepest;
            let z = if self.is_above {
                route[idx].z.max(route[from].z - climb)
            } else {
                route[idx].z.min(route[from].z + climb)
            };
            route[idx].z = z;
        };
        (1..=first).rev().for_each(|idx| bring(idx, idx + 1));
        (last..target).for_each(|idx| bring(idx, idx - 1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::{disc, scenario, search_briefly, soft_wall, wall};
    use crate::planner::{Nobody, plan};

    /// Start and target at 80 m on level ground, the band up to 150 m, and a threat between them that ends at 120 m.
    fn with_a_low(mut threat: Threat) -> Scenario {
        let mut scenario = scenario();
        let ends = [100.0, 900.0].map(|x| Point3::new(x, 500.0, 80.0));
        [scenario.start, scenario.target] = ends;
        (scenario.altitude.min, scenario.altitude.max) = (30.0, 150.0);
        threat.top = Some(120.0);
        scenario.threats = vec![threat];
        scenario
    }

    fn straight_over(scenario: &Scenario) -> Vec<Point3> {
        lifted_over(
            &Model::new(scenario),
            vec![scenario.start, scenario.target],
            &|| false,
        )
    }

    fn keeps_limits(scenario: &Scenario, route: &[Point3]) -> bool {
        price(&Model::new(scenario), route).is_feasible()
    }

    #[test]
    fn one_waypoint_leads_over_a_thin_wall() {
        let scenario = with_a_low(wall([498.0, 502.0], [-40.0, 1040.0]));
        let route = straight_over(&scenario);
        assert!(keeps_limits(&scenario, &route), "{route:?}");
        assert_eq!(route.len(), 3);
        assert!((120.0..121.0).contains(&route[1].z), "{}", route[1].z);
    }

    #[test]
    fn two_waypoints_lead_over_a_wide_threat() {
        for threat in [
            disc([500.0, 500.0, 200.0, 230.0]),
            wall([300.0, 700.0], [300.0, 700.0]),
        ] {
            let scenario = with_a_low(threat);
            let route = straight_over(&scenario);
            assert!(keeps_limits(&scenario, &route), "{route:?}");
            assert_eq!(route.len(), 4);
            for (at, x) in route[1..3].iter().zip([300.0, 700.0]) {
                assert!((at - Point3::new(x, 500.0, 120.0)).norm() < 1e-6, "{at}");
            }
        }
    }

    #[test]
    fn a_wall_that_begins_above_the_ground_is_passed_below() {
        let mut scenario = with_a_low(wall([498.0, 502.0], [-40.0, 1040.0]));
        (scenario.threats[0].base, scenario.threats[0].top) = (Some(60.0), None);
        let route = straight_over(&scenario);
        assert!(keeps_limits(&scenario, &route), "{route:?}");
        assert!(route.len() == 3 && route[1].z < 60.0, "{route:?}");
    }

    /// Between two corners of a string that lie on the threats' edges, no waypoint is added.
    #[test]
    fn the_ends_of_a_leg_over_adjoining_threats_are_raised() {
        let mut scenario = with_a_low(wall([300.0, 500.0], [300.0, 500.0]));
        let mut next = wall([500.0, 700.0], [300.0, 500.0]);
        next.top = Some(110.0);
        scenario.threats.push(next);
        let corners = [[300.0, 490.0], [700.0, 480.0]].map(|[x, y]| Point3::new(x, y, 80.0));
        let route = [scenario.start, corners[0], corners[1], scenario.target].to_vec();
        let route = lifted_over(&Model::new(&scenario), route, &|| false);
        assert!(keeps_limits(&scenario, &route), "{route:?}");
        assert_eq!(route.len(), 4);
        assert!(
            route[1..3].iter().all(|at| (at.z - 120.0).abs() < 1e-9),
            "{route:?}"
        );
    }

    /// A waypoint above a low threat, and its neighbours, which the vehicle must be able to climb to.
    #[test]
    fn waypoints_within_a_threat_are_raised_and_their_neighbours_follow() {
        let mut scenario = with_a_low(disc([500.0, 500.0, 60.0, 60.0]));
        scenario.vehicle.max_climb_deg = 20.0;
        let at = |x: f64| Point3::new(x, 500.0, 80.0);
        let route = [100.0, 420.0, 500.0, 580.0, 900.0].map(at).to_vec();
        let route = lifted_over(&Model::new(&scenario), route, &|| false);
        assert!(keeps_limits(&scenario, &route), "{route:?}");
        let high = |x: f64| route.iter().find(|at| at.x >= x).expect("on the way").z;
        assert!((high(500.0) - 120.0).abs() < 1e-9);
        assert!(high(420.0) > 105.0 && high(580.0) > 105.0);
    }

    #[test]
    fn threats_that_no_leg_meets_and_that_close_the_band_change_nothing() {
        let mut scenario = with_a_low(disc([500.0, 900.0, 60.0, 60.0]));
        let straight = [scenario.start, scenario.target];
        assert_eq!(straight_over(&scenario), straight);
        let mut closed = disc([500.0, 500.0, 60.0, 60.0]);
        closed.top = Some(151.0);
        scenario.threats = vec![closed];
        assert_eq!(straight_over(&scenario), straight);
    }

    /// Only so many waypoints are added as a route may have, or it takes for ever; the rest is passed by those.
    #[test]
    fn a_row_of_many_low_threats_is_passed_by_few_waypoints() {
        let mut scenario = with_a_low(disc([0.0; 4]));
        scenario.threats = (0..2_000)
            .map(|idx| {
                let mut low = disc([110.0 + 0.39 * f64::from(idx), 500.0, 0.1, 0.1]);
                low.top = Some(120.0);
                low
            })
            .collect();
        let route = straight_over(&scenario);
        let most = LEAST_ROOM.max(ROOM * scenario.planner.waypoints) + 2;
        assert!((3..=most).contains(&route.len()), "{}", route.len());
        let model = Model::new(&scenario);
        let straight = vec![scenario.start, scenario.target];
        assert_eq!(lifted_over(&model, straight.clone(), &|| true), straight);
    }

    /// The best way leads over the first wall, which is long, and round the end of the second, which is soft.
    #[test]
    fn one_wall_is_flown_over_and_the_next_one_rounded() {
        let mut scenario = with_a_low(wall([200.0, 203.0], [-40.0, 1000.0]));
        scenario
            .threats
            .push(soft_wall([600.0, 606.0], [-40.0, 700.0], 20.0));
        scenario.vehicle.max_turn_deg = 30.0;
        scenario.planner.waypoints = 8;
        search_briefly(&mut scenario);
        let outcome = plan(&scenario, &mut Nobody, &Nobody);
        let bound = outcome.bound;
        assert!(outcome.feasible);
        assert!(bound.gap.expect("a bound") < 0.02, "{bound:?}");
    }
}
