//! Shared by several subjects: a service over a fresh store, and helpers to play the worker.

pub(crate) mod api;
pub(crate) mod collector;
pub(crate) mod description;
pub(crate) mod elevations;
pub(crate) mod engines;
pub(crate) mod faulty_store;
pub(crate) mod gzip;
pub(crate) mod keys;
pub(crate) mod lives;
pub(crate) mod nats;
pub(crate) mod openmetrics;
pub(crate) mod patience;
pub(crate) mod plans;
pub(crate) mod process;
pub(crate) mod run;
pub(crate) mod server;
pub(crate) mod size;
pub(crate) mod sse;
pub(crate) mod stores;
pub(crate) mod wire;

use serde_json::{Value, json};

/// A small scenario that is planned almost instantly.
pub(crate) fn scenario() -> Value {
    json!({
        "name": "two radars",
        "start": {"x": 200, "y": 100, "z": 0},
        "target": {"x": 800, "y": 800, "z": 150},
        "area": {"min": {"x": 0, "y": 0}, "max": {"x": 1000, "y": 1000}},
        "threats": [
            {"kind": "cylinder", "name": "radar 1", "center": {"x": 350, "y": 250}, "radius": 60, "influence": 90},
            {"kind": "cylinder", "center": {"x": 500, "y": 480}, "radius": 70},
        ],
        "altitude": {"min": 0, "max": 200},
        "planner": {"population": 20, "iterations": 20, "seed": 7},
    })
}
