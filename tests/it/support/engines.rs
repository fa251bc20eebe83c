//! Engines controlled by the test.

use std::sync::Arc;

use noctule::geometry::Point3;
use noctule::job::Failure;
use noctule::planner::{
    Bound, ConvergencePoint, CostFigures, Incumbent, Leg, Measures, Observer, Outcome, Stop,
    StopReason,
};
use noctule::scenario::Frame;
use noctule::worker::{Engine, Unplanned};

/// Wraps a function as an engine that either plans or fails.
pub(crate) fn engine(
    plan: impl Fn(&str, &mut dyn Observer, &dyn Stop) -> Result<Outcome, Failure>
    + Send
    + Sync
    + 'static,
) -> Engine {
    Arc::new(move |scenario, observer, stop| {
        plan(scenario, observer, stop).map_err(Unplanned::Failed)
    })
}

/// An engine that runs `iterations` and finds a better route in every third one; its figures depend only on the
/// document.
pub(crate) fn deterministic(iterations: usize) -> Engine {
    engine(move |scenario, observer, stop| Ok(search(scenario, iterations, observer, stop)))
}

/// An engine that iterates until it is stopped.
pub(crate) fn endless() -> Engine {
    engine(|scenario, observer, stop| Ok(search(scenario, usize::MAX, observer, stop)))
}

fn search(
    scenario: &str,
    iterations: usize,
    observer: &mut dyn Observer,
    stop: &dyn Stop,
) -> Outcome {
    let start = scenario
        .bytes()
        .fold(1_u32, |sum, byte| sum.wrapping_mul(31) + u32::from(byte));
    let mut cost = f64::from(start % 1_000) + 1_000.0;
    let mut convergence = Vec::new();
    for iteration in 0..=iterations {
        if iteration % 3 == 1 {
            cost -= 1.0 / iteration as f64;
            observer.incumbent(&incumbent(iteration, cost));
        }
        let point = point(iteration, cost);
        observer.iteration(&point);
        // The endless one keeps only its first point.
        if iterations < usize::MAX || convergence.is_empty() {
            convergence.push(point);
        }
        if stop.requested() {
            return outcome(StopReason::Cancelled, cost, vec![point]);
        }
    }
    outcome(StopReason::Iterations, cost, convergence)
}

pub(crate) fn point(iteration: usize, cost: f64) -> ConvergencePoint {
    ConvergencePoint {
        iteration,
        evaluations: 20 * (iteration as u64 + 1),
        elapsed_ms: 0.0,
        best_cost: Some(cost),
        best_violation: 0.0,
        mean_cost: cost + 1.0,
        feasible_fraction: 1.0,
    }
}

pub(crate) fn incumbent(iteration: usize, cost: f64) -> Incumbent {
    Incumbent {
        frame: Frame::Local,
        iteration,
        elapsed_ms: 0.0,
        cost,
        feasible: true,
        waypoints: vec![Point3::origin(), Point3::new(cost, 0.1, 50.0)],
    }
}

pub(crate) fn outcome(
    stop_reason: StopReason,
    cost: f64,
    convergence: Vec<ConvergencePoint>,
) -> Outcome {
    Outcome {
        frame: Frame::Local,
        feasible: true,
        stop_reason,
        cost: CostFigures {
            total: cost,
            fuel: cost,
            threat: 0.0,
            altitude: 0.0,
        },
        cost_integral: None,
        bound: Bound {
            lower: 0.0,
            gap: None,
        },
        waypoints: vec![Point3::origin(), Point3::new(cost, 0.1, 50.0)],
        legs: vec![Leg {
            length: cost,
            turn_deg: 0.0,
            climb_deg: 1.0,
        }],
        path: None,
        waypoint_checks: Measures {
            clearance: Vec::new(),
            min_agl: None,
            max_agl: None,
            max_turn_deg: 0.0,
            max_climb_deg: 1.0,
            min_leg: cost,
        },
        path_checks: None,
        violations: Vec::new(),
        evaluations: convergence.last().map_or(0, |last| last.evaluations),
        convergence,
    }
}
