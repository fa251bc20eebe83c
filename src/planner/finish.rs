//! What happens to the routes that a search ends with: the best is polished and refined by Newton's method, and so are
//! some that lead elsewhere.

use super::log::Log;
use super::newton::{self, Newton};
use super::polish::{Polish, Steps};
use super::price::price;
use super::search::COARSE_STEPS;
use super::{StopReason, same, starts, why_stop};
use crate::cost::Model;
use crate::geometry::{Point2, Point3};
use crate::optimizer::Fitness;

/// Maximum number of routes polished at the end that lead elsewhere than the best, unless waypoints are [`FEW`].
const CHALLENGERS: usize = 5;

/// Up to this many waypoints, all routes that lead elsewhere are polished: so few waypoints cannot follow a coarse
/// route, and that loss is only made up by the polish.
const FEW: usize = 8;

/// The routes priced for challengers are at most the bats' budget divided by this.
const CHALLENGE_PART: usize = 2;

/// A challenger that costs this share more than the best after the rough polish is dropped.
const CLOSE: f64 = 0.002;

/// Over hills, this many waypoints are more than there are bends: where the spare ones lie affects the cost.
const ROOMY: usize = 16;

/// Steps of the polish at the end.
const LAST_STEPS: Steps = Steps {
    from: 0.01,
    to: 5e-5,
    gain: 5e-6,
    violation_m: f64::INFINITY,
};

/// Steps of the rough polish of a challenger.
const ROUGH_STEPS: Steps = Steps {
    from: 0.01,
    ..COARSE_STEPS
};

/// Steps of the fine polish that follows for a promising challenger.
const FINE_STEPS: Steps = Steps {
    from: 1e-3,
    ..LAST_STEPS
};

/// Steps of the polish of a route that is nearly in place.
const BACK_STEPS: Steps = Steps {
    from: 2e-3,
    ..LAST_STEPS
};

/// Where else than along its best route a search may end.
#[derive(Default)]
pub(super) struct Leads<'r> {
    /// Routes that may become better once they are polished.
    pub(super) others: &'r [Vec<Point3>],
    /// Routes of no search that lead elsewhere than its best start.
    pub(super) grafts: &'r [Vec<Point3>],
    /// Routes that break limits.
    pub(super) beyond: &'r [Vec<Point3>],
    /// Ways round the threats as seen from above.
    pub(super) round: &'r [Vec<Point2>],
}

/// Polish the best route, which the last point of the curve shows, unless it is already good enough; the polish may make
/// it so. One of the `leads` may become better.
pub(super) fn finish(
    model: &Model,
    reason: StopReason,
    leads: &Leads,
    log: &mut Log,
) -> StopReason {
    let is_wanted = model.scenario.planner.polish && reason != StopReason::Converged;
    // Even looking at what there is takes long beside rings of thousands of corners.
    if is_wanted && why_stop(model.scenario, log.stop).is_none() {
        let mut candidates = vec![log.route.clone()];
        // Where the best so far is still a start of the search, what its bats found may be better once polished.
        candidates.extend(
            leads
                .others
                .first()
                .filter(|other| **other != log.route)
                .cloned(),
        );
        let before = log.evaluations;
        for mut route in candidates {
            let fitness = polish(model, &mut route, LAST_STEPS, log);
            log.offer(&route, fitness);
        }
        let spent = log.evaluations - before;
        bring_home(model, leads.others, log);
        // The first has been polished with the best.
        for others in [leads.others.get(1..).unwrap_or_default(), leads.grafts] {
            if challenge(model, others, spent, log) {
                bring_home(model, &[], log);
            }
        }
        round_off(model, leads.round, log);
        bring_within(model, leads.beyond, log);
        log.is_polished = true;
    }
    if reason == StopReason::Iterations && log.has_converged() {
        return StopReason::Converged;
    }
    reason
}

/// Polish and refine `route`, and keep it if it is better than the best.
pub(super) fn finish_from(model: &Model, mut route: Vec<Point3>, log: &mut Log) {
    polish(model, &mut route, LAST_STEPS, log);
    let fitness = refine(model, &mut route, &[], log);
    log.offer(&route, fitness);
}

/// Bring `route`, which is the best where threats are a little larger, to where they are.
pub(super) fn bring_back(model: &Model, mut route: Vec<Point3>, log: &mut Log) {
    let fitness = polish(model, &mut route, BACK_STEPS, log);
    log.offer(&route, fitness);
    bring_home(model, &[], log);
}

