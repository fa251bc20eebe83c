//! Searches on behalf of a run that another has begun: of the scenario seen otherwise.

use super::log::Log;
use super::search::guided;
use super::starts::{self, Starts};
use super::{Nobody, StopReason};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Fitness;

/// Largest population of a search with another number of waypoints, however large a search was requested.
const POPULATION: usize = 200;

/// Largest number of iterations of such a search.
const ITERATIONS: usize = 200;

/// The guided search of another `model` from `starts`, on behalf of the run of `log`, which counts what it prices: why it
/// ended, and its best route. `None` where there is nothing to start from.
pub(super) fn aside(
    model: &Model,
    starts: Option<Starts>,
    lower: Option<f64>,
    log: &mut Log,
) -> Option<(StopReason, Fitness, Vec<Point3>)> {
    let mut nobody = Nobody;
    let mut own = Log::new(model, &mut nobody, log.stop);
    own.lower = lower;
    let reason = guided(model, starts?, &mut own);
    log.evaluations += own.evaluations;
    Some((reason, own.best, own.route))
}

/// As [`aside`], with another number of `waypoints`, and no larger a search than most ask for: it comes on top of the one
/// that was asked for.
pub(super) fn aside_with(
    model: &Model,
    waypoints: usize,
    log: &mut Log,
) -> Option<(StopReason, Fitness, Vec<Point3>)> {
    let mut scenario = model.scenario.clone();
    let settings = &mut scenario.planner;
    settings.waypoints = waypoints;
    settings.population = settings.population.min(POPULATION);
    settings.iterations = settings.iterations.min(ITERATIONS);
    let other = Model::new(&scenario);
    aside(&other, starts::routes(&other, log.stop), None, log)
}
