//! Plans: accept, list, show, cancel, delete.

mod list;
mod submit;

use std::time::Duration;

use axum::extract::State;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use tokio::time::Instant;

pub(super) use list::{MAX_PAGE, list};
pub(super) use submit::submit;

use super::auth::{Scope, Unauthorized};
use super::caller::Caller;
use super::entity_tags::EntityTags;
use super::params::{Id, NoParams};
use super::phase::stopping;
use super::precondition::Precondition;
use super::prefer::{PREFERENCE_APPLIED, Wait};
use super::problem::Problem;
use super::status::{StatusDocument, etag};
use super::{AppState, retry};
use crate::job::{Plan, PlanId, Status};

/// Pause between checks of a waiting plan's place in the queue.
const PLACE_LOOK: Duration = Duration::from_secs(1);

/// `GET /plans/{id}`.
pub(super) async fn show(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    _: NoParams,
    wait: Option<Wait>,
    known: Option<EntityTags>,
) -> Result<Response, Problem> {
    let mut plan = caller.plan(&*state.store, id).await?;
    if let Some(wait) = wait {
        // Few requests wait, so the future is boxed to keep the others' small.
        plan = Box::pin(changed(&state, &caller, id, wait, known.as_ref())).await?;
    }

    let tag = etag(&plan);
    let retry_after = retry_after(&state, &plan).await?;
    let mut response = if known.is_some_and(|known| known.contain(&tag)) {
        StatusCode::NOT_MODIFIED.into_response()
    } else {
        StatusDocument::from(plan).into_response()
    };
    let headers = response.headers_mut();
    headers.insert(header::ETAG, tag);
    if let Some(seconds) = retry_after {
        headers.insert(header::RETRY_AFTER, seconds);
    }
    // It may be cached, but must be revalidated each time.
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if let Some(wait) = wait {
        headers.insert(PREFERENCE_APPLIED, wait.applied());
    }
    Ok(response)
}

/// The plan once it differs from the version that is `known`; where none is, or none can come, once it has ended.
async fn changed(
    state: &AppState,
    caller: &Caller,
    id: PlanId,
    wait: Wait,
    known: Option<&EntityTags>,
) -> Result<Plan, Problem> {
    let awaited = known.map_or(Awaited::End, Awaited::Change);
    tokio::select! {
        changed = wait_for(state, id, wait.duration(), awaited) => changed,
        () = state.access.withdrawn(caller.key, Scope::Read) => {
            Err(Problem::Unauthorized(Unauthorized::NoKey))
        }
    }
}

async fn retry_after(state: &AppState, plan: &Plan) -> Result<Option<HeaderValue>, Problem> {
    if plan.status.is_final() {
        return Ok(None);
    }
    let seconds = retry::for_end(plan, &state.store.stats().await?, state.capacity);
    Ok(Some(HeaderValue::from(seconds)))
}

/// `POST /plans/{id}/cancel`.
pub(super) async fn cancel(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    _: NoParams,
    precondition: Precondition,
) -> Result<Response, Problem> {
    let plan = caller.plan(&*state.store, id).await?;
    let now_ms = state.clock.now_ms();
    let cancel = |revision| state.store.request_cancel_if(id, revision, now_ms);
    let plan = precondition.heeded(plan, cancel).await?;
    let status = if plan.status.is_final() {
        state.instruments.origins.forget(id);
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
    _: NoParams,
    precondition: Precondition,
) -> Result<StatusCode, Problem> {
    let now_ms = state.clock.now_ms();
    let delete = |revision| state.store.delete_if(id, revision, now_ms);
    let deleted = match caller.plan(&*state.store, id).await {
        Ok(plan) => precondition.heeded(plan, delete).await,
        Err(problem) => Err(problem),
    };
    match deleted {
        Ok(()) => state.instruments.origins.forget(id),
        // Whoever repeats the request got no answer the first time.
        Err(Problem::Gone(_)) => precondition.check_removed(id)?,
        Err(problem) => return Err(problem),
    }
    Ok(StatusCode::NO_CONTENT)
}

/// What a caller waits for.
#[derive(Clone, Copy)]
enum Awaited<'k> {
    /// The plan's end.
    End,
    /// That, or another version of it than these.
    Change(&'k EntityTags),
}

impl Awaited<'_> {
    fn has_come(self, plan: &Plan) -> bool {
        let is_news = match self {
            Self::End => false,
            Self::Change(known) => !known.contain(&etag(plan)),
        };
        is_news || plan.status.is_final()
    }
}

/// The plan once what is awaited has come, or its current record when time runs out or the service stops.
async fn wait_for(
    state: &AppState,
    id: PlanId,
    patience: Duration,
    awaited: Awaited<'_>,
) -> Result<Plan, Problem> {
    let deadline = Instant::now() + patience;
    // Subscribed before the first look, so that no change is missed.
    let mut changes = state.store.changes(id);
    let mut phase = state.phase.clone();
    loop {
        changes.mark_unchanged();
        let plan = state.store.get(id).await?;
        if awaited.has_come(&plan) {
            return Ok(plan);
        }
        // Its place changes with other plans, whose changes are not signalled here.
        let moves = plan.status == Status::Queued && matches!(awaited, Awaited::Change(_));
        tokio::select! {
            changed = changes.changed() => if changed.is_err() { return Ok(plan) },
            () = tokio::time::sleep_until(deadline) => return Ok(state.store.get(id).await?),
            () = tokio::time::sleep(PLACE_LOOK), if moves => {}
            () = stopping(&mut phase) => return Ok(plan),
        }
    }
}
