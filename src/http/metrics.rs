//! `GET /metrics`: what Prometheus reads.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};

use super::AppState;
use super::params::NoParams;
use super::problem::Problem;
use crate::telemetry::metrics::{MEDIA_TYPE, Queue};

/// Answers even when the store does not: that is when the operator needs it.
pub(super) async fn show(State(state): State<AppState>, _: NoParams) -> Result<Response, Problem> {
    let stats = state.store.stats().await;
    let stats = stats
        .inspect_err(|error| tracing::warn!(%error, "the queue could not be counted"))
        .ok();
    let now_ms = state.clock.now_ms();
    let queue = Queue {
        queued: stats.map(|stats| stats.queued),
        running: stats.map(|stats| stats.running),
        oldest_queued_ms: stats
            .and_then(|stats| stats.oldest_queued_ms)
            .map(|since_ms| now_ms - since_ms),
        limit: state.capacity.queue,
        workers: state.capacity.workers,
    };
    let terrains = state.terrains.tally().await;
    state
        .instruments
        .metrics
        .terrains(terrains.datasets, terrains.bytes, terrains.cached_bytes);
    let text = state.instruments.metrics.text(queue);
    Ok(([(header::CONTENT_TYPE, MEDIA_TYPE)], text).into_response())
}