/// The last metres decide which of two ways is cheaper: one of the `others`, which were no better than the best before
/// the polish, may be better after it; returns whether one is. No challenger is begun when fewer routes are left
/// to price than the `spent` ones of that polish.
fn challenge(model: &Model, others: &[Vec<Point3>], spent: u64, log: &mut Log) -> bool {
    let settings = &model.scenario.planner;
    let asked_for = settings.population * settings.iterations;
    let most = log.evaluations + (asked_for / CHALLENGE_PART) as u64;
    let challengers = if settings.waypoints <= FEW {
        others.len()
    } else {
        CHALLENGERS
    };
    let others = elsewhere(model, &log.route, others);
    let others = starts::different_first(model, &log.route, others);
    let mut has_won = false;
    for mut route in others.into_iter().take(challengers) {
        let is_over = log.evaluations + spent > most;
        if is_over || why_stop(model.scenario, log.stop).is_some() {
            break;
        }
        if let Some(fitness) = challenger(model, &mut route, log) {
            has_won |= log.offer(&route, fitness);
        }
    }
    has_won
}

/// Those of the `others` that lead elsewhere than `route` and than each other.
fn elsewhere<'r>(
    model: &Model,
    route: &[Point3],
    others: impl IntoIterator<Item = &'r Vec<Point3>>,
) -> Vec<Vec<Point3>> {
    let mut met: Vec<Vec<Point3>> = Vec::new();
    for other in others {
        let is_near = |known: &[Point3]| same(model.scenario, known, other);
        if !is_near(route) && !met.iter().any(|known| is_near(known)) {
            met.push(other.clone());
        }
    }
    met
}

/// Polish `route` while it may still become better than the best; `None` when it does not.
fn challenger(model: &Model, route: &mut Vec<Point3>, log: &mut Log) -> Option<Fitness> {
    let best = log.best;
    let known = [(best, log.route.clone())];
    let mut polish = Polish::new(model, log.stop);
    let rough = polish.descend_unless_known(route, ROUGH_STEPS, &known);
    let is_close = |rough: &Fitness| {
        rough.violation <= best.violation && rough.cost < best.cost * (1.0 + CLOSE)
    };
    let fine = rough
        .filter(is_close)
        .and_then(|_| polish.descend_unless_known(route, FINE_STEPS, &known));
    log.evaluations += polish.evaluations(route.len() - 2);
    fine
}

/// Refine the last metres of a route that turns or climbs as sharply as it may, or has many waypoints over hills.
fn bring_home(model: &Model, others: &[Vec<Point3>], log: &mut Log) {
    let mut route = log.route.clone();
    let is_free = log.best.is_feasible() && !newton::is_felt(model, &route);
    let is_level = model.scenario.terrain.is_flat();
    let is_done = is_free && (is_level || model.scenario.planner.waypoints < ROOMY);
    if is_done || why_stop(model.scenario, log.stop).is_some() {
        return;
    }
    let others = if is_free { &[] } else { others };
    let others = elsewhere(model, &route, others);
    let fitness = refine(model, &mut route, &others, log);
    log.offer(&route, fitness);
}

/// Over level ground: follow the way `round` the threats that is the best at the heights of the best route, where that is
/// better. Its arcs have their best numbers of waypoints, while spare ones hardly come from one arc to another by
/// themselves.
fn round_off(model: &Model, round: &[Vec<Point2>], log: &mut Log) {
    if !model.scenario.terrain.is_flat() || why_stop(model.scenario, log.stop).is_some() {
        return;
    }
    let waypoints = model.scenario.planner.waypoints;
    let routes = round.iter().map(|corners| {
        let route = starts::at_heights_of(&log.route, corners);
        let route = starts::with_waypoints(model, route, waypoints);
        (price(model, &route), route)
    });
    let best = routes.min_by(|(one, _), (other, _)| one.rank(other));
    log.evaluations += round.len() as u64;
    if let Some((fitness, mut route)) = best
        && fitness.beats(&log.best)
    {
        let fitness = polish(model, &mut route, FINE_STEPS, log);
        log.offer(&route, fitness);
    }
}

/// Bring routes that break limits within them: from round to round of Newton's method, breaches cost more.
fn bring_within(model: &Model, beyond: &[Vec<Point3>], log: &mut Log) {
    for route in beyond {
        if why_stop(model.scenario, log.stop).is_some() {
            return;
        }
        let mut route = route.clone();
        let fitness = refine(model, &mut route, &[], log);
        log.offer(&route, fitness);
    }
}

