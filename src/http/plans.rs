//! Plans: accept, list, show, cancel, delete.

use std::time::Duration;

use axum::Json;
use axum::body::Body;
use axum::extract::{Extension, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD as BASE64;
use bytes::Bytes;
use jiff::Timestamp;
use serde::Serialize;
use tokio::time::Instant;
use uuid::Uuid;

use super::caller::Caller;
use super::idempotency::IDEMPOTENCY_REPLAYED;
use super::params::{self, Id, Params};
use super::phase::stopping;
use super::prefer::{PREFERENCE_APPLIED, Wait};
use super::problem::Problem;
use super::status::{StatusDocument, etag, location};
use super::{AppState, Phase, body, off_thread, retry, warm_start, webhook};
use crate::job::{self, Idempotency, Plan, PlanId, Status, Submission};
use crate::scenario::json;
use crate::store::{ListQuery, StoreError, Submitted};
use crate::telemetry::{Origin, spans};
use crate::terrain::Terrain;

/// Plans on a page of the list, unless asked otherwise.
const DEFAULT_PAGE: usize = 50;
/// Plans on a page of the list at most.
pub(super) const MAX_PAGE: usize = 1000;

/// `POST /plans`.
pub(super) async fn submit(
    State(state): State<AppState>,
    caller: Caller,
    uri: Uri,
    Extension(origin): Extension<Origin>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let params = Params::read(&uri, &["validate_only"])?;
    let validate_only = params
        .parse("validate_only", "true or false")?
        .unwrap_or(false);
    if !validate_only {
        refuse_when_draining(&state).await?;
    }
    let webhook = webhook::asked(state.webhooks.as_ref(), &headers)?;
    let once = state.in_flight.begin(&caller, &headers)?;
    let bytes = body::read_json(&state, &headers, body).await?;
    let idempotency = once.as_ref().map(|once| once.with(&bytes));
    let Submitted { plan, replayed } = match accept(&state, &caller, bytes).await {
        Ok(submission) if validate_only => return Ok(valid(&submission)),
        Ok(submission) => {
            let submission = Submission {
                webhook,
                idempotency,
                ..submission
            };
            hand_in(&state, origin, submission).await?
        }
        // What it names may have gone since it was accepted.
        Err(refusal) if !validate_only => repeated(&state, &caller, idempotency)
            .await?
            .ok_or(refusal)?,
        Err(refusal) => return Err(refusal),
    };
    drop(once);

    let address = HeaderValue::from_str(&location(plan.id)).expect("an id is visible ASCII");
    let mut answer = answer(&state, &headers, plan, address).await?;
    if replayed {
        answer
            .headers_mut()
            .insert(IDEMPOTENCY_REPLAYED, HeaderValue::from_static("true"));
    }
    Ok(answer)
}

/// The plan of a request that came before.
async fn repeated(
    state: &AppState,
    caller: &Caller,
    idempotency: Option<Idempotency>,
) -> Result<Option<Submitted>, Problem> {
    let Some(idempotency) = idempotency else {
        return Ok(None);
    };
    let owner = caller.owner.as_ref();
    let plan = state.store.repeated(owner, &idempotency).await?;
    Ok(plan.map(|plan| {
        spans::name_plan(plan.id);
        tracing::info!("accepted before");
        Submitted {
            plan,
            replayed: true,
        }
    }))
}

/// Make a plan durable, or say when there may be room for it.
async fn hand_in(
    state: &AppState,
    origin: Origin,
    submission: Submission,
) -> Result<Submitted, Problem> {
    let id = submission.id;
    // Before it can be claimed.
    state.instruments.origins.remember(id, origin);
    let submitted = state.store.submit(submission).await;
    if !matches!(&submitted, Ok(submitted) if !submitted.replayed) {
        state.instruments.origins.forget(id);
    }
    match submitted {
        Ok(submitted) => {
            spans::name_plan(submitted.plan.id);
            if submitted.replayed {
                tracing::info!("accepted before");
            } else {
                state.instruments.metrics.accepted();
                tracing::info!("accepted");
            }
            Ok(submitted)
        }
        Err(StoreError::QueueFull { queued }) => {
            let retry_after_s = retry::for_room(&state.store.stats().await?, state.capacity);
            Err(Problem::QueueFull {
                queued,
                retry_after_s,
            })
        }
        Err(StoreError::QuotaReached { active }) => {
            let retry_after_s = retry::for_room(&state.store.stats().await?, state.capacity);
            Err(Problem::QuotaReached {
                active,
                retry_after_s,
            })
        }
        Err(error) => Err(error.into()),
    }
}

/// What an accepted plan is answered with, as soon as the caller wants it.
async fn answer(
    state: &AppState,
    headers: &HeaderMap,
    plan: Plan,
    address: HeaderValue,
) -> Result<Response, Problem> {
    let Some(wait) = Wait::of(headers) else {
        return Ok(accepted(plan, address));
    };
    let plan = wait_for(state, plan.id, wait.duration(), |plan| {
        plan.status.is_final()
    })
    .await?;
    if !plan.status.is_final() {
        return Ok(accepted(plan, address));
    }
    let ended = [
        (header::LOCATION, address),
        (PREFERENCE_APPLIED, wait.applied()),
    ];
    Ok((ended, StatusDocument::from(plan)).into_response())
}

fn accepted(plan: Plan, address: HeaderValue) -> Response {
    let document = StatusDocument::from(plan);
    (
        StatusCode::ACCEPTED,
        [(header::LOCATION, address)],
        document,
    )
        .into_response()
}

async fn refuse_when_draining(state: &AppState) -> Result<(), Problem> {
    if *state.phase.borrow() == Phase::Serving {
        return Ok(());
    }
    let retry_after_s = retry::for_room(&state.store.stats().await?, state.capacity);
    Err(Problem::Draining { retry_after_s })
}

/// Length of a document, bytes, that is read in less time than it takes to hand it to another thread.
const SHORT: usize = 4_096;

/// What stands for the dataset of a scenario.
fn dataset(terrain: &Terrain) -> Option<String> {
    match terrain {
        Terrain::Dem(dem) => Some(dem.sha256().to_owned()),
        _ => None,
    }
}

/// Whether reading a document may read files: a name can be hidden in escapes.
fn may_name_a_dataset(document: &[u8]) -> bool {
    let word = b"dataset";
    document.contains(&b'\\') || document.windows(word.len()).any(|part| part == word)
}

/// Read a document into a submission, off the threads that answer unless it is short.
async fn accept(state: &AppState, caller: &Caller, document: Bytes) -> Result<Submission, Problem> {
    let rules = state.rules.clone();
    let short = document.len() <= SHORT;
    let reads_files = may_name_a_dataset(&document);
    let read = move || json::read(&document, &rules, job::draw_seed());
    let mut scenario = if reads_files {
        state.terrains.read(read).await?
    } else if short {
        read()
    } else {
        off_thread::run(read).await?
    }?;
    warm_start::resolve(state, caller, &mut scenario).await?;
    let Caller { owner, quota, .. } = caller.clone();
    let submission = move || Submission {
        id: job::new_id(),
        scenario: json::write(&scenario),
        work: scenario.planner.work(),
        name: scenario.name,
        algorithm: scenario.planner.algorithm,
        seed: scenario.planner.seed,
        iterations: scenario.planner.iterations as u64,
        created_ms: now_ms(),
        owner,
        quota,
        webhook: None,
        idempotency: None,
        dataset: dataset(&scenario.terrain),
    };
    if short {
        Ok(submission())
    } else {
        off_thread::run(submission).await
    }
}

/// The answer to `?validate_only=true`. The accepted document is put in as the text it is.
fn valid(submission: &Submission) -> Response {
    let document = format!(r#"{{"valid":true,"scenario":{}}}"#, submission.scenario);
    ([(header::CONTENT_TYPE, "application/json")], document).into_response()
}

/// A page of the list.
#[derive(Serialize)]
struct Page {
    plans: Vec<StatusDocument>,
    links: PageLinks,
}

#[derive(Serialize)]
struct PageLinks {
    next: Option<String>,
}

/// `GET /plans`.
pub(super) async fn list(
    State(state): State<AppState>,
    caller: Caller,
    uri: Uri,
) -> Result<Response, Problem> {
    let params = Params::read(&uri, &["status", "limit", "cursor"])?;
    let status = params.text("status").map(read_status).transpose()?;
    let limit = params
        .parse("limit", "a number from 1 to 1000")?
        .unwrap_or(DEFAULT_PAGE);
    if !(1..=MAX_PAGE).contains(&limit) {
        return Err(params::refused(
            "limit",
            &limit.to_string(),
            "from 1 to 1000",
        ));
    }
    let before = params.text("cursor").map(read_cursor).transpose()?;

    // One more than asked for tells whether there is a next page.
    let query = ListQuery {
        status,
        owner: caller.owner.filter(|_| !caller.sees_all),
        before,
        limit: limit + 1,
    };
    let mut plans = state.store.list(query).await?;
    let more = plans.len() > limit;
    plans.truncate(limit);
    let next = plans
        .last()
        .filter(|_| more)
        .map(|last| next_page(status, limit, last.id));

    let mut response = Json(Page {
        plans: plans.into_iter().map(Into::into).collect(),
        links: PageLinks { next: next.clone() },
    })
    .into_response();
    if let Some(next) = next {
        let link = HeaderValue::from_str(&format!("<{next}>; rel=\"next\""))
            .expect("a link is visible ASCII");
        response.headers_mut().insert(header::LINK, link);
    }
    Ok(response)
}

fn read_status(name: &str) -> Result<Status, Problem> {
    let allowed = || format!("one of {}", Status::ALL.map(Status::name).join(", "));
    Status::from_name(name).ok_or_else(|| params::refused("status", name, &allowed()))
}

/// A cursor is the last id of the page before it; callers are not to know.
fn read_cursor(text: &str) -> Result<PlanId, Problem> {
    let bytes = BASE64
        .decode(text)
        .ok()
        .and_then(|bytes| bytes.try_into().ok());
    bytes
        .map(Uuid::from_bytes)
        .ok_or_else(|| params::refused("cursor", text, "one out of a next link"))
}

fn next_page(status: Option<Status>, limit: usize, last: PlanId) -> String {
    let cursor = BASE64.encode(last.as_bytes());
    let status = status
        .map(|status| format!("status={}&", status.name()))
        .unwrap_or_default();
    format!("/plans?{status}limit={limit}&cursor={cursor}")
}

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

/// The entity tags of `If-None-Match`.
pub(super) struct KnownTags(Vec<String>);

impl KnownTags {
    pub(super) fn of(headers: &HeaderMap) -> Option<Self> {
        let values = headers.get_all(header::IF_NONE_MATCH).iter();
        let tags: Vec<String> = values
            .filter_map(|value| value.to_str().ok())
            .flat_map(|value| value.split(','))
            .map(|tag| tag.trim().to_owned())
            .collect();
        (!tags.is_empty()).then_some(Self(tags))
    }

    /// Weak comparison, RFC 9110 section 8.8.3.2.
    pub(super) fn contain(&self, tag: &HeaderValue) -> bool {
        let opaque = |tag: &str| tag.strip_prefix("W/").unwrap_or(tag).to_owned();
        let tag = opaque(tag.to_str().unwrap_or_default());
        self.0
            .iter()
            .any(|known| known == "*" || opaque(known) == tag)
    }
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
    let plan = state.store.request_cancel(id, now_ms()).await?;
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
        Ok(_) => state.store.delete(id, now_ms()).await?,
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
        tokio::select! {
            changed = changes.changed() => if changed.is_err() { return Ok(plan) },
            () = tokio::time::sleep_until(deadline) => return Ok(state.store.get(id).await?),
            () = stopping(&mut phase) => return Ok(plan),
        }
    }
}

/// Milliseconds since 1970.
pub(super) fn now_ms() -> i64 {
    Timestamp::now().as_millisecond()
}
