//! The status document: a plan's record as callers see it.

use axum::http::HeaderValue;
use jiff::Timestamp;
use serde::Serialize;

use super::problem::FailureDocument;
use crate::job::{Plan, PlanId};

/// Of `GET /plans/{id}` and of `status` events.
#[derive(Debug, Serialize)]
pub(super) struct StatusDocument {
    id: PlanId,
    name: Option<String>,
    status: &'static str,
    stop_reason: Option<String>,
    feasible: Option<bool>,
    best_cost: Option<f64>,
    progress: f64,
    iteration: u64,
    iterations: u64,
    evaluations: u64,
    queue_position: Option<u64>,
    cancel_requested: bool,
    algorithm: String,
    seed: u64,
    created_at: String,
    started_at: Option<String>,
    finished_at: Option<String>,
    expires_at: Option<String>,
    error: Option<FailureDocument>,
    links: Links,
}

#[derive(Debug, Serialize)]
struct Links {
    #[serde(rename = "self")]
    this: String,
    result: String,
    events: String,
    scenario: String,
    cancel: String,
}

impl From<Plan> for StatusDocument {
    fn from(plan: Plan) -> Self {
        Self {
            id: plan.id,
            name: plan.name,
            status: plan.status.name(),
            stop_reason: plan.stop_reason,
            feasible: plan.feasible,
            best_cost: plan.best_cost,
            progress: plan.progress,
            iteration: plan.iteration,
            iterations: plan.iterations,
            evaluations: plan.evaluations,
            queue_position: plan.queue_position,
            cancel_requested: plan.cancel_requested,
            algorithm: plan.algorithm,
            seed: plan.seed,
            created_at: rfc3339(plan.created_ms),
            started_at: plan.started_ms.map(rfc3339),
            finished_at: plan.finished_ms.map(rfc3339),
            expires_at: plan.expires_ms.map(rfc3339),
            error: plan.error.map(Into::into),
            links: Links::of(plan.id),
        }
    }
}

impl Links {
    fn of(id: PlanId) -> Self {
        let this = location(id);
        Self {
            result: format!("{this}/result"),
            events: format!("{this}/events"),
            scenario: format!("{this}/scenario"),
            cancel: format!("{this}/cancel"),
            this,
        }
    }
}

/// A plan's address.
pub(super) fn location(id: PlanId) -> String {
    format!("/plans/{id}")
}

/// Changes whenever the status document does. Weak, for the bytes are written anew each time; the
/// place in the queue moves without a change of the record.
pub(super) fn etag(plan: &Plan) -> HeaderValue {
    let position = plan.queue_position.unwrap_or(0);
    HeaderValue::from_str(&format!("W/\"{}-{position}\"", plan.revision))
        .expect("digits are visible ASCII")
}

/// UTC with milliseconds.
fn rfc3339(ms: i64) -> String {
    let time = Timestamp::from_millisecond(ms).unwrap_or(Timestamp::UNIX_EPOCH);
    format!("{time:.3}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_utc_with_milliseconds() {
        assert_eq!(rfc3339(1_700_000_000_123), "2023-11-14T22:13:20.123Z");
        assert_eq!(rfc3339(0), "1970-01-01T00:00:00.000Z");
    }
}
