//! From a scenario to a route: the outcome of the search and of the bound computed beside it, priced, smoothed and
//! certified.
//!
//! Plain functions: no async, no store, no clock of their own.

mod aside;
mod backwards;
mod beside;
mod blocks;
mod certificate;
mod coding;
mod doubt;
mod fewer;
mod finish;
mod guide;
mod kept;
mod kicks;
mod log;
mod moves;
mod newton;
mod objective;
mod outcome;
mod place;
mod polish;
mod price;
mod recount;
mod roomier;
mod rules;
mod search;
mod share_out;
mod simpler;
mod slow_climbs;
mod smoothing;
mod starts;
#[cfg(test)]
mod tests;
mod watch;

pub use outcome::{
    Bound, Clearance, ConvergencePoint, Incumbent, Leg, Measures, Outcome, Path, StopReason,
    Violation,
};
pub use place::Place;
pub use rules::rules;

pub(crate) use smoothing::keeps_limits;

pub use crate::cost::CostFigures;

use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Objective;
use crate::scenario::{Quadrature, Scenario, Seeding};
use crate::seeding;
use coding::Coding;
use log::Log;
use objective::Routes;

/// Follows a run. Called on the planning thread; must return quickly.
pub trait Observer {
    /// After each iteration, the first evaluation (iteration 0) included; with the number of the last one again if routes
    /// were improved after it.
    fn iteration(&mut self, point: &ConvergencePoint);
    /// When the best route has improved.
    fn incumbent(&mut self, incumbent: &Incumbent);
}

/// Tells a run when to end and what time it is. It is asked often, at least once an iteration, sweep or step, so both
/// must be quick.
pub trait Stop {
    /// Whether the run should end with the best route so far.
    fn requested(&self) -> bool;
    /// Milliseconds since the run began. It is reported, and compared to the request's time
    /// limit; no other decision may look at it.
    fn elapsed_ms(&self) -> f64;
}

/// No observer, and nobody to stop the run: for planning without an audience. It has no clock either, so a time limit
/// of the scenario does not end the run.
#[derive(Debug, Clone, Copy)]
pub struct Nobody;

impl Observer for Nobody {
    fn iteration(&mut self, _: &ConvergencePoint) {}
    fn incumbent(&mut self, _: &Incumbent) {}
}

impl Stop for Nobody {
    fn requested(&self) -> bool {
        false
    }
    fn elapsed_ms(&self) -> f64 {
        0.0
    }
}

/// Plan a route for `scenario`.
///
/// The outcome depends on the scenario alone, unless it sets a time limit or `stop` ends the run; `elapsed_ms` is the
/// only figure that depends on a clock. A [`WarmStart::Plan`](crate::scenario::WarmStart::Plan) is passed over: whoever
/// keeps plans replaces it by that plan's waypoints first.
///
/// # Panics
/// When the scenario is not valid, see [`Scenario`]: for instance when it names an algorithm that is not in the table.
pub fn plan(scenario: &Scenario, observer: &mut dyn Observer, stop: &dyn Stop) -> Outcome {
    let model = Model::new(scenario);
    let mut log = Log::new(&model, observer, stop);
    let (reason, lower) = match simpler::scene(scenario) {
        Some(scene) => simpler::searched(&model, &scene, &mut log),
        None => searched(&model, scenario, &mut log),
    };
    // Only now: the searches after the last iteration are one point of the curve together.
    log.last_point();
    // What follows the last iteration is cut short by a stop as well, and the outcome is another then.
    let cut_short = why_stop(scenario, stop).filter(|_| reason == StopReason::Iterations);
    let stop_reason = cut_short.unwrap_or(reason);
    let mut outcome = measured(&model, log.route, log.convergence, lower, stop_reason);
    if log.is_closed {
        certificate::say_closed(&mut outcome.violations);
    }
    outcome
}

/// Search routes of `model`, and compute the bound of `scenario` meanwhile.
fn searched(model: &Model, scenario: &Scenario, log: &mut Log) -> (StopReason, f64) {
    let stop = log.stop;
    let (reason, lower) = if scenario.planner.gap > 0.0 {
        // At each step the search checks whether it is near enough to the bound.
        let is_over = || why_stop(scenario, stop).is_some();
        let lower = seeding::lower_bound_until(scenario, &is_over);
        log.lower = Some(lower);
        (search(model, log), lower)
    } else {
        beside::bounded(scenario, stop, || search(model, log))
    };
    let reason = match reason {
        StopReason::Iterations => search_on(model, lower, log),
        ended => ended,
    };
    (reason, lower)
}

fn search(model: &Model, log: &mut Log) -> StopReason {
    match starts::routes(model, log.stop) {
        None => search::plain(model, log),
        Some(starts) => search::guided(model, starts, log),
    }
}

/// Where more waypoints than this are requested, only the other direction is tried: the rest would take long, and so many
/// are hardly ever too few.
const MOST_WAYPOINTS: usize = 64;

/// After the last iteration: search in other ways too where that promises a better route, given that none costs less
/// than `lower`.
fn search_on(model: &Model, lower: f64, log: &mut Log) -> StopReason {
    let mut reason = StopReason::Iterations;
    if is_hopeless(model, log) {
        return reason;
    }
    let goes_on =
        |reason| reason == StopReason::Iterations && why_stop(model.scenario, log.stop).is_none();
    if goes_on(reason) && backwards::is_worthwhile(model, lower, log) {
        reason = backwards::search(model, log);
    }
    if goes_on(reason) && recount::is_worthwhile(model, lower, log) {
        reason = recount::search(model, log);
    }
    if goes_on(reason) && slow_climbs::is_worthwhile(model, lower, log) {
        reason = slow_climbs::search(model, log);
    }
    if goes_on(reason) && roomier::is_worthwhile(model, log) {
        reason = roomier::search(model, log);
    }
    if goes_on(reason) && share_out::is_worthwhile(model, log) {
        reason = share_out::search(model, log);
    }
    if goes_on(reason) && kicks::is_worthwhile(model, lower, log) {
        reason = kicks::search(model, log);
    }
    reason
}

