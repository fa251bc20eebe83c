//! Iterated local search over hills (Lourenço, Martin and Stützle, "Iterated local search", Handbook of Metaheuristics,
//! 2003): a part of the best route is moved aside, and what comes of that is polished.
//!
//! Where a vehicle climbs slowly, one way over a ridge or round a spur is hardly told from the next: nets of places are
//! coarser than the difference, and between the two all routes break limits or cost more, so that no small change of one
//! leads to the other.

use super::doubt::is_hard_pressed;
use super::finish::refine;
use super::log::Log;
use super::polish::{Polish, Steps};
use super::{MOST_WAYPOINTS, StopReason, is_from_scratch, why_stop};
use crate::cost::Model;
use crate::geometry::{LEVEL, Point3, Vector2};
use crate::optimizer::{Random, share_of};

/// The search ends after so many kicks that gained nothing, and after so many in all.
const IN_VAIN: usize = 24;
const MOST_KICKS: usize = 96;

/// A gain that is worth so many more, as a share of the cost.
const WORTH: f64 = 1e-4;

/// Neighbouring waypoints that are moved at most.
const PART: usize = 8;

/// How far, as shares of the straight way from the start to the target: at least, and so many times as far at most.
const LEAST: f64 = 0.02;
const TIMES: f64 = 6.0;

/// Steps from each kick to the next in its four numbers, so that any few in a row are spread evenly: powers of the root of
/// x^5 = x + 1, as in the additive recurrences of Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
const SPREAD: [f64; 4] = [
    0.856_674_883_854_502_9,
    0.733_891_856_627_126,
    0.628_706_721_037_808_7,
    0.538_597_257_223_610_1,
];

/// A route that costs this share more than the best after the rough polish is dropped: Newton's method gains little.
const CLOSE: f64 = 0.02;

const ROUGH_STEPS: Steps = Steps {
    from: 0.02,
    ..super::search::COARSE_STEPS
};

/// Whether the best route of `log` is worth it, given that none costs less than `lower`: it flies at the limits of the
/// vehicle, and another may be much cheaper.
pub(super) fn is_worthwhile(model: &Model, lower: f64, log: &Log) -> bool {
    let scenario = model.scenario;
    is_from_scratch(scenario)
        && scenario.planner.waypoints <= MOST_WAYPOINTS
        && log.best.is_feasible()
        && is_hard_pressed(model, lower, log)
}

/// Kick the best route of `log` while that makes it better.
pub(super) fn search(model: &Model, log: &mut Log) -> StopReason {
    // It takes a moment, and the best so far may be all there is.
    log.tell();
    let mut random = Random::new(model.scenario.planner.seed);
    let from = SPREAD.map(|_| random.unit());
    let mut in_vain = 0;
    for number in 0..MOST_KICKS {
        if let Some(reason) = why_stop(model.scenario, log.stop) {
            return reason;
        }
        let before = log.best.cost;
        let drawn = [0, 1, 2, 3].map(|dim| (from[dim] + SPREAD[dim] * number as f64).fract());
        let route = kicked(model, &log.route, drawn);
        settle(model, route, log);
        if log.has_converged() {
            return StopReason::Converged;
        }
        let is_better = log.best.cost < before * (1.0 - WORTH);
        in_vain = if is_better { 0 } else { in_vain + 1 };
        if in_vain == IN_VAIN {
            break;
        }
    }
    StopReason::Iterations
}

/// `route` with some neighbouring waypoints moved to one side, the middle ones farthest, at their heights above ground: how
/// many, which, how far and to which side, as four numbers from 0 to 1 say.
fn kicked(model: &Model, route: &[Point3], [many, which, far, side]: [f64; 4]) -> Vec<Point3> {
    let scenario = model.scenario;
    let free = route.len() - 2;
    let most = PART.min(free);
    let count = 1 + share_of(most, many).min(most - 1);
    let places = free - count + 1;
    let first = 1 + share_of(places, which).min(places - 1);
    let far = scenario.direct() * LEAST * libm::pow(TIMES, far);
    let way = route[first + count].xy() - route[first - 1].xy();
    let across = Vector2::new(-way.y, way.x);
    let across = across.try_normalize(LEVEL).unwrap_or_else(Vector2::x);
    let aside = across * if side < 0.5 { far } else { -far };
    let mut route = route.to_vec();
    for (idx, waypoint) in route[first..first + count].iter_mut().enumerate() {
        let off_middle = (2.0 * (idx as f64 + 0.5) / count as f64 - 1.0).abs();
        let above = scenario.terrain.height_of(*waypoint);
        let at = waypoint.xy() + aside * (1.0 - 0.5 * off_middle);
        let at = scenario.area.nearest(at);
        *waypoint = at
            .coords
            .push(scenario.terrain.elevation(at) + above)
            .into();
    }
    route
}

