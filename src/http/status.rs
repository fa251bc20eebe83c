//! The status document: a plan's record as callers see it.

use axum::body::Body;
use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde::{Serialize, Serializer};

use super::problem::FailureDocument;
use super::time::Time;
use crate::job::{Plan, PlanId};

/// The body of `GET /plans/{id}` and the data of `status` events.
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
    created_at: Time,
    started_at: Option<Time>,
    finished_at: Option<Time>,
    expires_at: Option<Time>,
    error: Option<FailureDocument>,
    links: Links,
}

#[derive(Debug, Serialize)]
struct Links {
    #[serde(rename = "self")]
    this: Link,
    result: Link,
    events: Link,
    scenario: Link,
    cancel: Link,
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
            progress: if plan.status.is_final() {
                1.0
            } else {
                plan.progress
            },
            iteration: plan.iteration,
            iterations: plan.iterations,
            evaluations: plan.evaluations,
            queue_position: plan.queue_position,
            cancel_requested: plan.cancel_requested,
            algorithm: plan.algorithm,
            seed: plan.seed,
            created_at: Time(plan.created_ms),
            started_at: plan.started_ms.map(Time),
            finished_at: plan.finished_ms.map(Time),
            expires_at: plan.expires_ms.map(Time),
            error: plan.error.map(Into::into),
            links: Links::of(plan.id),
        }
    }
}

/// Most documents fit in this many bytes.
const ROOM: usize = 1_024;

/// Maximum number of headers of an answer with one, most of which come from the layers around the handlers.
const N_HEADERS: usize = 12;

impl IntoResponse for StatusDocument {
    fn into_response(self) -> Response {
        let mut text = Vec::with_capacity(ROOM);
        serde_json::to_writer(&mut text, &self).expect("its keys are texts");
        let mut response = Response::new(Body::from(text));
        let headers = response.headers_mut();
        headers.reserve(N_HEADERS);
        let media_type = HeaderValue::from_static("application/json");
        headers.insert(header::CONTENT_TYPE, media_type);
        response
    }
}

impl Links {
    fn of(id: PlanId) -> Self {
        let link = |to| Link { id, to };
        Self {
            this: link(""),
            result: link("/result"),
            events: link("/events"),
            scenario: link("/scenario"),
            cancel: link("/cancel"),
        }
    }
}

/// The address of a part of a plan.
#[derive(Debug)]
struct Link {
    id: PlanId,
    to: &'static str,
}

impl Serialize for Link {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("/plans/{}{}", self.id, self.to))
    }
}

/// A plan's address.
pub(super) fn location(id: PlanId) -> String {
    format!("/plans/{id}")
}

/// Changes whenever the status document does. Weak, because the bytes are written anew each time; the place in the
/// queue changes without a change of the record.
pub(super) fn etag(plan: &Plan) -> HeaderValue {
    let position = plan.queue_position.unwrap_or(0);
    HeaderValue::from_str(&format!("W/\"{}-{position}\"", plan.revision))
        .expect("digits are visible ASCII")
}
