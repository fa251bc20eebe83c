//! Datasets as users see them: uploaded, mounted, planned over, replaced, deleted.

mod big;
mod crash;
mod hostile;
mod mounted;
mod names;
mod planning;
mod sampling;
mod shared;
mod stalled;
mod uses;

use std::path::{Path, PathBuf};

use axum::http::Method;
use serde_json::{Value, json};

use crate::support::api::{Answer, Api};
use crate::support::elevations::ascii_grid;

/// The shipped elevation file.
fn jacksboro() -> Vec<u8> {
    std::fs::read(shipped().join("jacksboro.tif")).expect("it ships")
}

/// The directory of shipped files.
fn shipped() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/terrain")
}

/// A hill `height` metres high, on 36.0 to 36.4 N, 85.0 to 84.6 W.
fn hill(height: f64) -> String {
    ascii_grid([41, 41], [-85.0, 36.0], 0.01, |column, row| {
        let (x, y) = (column as f64 - 20.0, row as f64 - 20.0);
        300.0 + height / (1.0 + (x * x + y * y) / 50.0)
    })
}

/// A scenario over a dataset in the hill's place.
fn over(name: &str) -> Value {
    json!({
        "name": "over a hill", "frame": "wgs84",
        "start": {"lat": 36.1, "lon": -84.9, "alt": 450},
        "target": {"lat": 36.3, "lon": -84.7, "alt": 450},
        "terrain": {"kind": "dataset", "name": name},
        "altitude": {"min": 30, "max": 400},
        "planner": {"population": 20, "iterations": 5, "seed": 7, "waypoints": 4, "smoothing": {"spacing": 200}},
    })
}

async fn put(api: &Api, uri: &str, body: impl Into<Vec<u8>>) -> Answer {
    put_with(api, uri, &[], body).await
}

async fn put_with(
    api: &Api,
    uri: &str,
    headers: &[(&str, &str)],
    body: impl Into<Vec<u8>>,
) -> Answer {
    api.send(Method::PUT, uri, headers, body.into()).await
}

/// The number of files in `content`, `names` and `incoming` of the directory of uploads.
fn kept(uploads: &Path) -> [usize; 3] {
    ["content", "names", "incoming"].map(|part| {
        let entries = std::fs::read_dir(uploads.join(part));
        entries.map_or(0, Iterator::count)
    })
}
