//! Waypoints shared out anew along a route over hills. Where the limits of the vehicle are felt, as in the circles of a
//! slow descent, no small change brings a waypoint to a leg that follows the ground badly: the bend that it leaves would
//! be too sharp, until all others of that bend have moved.

use super::finish::refine;
use super::log::Log;
use super::newton::{self, dealt};
use super::recount::circles;
use super::{MOST_WAYPOINTS, StopReason, is_from_scratch, why_stop};
use crate::cost::Model;

/// Waypoints that are put on the longest leg in turn, those first that make the route longer by least.
const SPARES: usize = 8;

/// Gain of putting one there that is worth doing it again, as a share of the cost.
const WORTH: f64 = 1e-3;

/// Whether a search that ended with the best route of `log` is worth it.
pub(super) fn is_worthwhile(model: &Model, log: &Log) -> bool {
    let scenario = model.scenario;
    is_from_scratch(scenario)
        && !scenario.terrain.is_flat()
        && scenario.planner.waypoints <= MOST_WAYPOINTS
        && log.best.is_feasible()
        && (circles(&log.route) || newton::is_felt(model, &log.route))
}

/// Put one waypoint after the other on the longest leg, bring what comes of it within the limits, and go on from the
/// best of these routes while they become better.
pub(super) fn search(model: &Model, log: &mut Log) -> StopReason {
    // It takes a moment, and the best so far may be all there is.
    log.tell();
    loop {
        let before = log.best.cost;
        let legs = log.route.len() - 1;
        let length = |leg: &usize| (log.route[leg + 1] - log.route[*leg]).norm();
        let longest = (0..legs).max_by(|one, other| length(one).total_cmp(&length(other)));
        for mut route in dealt(&log.route, SPARES, longest.as_slice(), 1) {
            if let Some(reason) = why_stop(model.scenario, log.stop) {
                return reason;
            }
            let fitness = refine(model, &mut route, &[], log);
            log.offer(&route, fitness);
        }
        if log.has_converged() {
            return StopReason::Converged;
        }
        if log.best.cost >= before * (1.0 - WORTH) {
            return StopReason::Iterations;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;
    use crate::planner::Nobody;
    use crate::planner::newton::Newton;
    use crate::planner::tests::{Looks, descent};
    use crate::scenario::{Scenario, WarmStart};
    use crate::terrain::{Flat, Terrain};

    /// A steep mountain that is left by a vehicle that descends slowly, and others before the target.
    fn summit() -> Scenario {
        let mountains = [
            [200.00, 500.00, 356.39, 85.57, 85.57],
            [875.23, 415.28, 57.31, 87.90, 86.45],
            [870.94, 847.24, 80.00, 118.81, 79.44],
            [451.61, 295.21, 83.40, 105.06, 66.22],
            [403.84, 765.90, 162.45, 62.73, 56.63],
        ];
        let mut scenario = descent(&mountains, 20.26);
        scenario.vehicle.max_turn_deg = 60.0;
        scenario.vehicle.max_climb_deg = 15.0;
        scenario.vehicle.min_leg = 4.57;
        scenario.weights.fuel = 0.5;
        scenario
    }

    /// Circles of fifteen waypoints, and a long leg high above the ground, as Newton's method leaves them.
    fn circling(scenario: &Scenario) -> Vec<Point3> {
        let free = [
            [227.58, 512.07, 356.15],
            [232.49, 528.63, 351.52],
            [217.38, 552.58, 343.93],
            [183.61, 557.95, 334.77],
            [144.79, 530.19, 321.98],
            [136.66, 480.65, 308.53],
            [169.01, 437.46, 294.07],
            [220.68, 429.98, 280.08],
            [267.83, 463.37, 264.60],
            [278.71, 519.95, 249.16],
            [243.21, 574.56, 231.71],
            [180.86, 586.84, 214.68],
            [118.39, 548.45, 195.04],
            [102.93, 469.64, 173.52],
            [118.80, 437.72, 163.96],
            [202.30, 398.16, 156.43],
        ];
        let free = free.map(Point3::from);
        let mut route = [&[scenario.start], &free[..], &[scenario.target]].concat();
        Newton::new(&Model::new(scenario), &Nobody).improve(&mut route, &[]);
        route
    }

    #[test]
    fn circles_give_waypoints_to_the_rest() {
        let scenario = summit();
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        log.offer_unpriced(&circling(&scenario));
        assert!(
            log.best.is_feasible() && log.best.cost > 1200.0,
            "{:?}",
            log.best
        );
        assert!(is_worthwhile(&model, &log));
        assert_eq!(search(&model, &mut log), StopReason::Iterations);
        assert!(
            log.best.is_feasible() && log.best.cost < 900.0,
            "{:?}",
            log.best
        );
    }

    /// Nothing costs less, and nothing is gained.
    #[test]
    fn a_route_that_costs_nothing_is_the_end() {
        let mut scenario = summit();
        (scenario.weights.fuel, scenario.weights.altitude) = (0.0, 0.0);
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        log.offer_unpriced(&circling(&scenario));
        assert_eq!(search(&model, &mut log), StopReason::Iterations);
        assert!(log.best.cost.abs() < f64::EPSILON);
    }

    #[test]
    fn what_was_found_until_a_stop_is_kept() {
        let scenario = summit();
        let model = Model::new(&scenario);
        let known = circling(&scenario);
        let found = |looks: &Looks| {
            let mut nobody = Nobody;
            let mut log = Log::new(&model, &mut nobody, looks);
            log.offer_unpriced(&known);
            let cost = log.best.cost;
            let reason = search(&model, &mut log);
            assert!(log.best.is_feasible() && log.best.cost <= cost);
            reason
        };
        let looks = Looks::until(u32::MAX);
        assert_eq!(found(&looks), StopReason::Iterations);
        let early = Looks::until(looks.count.get() / 4);
        assert_eq!(found(&early), StopReason::Cancelled);
    }

    #[test]
    fn level_ground_known_routes_and_many_waypoints_are_left_as_they_are() {
        let scenario = summit();
        let known = circling(&scenario);
        let worthwhile_but = |change: fn(&mut Scenario)| {
            let mut scenario = scenario.clone();
            change(&mut scenario);
            let model = Model::new(&scenario);
            let mut nobody = Nobody;
            let mut log = Log::new(&model, &mut nobody, &Nobody);
            log.offer_unpriced(&known);
            is_worthwhile(&model, &log)
        };
        assert!(worthwhile_but(|_| {}));
        assert!(!worthwhile_but(|scenario| {
            scenario.terrain = Terrain::Flat(Flat { elevation: 0.0 });
        }));
        assert!(!worthwhile_but(|scenario| {
            scenario.planner.warm_start = Some(WarmStart::Waypoints(Vec::new()));
        }));
        assert!(!worthwhile_but(|scenario| scenario.planner.polish = false));
        assert!(!worthwhile_but(|scenario| {
            scenario.planner.waypoints = MOST_WAYPOINTS + 1;
        }));
        // A route that breaks a limit is another search's.
        assert!(!worthwhile_but(
            |scenario| scenario.vehicle.max_turn_deg = 20.0
        ));
    }
}
