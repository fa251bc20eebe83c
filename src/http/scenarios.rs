//! Scenarios that are not plans yet.

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::HeaderMap;

use super::caller::Caller;
use super::params::NoParams;
use super::problem::Problem;
use super::{AppState, body, off_thread};
use crate::import::{self, Conversion, Most};

/// `POST /scenarios:convert`.
pub(super) async fn convert(
    State(state): State<AppState>,
    caller: Caller,
    _: NoParams,
    headers: HeaderMap,
    body: Body,
) -> Result<Json<Conversion>, Problem> {
    let (text, syntax) = body::read_json_or_xml(&state, &caller, &headers, body).await?;
    let limits = state.rules.limits;
    let most = Most {
        threats: limits.threats,
        polygon_vertices: limits.polygon_vertices,
    };
    let conversion =
        off_thread::run(&caller, move || import::convert(&text, syntax, most)).await??;
    Ok(Json(conversion))
}
