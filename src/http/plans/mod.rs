//! Plans: accept, list, show, cancel, delete.

mod list;
mod submit;

use std::time::Duration;

use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use tokio::time::Instant;

pub(super) use list::{MAX_PAGE, list};
pub(super) use submit::submit;

use super::caller::Caller;
use super::known_tags::KnownTags;
use super::params::{Id, Params};
use super::phase::stopping;
use super::prefer::{PREFERENCE_APPLIED, Wait};
use super::problem::Problem;
use super::status::{StatusDocument, etag};
use super::{AppState, retry};
use crate::job::{Plan, PlanId, Status};

/// Between two looks at a waiting plan's place in the queue.
const PLACE_LOOK: Duration = Duration::from_secs(1);

/// `GET /plans/{id}`.
pub(super) async fn show(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    Params::read(&uri, &[])?;
    let mut plan = caller.plan(&*state.store, id).await?;
    let wait = Wait::of(&headers);
    let known = KnownTags::of(&headers);
    if let Some(wait) = wait {
        // Who knows a version waits for another one; who knows none waits for the end.
        plan = wait_for(&state, id, wait.duration(), |plan| match &known {
            Some(known) => !known.contain(&etag(plan)),
            None => plan.status.is_final(),
        })
        .await?;
    }

    let tag = etag(&plan);
    let mut response = if known.is_some_and(|known| known.contain(&tag)) {
        StatusCode::NOT_MODIFIED.into_response()
    } else {
        shown(&state, plan).await?
    };
    let headers = response.headers_mut();
    headers.insert(header::ETAG, tag);
    // It may be kept, but must be asked for again each time.
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if let Some(wait) = wait {
        headers.insert(PREFERENCE_APPLIED, wait.applied());
    }
    Ok(response)
}

async fn shown(state: &AppState, plan: Plan) -> Result<Response, Problem> {
    if plan.status.is_final() {
        return Ok(StatusDocument::from(plan).into_response());
    }
    let seconds = retry::for_end(&plan, &state.store.stats().await?, state.capacity);
    let retry_after = [(header::RETRY_AFTER, HeaderValue::from(seconds))];
    Ok((retry_after, StatusDocument::from(plan)).into_response())
}

/// `POST /plans/{id}/cancel`.
pub(super) async fn cancel(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    uri: Uri,
) -> Result<Response, Problem> {
    Params::read(&uri, &[])?;
    caller.plan(&*state.store, id).await?;
    let plan = state.store.request_cancel(id, state.clock.now_ms()).await?;
    let status = if plan.status.is_final() {
        StatusCode::OK
    } else {
        StatusCode::ACCEPTED
    };
    Ok((status, StatusDocument::from(plan)).into_response())
}

/// `DELETE /plans/{id}`.
pub(super) async fn delete(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    uri: Uri,
) -> Result<StatusCode, Problem> {
    Params::read(&uri, &[])?;
    match caller.plan(&*state.store, id).await {
        Ok(_) => state.store.delete(id, state.clock.now_ms()).await?,
        // Whoever asks again had no answer the first time.
        Err(Problem::Gone(_)) => {}
        Err(problem) => return Err(problem),
    }
    Ok(StatusCode::NO_CONTENT)
}

/// The plan as soon as it is `enough`, or as it is when the time or the service comes to its end.
async fn wait_for(
    state: &AppState,
    id: PlanId,
    patience: Duration,
    enough: impl Fn(&Plan) -> bool,
) -> Result<Plan, Problem> {
    let deadline = Instant::now() + patience;
    // Subscribed before the first look, so that no change is missed.
    let mut changes = state.store.changes(id);
    let mut phase = state.phase.clone();
    loop {
        changes.mark_unchanged();
        let plan = state.store.get(id).await?;
        if enough(&plan) {
            return Ok(plan);
        }
        // Its place changes with other plans, of which nothing is heard here.
        let moves = plan.status == Status::Queued;
        tokio::select! {
            changed = changes.changed() => if changed.is_err() { return Ok(plan) },
            () = tokio::time::sleep_until(deadline) => return Ok(state.store.get(id).await?),
            () = tokio::time::sleep(PLACE_LOOK), if moves => {}
            () = stopping(&mut phase) => return Ok(plan),
        }
    }
}
