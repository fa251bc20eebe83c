//! From a scenario to a route: the one loop, and what comes out of it.
//!
//! Plain functions: no async, no store, no clock of their own.

mod beside;
mod certificate;
mod coding;
mod guide;
mod log;
mod moves;
mod objective;
mod outcome;
mod polish;
mod price;
mod rules;
mod search;
mod smoothing;
mod starts;

pub use outcome::{
    Bound, Clearance, ConvergencePoint, Incumbent, Leg, Measures, Outcome, Path, StopReason,
    Violation,
};
pub use rules::rules;

pub use crate::cost::CostFigures;

use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Objective;
use crate::scenario::{Quadrature, Scenario};
use crate::seeding;
use log::Log;
use objective::Routes;

/// Follows a run. Called on the planning thread; must return quickly.
pub trait Observer {
    /// After each iteration, the first evaluation (iteration 0) included.
    fn iteration(&mut self, point: &ConvergencePoint);
    /// When the best route has improved.
    fn incumbent(&mut self, incumbent: &Incumbent);
}

/// Tells a run when to end and what time it is; asked once an iteration, and now and then within
/// one whose routes take long to price.
pub trait Stop {
    /// Whether somebody wants the run to end with the best route so far.
    fn requested(&self) -> bool;
    /// Milliseconds since the run began. It is reported, and compared to the request's time
    /// limit; no other decision may look at it.
    fn elapsed_ms(&self) -> f64;
}

/// Nobody looks on, and nobody stops the run: for planning without an audience.
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
/// The outcome depends on the scenario alone, unless it sets a time limit or `stop` ends the run;
/// `elapsed_ms` is the only figure that a clock has a part in.
///
/// # Panics
/// When the scenario names an algorithm that is not in the table; its reader refuses those.
pub fn plan(scenario: &Scenario, observer: &mut dyn Observer, stop: &dyn Stop) -> Outcome {
    let model = Model::new(scenario);
    let mut log = Log::new(&model, observer, stop);
    if scenario.planner.gap > 0.0 {
        // The search asks at each step whether it is near enough to the bound.
        let is_over = || why_stop(scenario, stop).is_some();
        let lower = seeding::lower_bound_until(scenario, &is_over);
        log.lower = Some(lower);
        let stop_reason = search(&model, &mut log);
        return measured(&model, log.route, log.convergence, lower, stop_reason);
    }
    let (stop_reason, lower) = beside::bounded(scenario, || search(&model, &mut log));
    measured(&model, log.route, log.convergence, lower, stop_reason)
}

fn search(model: &Model, log: &mut Log) -> StopReason {
    match starts::routes(model, log.stop) {
        None => search::plain(model, log),
        Some(starts) => search::guided(model, starts, log),
    }
}

/// The routes of `scenario` as its algorithm sees them: positions in a box, each with its price.
///
/// For measuring the pricing itself, and for searches of one's own. Once `stop` asks for it, what is
/// left of a batch is [`Fitness::WORST`](optimizer::Fitness::WORST).
///
/// # Panics
/// When the scenario names an algorithm that is not in the table; its reader refuses those.
pub fn objective<'s>(scenario: &'s Scenario, stop: &'s dyn Stop) -> impl Objective + 's {
    Routes::plain(&Model::new(scenario), stop)
}

/// Routes are the same when no waypoint is farther from its like than this share of the way.
const SAME: f64 = 0.02;

