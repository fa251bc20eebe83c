//! `POST /plans`: from a document to a plan on disk.

use axum::body::Body;
use axum::extract::{Extension, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;

use super::wait_for;
use crate::http::caller::Caller;
use crate::http::idempotency::IDEMPOTENCY_REPLAYED;
use crate::http::params::Params;
use crate::http::prefer::{PREFERENCE_APPLIED, Wait};
use crate::http::problem::Problem;
use crate::http::status::{StatusDocument, location};
use crate::http::{AppState, Phase, body, off_thread, retry, warm_start, webhook};
use crate::job::{self, Idempotency, Plan, Submission};
use crate::scenario::json;
use crate::store::{StoreError, Submitted};
use crate::telemetry::{Origin, spans};
use crate::terrain::Terrain;

/// `POST /plans`.
pub(in crate::http) async fn submit(
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
        Err(StoreError::QuotaReached { active, quota }) => {
            let retry_after_s = retry::for_room(&state.store.stats().await?, state.capacity);
            Err(Problem::QuotaReached {
                active,
                quota,
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
    let created_ms = state.clock.now_ms();
    let submission = move || Submission {
        id: job::new_id(created_ms),
        scenario: json::write(&scenario),
        work: scenario.planner.work(),
        name: scenario.name,
        algorithm: scenario.planner.algorithm,
        seed: scenario.planner.seed,
        iterations: scenario.planner.iterations as u64,
        created_ms,
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
