//! Playing the worker: runs whose every step the test controls.

use noctule::export::document::{
    Bound, Checks, Clearance, Convergence, Cost, Incumbent, Leg, MeasuresDocument, Position,
    ResultDocument, Timing,
};
use noctule::job::{Event, FailureKind, PlanId, Status};
use noctule::store::{Ending, Lease, Store};

/// A convergence point at the given time of the run.
pub(crate) fn convergence(iteration: usize, elapsed_ms: f64) -> Event {
    Event::Convergence(curve(iteration, elapsed_ms))
}

/// A better route at the given time of the run.
pub(crate) fn incumbent(iteration: usize, elapsed_ms: f64) -> Event {
    Event::Incumbent(Incumbent {
        iteration,
        elapsed_ms,
        cost: 600.0 - iteration as f64,
        feasible: true,
        waypoints: route(),
    })
}

/// Claims the only queued plan, appends `events`, and ends it with a result.
pub(crate) async fn complete(store: &dyn Store, events: Vec<Event>) -> Lease {
    let lease = store.claim().await.expect("a queued plan");
    store.append(&lease, events).await.expect("the lease holds");
    finish(store, &lease, Status::Succeeded).await;
    lease
}

/// Ends a run with a result.
pub(crate) async fn finish(store: &dyn Store, lease: &Lease, status: Status) {
    let stop_reason = match status {
        Status::Cancelled => "cancelled",
        _ => "iterations",
    };
    let document = result(lease.plan.id, stop_reason).to_json();
    finish_with(store, lease, (status, stop_reason), document).await;
}

/// Ends a run with this result.
pub(crate) async fn finish_with(
    store: &dyn Store,
    lease: &Lease,
    (status, stop_reason): (Status, &str),
    document: String,
) {
    let ending = Ending::Result {
        cancelled: status == Status::Cancelled,
        stop_reason: stop_reason.to_owned(),
        feasible: true,
        best_cost: Some(580.0),
        evaluations: 420,
        iteration: 20,
        document,
    };
    store
        .finish(lease, ending.at(lease.plan.created_ms + 50))
        .await
        .expect("the lease holds");
}

/// Ends a run without a result.
pub(crate) async fn fail(store: &dyn Store, lease: &Lease) {
    fail_for(store, lease, FailureKind::PlannerPanic).await;
}

/// Ends a run without a result, for the given reason.
pub(crate) async fn fail_for(store: &dyn Store, lease: &Lease, kind: FailureKind) {
    let failure = kind.because("the planner broke");
    let ended_ms = lease.plan.created_ms + 50;
    store
        .finish(lease, Ending::Failed(failure).at(ended_ms))
        .await
        .expect("the lease holds");
}

/// A result as the planner would write it.
pub(crate) fn result(plan: PlanId, stop_reason: &str) -> ResultDocument {
    let leg = Leg {
        length: 300.0,
        turn_deg: 0.0,
        climb_deg: 14.0,
    };
    let measures = MeasuresDocument {
        clearance: vec![Clearance {
            threat: 0,
            name: Some("radar 1".to_owned()),
            distance: Some(12.5),
        }],
        min_agl: Some(20.0),
        max_agl: Some(150.0),
        max_turn_deg: 12.0,
        max_climb_deg: 14.0,
        min_leg: 300.0,
    };
    ResultDocument {
        frame: None,
        plan_id: Some(plan),
        algorithm: "tms-sba".to_owned(),
        seed: 7,
        engine_version: "0.1.0".to_owned(),
        scenario_sha256: "0".repeat(64),
        feasible: true,
        stop_reason: Some(stop_reason.to_owned()),
        is_final: None,
        cost: Cost {
            total: 580.0,
            fuel: 500.0,
            threat: 60.0,
            altitude: 20.0,
        },
        cost_integral: None,
        bound: Bound {
            lower: 470.0,
            gap: Some(0.234),
        },
        waypoints: route(),
        legs: vec![leg; 2],
        path: None,
        checks: Checks {
            waypoints: measures,
            path: None,
            violations: Vec::new(),
        },
        convergence: vec![curve(0, 0.1), curve(20, 4.0)],
        timing: Timing {
            queued_ms: 0.4,
            run_ms: 5.0,
        },
        evaluations: 420,
    }
}

fn curve(iteration: usize, elapsed_ms: f64) -> Convergence {
    Convergence {
        iteration,
        evaluations: 20 * (iteration as u64 + 1),
        elapsed_ms,
        best_cost: Some(600.0 - iteration as f64),
        best_violation: 0.0,
        mean_cost: 900.0,
        feasible_fraction: 0.5,
    }
}

fn route() -> Vec<Position> {
    [
        (200.0, 100.0, 0.0),
        (500.0, 300.0, 80.0),
        (800.0, 800.0, 150.0),
    ]
    .map(|(x, y, z)| Position::Local { x, y, z })
    .to_vec()
}
