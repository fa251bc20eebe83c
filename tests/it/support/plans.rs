//! Plans to submit, and what happens to them.

use noctule::export::document::Convergence;
use noctule::job::{Event, Failure, Plan, PlanId, Status, Submission};
use noctule::store::{Ending, ListQuery, Store, StoreError};

use super::patience::in_time;

/// Lists all plans of a test.
pub(crate) const ALL: ListQuery = ListQuery {
    status: None,
    owner: None,
    before: None,
    limit: 1_000,
};

/// A submission of ten iterations.
pub(crate) fn submission() -> Submission {
    let id = PlanId::now_v7();
    Submission {
        id,
        name: Some("Überflug \"7\"".to_owned()),
        algorithm: "tms-sba".to_owned(),
        seed: (1 << 53) - 1,
        iterations: 10,
        work: 2_000,
        scenario: format!("{{\"name\":\"{id}\"}}"),
        created_ms: 1_000,
        owner: None,
        quota: None,
        webhook: None,
        idempotency: None,
        dataset: None,
    }
}

pub(crate) fn point(iteration: usize, best_cost: Option<f64>) -> Event {
    Event::Convergence(Convergence {
        iteration,
        evaluations: 20 * (iteration as u64 + 1),
        elapsed_ms: 0.1,
        best_cost,
        best_violation: if best_cost.is_some() { 0.0 } else { 3.5 },
        mean_cost: 512.25,
        feasible_fraction: 0.5,
    })
}

/// Its result document would be changed by a store that parsed and rewrote it.
pub(crate) fn ending(status: Status) -> Ending {
    Ending::Result {
        cancelled: status == Status::Cancelled,
        stop_reason: "iterations".to_owned(),
        feasible: true,
        best_cost: Some(471.2),
        evaluations: 220,
        iteration: 10,
        document: "{\"b\":0.1000000000000000055,\r\n \"a\":\"\u{1F987}\\u0000\"}\n\n".to_owned(),
    }
}

pub(crate) fn failure() -> Ending {
    Ending::Failed(Failure {
        kind: "planner-panic".to_owned(),
        detail: "index out of bounds".to_owned(),
    })
}

/// All events of a plan.
pub(crate) async fn history(store: &dyn Store, id: PlanId) -> Vec<Event> {
    let page = store
        .events(id, 0, usize::MAX)
        .await
        .expect("the plan is there");
    page.events
        .into_iter()
        .map(|numbered| numbered.event)
        .collect()
}

/// The same, as soon as the last of them has come: a node that is behind may know sooner that a plan has ended.
pub(crate) async fn history_to_its_end(store: &dyn Store, id: PlanId) -> Vec<Event> {
    let mut changes = store.changes(id);
    let whole = async {
        loop {
            let told = history(store, id).await;
            if matches!(told.last(), Some(Event::End(_))) {
                return told;
            }
            changes.changed().await.expect("the store is open");
        }
    };
    in_time(whole).await
}

/// The statuses that a plan has gone through, according to its events.
pub(crate) fn statuses(events: &[Event]) -> Vec<Status> {
    let statuses = events.iter().filter_map(|event| match event {
        Event::Status(plan) => Some(plan.status),
        _ => None,
    });
    statuses.collect()
}

/// Waits until the record is as `wanted`.
pub(crate) async fn until(store: &dyn Store, id: PlanId, wanted: impl Fn(&Plan) -> bool) -> Plan {
    let mut changes = store.changes(id);
    let plan = async {
        loop {
            let plan = store.get(id).await.expect("the plan is there");
            if wanted(&plan) {
                return plan;
            }
            changes.changed().await.expect("the store is open");
        }
    };
    in_time(plan).await
}

/// The kind of error, without its details.
pub(crate) fn kind<T>(result: Result<T, StoreError>) -> Result<(), &'static str> {
    result.map(drop).map_err(|error| match error {
        StoreError::NotFound(_) => "not found",
        StoreError::Gone(_) => "gone",
        StoreError::Changed(_) => "changed",
        StoreError::QueueFull { .. } => "queue full",
        StoreError::QuotaReached { .. } => "quota reached",
        StoreError::KeyReused => "key reused",
        StoreError::KeyInFlight => "key in flight",
        StoreError::LeaseLost(_) => "lease lost",
        StoreError::ScenarioLost(_) => "scenario lost",
        StoreError::InUse(_) => "in use",
        StoreError::Unavailable { .. } => "unavailable",
    })
}
