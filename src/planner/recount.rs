//! The same search with a few waypoints fewer, with a few more, and with few. Over hills where the limits of a vehicle that turns in
//! wide bows are felt or where the route circles, and over level ground where waypoints are scarce, they decide which ways
//! are seen at all, and the best of those seen with another number may be better with this one too.

use std::f64::consts::TAU;

use super::aside::aside_with;
use super::backwards::WIDE_TURNS_DEG;
use super::doubt::is_doubtful;
use super::finish::finish_from;
use super::log::Log;
use super::{MOST_WAYPOINTS, StopReason, is_from_scratch, newton, starts};
use crate::cost::{Model, turns};
use crate::geometry::Point3;
use crate::scenario::Scenario;
use crate::threat::Threat;

/// The numbers of waypoints, as shares of the requested one.
const SHARES: [f64; 2] = [0.8, 1.2];

/// A number beside those over level ground, where threats may be passed above or below: with so few waypoints all ways that
/// lead elsewhere are polished. One over a threat and under the next mostly breaks limits before it is.
const FEW: usize = 5;

/// Whether a search that ended with the best route of `log` is worth others, given that no route costs less than `lower`.
pub(super) fn is_worthwhile(model: &Model, lower: f64, log: &Log) -> bool {
    let are_ways_missed = || {
        if model.scenario.terrain.is_flat() {
            is_doubtful(model, lower, log)
        } else {
            model.scenario.vehicle.max_turn_deg <= WIDE_TURNS_DEG
                && newton::is_felt(model, &log.route)
                || circles(&log.route)
        }
    };
    is_from_scratch(model.scenario)
        && model.scenario.planner.waypoints <= MOST_WAYPOINTS
        && log.best.is_feasible()
        && are_ways_missed()
}

/// Whether a route turns as much as a full circle does. Circles above a summit, say, are made of few waypoints each, and
/// how many are left for the rest decides how well they follow the ground.
pub(super) fn circles(route: &[Point3]) -> bool {
    turns(route).map(f64::abs).sum::<f64>() >= TAU
}

/// Search with other numbers of waypoints, and keep what comes of the routes found if it is better.
pub(super) fn search(model: &Model, log: &mut Log) -> StopReason {
    // It takes as long again.
    log.tell();
    let waypoints = model.scenario.planner.waypoints;
    for other in numbers(model.scenario) {
        let found = aside_with(model, other, log);
        let Some((reason, best, route)) = found else {
            continue;
        };
        if best.is_feasible() {
            let route = starts::with_waypoints(model, route, waypoints);
            if reason == StopReason::Iterations {
                finish_from(model, route, log);
            } else {
                log.offer_unpriced(&route);
            }
        }
        if reason != StopReason::Iterations {
            return reason;
        }
        if log.has_converged() {
            return StopReason::Converged;
        }
    }
    StopReason::Iterations
}

/// Other numbers of waypoints than those requested, none of them 0.
fn numbers(scenario: &Scenario) -> impl Iterator<Item = usize> {
    let about = SHARES.map(|share| part(scenario.planner.waypoints, share));
    let may_pass = |threat: &Threat| threat.base.is_some() || threat.top.is_some();
    let needs_few = scenario.terrain.is_flat() && scenario.threats.iter().any(may_pass);
    let few = (needs_few && FEW < about[0]).then_some(FEW);
    about.into_iter().filter(|number| *number > 0).chain(few)
}

