//! A plan's documents: what was accepted, and what came out, in the format asked for.

use axum::extract::State;
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};

use super::caller::Caller;
use super::params::{self, Id, Params};
use super::problem::Problem;
use super::{AppState, accept, off_thread, partial, retry};
use crate::export::{self, Format, ResultInput};
use crate::job::PlanId;

/// `GET /plans/{id}/scenario`.
pub(super) async fn scenario(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    uri: Uri,
) -> Result<Response, Problem> {
    Params::read(&uri, &[])?;
    caller.plan(&*state.store, id).await?;
    let document = state.store.scenario(id).await?;
    Ok(([(header::CONTENT_TYPE, "application/json")], document).into_response())
}

/// `GET /plans/{id}/result`.
pub(super) async fn result(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let params = Params::read(&uri, &["format", "partial"])?;
    let partial = params.parse("partial", "true or false")?.unwrap_or(false);
    let plan = caller.plan(&*state.store, id).await?;
    let format = choose_format(&params, &headers)?;
    if partial
        && !plan.status.is_final()
        && let Some(so_far) = partial::result(&state, &plan).await?
    {
        return written(&state, id, format, so_far).await;
    }
    if !plan.status.is_final() {
        let retry_after_s = retry::for_end(&plan, &state.store.stats().await?, state.capacity);
        return Err(Problem::NotReady {
            id,
            status: plan.status,
            retry_after_s,
        });
    }
    let Some(stored) = state.store.result(id).await? else {
        return Err(Problem::NoResult {
            id,
            status: plan.status,
            failure: plan.error,
        });
    };
    written(&state, id, format, stored).await
}

/// A result in the format that was asked for.
async fn written(
    state: &AppState,
    id: PlanId,
    format: &Format,
    result: String,
) -> Result<Response, Problem> {
    let document = match format.write {
        None => result,
        Some(write) => {
            let scenario = state.store.scenario(id).await?;
            off_thread::run(move || {
                write(&ResultInput {
                    result: &result,
                    scenario: &scenario,
                })
            })
            .await?
        }
    };
    Ok(([(header::CONTENT_TYPE, format.media_type)], document).into_response())
}

/// `?format=` decides, else `Accept`.
fn choose_format(params: &Params, headers: &HeaderMap) -> Result<&'static Format, Problem> {
    if let Some(name) = params.text("format") {
        let found = export::ALL.iter().find(|format| format.name == name);
        let names = || {
            let names: Vec<_> = export::ALL.iter().map(|format| format.name).collect();
            format!("one of {}", names.join(", "))
        };
        return found.ok_or_else(|| params::refused("format", name, &names()));
    }
    let offers: Vec<_> = export::ALL.iter().map(|format| format.media_type).collect();
    accept::choose(headers, &offers)
        .and_then(|media_type| {
            export::ALL
                .iter()
                .find(|format| format.media_type == media_type)
        })
        .ok_or_else(|| Problem::NotAcceptable {
            asked: accept::asked(headers),
            available: offers,
        })
}
