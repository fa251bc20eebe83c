//! The fallback where no route is found that keeps every limit: search for one with more waypoints, which is easier,
//! then remove waypoints until the requested number is left.

use super::finish::{finish, polish};
use super::log::Log;
use super::newton::Newton;
use super::polish::Steps;
use super::price::price;
use super::search::{self, COARSE_STEPS};
use super::{StopReason, why_stop};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Fitness;

/// How many times the requested number of waypoints each attempt uses.
const TIMES: [f64; 2] = [1.4, 2.0];

/// An attempt uses at least this many waypoints more than requested.
const MORE: usize = 3;

/// Largest population of such a search, however large a search was requested: any feasible route will do.
const POPULATION: usize = 200;

/// Largest number of iterations of such a search.
const ITERATIONS: usize = 200;

/// Where more waypoints than this are requested nothing is tried: they hardly ever lack waypoints, and removing some
/// would take long.
const MOST: usize = 64;

/// Waypoints whose removal is tried at each step.
const TRIES: usize = 3;

/// Polish of the rest of a route after a waypoint has been removed.
const STEPS: Steps = Steps {
    from: 0.05,
    ..COARSE_STEPS
};

/// Look for a route that keeps every limit, starting from routes with more waypoints.
pub(super) fn search(model: &Model, log: &mut Log) -> StopReason {
    if model.scenario.planner.waypoints > MOST {
        return StopReason::Iterations;
    }
    // It takes long, and the best so far may be all there is.
    log.tell();
    for times in TIMES {
        if let Some(reason) = why_stop(model.scenario, log.stop) {
            return reason;
        }
        if let Some(mut route) = roomy(model, times, log) {
            match leave_out(model, &mut route, log) {
                Ok(fitness) => log.offer(&route, fitness),
                Err(reason) => return reason,
            };
        }
        if log.best.is_feasible() {
            return finish(model, StopReason::Iterations, &[], &[], log);
        }
    }
    StopReason::Iterations
}

/// A route with more waypoints that keeps every limit, if one is found.
fn roomy(model: &Model, times: f64, log: &mut Log) -> Option<Vec<Point3>> {
    let mut scenario = model.scenario.clone();
    let settings = &mut scenario.planner;
    settings.waypoints = more(settings.waypoints, times);
    settings.population = settings.population.min(POPULATION);
    settings.iterations = settings.iterations.min(ITERATIONS);
    let (_, best, route) = search::aside(&Model::new(&scenario), None, log)?;
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

/// Remove one waypoint after another, always the one without which the rest is best once pulled into place.
///
/// # Errors
/// Why the run must stop; then the route still has too many waypoints.
fn leave_out(model: &Model, route: &mut Vec<Point3>, log: &mut Log) -> Result<Fitness, StopReason> {
    let mut best = price(model, route);
    while route.len() - 2 > model.scenario.planner.waypoints {
        if let Some(reason) = why_stop(model.scenario, log.stop) {
            return Err(reason);
        }
        let mut rests: Vec<_> = (1..route.len() - 1)
            .map(|idx| {
                let mut rest = route.clone();
                rest.remove(idx);
                (price(model, &rest), rest)
            })
            .collect();
        log.evaluations += rests.len() as u64;
        rests.sort_by(|one, other| one.0.rank(&other.0));
        rests.truncate(TRIES);
        for (fitness, rest) in &mut rests {
            *fitness = into_place(model, rest, log);
        }
        let rests = rests.into_iter();
        if let Some(placed) = rests.min_by(|one, other| one.0.rank(&other.0)) {
            (best, *route) = placed;
        }
    }
    Ok(best)
}

fn into_place(model: &Model, route: &mut Vec<Point3>, log: &mut Log) -> Fitness {
    let fitness = polish(model, route, STEPS, log);
    if fitness.is_feasible() {
        return fitness;
    }
    let mut newton = Newton::new(model, log.stop);
    let fitness = newton.improve(route, &[]);
    log.evaluations += newton.evaluations;
    fitness
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point2;
    use crate::planner::Nobody;
    use crate::planner::tests::{Looks, scenario};
    use crate::scenario::{Scenario, Seeding};
    use crate::threat::{Polygon, Shape, Threat};

    /// Walls across the area with gates at alternating ends, and few waypoints to get through them.
    fn slalom() -> Scenario {
        let mut scenario = scenario();
        let at = |x| Point3::new(x, 500.0, 100.0);
        (scenario.start, scenario.target) = (at(50.0), at(950.0));
        let wall = |x: f64, [from, to]: [f64; 2]| {
            let corners = [(x, from), (x + 10.0, from), (x + 10.0, to), (x, to)];
            Threat {
                name: None,
                shape: Shape::Polygon(Polygon::new(
                    corners.map(|(x, y)| Point2::new(x, y)).to_vec(),
                    0.0,
                )),
                base: None,
                top: None,
            }
        };
        scenario.threats = vec![
            wall(300.0, [-100.0, 850.0]),
            wall(500.0, [150.0, 1100.0]),
            wall(700.0, [-100.0, 850.0]),
        ];
        scenario.vehicle.max_turn_deg = 70.0;
        scenario.planner.waypoints = 9;
        scenario.planner.seeding = Seeding::Tangent;
        scenario.planner.polish = true;
        scenario
    }

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
        roomy(&model, TIMES[0], &mut log).expect("more waypoints are enough");
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

    #[test]
    fn the_waypoints_left_out_are_those_missed_least() {
        let mut scenario = slalom();
        scenario.threats.truncate(1);
        scenario.planner.waypoints = 3;
        let model = Model::new(&scenario);
        let corners = [
            (250.0, 860.0),
            (290.0, 870.0),
            (320.0, 870.0),
            (500.0, 740.0),
            (800.0, 560.0),
        ];
        let free = corners.map(|(x, y)| Point3::new(x, y, 100.0));
        let mut route = [&[scenario.start], &free[..], &[scenario.target]].concat();
        let whole = route.clone();
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        let fitness = leave_out(&model, &mut route, &mut log).expect("nobody stops it");
        assert!(fitness.is_feasible() && route.len() == 5, "{fitness:?}");
        assert!(log.evaluations > 0);
        // Leaving out any two others, and moving nothing, gives no better route.
        for first in 1..6 {
            for second in first..5 {
                let mut rest = whole.clone();
                rest.remove(first);
                rest.remove(second);
                assert!(!price(&model, &rest).beats(&fitness), "{rest:?}");
            }
        }
    }
}
