//! Where a vehicle climbs slowly over hills, only few ways can be flown at all, and nets of places are too coarse to show
//! them. The cheapest ways over a fine grid, which follow ledges and cross ridges where these are low, are pulled into
//! place with more waypoints than requested, and then lose one after the other.

use super::doubt::is_hard_pressed;
use super::fewer::leave_out_quickly;
use super::finish::finish_from;
use super::log::Log;
use super::{MOST_WAYPOINTS, Nobody, StopReason, is_from_scratch, same, starts, why_stop};
use crate::cost::Model;
use crate::geometry::Point3;

/// How many times the requested number of waypoints a way keeps at first.
const TIMES: [usize; 2] = [2, 4];

/// A way this many times as expensive as the best route is not worth a look: pulling it into place makes it cheaper by that
/// much at most.
const PROMISING: f64 = 1.25;

/// A route whose way alone costs this share more than the best route is not worth leaving waypoints out: what they gain by
/// the last polish is less.
const HOPE: f64 = 0.03;

/// Whether the best route of `log` is worth it, given that none costs less than `lower`: there is none, or it flies at the
/// limits of the vehicle, and another may be much cheaper.
pub(super) fn is_worthwhile(model: &Model, lower: f64, log: &Log) -> bool {
    let scenario = model.scenario;
    is_from_scratch(scenario)
        && !scenario.terrain.is_flat()
        && scenario.planner.waypoints <= MOST_WAYPOINTS
        && (!log.best.is_feasible() || is_hard_pressed(model, lower, log))
}

/// Follow ways along ledges, and keep what comes of them if it is better than the best route of `log`.
pub(super) fn search(model: &Model, log: &mut Log) -> StopReason {
    // It takes long, and the best so far may be all there is.
    log.tell();
    let is_over = || why_stop(model.scenario, log.stop).is_some();
    let waypoints = model.scenario.planner.waypoints;
    let most = if log.best.is_feasible() {
        PROMISING * log.best.cost
    } else {
        f64::INFINITY
    };
    let ledges = starts::ledges(model, most, &is_over);
    log.evaluations += ledges.legs_priced / (waypoints as u64 + 1);
    let mut placed: Vec<Vec<Point3>> = Vec::new();
    for route in followed(&ledges.ways, waypoints) {
        if let Some(reason) = why_stop(model.scenario, log.stop) {
            return reason;
        }
        let Some(route) = pulled_into_place(model, route, log) else {
            continue;
        };
        let is_known = placed
            .iter()
            .any(|other| same(model.scenario, other, &route));
        if is_known || cannot_pay(model, &route, log) {
            continue;
        }
        placed.push(route.clone());
        match leave_out_quickly(model, route, log) {
            Ok(route) => finish_from(model, starts::with_waypoints(model, route, waypoints), log),
            Err(reason) => return reason,
        }
        if log.has_converged() {
            return StopReason::Converged;
        }
    }
    StopReason::Iterations
}

/// Different routes along the `ways`: with more or less room a way may be the same, and where it has few places, all of
/// them are kept whatever the number.
fn followed(ways: &[Vec<Point3>], waypoints: usize) -> Vec<Vec<Point3>> {
    let mut routes = Vec::new();
    for way in ways {
        for times in TIMES {
            let route = starts::thinned_out(way, times * waypoints);
            if !routes.contains(&route) {
                routes.push(route);
            }
        }
    }
    routes
}

/// Whether `route` will hardly become better than the best one: with fewer waypoints its way is hardly shorter or less
/// exposed, only its heights may cost less.
fn cannot_pay(model: &Model, route: &[Point3], log: &Log) -> bool {
    let figures = model.figures(route, model.scenario.planner.quadrature);
    log.best.is_feasible() && figures.fuel + figures.threat > log.best.cost * (1.0 + HOPE)
}

/// What becomes of `route` with as many waypoints as it has, if that keeps every limit.
fn pulled_into_place(model: &Model, route: Vec<Point3>, log: &mut Log) -> Option<Vec<Point3>> {
    let mut scenario = model.scenario.clone();
    scenario.planner.waypoints = route.len() - 2;
    let long = Model::new(&scenario);
    let mut nobody = Nobody;
    let mut own = Log::new(&long, &mut nobody, log.stop);
    finish_from(&long, route, &mut own);
    log.evaluations += own.evaluations;
    own.best.is_feasible().then_some(own.route)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::newton;
    use crate::planner::tests::{Looks, mountain, straight};
    use crate::scenario::{Scenario, WarmStart};
    use crate::terrain::{Flat, Terrain};

    /// From the top of a mountain too steep to be flown straight down, with enough waypoints for the way round it.
    fn down_a_mountain() -> Scenario {
        let mut scenario = mountain(250.0, true);
        scenario.planner.waypoints = 20;
        scenario
    }

    #[test]
    fn where_no_route_is_known_one_along_ledges_is_found() {
        let scenario = down_a_mountain();
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        log.offer_unpriced(&straight(&scenario));
        assert!(!log.best.is_feasible() && is_worthwhile(&model, 0.0, &log));
        assert_eq!(search(&model, &mut log), StopReason::Iterations);
        assert!(log.best.is_feasible(), "{:?}", log.best);
        assert_eq!(log.route.len(), straight(&scenario).len());
    }

    #[test]
    fn a_stop_is_heard_between_two_ways() {
        let scenario = down_a_mountain();
        let model = Model::new(&scenario);
        let ended = |looks: &Looks| {
            let mut nobody = Nobody;
            let mut log = Log::new(&model, &mut nobody, looks);
            log.offer_unpriced(&straight(&scenario));
            search(&model, &mut log)
        };
        let looks = Looks::until(u32::MAX);
        assert_eq!(ended(&looks), StopReason::Iterations);
        for share in [4, 2] {
            let early = Looks::until(looks.count.get() / share);
            assert_eq!(ended(&early), StopReason::Cancelled);
        }
    }

    #[test]
    fn what_is_proven_level_ground_known_routes_and_many_waypoints_are_left_as_they_are() {
        let worthwhile_but = |change: fn(&mut Scenario)| {
            let mut scenario = down_a_mountain();
            change(&mut scenario);
            let model = Model::new(&scenario);
            let mut nobody = Nobody;
            let mut log = Log::new(&model, &mut nobody, &Nobody);
            log.offer_unpriced(&straight(&scenario));
            is_worthwhile(&model, 0.0, &log)
        };
        assert!(worthwhile_but(|_| {}));
        assert!(!worthwhile_but(|scenario| {
            scenario.terrain = Terrain::Flat(Flat { elevation: 0.0 });
        }));
        assert!(!worthwhile_but(|scenario| {
            scenario.planner.warm_start = Some(WarmStart::Waypoints(Vec::new()));
        }));
        assert!(!worthwhile_but(|scenario| {
            scenario.planner.waypoints = MOST_WAYPOINTS + 1;
        }));
        // Found, at the limits of the vehicle: it depends on what is proven.
        let scenario = down_a_mountain();
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        log.offer_unpriced(&straight(&scenario));
        search(&model, &mut log);
        assert!(newton::is_felt(&model, &log.route) && is_worthwhile(&model, 0.0, &log));
        assert!(!is_worthwhile(&model, 0.96 * log.best.cost, &log));
    }
}
