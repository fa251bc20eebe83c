//! The result document: the wire form of an [`Outcome`](crate::planner::Outcome) and of the events of a run.

mod from;

use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::planner::Place;

/// The document of `GET /plans/{id}/result` and of `noctule plan`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResultDocument {
    /// `None` when planned without a server.
    pub plan_id: Option<Uuid>,
    /// Name of the algorithm.
    pub algorithm: String,
    /// Seed of the run.
    pub seed: u64,
    /// Version of the engine that found the route.
    pub engine_version: String,
    /// SHA-256 of the accepted scenario document, hexadecimal.
    pub scenario_sha256: String,
    /// Whether the waypoints meet every constraint.
    pub feasible: bool,
    /// `iterations`, `converged`, `time-limit` or `cancelled`; `None` before the end.
    pub stop_reason: Option<String>,
    /// `false` before the end, omitted afterwards.
    #[serde(rename = "final", default, skip_serializing_if = "Option::is_none")]
    pub is_final: Option<bool>,
    /// Weighted terms and their sum.
    pub cost: Cost,
    /// Cost of the same route by the exact integral; only with the paper's quadrature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cost_integral: Option<Cost>,
    /// Proven lower bound.
    pub bound: Bound,
    /// Omitted in the local frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<FrameDocument>,
    /// Start, free waypoints, target.
    pub waypoints: Vec<Position>,
    /// One fewer than the waypoints.
    pub legs: Vec<Leg>,
    /// The smoothed route, `null` when infeasible.
    pub path: Option<Path>,
    /// The certificate.
    pub checks: Checks,
    /// The convergence curve of the search.
    pub convergence: Vec<Convergence>,
    /// Wall times.
    pub timing: Timing,
    /// Total number of routes evaluated.
    pub evaluations: u64,
}

/// A point in the request's frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Position {
    /// Metres of the local plane.
    Local {
        /// East.
        x: f64,
        /// North.
        y: f64,
        /// Up.
        z: f64,
    },
    /// Degrees on the WGS 84 ellipsoid.
    Geodetic {
        /// Latitude, degrees north.
        lat: f64,
        /// Longitude, degrees east.
        lon: f64,
        /// Metres above the request's datum.
        alt: f64,
    },
}

/// How a geodetic request was mapped to the plane used for planning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameDocument {
    /// `wgs84`.
    pub kind: String,
    /// `msl` or `ellipsoid`.
    pub altitude_datum: String,
    /// Tangent point of the plane; lengths are true at its altitude.
    pub origin: Position,
    /// Height of mean sea level above the ellipsoid there, metres.
    pub undulation: f64,
}

/// Weighted terms of Eq. 1 and their sum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "named and documented in planner::CostFigures")]
pub struct Cost {
    pub total: f64,
    pub fuel: f64,
    pub threat: f64,
    pub altitude: f64,
}

/// Proven lower bound and the gap to it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "named and documented in planner::Bound")]
pub struct Bound {
    pub lower: f64,
    pub gap: Option<f64>,
}

/// A straight leg of the route.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "named and documented in planner::Leg")]
pub struct Leg {
    pub length: f64,
    pub turn_deg: f64,
    pub climb_deg: f64,
}

/// The smoothed route.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "named and documented in planner::Path")]
pub struct Path {
    pub points: Vec<Position>,
    pub length: f64,
    pub degree: usize,
    pub knots: Vec<f64>,
    pub control_points: Vec<Position>,
    pub duration_s: f64,
}

/// The certificate: measured values and violated constraints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checks {
    /// Along the waypoints.
    pub waypoints: MeasuresDocument,
    /// Along the path; `null` if there is none.
    pub path: Option<MeasuresDocument>,
    /// Empty when feasible.
    pub violations: Vec<Violation>,
}

/// Values measured along a polyline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "named and documented in planner::Measures")]
pub struct MeasuresDocument {
    pub clearance: Vec<Clearance>,
    pub min_agl: Option<f64>,
    pub max_agl: Option<f64>,
    pub max_turn_deg: f64,
    pub max_climb_deg: f64,
    pub min_leg: f64,
}

/// How close the route comes to a threat.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "named and documented in planner::Clearance")]
pub struct Clearance {
    pub threat: usize,
    pub name: Option<String>,
    pub distance: Option<f64>,
}

/// A broken constraint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Violation {
    /// `threat`, `altitude`, `terrain`, `turn`, `climb`, `leg` or `area`.
    pub kind: String,
    /// Place of the violation, such as `leg 3`.
    #[serde(rename = "where", with = "place")]
    pub place: Place,
    /// Metres or degrees beyond the limit.
    pub amount: f64,
    /// Message for the user.
    pub message: String,
}

/// A point of the convergence curve; also the data of a `convergence` event.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[expect(
    missing_docs,
    reason = "named and documented in planner::ConvergencePoint"
)]
pub struct Convergence {
    pub iteration: usize,
    pub evaluations: u64,
    pub elapsed_ms: f64,
    pub best_cost: Option<f64>,
    pub best_violation: f64,
    pub mean_cost: f64,
    pub feasible_fraction: f64,
}

/// The data of an `incumbent` event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "named and documented in planner::Incumbent")]
pub struct Incumbent {
    pub iteration: usize,
    pub elapsed_ms: f64,
    pub cost: f64,
    pub feasible: bool,
    pub waypoints: Vec<Position>,
}

/// Wall times, milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// From acceptance to the start of the run.
    pub queued_ms: f64,
    /// Duration of the run.
    pub run_ms: f64,
}

/// Origin of a result: everything but the route itself.
#[derive(Debug, Clone)]
pub struct Origin {
    /// `None` without a server.
    pub plan_id: Option<Uuid>,
    /// Name of the algorithm.
    pub algorithm: String,
    /// Seed of the run.
    pub seed: u64,
    /// SHA-256 of the accepted scenario document, by [`sha256_hex`](crate::digest::sha256_hex).
    pub scenario_sha256: String,
    /// Wall times.
    pub timing: Timing,
}

impl ResultDocument {
    /// As JSON text.
    ///
    /// # Panics
    /// Never: all map keys of the document are strings.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("every map key is a string and every number is finite")
    }
}

/// A place as a text.
mod place {
    use serde::de::Error as _;
    use serde::{Deserialize as _, Deserializer, Serializer};

    use super::Place;

    pub(super) fn serialize<S: Serializer>(
        place: &Place,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_str(place)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Place, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(D::Error::custom)
    }
}