fn same(scenario: &Scenario, one: &[Point3], other: &[Point3]) -> bool {
    let reach = SAME * (scenario.target - scenario.start).norm();
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
/// and its count of evaluations are not known here.
#[must_use]
pub fn so_far(scenario: &Scenario, route: Vec<Point3>) -> Outcome {
    let lower = seeding::lower_bound(scenario);
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
    let feasible = violations.is_empty();
    if let Some(last) = convergence.last_mut().filter(|_| feasible) {
        // The search aims at half the tolerance; what is delivered counts by the whole.
        last.best_cost = Some(cost.total);
        last.best_violation = 0.0;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point2, Rect};
    use crate::scenario::{
        AltitudeBand, Frame, PlannerSettings, Seeding, Smoothing, Vehicle, WarmStart, Weights,
    };
    use crate::terrain::{Flat, Terrain};
    use crate::threat::{Cylinder, Shape, Threat};

    /// Three radars on flat ground, as in the first scenario of the paper.
    pub(super) fn scenario() -> Scenario {
        let radar = |x, y, radius| Threat {
            name: Some(format!("radar at {x}, {y}")),
            shape: Shape::Cylinder(Cylinder {
                center: Point2::new(x, y),
                radius,
                influence: radius + 30.0,
            }),
            base: None,
            top: None,
        };
        Scenario {
            frame: Frame::Local,
            name: None,
            start: Point3::new(200.0, 100.0, 0.0),
            target: Point3::new(800.0, 800.0, 150.0),
            area: Rect {
                min: Point2::new(0.0, 0.0),
                max: Point2::new(1000.0, 1000.0),
            },
            threats: vec![
                radar(350.0, 250.0, 60.0),
                radar(500.0, 480.0, 70.0),
                radar(680.0, 620.0, 60.0),
            ],
            terrain: Terrain::Flat(Flat { elevation: 0.0 }),
            altitude: AltitudeBand {
                min: 0.0,
                max: 200.0,
            },
            vehicle: Vehicle {
                max_turn_deg: 60.0,
                max_climb_deg: 45.0,
                min_leg: 8.4,
                cruise_speed: 15.0,
                fuel_per_km: 1000.0,
            },
            weights: Weights {
                fuel: 0.5,
                threat: 1.0,
                altitude: 1.0,
            },
            planner: PlannerSettings {
                algorithm: "tms-sba".to_owned(),
                waypoints: 10,
                population: 60,
                iterations: 60,
                seed: 7,
                time_limit_ms: None,
                seeding: Seeding::Random,
                polish: false,
                warm_start: None,
                smoothing: Smoothing {
                    degree: 3,
                    spacing: 5.0,
                },
                quadrature: Quadrature::Integral,
                gap: 0.0,
                threads: 1,
                parameters: std::collections::BTreeMap::new(),
            },
        }
    }

    #[derive(Default)]
    struct Diary {
        points: Vec<ConvergencePoint>,
        incumbents: Vec<Incumbent>,
    }

    impl Observer for Diary {
        fn iteration(&mut self, point: &ConvergencePoint) {
            self.points.push(*point);
        }
        fn incumbent(&mut self, incumbent: &Incumbent) {
            self.incumbents.push(incumbent.clone());
        }
    }

    /// A clock that only moves when looked at, and a stop after so many looks.
    struct Looks {
        count: std::cell::Cell<u32>,
        stop_after: u32,
    }

    impl Looks {
        fn until(stop_after: u32) -> Self {
            Self {
                count: std::cell::Cell::new(0),
                stop_after,
            }
        }
    }

    impl Stop for Looks {
        fn requested(&self) -> bool {
            self.count.set(self.count.get() + 1);
            self.count.get() > self.stop_after
        }
        fn elapsed_ms(&self) -> f64 {
            f64::from(self.count.get())
        }
    }

    #[test]
    fn a_run_delivers_a_feasible_route_and_tells_its_story() {
        let mut diary = Diary::default();
        let outcome = plan(&scenario(), &mut diary, &Looks::until(u32::MAX));
        assert!(outcome.feasible && outcome.violations.is_empty());
        assert_eq!(outcome.stop_reason, StopReason::Iterations);
        assert_eq!(outcome.convergence, diary.points);
        assert_eq!(outcome.convergence.len(), 61);
        let last = diary
            .incumbents
            .last()
            .expect("the first evaluation is an incumbent");
        assert_eq!(last.waypoints, outcome.waypoints);
        assert_eq!(last.cost.to_bits(), outcome.cost.total.to_bits());
        let mut before = f64::INFINITY;
        for point in &outcome.convergence {
            assert!(point.best_cost.unwrap_or(f64::INFINITY) <= before);
            before = point.best_cost.unwrap_or(f64::INFINITY);
        }
        assert!(outcome.bound.lower <= outcome.cost.total);
        let path = outcome.path.expect("a feasible route has a path");
        let checks = outcome.path_checks.expect("and the path its certificate");
        assert!(
            checks
                .clearance
                .iter()
                .all(|clearance| clearance.distance.expect("unbounded threats") >= -1e-6)
        );
        assert!(path.points.len() > 100);
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_and_another_does_not() {
        let run = |seed| {
            let mut scenario = scenario();
            scenario.planner.seed = seed;
            plan(&scenario, &mut Diary::default(), &Looks::until(u32::MAX))
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1).waypoints, run(2).waypoints);
    }

    /// A radar pops up beside the route: from the known one, a tenth of the work does as well.
    #[test]
    fn a_warm_start_needs_a_tenth_of_the_evaluations() {
        let mut scenario = scenario();
        scenario.planner.seeding = Seeding::Tangent;
        scenario.planner.polish = true;
        scenario.planner.population = 200;
        scenario.planner.iterations = 200;
        let never = Looks::until(u32::MAX);
        let before = plan(&scenario, &mut Diary::default(), &never);
        let middle = before.waypoints[6];
        let mut popped_up = scenario.threats[0].clone();
        popped_up.shape = Shape::Cylinder(Cylinder {
            center: Point2::new(middle.x + 10.0, middle.y - 10.0),
            radius: 15.0,
            influence: 30.0,
        });
        scenario.threats.push(popped_up);
        let cold = plan(&scenario, &mut Diary::default(), &never);
        scenario.planner.population = 10;
        scenario.planner.iterations = 20;
        scenario.planner.warm_start = Some(WarmStart::Waypoints(before.waypoints));
        let warm = plan(&scenario, &mut Diary::default(), &never);
        assert!(cold.feasible && warm.feasible);
        assert!(
            warm.cost.total <= 1.002 * cold.cost.total,
            "{:?} {:?}",
            warm.cost,
            cold.cost
        );
        assert!(
            warm.evaluations * 8 <= cold.evaluations,
            "{} {}",
            warm.evaluations,
            cold.evaluations
        );
    }

    #[test]
    fn a_stop_keeps_the_best_so_far() {
        let outcome = plan(&scenario(), &mut Diary::default(), &Looks::until(5));
        assert_eq!(outcome.stop_reason, StopReason::Cancelled);
        assert_eq!(outcome.convergence.len(), 6);
        let longer = plan(&scenario(), &mut Diary::default(), &Looks::until(u32::MAX));
        assert_eq!(outcome.convergence[..], longer.convergence[..6]);
    }

    #[test]
    fn a_time_limit_ends_the_run() {
        let mut scenario = scenario();
        scenario.planner.time_limit_ms = Some(10);
        let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(u32::MAX));
        assert_eq!(outcome.stop_reason, StopReason::TimeLimit);
        assert_eq!(outcome.convergence.len(), 10);
    }

    /// Routes that each take long to price: a stop does not wait for the whole population.
    #[test]
    fn a_stop_within_an_iteration_is_heard() {
        let mut scenario = scenario();
        let far = scenario.threats[0].clone();
        scenario.threats.extend((0..20_000).map(|_| far.clone()));
        // Every fourth route or so is a look; the first population takes 60 routes.
        let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(5));
        assert_eq!(outcome.stop_reason, StopReason::Cancelled);
        assert_eq!(outcome.convergence.len(), 1);
        assert!(
            (1..60).contains(&outcome.evaluations),
            "{}",
            outcome.evaluations
        );
        assert!(outcome.convergence[0].mean_cost.is_finite());
        let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(40));
        assert_eq!(outcome.convergence.len(), 2);
        assert_eq!(outcome.evaluations, outcome.convergence[1].evaluations);
        assert!(
            outcome
                .convergence
                .iter()
                .all(|point| point.mean_cost.is_finite())
        );
    }

    #[test]
    fn an_impossible_scenario_ends_with_its_violations() {
        let mut scenario = scenario();
        // A wall across the whole area.
        scenario.threats[1].shape = Shape::Polygon(crate::threat::Polygon::new(
            vec![
                Point2::new(-100.0, 400.0),
                Point2::new(1100.0, 400.0),
                Point2::new(1100.0, 450.0),
                Point2::new(-100.0, 450.0),
            ],
            0.0,
        ));
        let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(u32::MAX));
        assert!(!outcome.feasible && outcome.path.is_none() && outcome.path_checks.is_none());
        assert!(
            outcome
                .violations
                .iter()
                .any(|violation| violation.kind == "threat")
        );
        assert_eq!(outcome.bound.gap, None);
    }

    #[test]
    fn the_papers_quadrature_reports_both_figures() {
        let mut scenario = scenario();
        scenario.planner.quadrature = Quadrature::Paper;
        let outcome = plan(&scenario, &mut Diary::default(), &Looks::until(u32::MAX));
        let exact = outcome
            .cost_integral
            .expect("the integral is reported beside the samples");
        assert_eq!(exact.fuel.to_bits(), outcome.cost.fuel.to_bits());
        let last = outcome.convergence.last().expect("there is a curve");
        assert_eq!(last.best_cost, Some(outcome.cost.total));
    }
}