/// Improve `route` by `steps`.
pub(super) fn polish(
    model: &Model,
    route: &mut Vec<Point3>,
    steps: Steps,
    log: &mut Log,
) -> Fitness {
    let mut polish = Polish::new(model, log.stop);
    let fitness = polish.descend(route, steps);
    log.evaluations += polish.evaluations(route.len() - 2);
    fitness
}

/// Improve `route` by Newton's method, given `others` that lead elsewhere.
pub(super) fn refine(
    model: &Model,
    route: &mut Vec<Point3>,
    others: &[Vec<Point3>],
    log: &mut Log,
) -> Fitness {
    let mut newton = Newton::new(model, log.stop);
    let fitness = newton.improve(route, others);
    log.evaluations += newton.evaluations;
    fitness
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::Nobody;
    use crate::planner::starts::tangents::corners;
    use crate::planner::tests::{disc, radar, scenario};
    use crate::scenario::Scenario;
    use crate::seeding::{Obstacles, taut_strings};

    /// Start and target on one level, an obstacle off to one side, and a route around it on each side: a smooth
    /// one on the long side, and one on the short side that is more expensive until it is improved.
    fn one_in_the_way() -> (Scenario, [Vec<Point3>; 2]) {
        let mut scenario = scenario();
        scenario.planner.waypoints = 3;
        (scenario.planner.population, scenario.planner.iterations) = (200, 200);
        let at = |[x, y]: [f64; 2]| Point3::new(x, y, 100.0);
        (scenario.start, scenario.target) = (at([100.0, 500.0]), at([900.0, 500.0]));
        scenario.threats = vec![radar(500.0, 540.0, 150.0)];
        let routes = [
            [[400.0, 740.0], [500.0, 750.0], [600.0, 740.0]],
            [[250.0, 150.0], [500.0, 250.0], [750.0, 150.0]],
        ];
        let [start, target] = [scenario.start, scenario.target];
        let routes = routes.map(|[a, b, c]| vec![start, at(a), at(b), at(c), target]);
        (scenario, routes)
    }

    #[test]
    fn a_route_that_is_cheaper_after_polishing_wins() {
        let (scenario, others) = one_in_the_way();
        let model = Model::new(&scenario);
        let [long, short] = others.each_ref().map(|route| price(&model, route).cost);
        assert!(long < short);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        log.offer_unpriced(&others[0]);
        finish(&model, StopReason::Iterations, &Leads::default(), &mut log);
        assert!(log.route[2].y > 700.0, "polished, it leads as it did");
        assert!(challenge(&model, &others, 1_000, &mut log));
        assert!(log.best.is_feasible() && log.route[2].y < 400.0);
    }

    #[test]
    fn a_small_search_polishes_no_other_routes() {
        let (mut scenario, others) = one_in_the_way();
        (scenario.planner.population, scenario.planner.iterations) = (10, 20);
        let model = Model::new(&scenario);
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        log.offer_unpriced(&others[0]);
        assert!(!challenge(&model, &others, 1_000, &mut log));
        assert_eq!(log.evaluations, 1);
    }

    /// Two arcs lack a waypoint each, and spare ones lie on a leg.
    #[test]
    fn waypoints_come_to_the_arc_that_lacks_them() {
        let mut scenario = scenario();
        let at = |x| Point3::new(x, 500.0, 100.0);
        (scenario.start, scenario.target) = (at(100.0), at(900.0));
        scenario.threats = vec![
            disc([350.0, 420.0, 120.0, 120.0]),
            disc([650.0, 580.0, 120.0, 120.0]),
        ];
        scenario.planner.waypoints = 6;
        let model = Model::new(&scenario);
        let strings = taut_strings(&Obstacles::hard(&scenario, |_, _| true), 1);
        let round = [corners(&scenario, &strings.strings[0], 6)];
        let mut nobody = Nobody;
        let mut log = Log::new(&model, &mut nobody, &Nobody);
        let even = starts::at_heights_of(&[scenario.start, scenario.target], &round[0]);
        let uneven = [&even[..3], &even[5..]].concat();
        log.offer_unpriced(&starts::with_waypoints(&model, uneven, 6));
        let before = log.best;
        round_off(&model, &round, &mut log);
        let even = price(&model, &even);
        assert!(!before.is_feasible() || before.cost > even.cost + 0.2);
        assert!(log.best.is_feasible() && log.best.cost < even.cost + 0.01);

        // Where the best is as good, it stays.
        let known = log.route.clone();
        round_off(&model, &round, &mut log);
        assert_eq!(log.route, known);
    }
}
