//! The same search from the target to the start. Costs and limits do not depend on the direction, but starts, codings and
//! bats do: where the vehicle's limits are felt over hills, it turns in wide bows, or soft zones fill the only gaps,
//! either direction finds ways that the other misses.

use super::aside::aside;
use super::doubt::is_doubtful;
use super::log::Log;
use super::{StopReason, is_from_scratch, newton, starts};
use crate::cost::Model;

/// Over level ground either direction finds the same ways with sharper turns than this, degrees.
pub(super) const WIDE_TURNS_DEG: f64 = 50.0;

/// Whether a search that ended with the best route of `log` is worth another in the other direction, given that no route
/// costs less than `lower`.
pub(super) fn is_worthwhile(model: &Model, lower: f64, log: &Log) -> bool {
    let is_one_sided = || {
        if model.scenario.terrain.is_flat() {
            model.scenario.vehicle.max_turn_deg <= WIDE_TURNS_DEG || is_doubtful(model, lower, log)
        } else {
            newton::is_felt(model, &log.route)
        }
    };
    is_from_scratch(model.scenario) && (!log.best.is_feasible() || is_one_sided())
}

/// Search in the other direction, and keep what is found if it is better.
pub(super) fn search(model: &Model, log: &mut Log) -> StopReason {
    // It takes as long again, and the best so far may be all there is.
    log.tell();
    let mut scenario = model.scenario.clone();
    std::mem::swap(&mut scenario.start, &mut scenario.target);
    let back = Model::new(&scenario);
    let starts = starts::routes(&back, log.stop);
    let found = aside(&back, starts, log.lower, log);
    found.map_or(StopReason::Iterations, |(reason, _, mut route)| {
        route.reverse();
        log.offer_unpriced(&route);
        reason
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;
    use crate::planner::tests::{
        disc, hilly_scenario, mountain, scenario as level_scenario, search_briefly, soft_wall,
        straight, wall,
    };
    use crate::planner::{self, Nobody, plan};
    use crate::scenario::{Scenario, Seeding, WarmStart};
    use crate::seeding::lower_bound;

    #[test]
    fn what_is_found_in_the_other_direction_leads_from_start_to_target() {
        let scenario = mountain(200.0, true);
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        log.offer_unpriced(&straight(&scenario));
        assert!(!log.best.is_feasible() && is_worthwhile(&model, 0.0, &log));
        assert_eq!(search(&model, &mut log), StopReason::Iterations);
        assert!(log.best.is_feasible() && log.evaluations > 1_000);
        let ends = [log.route.first(), log.route.last()];
        assert_eq!(ends, [Some(&scenario.start), Some(&scenario.target)]);
    }

    /// Each of them is found by searching in either direction.
    #[test]
    fn a_steep_mountain_costs_the_same_either_way() {
        let [down, up] = [true, false].map(|is_down| {
            let outcome = plan(&mountain(200.0, is_down), &mut Nobody, &Nobody);
            assert!(outcome.feasible);
            outcome.cost.total
        });
        assert!((down / up - 1.0).abs() < 2e-3, "{down} {up}");
    }

    /// A disc is right before one end, and the vehicle turns in wide bows: from the other end, the way that costs 2 % less
    /// is not found.
    #[test]
    fn wide_bows_cost_the_same_either_way() {
        let mut scenario = level_scenario();
        let [one, other] = [[657.68, 471.31, 100.0], [104.24, 176.39, 100.0]].map(Point3::from);
        scenario.threats = [
            [173.8, 267.2, 15.5, 75.5],
            [431.6, 251.3, 27.3, 87.3],
            [369.5, 312.7, 34.5, 94.5],
            [85.5, 210.3, 21.0, 81.0],
        ]
        .map(disc)
        .to_vec();
        scenario.vehicle.max_turn_deg = 30.0;
        scenario.planner.waypoints = 20;
        scenario.planner.seeding = Seeding::Tangent;
        scenario.planner.polish = true;
        let [there, back] = [[one, other], [other, one]].map(|[start, target]| {
            (scenario.start, scenario.target) = (start, target);
            plan(&scenario, &mut Nobody, &Nobody).cost.total
        });
        assert!((there / back - 1.0).abs() < 1e-3, "{there} {back}");
        assert!(there < 538.0, "{there}");
    }

    /// Two walls, each with one gap, of which one is full of a soft zone: from one end, the way of squeezing through that
    /// costs 2 % less is not found.
    #[test]
    fn a_route_far_from_what_is_proven_is_improved_from_the_other_end() {
        let mut scenario = level_scenario();
        let (west, east) = ([200.0, 218.0], [576.0, 593.0]);
        scenario.threats = vec![
            soft_wall(west, [-40.0, 749.0], 40.0),
            wall(west, [783.0, 1040.0]),
            wall(east, [-40.0, 434.0]),
            wall(east, [481.0, 1040.0]),
        ];
        let ends = [60.0, 940.0].map(|x| Point3::new(x, 500.0, 100.0));
        [scenario.start, scenario.target] = ends;
        scenario.vehicle.min_leg = 8.0;
        search_briefly(&mut scenario);
        scenario.planner.seed = 2;
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        assert_eq!(planner::search(&model, &mut log), StopReason::Iterations);
        let there = log.best.cost;
        assert!(is_worthwhile(&model, lower_bound(&scenario), &log));
        assert_eq!(search(&model, &mut log), StopReason::Iterations);
        assert!(log.best.is_feasible() && log.best.cost < 0.985 * there);
    }

    #[test]
    fn near_routes_gentle_hills_and_known_routes_are_searched_once() {
        let mut scenario = mountain(200.0, true);
        let worthwhile_if_proven = |scenario: &Scenario, share: f64| {
            let model = Model::new(scenario);
            let mut nobody = Nobody;
            let mut log = Log::new(&model, &mut nobody, &Nobody);
            log.offer_unpriced(&straight(scenario));
            is_worthwhile(&model, share * log.best.cost, &log)
        };
        let worthwhile = |scenario: &Scenario| worthwhile_if_proven(scenario, 0.99);
        assert!(worthwhile(&scenario));
        scenario.planner.warm_start = Some(WarmStart::Waypoints(Vec::new()));
        assert!(!worthwhile(&scenario));
        scenario.planner.warm_start = None;
        scenario.planner.seeding = Seeding::Random;
        assert!(!worthwhile(&scenario));

        let mut gentle = hilly_scenario();
        gentle.planner.seeding = Seeding::Tangent;
        gentle.planner.polish = true;
        gentle.vehicle.max_turn_deg = 180.0;
        gentle.vehicle.max_climb_deg = 80.0;
        let outcome = plan(&gentle, &mut Nobody, &Nobody);
        let model = Model::new(&gentle);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        log.offer_unpriced(&outcome.waypoints);
        assert!(outcome.feasible && !is_worthwhile(&model, 0.0, &log));

        let mut open = level_scenario();
        open.threats.clear();
        open.planner.seeding = Seeding::Tangent;
        open.planner.polish = true;
        for (max_turn_deg, expected) in [(60.0, false), (30.0, true)] {
            open.vehicle.max_turn_deg = max_turn_deg;
            assert_eq!(worthwhile(&open), expected, "{max_turn_deg}");
        }
        open.vehicle.max_turn_deg = 60.0;
        assert!(!worthwhile_if_proven(&open, 0.9));
        open.threats = vec![disc([500.0, 500.0, 50.0, 80.0])];
        assert!(worthwhile_if_proven(&open, 0.9));
        open.threats = vec![disc([100.0, 900.0, 10.0, 10.0])];
        assert!(!worthwhile_if_proven(&open, 0.9));
    }
}
