//! `POST /plans`: from a document to a plan on disk.

use std::future::ready;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures_util::future::Either;

use super::{Awaited, wait_for};
use crate::digest::sha256_hex;
use crate::http::auth::Scope;
use crate::http::body::Announced;
use crate::http::caller::Caller;
use crate::http::idempotency::{IDEMPOTENCY_REPLAYED, Once};
use crate::http::named::{DATASET, PLAN, may_name};
use crate::http::params::Params;
use crate::http::prefer::{PREFERENCE_APPLIED, Wait};
use crate::http::problem::Problem;
use crate::http::status::{StatusDocument, location};
use crate::http::{AppState, Phase, off_thread, retry, warm_start, webhook};
use crate::job::{self, Idempotency, Plan, Submission};
use crate::scenario::{Scenario, json};
use crate::store::{StoreError, Submitted};
use crate::telemetry::{Origin, spans};

/// `POST /plans`. The head is read before the future begins, which then holds only what is left of the request.
pub(in crate::http) fn submit(
    State(state): State<AppState>,
    caller: Caller,
    request: Request,
) -> impl Future<Output = Result<Response, Problem>> {
    let (head, body) = request.into_parts();
    let asked = match Asked::of(&state, &caller, head) {
        Ok(asked) => asked,
        Err(refusal) => return Either::Left(ready(Err(refusal))),
    };
    Either::Right(async move {
        if asked.validate_only {
            return validated(&state, &caller, asked.announced, body).await;
        }
        let draining = refusal_when_draining(&state).await;
        // A repeated request is answered all the same: it asks for no other plan.
        if asked.once.is_none()
            && let Some(refusal) = draining
        {
            return Err(refusal);
        }
        let bytes = asked.announced.read(&caller, body).await?;
        let idempotency = match &asked.once {
            Some(once) => Some(once.with(checksum(&caller, &bytes).await?)),
            None => None,
        };
        let read = match draining {
            Some(refusal) => Err(refusal),
            None => accept(&state, &caller, bytes).await,
        };
        let Submitted { plan, replayed } = match read {
            Ok(submission) => {
                let submission = Submission {
                    webhook: asked.webhook,
                    idempotency,
                    ..submission
                };
                Box::pin(hand_in(&state, asked.origin, submission)).await?
            }
            Err(refusal) => Box::pin(repeated(&state, &caller, idempotency, refusal)).await?,
        };
        drop(asked.once);

        let address = HeaderValue::from_str(&location(plan.id)).expect("an id is visible ASCII");
        let mut answer = match asked.wait {
            Some(wait) => Box::pin(ended(&state, &caller, wait, plan, address)).await,
            None => accepted(plan, address),
        };
        if replayed {
            answer
                .headers_mut()
                .insert(IDEMPOTENCY_REPLAYED, HeaderValue::from_static("true"));
        }
        Ok(answer)
    })
}

/// `?validate_only`: what would be accepted, and nothing is.
async fn validated(
    state: &AppState,
    caller: &Caller,
    announced: Announced,
    body: Body,
) -> Result<Response, Problem> {
    let bytes = announced.read(caller, body).await?;
    Ok(valid(&accept(state, caller, bytes).await?))
}

/// What a request specifies apart from its document.
struct Asked {
    validate_only: bool,
    webhook: Option<String>,
    once: Option<Once>,
    wait: Option<Wait>,
    announced: Announced,
    /// `None` for a request that bypassed the layer that sets it.
    origin: Option<Origin>,
}

impl Asked {
    fn of(state: &AppState, caller: &Caller, mut head: Parts) -> Result<Self, Problem> {
        let params = Params::read(&head.uri, &["validate_only"])?;
        let validate_only = params.parse("validate_only", "true or false")?;
        Ok(Self {
            validate_only: validate_only.unwrap_or(false),
            webhook: webhook::asked(state.webhooks.as_ref(), &head.headers)?,
            once: state.in_flight.begin(caller, &head.headers)?,
            wait: Wait::of(&head.headers),
            announced: Announced::json(state, &head.headers)?,
            origin: head.extensions.remove(),
        })
    }
}

/// The plan of an earlier identical request, since what this one names may have gone meanwhile. `refusal` when there
/// was none.
async fn repeated(
    state: &AppState,
    caller: &Caller,
    idempotency: Option<Idempotency>,
    refusal: Problem,
) -> Result<Submitted, Problem> {
    let Some(idempotency) = idempotency else {
        return Err(refusal);
    };
    let owner = caller.owner.as_ref();
    let plan = state.store.repeated(owner, &idempotency).await?;
    let plan = plan.ok_or(refusal)?;
    spans::name_plan(plan.id);
    tracing::info!("accepted before");
    Ok(Submitted {
        plan,
        replayed: true,
    })
}

/// Make a plan durable, or say when there may be room for it.
fn hand_in(
    state: &AppState,
    origin: Option<Origin>,
    submission: Submission,
) -> impl Future<Output = Result<Submitted, Problem>> {
    let id = submission.id;
    if let Some(origin) = origin {
        // Must be set before the plan can be claimed.
        state.instruments.origins.remember(id, origin);
    }
    let submitting = state.store.submit(submission);
    async move {
        match submitting.await {
            Ok(submitted) => {
                spans::name_plan(submitted.plan.id);
                if submitted.replayed {
                    state.instruments.origins.forget(id);
                    tracing::info!("accepted before");
                } else {
                    state.instruments.metrics.accepted();
                    tracing::info!("accepted");
                }
                Ok(submitted)
            }
            Err(error) => {
                state.instruments.origins.forget(id);
                Err(Box::pin(refusal(state, error)).await)
            }
        }
    }
}

