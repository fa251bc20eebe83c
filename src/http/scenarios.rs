//! Scenarios that are not plans yet.

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, Uri};

use super::caller::Caller;
use super::params::{self, Params};
use super::problem::Problem;
use super::{AppState, body, off_thread};
use crate::import::{self, Conversion, End, Flight, Most, WITHIN_M};

/// `POST /scenarios:convert`.
pub(super) async fn convert(
    State(state): State<AppState>,
    caller: Caller,
    uri: Uri,
    headers: HeaderMap,
    body: Body,
) -> Result<Json<Conversion>, Problem> {
    let flight = flight(&uri)?;
    let (text, syntax) = body::read_a_map(&state, &caller, &headers, body).await?;
    let limits = state.rules.limits;
    let most = Most {
        threats: limits.threats,
        polygon_vertices: limits.polygon_vertices,
    };
    let conversion = off_thread::run(&caller, move || {
        import::convert(&text, syntax, most, &flight)
    })
    .await??;
    Ok(Json(conversion))
}

/// The flight that a map of zones is converted for, in the query.
fn flight(uri: &Uri) -> Result<Flight, Problem> {
    let params = Params::read(uri, &["start", "target", "within"])?;
    let end = |name| params.parse::<End>(name, End::ALLOWED);
    let flight = Flight {
        start: end("start")?,
        target: end("target")?,
        within_m: params.within("within", &WITHIN_M, "a number of metres")?,
    };
    let absent = [("start", flight.start), ("target", flight.target)]
        .into_iter()
        .find(|(_, end)| end.is_none());
    match absent.filter(|_| flight.within_m.is_some()) {
        Some((name, _)) => Err(params::missing(name, "given where within is")),
        None => Ok(flight),
    }
}
