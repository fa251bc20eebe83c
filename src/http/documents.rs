//! A plan's documents: what was accepted, and what came out, in the format asked for.

use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};

use super::caller::Caller;
use super::params::{self, Id, NoParams, Params};
use super::problem::Problem;
use super::{AppState, accept, off_thread, partial, retry};
use crate::export::{self, Format, OPTIONS, Options, ResultInput, file_name};
use crate::job::Plan;

/// Parameters of a result beside the options of its format.
const PARAMETERS: [&str; 2] = ["format", "partial"];

/// `GET /plans/{id}/scenario`.
pub(super) async fn scenario(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    _: NoParams,
) -> Result<Response, Problem> {
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
    let options = OPTIONS.iter().map(|rule| rule.name);
    let known: Vec<_> = PARAMETERS.into_iter().chain(options).collect();
    let params = Params::read(&uri, &known)?;
    let partial = params.parse("partial", "true or false")?.unwrap_or(false);
    let plan = caller.plan(&*state.store, id).await?;
    let format = choose_format(&params, &headers)?;
    let given = params.pairs();
    let options = given.filter(|(name, _)| !PARAMETERS.contains(name));
    let options = Options::read(format, options).map_err(export::ExportError::from)?;
    if partial
        && !plan.status.is_final()
        && let Some(so_far) = partial::result(&state, &plan).await?
    {
        return written(&state, &plan, format, options, so_far).await;
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
    written(&state, &plan, format, options, stored).await
}

/// A result in the format that was asked for.
async fn written(
    state: &AppState,
    plan: &Plan,
    format: &'static Format,
    options: Options,
    result: String,
) -> Result<Response, Problem> {
    let document = if format.is_stored() {
        result
    } else {
        let scenario = state.store.scenario(plan.id).await?;
        let rules = state.rules.clone();
        let write = move || {
            let input = ResultInput {
                result: &result,
                scenario: &scenario,
                rules: &rules,
            };
            format.write(&input, &options)
        };
        off_thread::run(write).await??
    };
    let headers = [
        (
            header::CONTENT_TYPE,
            HeaderValue::from_static(format.media_type),
        ),
        (header::CONTENT_DISPOSITION, disposition(plan, format)),
        (header::VARY, HeaderValue::from_static("accept")),
    ];
    Ok((headers, document).into_response())
}

/// What a browser makes of it: it shows what it can show, and keeps the rest under a name.
fn disposition(plan: &Plan, format: &Format) -> HeaderValue {
    let name = file_name(plan.name.as_deref(), Some(&plan.id.to_string()), format);
    let kind = if ["json", "svg"].contains(&format.name) {
        "inline"
    } else {
        "attachment"
    };
    HeaderValue::from_str(&format!("{kind}; filename=\"{name}\""))
        .expect("a file's name is ASCII letters, digits and hyphens")
}

/// `?format=` decides, else `Accept`.
fn choose_format(params: &Params, headers: &HeaderMap) -> Result<&'static Format, Problem> {
    if let Some(name) = params.text("format") {
        let found = Format::named(name);
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