/// The problem for a plan that the store did not accept.
async fn refusal(state: &AppState, error: StoreError) -> Problem {
    match error {
        StoreError::QueueFull { queued } => {
            let full = |retry_after_s| Problem::QueueFull {
                queued,
                retry_after_s,
            };
            until_room(state, full).await
        }
        StoreError::QuotaReached { active, quota } => {
            let full = |retry_after_s| Problem::QuotaReached {
                active,
                quota,
                retry_after_s,
            };
            until_room(state, full).await
        }
        error => error.into(),
    }
}

/// The problem `full` with the seconds after which there may be room.
async fn until_room(state: &AppState, full: impl FnOnce(u64) -> Problem) -> Problem {
    match state.store.stats().await {
        Ok(stats) => full(retry::for_room(&stats, state.capacity)),
        Err(error) => error.into(),
    }
}

/// The plan's final record, or that it was accepted when the end does not come in time or cannot be read, or the key is
/// withdrawn.
async fn ended(
    state: &AppState,
    caller: &Caller,
    wait: Wait,
    plan: Plan,
    address: HeaderValue,
) -> Response {
    let waited = tokio::select! {
        waited = wait_for(state, plan.id, wait.duration(), Awaited::End) => waited.ok(),
        () = state.access.withdrawn(caller.key, Scope::Plan) => None,
    };
    // A plan on the disk was accepted, whatever the store reports afterwards.
    let plan = waited.unwrap_or(plan);
    if !plan.status.is_final() {
        return accepted(plan, address);
    }
    let ended = [
        (header::LOCATION, address),
        (PREFERENCE_APPLIED, wait.applied()),
    ];
    (ended, StatusDocument::from(plan)).into_response()
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

/// The refusal of new plans while the service is about to end.
async fn refusal_when_draining(state: &AppState) -> Option<Problem> {
    if *state.phase.borrow() == Phase::Serving {
        return None;
    }
    let stats = state.store.stats().await;
    let retry_after_s = retry::for_room_if_known(stats, state.capacity);
    Some(Problem::Draining { retry_after_s })
}

/// The checksum of a document, off the request threads if it is long.
async fn checksum(caller: &Caller, document: &Bytes) -> Result<String, Problem> {
    if document.len() <= SHORT {
        return Ok(sha256_hex(document));
    }
    let document = document.clone();
    Box::pin(off_thread::run(caller, move || sha256_hex(&document))).await
}

/// A document of this length, bytes, is read in less time than it takes to hand it to another thread.
const SHORT: usize = 4_096;

/// Read a document into a submission. Most are short and name nothing that must be looked up.
async fn accept(state: &AppState, caller: &Caller, document: Bytes) -> Result<Submission, Problem> {
    let names_nothing = || {
        ![DATASET, PLAN]
            .iter()
            .any(|field| may_name(&document, field))
    };
    if document.len() <= SHORT && names_nothing() {
        let scenario = json::read(&document, &state.rules, job::draw_seed())?;
        return Ok(submission(scenario, caller.clone(), state.clock.now_ms()));
    }
    Box::pin(accept_slowly(state, caller, document)).await
}

/// Read any document into a submission, off the request threads.
async fn accept_slowly(
    state: &AppState,
    caller: &Caller,
    document: Bytes,
) -> Result<Submission, Problem> {
    let rules = state.rules.clone();
    let read = move |document: &Bytes| json::read(document, &rules, job::draw_seed());
    let mut scenario = match state.terrains.over(caller, document.clone(), read).await? {
        Ok(scenario) => scenario,
        Err(refusal) => {
            return Err(warm_start::refused_too(state, caller, document, refusal.into()).await);
        }
    };
    warm_start::resolve(state, caller, &mut scenario).await?;
    let (owner, now_ms) = (caller.clone(), state.clock.now_ms());
    off_thread::run(caller, move || submission(scenario, owner, now_ms)).await
}

fn submission(scenario: Scenario, caller: Caller, now_ms: i64) -> Submission {
    let dataset = scenario.terrain.dataset();
    let dataset = dataset.map(|dem| dem.sha256().to_owned());
    Submission {
        id: job::new_id(now_ms),
        scenario: json::write(&scenario),
        work: scenario.planner.work(),
        name: scenario.name,
        algorithm: scenario.planner.algorithm,
        seed: scenario.planner.seed,
        iterations: scenario.planner.iterations as u64,
        created_ms: now_ms,
        owner: caller.owner,
        quota: caller.quota,
        webhook: None,
        idempotency: None,
        dataset,
    }
}

/// The answer to `?validate_only=true`. The accepted document is inserted as text.
fn valid(submission: &Submission) -> Response {
    let document = format!(r#"{{"valid":true,"scenario":{}}}"#, submission.scenario);
    ([(header::CONTENT_TYPE, "application/json")], document).into_response()
}
