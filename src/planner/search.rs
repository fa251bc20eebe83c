//! How a run searches: the algorithm alone, or guided by routes to start from.

use super::log::Log;
use super::objective::Routes;
use super::polish::Polish;
use super::starts::Starts;
use super::{StopReason, same, starts, why_stop};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::{self, Algorithm, Fitness, Optimizer, Settings};

/// Share of the iterations that a guided search spends on coarse routes.
const COARSE_SHARE: f64 = 0.4;

/// Routes that go on from one stage of a guided search to the next.
const ELITES: usize = 4;

/// The algorithm alone, from random routes: the paper's.
pub(super) fn plain(model: &Model, log: &mut Log) -> StopReason {
    let mut routes = Routes::plain(model, log.stop);
    let scenario = model.scenario;
    let iterations = 0..=scenario.planner.iterations;
    let (_, reason) = run(model, &mut routes, iterations, log);
    polish(model, vec![log.route.clone()], log);
    reason
}

/// From `starts`, best first: bats about coarse routes, then about whole ones, then polish.
pub(super) fn guided(model: &Model, starts: Starts, log: &mut Log) -> StopReason {
    let settings = &model.scenario.planner;
    let coarse = starts.routes[0].len() - 2;
    log.evaluations += starts.evaluations;
    let turning = if coarse < settings.waypoints {
        (settings.iterations as f64 * COARSE_SHARE).floor() as usize
    } else {
        0
    };
    let mut elites = starts.routes;
    let mut reason = StopReason::Iterations;
    let mut first = 0;
    if turning > 0 {
        let mut routes = Routes::guided(model, log.stop, elites);
        let (search, why) = run(model, &mut routes, 0..=turning, log);
        elites = distinct(model, &routes, search.as_ref());
        reason = why;
        first = turning + 1;
    }
    if settings.polish {
        for route in &mut elites {
            let mut polish = Polish::new(model, log.stop);
            polish.descend(route, 0.03, 1e-3);
            log.evaluations += polish.evaluations(coarse);
        }
    }
    let mut elites: Vec<Vec<Point3>> = elites
        .into_iter()
        .map(|route| starts::with_waypoints(model, route, settings.waypoints))
        .collect();
    for route in &elites {
        log.offer_unpriced(route);
    }
    if reason == StopReason::Iterations {
        let mut routes = Routes::guided(model, log.stop, elites);
        let (search, why) = run(model, &mut routes, first..=settings.iterations, log);
        elites = distinct(model, &routes, search.as_ref());
        reason = why;
    }
    elites.truncate(2);
    elites.push(log.route.clone());
    polish(model, elites, log);
    reason
}

/// The best of `routes` made better, as the last point of the curve.
fn polish(model: &Model, routes: Vec<Vec<Point3>>, log: &mut Log) {
    if !model.scenario.planner.polish {
        return;
    }
    for mut route in routes {
        let mut polish = Polish::new(model, log.stop);
        let fitness = polish.descend(&mut route, 0.005, 5e-5);
        log.evaluations += polish.evaluations(model.scenario.planner.waypoints);
        log.offer(&route, fitness);
    }
    log.last_point();
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
    let before = log.evaluations;
    // A stop within the first population leaves the rest of it unpriced.
    let mut search = (algorithm.start)(&search_settings(model, algorithm), routes);
    let (first, last) = (*iterations.start(), *iterations.end());
    let mut offered = Fitness::WORST;
    let mut note = |iteration: usize, search: &dyn Optimizer, routes: &Routes, log: &mut Log| {
        log.evaluations = before + routes.evaluations;
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
                log.offer_unpriced(&starts::with_waypoints(model, route, settings.waypoints));
            }
        }
        log.point(iteration, search.swarm());
    };
    if first == 0 {
        note(0, search.as_ref(), routes, log);
    }
    let count = last + 1 - first.max(1);
    for iteration in first.max(1)..=last {
        if let Some(reason) = why_stop(model.scenario, log.stop) {
            return (search, reason);
        }
        let progress = (iteration + 1 - first.max(1)) as f64 / count as f64;
        search.iterate(routes, progress);
        if routes.interrupted {
            // Half an iteration is none: the result is that of the one before.
            let reason = why_stop(model.scenario, log.stop).unwrap_or(StopReason::Cancelled);
            return (search, reason);
        }
        note(iteration, search.as_ref(), routes, log);
    }
    (search, StopReason::Iterations)
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

/// The best few routes of the swarm that are not all but the same.
fn distinct(model: &Model, routes: &Routes, search: &dyn Optimizer) -> Vec<Vec<Point3>> {
    let swarm = search.swarm();
    let ranking = swarm.ranking();
    let mut chosen: Vec<Vec<Point3>> = Vec::new();
    let members = ranking.iter().map(|&idx| swarm.position(idx));
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
