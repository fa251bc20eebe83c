//! A plan's documents: the scenario, and the result in the requested format.

use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};

use super::caller::Caller;
use super::params::{self, Id, NoParams, Params};
use super::problem::Problem;
use super::{AppState, accept, partial, retry};
use crate::export::{
    self, ExportError, Format, OPTIONS, Options, ResultInput, file_name, file_name_in_full,
};
use crate::job::Plan;
use crate::scenario::json::Unread;
use crate::store::StoreError;

/// What is encoded in the second name of a file, RFC 8187.
const ENCODED: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.');

/// Parameters of a result beside the options of its format.
const PARAMETERS: [&str; 2] = ["format", "partial"];

/// `GET /plans/{id}/scenario`.
pub(super) async fn scenario(
    State(state): State<AppState>,
    caller: Caller,
    Id(id): Id,
    _: NoParams,
) -> Result<Response, Problem> {
    let plan = caller.plan(&*state.store, id).await?;
    let document = state.store.scenario(id).await?;
    let headers = [
        (
            header::CONTENT_TYPE,
            HeaderValue::from_static("application/json"),
        ),
        (
            header::CONTENT_DISPOSITION,
            disposition(&plan, "inline", "-scenario.json"),
        ),
    ];
    Ok((headers, document).into_response())
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
    let mut plan = caller.plan(&*state.store, id).await?;
    let choices = choices(&params, &headers)?;
    if partial && !plan.status.is_final() {
        if let Some(so_far) = partial::result(&state, &caller, &plan).await? {
            return written(&state, &caller, &plan, choices, so_far).await;
        }
        // A run that has ended meanwhile has a result instead of a route so far.
        plan = caller.plan(&*state.store, id).await?;
    }
    if !plan.status.is_final() {
        let retry_after_s = retry::for_end(&plan, &state.store.stats().await?, state.capacity);
        return Err(Problem::NotReady {
            id,
            status: plan.status,
            partial,
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
    written(&state, &caller, &plan, choices, stored).await
}

/// A format for a result, and the requested options.
type Choice = (&'static Format, Options);

/// A result in the first of `choices` in which it can be written.
async fn written(
    state: &AppState,
    caller: &Caller,
    plan: &Plan,
    choices: Vec<Choice>,
    result: String,
) -> Result<Response, Problem> {
    let (format, document) = if choices[0].0.is_stored() {
        (choices[0].0, result)
    } else {
        let result_room = state.answers.room_to_make_one(result.len())?;
        match state.store.scenario(plan.id).await {
            Ok(scenario) => {
                let scenario_room = state.answers.room_to_make_one(scenario.len())?;
                let rules = state.rules.clone();
                let write = move |scenario: &String| {
                    let _rooms = (&result_room, &scenario_room);
                    let input = ResultInput {
                        result: &result,
                        scenario,
                        rules: &rules,
                    };
                    write_first(&choices, &input)
                };
                state.terrains.over(caller, scenario, write).await??
            }
            Err(error) => (without_scenario(&choices, error)?, result),
        }
    };
    let kind = if format.shown { "inline" } else { "attachment" };
    let ending = format!(".{}", format.extension);
    let headers = [
        (
            header::CONTENT_TYPE,
            HeaderValue::from_static(format.media_type),
        ),
        (
            header::CONTENT_DISPOSITION,
            disposition(plan, kind, &ending),
        ),
        (header::VARY, HeaderValue::from_static("accept")),
    ];
    Ok((headers, document).into_response())
}

/// A plan without degrees, without a feasible route or without its ground cannot be written in every format; when none
/// of `choices` is possible, the refusal is that of the first.
fn write_first(
    choices: &[Choice],
    input: &ResultInput,
) -> Result<(&'static Format, String), ExportError> {
    let mut refusal = None;
    for (format, options) in choices {
        match format.write(input, options) {
            Err(
                error @ (ExportError::NoGeodeticFrame { .. }
                | ExportError::Infeasible { .. }
                | ExportError::Unflyable(_)
                | ExportError::Unread(Unread::NoGround(_))),
            ) => {
                refusal.get_or_insert(error);
            }
            written => return written.map(|document| (*format, document)),
        }
    }
    Err(refusal.expect("there is at least one choice"))
}

/// The format that needs no scenario, if the caller accepts it and `error` is that the scenario is lost.
fn without_scenario(choices: &[Choice], error: StoreError) -> Result<&'static Format, StoreError> {
    let mut formats = choices.iter().map(|(format, _)| *format);
    match (error, formats.find(|format| format.is_stored())) {
        (StoreError::ScenarioLost(_), Some(format)) => Ok(format),
        (error, _) => Err(error),
    }
}

/// How a browser should handle a document of `plan`: the `kind` of RFC 6266, and the file's name with this `ending`.
fn disposition(plan: &Plan, kind: &str, ending: &str) -> HeaderValue {
    let (scenario, id) = (plan.name.as_deref(), plan.id.to_string());
    let name = file_name(scenario, Some(&id), ending);
    // RFC 6266: a browser that knows the second name takes that.
    let in_full = file_name_in_full(scenario, Some(&id), ending).map_or_else(String::new, |name| {
        let encoded = utf8_percent_encode(&name, ENCODED);
        format!("; filename*=UTF-8''{encoded}")
    });
    HeaderValue::from_str(&format!("{kind}; filename=\"{name}\"{in_full}"))
        .expect("names are ASCII letters, digits, hyphens and percent signs")
}

/// At least one, the preferred first. Options unknown to the preferred format are refused; other formats that do not
/// know them are left out.
fn choices(params: &Params, headers: &HeaderMap) -> Result<Vec<Choice>, Problem> {
    let read = |format: &'static Format| {
        let given = params.pairs();
        let options = given.filter(|(name, _)| !PARAMETERS.contains(name));
        Options::read(format, options).map(|options| (format, options))
    };
    let mut formats = formats(params, headers)?.into_iter();
    let best = formats.next().map(read).transpose();
    let best = best.map_err(ExportError::from)?;
    Ok(best.into_iter().chain(formats.flat_map(read)).collect())
}

/// `?format=` decides, otherwise `Accept`; at least one.
fn formats(params: &Params, headers: &HeaderMap) -> Result<Vec<&'static Format>, Problem> {
    if let Some(name) = params.text("format") {
        let found = Format::named(name);
        let names = || {
            let names: Vec<_> = export::ALL.iter().map(|format| format.name).collect();
            format!("one of {}", names.join(", "))
        };
        let format = found.ok_or_else(|| params::refused("format", name, &names()))?;
        return Ok(vec![format]);
    }
    let offers: Vec<_> = export::ALL.iter().map(|format| format.media_type).collect();
    let taken = accept::ranked(headers, &offers);
    if taken.is_empty() {
        return Err(Problem::NotAcceptable {
            asked: accept::asked(headers),
            available: offers,
        });
    }
    let named = |media_type| {
        export::ALL
            .iter()
            .find(move |format| format.media_type == media_type)
    };
    Ok(taken.into_iter().filter_map(named).collect())
}