/// About this share of a number, and another number.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "about as many"
)]
fn part(waypoints: usize, share: f64) -> usize {
    let part = waypoints as f64 * share;
    let away = if share < 1.0 {
        part.floor()
    } else {
        part.ceil()
    };
    away as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::{Looks, descent, disc, mountain, peaks, scenario};
    use crate::planner::{Nobody, plan};
    use crate::scenario::{AltitudeBand, Scenario, Seeding, WarmStart};
    use crate::terrain::{Flat, Terrain};

    /// Five discs among hills, flown by a vehicle that turns and climbs slowly.
    fn slow_among_hills() -> Scenario {
        let mut scenario = scenario();
        scenario.start = Point3::new(429.9, 294.49, 63.1);
        scenario.target = Point3::new(520.35, 734.98, 150.7);
        scenario.threats = [
            [218.5, 639.5, 68.1, 98.1],
            [610.6, 762.5, 32.1, 62.1],
            [141.1, 532.2, 60.0, 90.0],
            [707.8, 141.8, 44.2, 74.2],
            [460.7, 426.8, 58.3, 88.3],
        ]
        .map(disc)
        .to_vec();
        scenario.terrain = peaks(
            0.0,
            &[
                [793.3, 435.7, 135.1, 80.1, 96.7],
                [244.7, 656.6, 227.8, 107.7, 102.2],
                [770.1, 397.0, 171.7, 63.8, 115.7],
                [501.4, 293.6, 177.8, 69.7, 65.8],
                [278.4, 650.2, 199.4, 114.0, 72.6],
            ],
        );
        scenario.altitude = AltitudeBand {
            min: 100.0,
            max: 300.0,
        };
        (
            scenario.vehicle.max_turn_deg,
            scenario.vehicle.max_climb_deg,
        ) = (30.0, 20.0);
        scenario.vehicle.min_leg = 4.1;
        scenario.planner.seeding = Seeding::Tangent;
        scenario.planner.polish = true;
        scenario.planner.waypoints = 10;
        scenario
    }

    #[test]
    fn numbers_of_waypoints_are_others() {
        let expected: [(usize, &[usize]); 4] =
            [(1, &[2]), (2, &[1, 3]), (10, &[8, 12]), (64, &[51, 77])];
        let mut scenario = scenario();
        for (waypoints, expected) in expected {
            scenario.planner.waypoints = waypoints;
            assert_eq!(numbers(&scenario).collect::<Vec<_>>(), expected);
        }
        scenario.threats[0].top = Some(100.0);
        for (waypoints, expected) in [(7, &[5, 9][..]), (8, &[6, 10, 5]), (10, &[8, 12, 5])] {
            scenario.planner.waypoints = waypoints;
            assert_eq!(numbers(&scenario).collect::<Vec<_>>(), expected);
        }
        scenario.terrain = peaks(0.0, &[]);
        assert_eq!(numbers(&scenario).count(), 2);
    }

    /// With sixteen waypoints alone, the best found costs 792.6: it circles high above the mountain.
    #[test]
    fn a_descent_in_circles_is_searched_with_other_numbers_of_waypoints() {
        let mut scenario = descent(&[[200.0, 500.0, 401.0, 138.0, 138.0]], 1.0);
        scenario.vehicle.max_climb_deg = 20.0;
        scenario.vehicle.min_leg = scenario.direct() / 170.0;
        scenario.planner.seed = 2;
        let outcome = plan(&scenario, &mut Nobody, &Nobody);
        assert!(outcome.feasible && circles(&outcome.waypoints));
        assert!(outcome.cost.total < 765.0, "{}", outcome.cost.total);
    }

    /// With ten waypoints alone, the best found costs 530.
    #[test]
    fn a_way_seen_with_other_numbers_of_waypoints_is_flown_with_the_requested_one() {
        let outcome = plan(&slow_among_hills(), &mut Nobody, &Nobody);
        assert!(outcome.feasible && outcome.waypoints.len() == 12);
        assert!(outcome.cost.total < 510.0, "{}", outcome.cost.total);
    }

    /// The first of the two searches is cut short after it has found a route.
    #[test]
    fn what_was_found_until_a_stop_is_kept() {
        let scenario = slow_among_hills();
        let model = Model::new(&scenario);
        let step = (scenario.target - scenario.start) / 11.0;
        let straight: Vec<Point3> = (0..=11)
            .map(|idx| scenario.start + step * f64::from(idx))
            .collect();
        let found = |looks: &Looks| {
            let mut nobody = Nobody;
            let mut log = Log::new(&model, &mut nobody, looks);
            log.offer_unpriced(&straight);
            (search(&model, &mut log), log.best)
        };
        let looks = Looks::until(u32::MAX);
        let (reason, best) = found(&looks);
        assert!(reason == StopReason::Iterations && best.is_feasible());
        let (reason, best) = found(&Looks::until(looks.count.get() / 4));
        assert!(reason == StopReason::Cancelled && best.is_feasible());
    }

    #[test]
    fn near_routes_sharp_turns_known_routes_and_many_waypoints_are_searched_once() {
        let mut scenario = mountain(100.0, true);
        scenario.vehicle.max_turn_deg = WIDE_TURNS_DEG;
        let worthwhile_if_proven = |scenario: &Scenario, share: f64| {
            let model = Model::new(scenario);
            let mut nobody = Nobody;
            let mut log = Log::new(&model, &mut nobody, &Nobody);
            log.offer_unpriced(&plan(scenario, &mut Nobody, &Nobody).waypoints);
            is_worthwhile(&model, share * log.best.cost, &log)
        };
        let worthwhile = |scenario: &Scenario| worthwhile_if_proven(scenario, 0.99);
        assert!(worthwhile(&scenario));
        let but = |change: fn(&mut Scenario)| {
            let mut scenario = scenario.clone();
            change(&mut scenario);
            worthwhile(&scenario)
        };
        assert!(!but(|scenario| scenario.planner.seeding = Seeding::Random));
        assert!(!but(|scenario| scenario.planner.polish = false));
        assert!(!but(|scenario| {
            scenario.planner.warm_start = Some(WarmStart::Waypoints(Vec::new()));
        }));
        assert!(!but(|scenario| {
            scenario.terrain = Terrain::Flat(Flat { elevation: 0.0 });
        }));
        assert!(!but(
            |scenario| scenario.planner.waypoints = MOST_WAYPOINTS + 1
        ));
        assert!(!but(
            |scenario| scenario.vehicle.max_turn_deg = WIDE_TURNS_DEG + 1.0
        ));
        scenario.terrain = Terrain::Flat(Flat { elevation: 0.0 });
        scenario.threats = vec![disc([600.0, 550.0, 50.0, 80.0])];
        assert!(worthwhile_if_proven(&scenario, 0.9));
    }
}
