//! How a run searches: the algorithm alone, or guided by routes to start from.

use super::finish::{Leads, finish, polish};
use super::log::Log;
use super::objective::Routes;
use super::polish::Steps;
use super::starts::Starts;
use super::{StopReason, same, starts, why_stop};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::{self, Algorithm, Fitness, Optimizer, Settings, share_of};

/// Share of the iterations that a guided search spends on coarse routes.
const COARSE_SHARE: f64 = 0.4;

/// Routes carried over from one stage of a guided search to the next.
const ELITES: usize = 4;

/// A route that is carried over costs at most this share more than the best.
const PROMISING: f64 = 0.05;

/// Maximum number of starts that compete in the end.
const RIVALS: usize = 8;

/// Steps of the polish between the stages.
pub(super) const COARSE_STEPS: Steps = Steps {
    from: 0.02,
    to: 1e-3,
    gain: 1e-4,
    violation_m: f64::INFINITY,
};

/// The algorithm alone, from random routes: as in the paper.
pub(super) fn plain(model: &Model, log: &mut Log) -> StopReason {
    let mut routes = Routes::plain(model, log.stop);
    let scenario = model.scenario;
    let iterations = 0..=scenario.planner.iterations;
    let (_, reason) = run(model, &mut routes, iterations, log);
    finish(model, reason, &Leads::default(), log)
}

/// From `starts`, best first: bats around coarse routes, then around whole ones, then polish.
pub(super) fn guided(model: &Model, starts: Starts, log: &mut Log) -> StopReason {
    let settings = &model.scenario.planner;
    log.evaluations += starts.evaluations;
    let coarse = starts.routes[0].len() - 2;
    let turning = if coarse < settings.waypoints {
        share_of(settings.iterations, COARSE_SHARE)
    } else {
        0
    };
    let whole = |routes: Vec<Vec<Point3>>, log: &mut Log| -> Vec<Vec<Point3>> {
        let with_all = |route| with_all(model, route, log);
        let routes: Vec<_> = routes.into_iter().map(with_all).collect();
        for route in &routes {
            log.offer_unpriced(route);
        }
        routes
    };
    let mut best_starts = Vec::new();
    let mut elites = starts.routes;
    let mut reason = StopReason::Iterations;
    if turning > 0 {
        let mut routes = Routes::guided(model, log.stop, &elites);
        let (search, why) = run(model, &mut routes, 0..=turning, log);
        let others = elites.split_off(1);
        let others = starts::different_first(model, &elites[0], others);
        best_starts = elites;
        best_starts.extend(others);
        best_starts.truncate(RIVALS);
        elites = distinct(model, &routes, search.as_ref());
        reason = why;
        if settings.polish && reason == StopReason::Iterations {
            for route in &mut elites {
                polish(model, route, COARSE_STEPS, log);
            }
        }
    }
    if reason != StopReason::Iterations && starts::is_vast(model.scenario) {
        elites.truncate(1);
        best_starts.clear();
    }
    let mut elites = whole(elites, log);
    // Coarse routes do not show what spare waypoints cost: a start that was dropped may be the best of all.
    let best_starts = whole(best_starts, log);
    if reason == StopReason::Iterations {
        let mut routes = Routes::guided(model, log.stop, &elites);
        let first = if turning > 0 { turning + 1 } else { 0 };
        let (search, why) = run(model, &mut routes, first..=settings.iterations, log);
        // The best of the swarm first.
        elites.splice(0..0, distinct(model, &routes, search.as_ref()));
        reason = why;
    }
    elites.extend(best_starts);
    let grafts = whole(starts.grafts, log);
    let leads = Leads {
        grafts: &grafts,
        others: &elites,
        beyond: &starts.beyond,
        round: &starts.round,
    };
    finish(model, reason, &leads, log)
}

/// Start the algorithm and do `iterations`; where the range begins with 0, the first evaluation is
/// a point of the curve.
fn run(
    model: &Model,
    routes: &mut Routes,
    iterations: std::ops::RangeInclusive<usize>,
    log: &mut Log,
) -> (Box<dyn Optimizer>, StopReason) {
    let settings = &model.scenario.planner;
    let algorithm = optimizer::by_name(&settings.algorithm)
        .expect("the reader accepts only names in the table");
    let mut counted = 0;
    // A stop within the first population leaves the rest of it unpriced.
    let mut search = (algorithm.start)(&search_settings(model, algorithm), routes);
    let (first, last) = (*iterations.start(), *iterations.end());
    let mut offered = Fitness::WORST;
    let mut note = |iteration: usize, search: &dyn Optimizer, routes: &Routes, log: &mut Log| {
        log.evaluations += routes.watch.evaluations - counted;
        counted = routes.watch.evaluations;
        let best = search.swarm().best_fitness();
        if best.beats(&offered) || log.route.is_empty() {
            offered = best;
            let mut route = Vec::new();
            routes
                .coding
                .decode(search.swarm().best_position(), &mut route);
            if route.len() == settings.waypoints + 2 {
                log.offer(&route, best);
            } else {
                log.offer_unpriced(&with_all(model, route, log));
            }
        }
        log.point(iteration, search.swarm());
    };
    if first == 0 {
        note(0, search.as_ref(), routes, log);
    }
    let count = last + 1 - first.max(1);
    for iteration in first.max(1)..=last {
        if log.has_converged() {
            return (search, StopReason::Converged);
        }
        if let Some(reason) = why_stop(model.scenario, log.stop) {
            return (search, reason);
        }
        let progress = (iteration + 1 - first.max(1)) as f64 / count as f64;
        search.iterate(routes, progress);
        if routes.watch.interrupted {
            // Half an iteration does not count: the result is that of the one before.
            let reason = why_stop(model.scenario, log.stop).unwrap_or(StopReason::Cancelled);
            return (search, reason);
        }
        note(iteration, search.as_ref(), routes, log);
    }
    (search, StopReason::Iterations)
}

/// `route` with all its waypoints; where even this takes long, only as long as there is time.
fn with_all(model: &Model, route: Vec<Point3>, log: &Log) -> Vec<Point3> {
    let scenario = model.scenario;
    let is_vast = starts::is_vast(scenario);
    let is_late = || is_vast && why_stop(scenario, log.stop).is_some();
    starts::with_waypoints_until(model, route, scenario.planner.waypoints, &is_late)
}

fn search_settings(model: &Model, algorithm: &Algorithm) -> Settings {
    let settings = &model.scenario.planner;
    let chosen = &settings.parameters;
    Settings {
        population: settings.population,
        seed: settings.seed,
        parameters: algorithm.parameters_with(|name| chosen.get(name).copied()),
    }
}

/// The best few routes of the swarm that are not nearly the same.
fn distinct(model: &Model, routes: &Routes, search: &dyn Optimizer) -> Vec<Vec<Point3>> {
    let swarm = search.swarm();
    let best = swarm.best_fitness();
    let promising = |fitness: &Fitness| {
        fitness.violation <= best.violation && fitness.cost <= best.cost * (1.0 + PROMISING)
    };
    let ranking = swarm.ranking();
    let members = ranking
        .iter()
        .filter(|&&idx| promising(&swarm.fitness()[idx]))
        .map(|&idx| swarm.position(idx));
    let mut chosen: Vec<Vec<Point3>> = Vec::new();
    for position in std::iter::once(swarm.best_position()).chain(members) {
        let mut route = Vec::new();
        routes.coding.decode(position, &mut route);
        if !chosen
            .iter()
            .any(|other| same(model.scenario, &route, other))
        {
            chosen.push(route);
        }
        if chosen.len() == ELITES {
            break;
        }
    }
    chosen
}
