//! The fallback where no route is found that keeps every limit: search for one with more waypoints, which is easier,
//! then remove waypoints until the requested number is left.

use super::aside::aside_with;
use super::fewer::leave_out;
use super::finish::{Leads, finish};
use super::log::Log;
use super::{MOST_WAYPOINTS, StopReason, starts, why_stop};
use crate::cost::Model;
use crate::geometry::Point3;

/// How many times the requested number of waypoints each attempt uses.
const ATTEMPTS: [f64; 2] = [1.4, 2.0];

/// An attempt uses at least this many waypoints more than requested.
const MORE: usize = 3;

/// Whether a search from routes, which ended with the best one of `log`, may still find one that keeps every limit.
pub(super) fn is_worthwhile(model: &Model, log: &Log) -> bool {
    let settings = &model.scenario.planner;
    starts::are_wanted(model.scenario)
        && settings.polish
        && settings.waypoints <= MOST_WAYPOINTS
        && !log.best.is_feasible()
}

/// Look for a route that keeps every limit, starting from routes with more waypoints.
pub(super) fn search(model: &Model, log: &mut Log) -> StopReason {
    // It takes long, and the best so far may be all there is.
    log.tell();
    for times in ATTEMPTS {
        if let Some(reason) = why_stop(model.scenario, log.stop) {
            return reason;
        }
        let Some(route) = roomy(model, times, log) else {
            continue;
        };
        match leave_out(model, route, log) {
            Ok((fitness, route)) => log.offer(&route, fitness),
            Err(reason) => return reason,
        };
        if log.best.is_feasible() {
            return finish(model, StopReason::Iterations, &Leads::default(), log);
        }
    }
    StopReason::Iterations
}

/// A route with more waypoints that keeps every limit, if one is found.
fn roomy(model: &Model, times: f64, log: &mut Log) -> Option<Vec<Point3>> {
    let waypoints = more(model.scenario.planner.waypoints, times);
    let (_, best, route) = aside_with(model, waypoints, log)?;
    best.is_feasible().then_some(route)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a few times a count"
)]
fn more(waypoints: usize, times: f64) -> usize {
    let many = (waypoints as f64 * times).ceil() as usize;
    many.max(waypoints + MORE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::Nobody;
    use crate::planner::tests::{Looks, slalom};
    use crate::scenario::Scenario;

    fn straight(scenario: &Scenario) -> Vec<Point3> {
        let step = (scenario.target - scenario.start) / 10.0;
        (0..=10)
            .map(|idx| scenario.start + step * f64::from(idx))
            .collect()
    }

    #[test]
    fn searching_with_more_waypoints_finds_a_route_with_the_requested_number() {
        let scenario = slalom();
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        let straight = straight(&scenario);
        log.offer_unpriced(&straight);
        assert!(!log.best.is_feasible());
        search(&model, &mut log);
        assert!(log.best.is_feasible(), "{:?}", log.best);
        assert_eq!(log.route.len(), straight.len());
    }

    #[test]
    fn a_stop_is_heard_between_two_waypoints_left_out() {
        let scenario = slalom();
        let model = Model::new(&scenario);
        let (mut nobody, looks) = (Nobody, Looks::until(u32::MAX));
        let mut log = Log::new(&model, &mut nobody, &looks);
        roomy(&model, ATTEMPTS[0], &mut log).expect("more waypoints are enough");
        let (before, priced) = (looks.count.get(), log.evaluations);
        // One look before the search with more waypoints, and one after it.
        for rounds in [0, 1] {
            let (mut nobody, looks) = (Nobody, Looks::until(before + 1 + rounds));
            let mut log = Log::new(&model, &mut nobody, &looks);
            log.offer_unpriced(&straight(&scenario));
            assert_eq!(search(&model, &mut log), StopReason::Cancelled);
            assert_eq!(log.route, straight(&scenario));
            assert_eq!(log.evaluations > priced + 1, rounds > 0);
        }
    }
}
