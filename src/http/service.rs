//! The service about itself: liveness, readiness, version, limits, algorithms.

use axum::Json;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::{Value, json};

use super::params::NoParams;
use super::problem::Problem;
use super::{AppState, Phase, events, plans, prefer, retry};
use crate::optimizer::{self, Algorithm, Parameter};
use crate::scenario::json::{COMMON, CommonParameter, Takes};

/// `GET /livez`: the process answers.
pub(super) async fn livez(_: NoParams) -> Result<Response, Problem> {
    Ok(ok())
}

/// `GET /readyz`: whether it accepts plans.
pub(super) async fn readyz(
    State(state): State<AppState>,
    _: NoParams,
) -> Result<Response, Problem> {
    if *state.phase.borrow() != Phase::Serving {
        let stats = state.store.stats().await;
        let retry_after_s = retry::for_room_if_known(stats, state.capacity);
        return Err(Problem::Draining { retry_after_s });
    }
    let health = state.readiness.shared(state.store.health()).await;
    health.map_err(|error| Problem::store_unavailable(&error))?;
    let warnings = [state.clock.warning(), state.store.warning()];
    let warnings: Vec<_> = warnings.into_iter().flatten().collect();
    if warnings.is_empty() {
        return Ok(ok());
    }
    Ok(Json(json!({"status": "ok", "warnings": warnings})).into_response())
}

fn ok() -> Response {
    Json(json!({"status": "ok"})).into_response()
}

/// `GET /version`.
pub(super) async fn version(_: NoParams) -> Result<Json<Value>, Problem> {
    Ok(Json(json!({
        "name": env!("CARGO_PKG_NAME"),
        "version": env!("CARGO_PKG_VERSION"),
        "engine_version": env!("CARGO_PKG_VERSION"),
    })))
}

/// The operator's limits.
#[derive(Serialize)]
struct LimitsDocument {
    body_bytes: usize,
    threats: usize,
    polygon_vertices: usize,
    terrain_nodes: usize,
    terrain_bytes: u64,
    terrains_bytes: u64,
    terrains: usize,
    peaks: usize,
    waypoints: usize,
    population: usize,
    iterations: usize,
    work: u64,
    path_samples: usize,
    workers: usize,
    queue: usize,
    page: usize,
    wait_s: u64,
    event_rate_hz: f64,
    streams: usize,
    streams_per_key: usize,
}

/// `GET /limits`.
pub(super) async fn limits(
    State(state): State<AppState>,
    _: NoParams,
) -> Result<Response, Problem> {
    let limits = state.rules.limits;
    let access = state.access.settings();
    let stats = state.store.stats().await.ok();
    let document = LimitsDocument {
        body_bytes: limits.body_bytes,
        threats: limits.threats,
        polygon_vertices: limits.polygon_vertices,
        terrain_nodes: limits.terrain_nodes,
        terrain_bytes: limits.terrain_bytes,
        terrains_bytes: limits.terrains_bytes,
        terrains: limits.terrains,
        peaks: limits.peaks,
        waypoints: limits.waypoints,
        population: limits.population,
        iterations: limits.iterations,
        work: limits.work,
        path_samples: limits.path_samples,
        workers: state.capacity.all_workers(stats.as_ref()),
        queue: state.capacity.queue,
        page: plans::MAX_PAGE,
        wait_s: prefer::MAX_WAIT_S.into(),
        event_rate_hz: *events::RATES_HZ.end(),
        streams: access.streams,
        streams_per_key: access.streams_per_key,
    };
    Ok(Json(document).into_response())
}

/// The values of `planner.algorithm`.
#[derive(Serialize)]
pub(super) struct AlgorithmsDocument {
    /// Parameters common to all of them.
    parameters: Vec<ParameterDocument>,
    algorithms: Vec<AlgorithmDocument>,
}

#[derive(Serialize)]
struct AlgorithmDocument {
    name: &'static str,
    title: &'static str,
    source: &'static str,
    parameters: Vec<ParameterDocument>,
}

#[derive(Serialize)]
struct ParameterDocument {
    name: &'static str,
    #[serde(flatten)]
    takes: TakesDocument,
    meaning: &'static str,
}

#[derive(Serialize)]
#[serde(untagged)]
enum TakesDocument {
    Choice {
        default: &'static str,
        choices: &'static [&'static str],
    },
    Number {
        default: f64,
        min: f64,
        max: f64,
    },
}

impl From<&Algorithm> for AlgorithmDocument {
    fn from(algorithm: &Algorithm) -> Self {
        Self {
            name: algorithm.name,
            title: algorithm.title,
            source: algorithm.source,
            parameters: algorithm.parameters.iter().map(Into::into).collect(),
        }
    }
}

impl From<&Parameter> for ParameterDocument {
    fn from(parameter: &Parameter) -> Self {
        Self {
            name: parameter.name,
            takes: TakesDocument::Number {
                default: parameter.default,
                min: parameter.min,
                max: parameter.max,
            },
            meaning: parameter.meaning,
        }
    }
}

impl From<&CommonParameter> for ParameterDocument {
    fn from(parameter: &CommonParameter) -> Self {
        Self {
            name: parameter.name,
            takes: match parameter.takes {
                Takes::Choice { default, choices } => TakesDocument::Choice { default, choices },
                Takes::Number { default, min, max } => TakesDocument::Number { default, min, max },
            },
            meaning: parameter.meaning,
        }
    }
}

/// `GET /algorithms`.
pub(super) async fn algorithms(_: NoParams) -> Result<Json<AlgorithmsDocument>, Problem> {
    Ok(Json(AlgorithmsDocument {
        parameters: COMMON.iter().map(Into::into).collect(),
        algorithms: optimizer::ALL.iter().map(Into::into).collect(),
    }))
}