/// Polish `route` while it does not come back to the best one, and keep it if it is better.
fn settle(model: &Model, mut route: Vec<Point3>, log: &mut Log) {
    let known = [(log.best, log.route.clone())];
    let mut polish = Polish::new(model, log.stop);
    let rough = polish.descend_unless_known(&mut route, ROUGH_STEPS, &known);
    log.evaluations += polish.evaluations(route.len() - 2);
    if rough.is_some_and(|rough| rough.cost < log.best.cost * (1.0 + CLOSE)) {
        let fitness = refine(model, &mut route, &[], log);
        log.offer(&route, fitness);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::Nobody;
    use crate::planner::finish::finish_from;
    use crate::planner::tests::{Looks, peaks, scenario, search_briefly};
    use crate::scenario::{AltitudeBand, Scenario, WarmStart};
    use crate::terrain::{Flat, Terrain};

    /// A hill that a slow climber flies round: the way south of it is the shorter one.
    fn hill() -> Scenario {
        let mut scenario = scenario();
        scenario.threats.clear();
        scenario.terrain = peaks(0.0, &[[500.0, 530.0, 160.0, 35.0, 35.0]]);
        let at = |x| Point3::new(x, 500.0, 60.0);
        (scenario.start, scenario.target) = (at(150.0), at(850.0));
        scenario.altitude = AltitudeBand {
            min: 30.0,
            max: 90.0,
        };
        (
            scenario.vehicle.max_turn_deg,
            scenario.vehicle.max_climb_deg,
        ) = (5.0, 6.0);
        search_briefly(&mut scenario);
        scenario.planner.waypoints = 6;
        scenario
    }

    /// The way north of it, as good as it gets.
    fn north_about(scenario: &Scenario) -> Vec<Point3> {
        let at = |[x, y]: [f64; 2]| Point3::new(x, y, 60.0);
        let free = [
            [300.0, 580.0],
            [400.0, 610.0],
            [470.0, 620.0],
            [530.0, 620.0],
            [600.0, 610.0],
            [700.0, 580.0],
        ];
        let route = [&[scenario.start], &free.map(at)[..], &[scenario.target]].concat();
        let model = Model::new(scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        finish_from(&model, route, &mut log);
        assert!(log.best.is_feasible(), "{:?}", log.best);
        assert!(log.route.iter().all(|at| at.y > 499.0), "{:?}", log.route);
        log.route
    }

    #[test]
    fn another_way_round_a_hill_is_found() {
        let scenario = hill();
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        log.offer_unpriced(&north_about(&scenario));
        let before = log.best;
        assert!(is_worthwhile(&model, 0.0, &log));
        assert_eq!(search(&model, &mut log), StopReason::Iterations);
        assert!(log.best.is_feasible() && log.best.cost < 0.99 * before.cost);
        assert!(log.route.iter().any(|at| at.y < 490.0), "{:?}", log.route);
    }

    #[test]
    fn a_stop_is_heard_between_two_kicks() {
        let scenario = hill();
        let model = Model::new(&scenario);
        let known = north_about(&scenario);
        let found = |looks: &Looks| {
            let mut nobody = Nobody;
            let mut log = Log::new(&model, &mut nobody, looks);
            log.offer_unpriced(&known);
            let before = log.best.cost;
            let reason = search(&model, &mut log);
            assert!(log.best.is_feasible() && log.best.cost <= before);
            reason
        };
        let looks = Looks::until(u32::MAX);
        assert_eq!(found(&looks), StopReason::Iterations);
        let early = Looks::until(looks.count.get() / 4);
        assert_eq!(found(&early), StopReason::Cancelled);
    }

    #[test]
    fn what_is_proven_level_ground_and_known_routes_are_left_as_they_are() {
        let scenario = hill();
        let known = north_about(&scenario);
        let worthwhile_but = |share: f64, change: fn(&mut Scenario)| {
            let mut scenario = scenario.clone();
            change(&mut scenario);
            let model = Model::new(&scenario);
            let mut nobody = Nobody;
            let mut log = Log::new(&model, &mut nobody, &Nobody);
            log.offer_unpriced(&known);
            is_worthwhile(&model, share * log.best.cost, &log)
        };
        assert!(worthwhile_but(0.9, |_| {}));
        assert!(!worthwhile_but(0.96, |_| {}));
        assert!(!worthwhile_but(0.9, |scenario| {
            scenario.terrain = Terrain::Flat(Flat { elevation: 0.0 });
        }));
        assert!(!worthwhile_but(0.9, |scenario| {
            scenario.planner.warm_start = Some(WarmStart::Waypoints(Vec::new()));
        }));
        assert!(!worthwhile_but(0.9, |scenario| {
            scenario.planner.waypoints = MOST_WAYPOINTS + 1;
        }));
        // Far from every limit, no way is missed.
        assert!(!worthwhile_but(0.9, |scenario| {
            (
                scenario.vehicle.max_turn_deg,
                scenario.vehicle.max_climb_deg,
            ) = (170.0, 80.0);
        }));
    }

    /// However many waypoints there are, those that move are free ones, and they stay in the area.
    #[test]
    fn a_kick_moves_some_waypoints_aside() {
        let scenario = hill();
        let model = Model::new(&scenario);
        let straight = |free: usize| -> Vec<Point3> {
            let step = (scenario.target - scenario.start) / (free + 1) as f64;
            let at = |idx: usize| scenario.start + step * idx as f64;
            (0..free + 2).map(at).collect()
        };
        let ends = [0.0, 0.5, 1.0 - f64::EPSILON];
        for free in [1, 2, 30] {
            let route = straight(free);
            for drawn in ends
                .map(|many| ends.map(|which| [many, which, which, many]))
                .as_flattened()
            {
                let kicked = kicked(&model, &route, *drawn);
                let moved = (0..route.len()).filter(|&idx| kicked[idx] != route[idx]);
                let moved: Vec<usize> = moved.collect();
                assert!((1..=PART).contains(&moved.len()), "{moved:?}");
                assert!(moved[0] > 0 && moved[moved.len() - 1] < route.len() - 1);
                assert_eq!(moved[moved.len() - 1] - moved[0] + 1, moved.len());
                assert!(kicked.iter().all(|at| scenario.area.contains(at.xy())));
            }
        }
    }
}
