//! `GET /terrains/{name}/elevations`: a dataset sampled on a grid of degrees, for drawing.

use std::ops::RangeInclusive;

use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;

use super::document::{Corners, Place};
use super::{Name, tagged};
use crate::digest;
use crate::geometry::geodesy::{LatLon, wrapped};
use crate::http::AppState;
use crate::http::caller::Caller;
use crate::http::entity_tags::EntityTags;
use crate::http::params::{self, Params};
use crate::http::problem::Problem;
use crate::http::sampled::{between, to_the_centimetre};
use crate::http::shown::Shown;
use crate::terrain::dem::Degrees;
use crate::terrain::{DatasetError, Datasets};

/// Allowed number of samples along one side.
const LOOKS_ALONG: RangeInclusive<usize> = 2..=512;
/// Maximum number of samples.
const MOST_LOOKS: usize = 131_072;
/// Samples along one side by default.
const SOME_LOOKS: usize = 64;

const PARAMETERS: [&str; 7] = [
    "south", "west", "north", "east", "columns", "rows", "sha256",
];

/// A dataset, sampled.
#[derive(Serialize)]
struct ElevationsDocument {
    name: String,
    sha256: String,
    area: Corners<Place>,
    columns: usize,
    rows: usize,
    elevations: Vec<Option<f64>>,
}

/// `GET /terrains/{name}/elevations`.
pub(in crate::http) async fn elevations(
    State(state): State<AppState>,
    caller: Caller,
    Name(name): Name,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let asked = Asked::read(name.clone(), &uri)?;
    let (datasets, known) = (state.rules.datasets.clone(), EntityTags::known(&headers));
    let sampled = state
        .terrains
        .read(&caller, move || asked.sample(&*datasets, known.as_ref()))
        .await?;
    let (tag, document) = sampled.map_err(|error| refusal(error, &name))?;
    let answer = match document {
        Some(document) => Json(document).into_response(),
        // As compression does for the answer itself.
        None => (
            StatusCode::NOT_MODIFIED,
            [(header::VARY, "accept-encoding")],
        )
            .into_response(),
    };
    Ok(tagged(answer, Some(tag)))
}

/// What may stand for a dataset.
fn checksum(text: &str) -> Result<String, Problem> {
    if digest::is_sha256(text) {
        Ok(text.to_owned())
    } else {
        Err(params::refused("sha256", text, digest::SHA256))
    }
}

/// The request for samples.
struct Asked {
    name: String,
    sha256: Option<String>,
    /// `None` for all of it.
    area: Option<Degrees>,
    columns: usize,
    rows: usize,
}

impl Asked {
    fn read(name: String, uri: &Uri) -> Result<Self, Problem> {
        let params = Params::read(uri, &PARAMETERS)?;
        let looks = |name| params.within(name, &LOOKS_ALONG, "a whole number");
        let columns = looks("columns")?.unwrap_or(SOME_LOOKS);
        let rows = looks("rows")?.unwrap_or(SOME_LOOKS);
        if columns * rows > MOST_LOOKS {
            let allowed = format!("at most {MOST_LOOKS} divided by columns");
            return Err(params::refused("rows", &rows.to_string(), &allowed));
        }
        Ok(Self {
            name,
            sha256: params.text("sha256").map(checksum).transpose()?,
            area: area(&params)?,
            columns,
            rows,
        })
    }

    /// The content's entity tag, and its samples unless the caller has them already.
    fn sample(
        self,
        datasets: &dyn Datasets,
        known: Option<&EntityTags>,
    ) -> Result<(HeaderValue, Option<ElevationsDocument>), DatasetError> {
        let found = datasets.find(&self.name, self.sha256.as_deref())?;
        let tag = weak_etag(&found.sha256);
        if known.is_some_and(|known| known.contain(&tag)) {
            return Ok((tag, None));
        }
        let area = self.area.unwrap_or(found.dataset.metadata().degrees);
        let places: Vec<LatLon> = places(area, self.columns, self.rows).collect();
        let elevations = found.dataset.sample(&places)?.into_iter();
        let document = ElevationsDocument {
            name: self.name,
            sha256: found.sha256,
            area: Corners::of(area),
            columns: self.columns,
            rows: self.rows,
            elevations: elevations
                .map(|elevation| elevation.map(to_the_centimetre))
                .collect(),
        };
        Ok((tag, Some(document)))
    }
}

/// The entity tag for samples of a content. Weak, because the bytes differ when compressed.
fn weak_etag(sha256: &str) -> HeaderValue {
    HeaderValue::from_str(&format!("W/\"{sha256}\"")).expect("digits and quotes are visible ASCII")
}

fn refusal(error: DatasetError, name: &str) -> Problem {
    match error {
        DatasetError::Unknown { .. } => Problem::NoSuchTerrain(Shown::of(name)),
        error @ DatasetError::Replaced { .. } => Problem::NoGround(error.to_string()),
        DatasetError::Unreadable(error) => Problem::InvalidTerrain(error.to_string()),
        DatasetError::Unavailable(error) => Problem::unreachable_datasets(&error),
    }
}

/// The requested area; `None` for all of it.
fn area(params: &Params) -> Result<Option<Degrees>, Problem> {
    let degrees = |name: &str, most: f64| params.within(name, &(-most..=most), "degrees");
    let sides = [
        degrees("south", 90.0)?,
        degrees("west", 180.0)?,
        degrees("north", 90.0)?,
        degrees("east", 180.0)?,
    ];
    let [Some(south), Some(west), Some(north), Some(east)] = sides else {
        let missing = PARAMETERS
            .iter()
            .zip(sides)
            .find(|(_, side)| side.is_none());
        return match missing {
            Some((name, _)) if sides.iter().any(Option::is_some) => Err(params::missing(
                name,
                "given with south, west, north and east, or none of them",
            )),
            _ => Ok(None),
        };
    };
    if south >= north {
        let allowed = format!("more than south, {south}");
        return Err(params::refused("north", &north.to_string(), &allowed));
    }
    // The first longitude is the western one, also across the antimeridian.
    let east = if east > west { east } else { east + 360.0 };
    Ok(Some(Degrees {
        west,
        south,
        east,
        north,
    }))
}

/// From the south-west along the parallels, in the order of a scenario's grid.
fn places(area: Degrees, columns: usize, rows: usize) -> impl Iterator<Item = LatLon> {
    (0..columns * rows).map(move |look| LatLon {
        lat: between(area.south, area.north, look / columns, rows),
        lon: wrapped(between(area.west, area.east, look % columns, columns)),
    })
}
