//! `POST /scenarios:ground`: the ground under a scenario at the nodes of a small grid, for drawing.

use std::ops::RangeInclusive;

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, Uri};
use bytes::Bytes;
use serde::Serialize;

use super::caller::Caller;
use super::params::Params;
use super::problem::Problem;
use super::sampled::{between, to_the_centimetre};
use super::{AppState, body};
use crate::geometry::geodesy::{LatLon, wrapped};
use crate::geometry::{Point2, Rect};
use crate::scenario::Scenario;
use crate::scenario::json;

/// Allowed number of nodes from west to east, and from south to north.
const NODES: RangeInclusive<usize> = 2..=401;

/// Default number.
const SOME_NODES: usize = 101;

/// Elevations over the area of a scenario.
#[derive(Serialize)]
pub(super) struct GroundDocument {
    /// In the coordinates of the request; the first node is at `min`, the last at `max`.
    area: Area,
    columns: usize,
    rows: usize,
    /// Metres, to a centimetre; row by row from south to north, each from west to east.
    elevations: Vec<f64>,
}

#[derive(Serialize)]
struct Area {
    min: Place,
    max: Place,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Place {
    Local { x: f64, y: f64 },
    Geodetic { lat: f64, lon: f64 },
}

/// `POST /scenarios:ground`.
pub(super) async fn sample(
    State(state): State<AppState>,
    caller: Caller,
    uri: Uri,
    headers: HeaderMap,
    body: Body,
) -> Result<Json<GroundDocument>, Problem> {
    let params = Params::read(&uri, &["columns", "rows"])?;
    let nodes = |name| params.within(name, &NODES, "a whole number");
    let columns = nodes("columns")?.unwrap_or(SOME_NODES);
    let rows = nodes("rows")?.unwrap_or(SOME_NODES);
    let text = body::read_json(&state, &caller, &headers, body).await?;
    let rules = state.rules.clone();
    let sample = move |text: &Bytes| {
        json::read(text, &rules, 0).map(|scenario| sampled(&scenario, columns, rows))
    };
    Ok(Json(state.terrains.over(&caller, text, sample).await??))
}

fn sampled(scenario: &Scenario, columns: usize, rows: usize) -> GroundDocument {
    let wgs84 = scenario.frame.wgs84();
    // Geodetic scenarios are sampled in degrees: the caller's map knows nothing of our plane.
    let (min, max) = match wgs84 {
        None => (scenario.area.min, scenario.area.max),
        Some(wgs84) => (
            Point2::new(wgs84.area.min.lon, wgs84.area.min.lat),
            // Beyond 180 degrees where the area crosses the antimeridian.
            Point2::new(wgs84.area.min.lon + wgs84.area.width(), wgs84.area.max.lat),
        ),
    };
    let area = Rect { min, max };
    let elevation = |node: usize| {
        let x = between(area.min.x, area.max.x, node % columns, columns);
        let y = between(area.min.y, area.max.y, node / columns, rows);
        let point = match wgs84 {
            None => Point2::new(x, y),
            Some(wgs84) => wgs84.plane.local(LatLon {
                lat: y,
                lon: wrapped(x),
            }),
        };
        to_the_centimetre(scenario.terrain.elevation(point))
    };
    let place = |point: Point2| match wgs84 {
        None => Place::Local {
            x: point.x,
            y: point.y,
        },
        Some(_) => Place::Geodetic {
            lat: point.y,
            lon: wrapped(point.x),
        },
    };
    GroundDocument {
        area: Area {
            min: place(area.min),
            max: place(area.max),
        },
        columns,
        rows,
        elevations: (0..columns * rows).map(elevation).collect(),
    }
}