/// Whether the search has found no route because there is none: all ways are closed, whoever searches. Notes it, too.
fn is_hopeless(model: &Model, log: &mut Log) -> bool {
    let is_over = || why_stop(model.scenario, log.stop).is_some();
    log.is_closed = !log.best.is_feasible() && seeding::is_closed(model.scenario, &is_over);
    log.is_closed
}

/// Whether all that helps may be tried: no route is given to begin with, and the plain algorithm is not asked for.
fn is_from_scratch(scenario: &Scenario) -> bool {
    let settings = &scenario.planner;
    settings.polish && settings.seeding == Seeding::Tangent && settings.warm_start.is_none()
}

/// The routes of `scenario` as its algorithm sees them: positions in a box, each with its price.
///
/// For measuring the pricing itself, and for searches of one's own. Once `stop` asks for it, what is
/// left of a batch is [`Fitness::WORST`](crate::optimizer::Fitness::WORST).
///
/// # Panics
/// When the scenario names an algorithm that is not in the table; its reader refuses those.
pub fn objective<'s>(scenario: &'s Scenario, stop: &'s dyn Stop) -> impl Objective + 's {
    Routes::plain(&Model::new(scenario), stop)
}

/// The route, start to target, of a position of [`objective()`].
///
/// # Panics
/// When the scenario names an algorithm that is not in the table; its reader refuses those.
pub fn decoder(scenario: &Scenario) -> impl Fn(&[f64]) -> Vec<Point3> + '_ {
    let coding = Coding::of(scenario, scenario.planner.waypoints);
    move |position| {
        let mut route = Vec::new();
        coding.decode(position, &mut route);
        route
    }
}

/// The path that a vehicle flies along `route`, start to target; `None` where no path keeps every limit.
///
/// # Panics
/// When `route` has fewer than two waypoints.
#[must_use]
pub fn smoothed(scenario: &Scenario, route: &[Point3]) -> Option<Path> {
    smoothing::smooth(&Model::new(scenario), route)
}

/// Routes are the same when no waypoint is farther from its counterpart than this share of the way.
const SAME: f64 = 0.02;

fn same(scenario: &Scenario, one: &[Point3], other: &[Point3]) -> bool {
    let reach = SAME * scenario.direct();
    one.len() == other.len()
        && one
            .iter()
            .zip(other)
            .all(|(one, other)| (one - other).norm() <= reach)
}

fn why_stop(scenario: &Scenario, stop: &dyn Stop) -> Option<StopReason> {
    if stop.requested() {
        return Some(StopReason::Cancelled);
    }
    let limit = scenario.planner.time_limit_ms?;
    (stop.elapsed_ms() >= limit as f64).then_some(StopReason::TimeLimit)
}

/// What a run whose best route so far is `route` would deliver if it were cancelled now; its curve
/// and its count of evaluations are not known here. Thus it also prices and certifies a route of one's own.
/// `lower` is what is known of the [`seeding::lower_bound`], which takes the longest; 0 is always true.
///
/// `route` begins at the start and ends at the target, which is not checked; waypoints that coincide are spread along
/// their legs.
///
/// # Panics
/// When `route` has fewer than two waypoints.
#[must_use]
pub fn so_far(scenario: &Scenario, route: Vec<Point3>, lower: f64) -> Outcome {
    let model = Model::new(scenario);
    measured(&model, route, Vec::new(), lower, StopReason::Cancelled)
}

/// Price, smooth and certify a route.
fn measured(
    model: &Model,
    route: Vec<Point3>,
    mut convergence: Vec<ConvergencePoint>,
    lower: f64,
    stop_reason: StopReason,
) -> Outcome {
    let route = starts::spread(model, route);
    let evaluations = convergence.last().map_or(0, |last| last.evaluations);
    let quadrature = model.scenario.planner.quadrature;
    let cost = model.figures(&route, quadrature);
    let violations = certificate::violations(model, &route);
    // What is no number breaks no limit that it is compared to.
    let feasible = violations.is_empty() && cost.total.is_finite();
    if let Some(last) = convergence.last_mut() {
        // The search aims at half the tolerance; the delivered route is judged by all of it.
        last.best_cost = feasible.then_some(cost.total);
        // From 0, since a sum of nothing is -0.
        let amounts = violations.iter().map(|violation| violation.amount);
        last.best_violation = amounts.fold(0.0, |sum, amount| sum + amount);
    }
    let path = feasible.then(|| smoothing::smooth(model, &route)).flatten();
    Outcome {
        frame: model.scenario.frame.clone(),
        feasible,
        stop_reason,
        cost,
        cost_integral: (quadrature == Quadrature::Paper)
            .then(|| model.figures(&route, Quadrature::Integral)),
        bound: Bound {
            lower,
            gap: (feasible && lower > 0.0).then(|| cost.total / lower - 1.0),
        },
        legs: certificate::legs(&route),
        waypoint_checks: certificate::measure(model, &route),
        path_checks: path
            .as_ref()
            .map(|path| certificate::measure(model, &path.points)),
        path,
        violations,
        waypoints: route,
        convergence,
        evaluations,
    }
}
