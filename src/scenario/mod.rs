//! What a caller asks for: a [`Scenario`] that has been checked once and cannot be wrong afterwards.
//!
//! [`json`] reads the wire document and reports every fault at once; [`limits`] holds what the
//! operator allows. Deliberately absent: HTTP, defaults that depend on a clock or a machine.

pub mod frame;
pub mod json;
pub mod limits;

use std::collections::BTreeMap;

use crate::geometry::{Point3, Rect};
use crate::terrain::Terrain;
use crate::threat::Threat;
pub use frame::Frame;

/// A planning request, validated: every field is finite and within its range, the start and the
/// target are clear of threats, above ground and inside the area.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The caller's own name for it.
    pub name: Option<String>,
    /// What the coordinates of the request mean; all below are in the local plane.
    pub frame: Frame,
    /// Where the route begins; `z` is the height in the frame, not above ground.
    pub start: Point3,
    /// Where the route ends.
    pub target: Point3,
    /// Free waypoints stay inside.
    pub area: Rect,
    /// In the order of the request.
    pub threats: Vec<Threat>,
    /// The ground under the area.
    pub terrain: Terrain,
    /// Allowed heights above ground, Eq. 6.
    pub altitude: AltitudeBand,
    /// What the aircraft can do.
    pub vehicle: Vehicle,
    /// Weights of Eq. 1.
    pub weights: Weights,
    /// How to search.
    pub planner: PlannerSettings,
}

/// Allowed heights above ground, metres; `0 <= min < max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AltitudeBand {
    /// Lowest, `h_min`.
    pub min: f64,
    /// Highest, `h_max`.
    pub max: f64,
}

/// Limits and consumption of the aircraft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vehicle {
    /// Largest horizontal heading change between legs, degrees, Eq. 8.
    pub max_turn_deg: f64,
    /// Largest climb or descent angle of a leg, degrees, Eq. 9.
    pub max_climb_deg: f64,
    /// Shortest leg, metres (3-D).
    pub min_leg: f64,
    /// Metres a second.
    pub cruise_speed: f64,
    /// Fuel used in a kilometre; 1000 makes a metre cost 1, Eq. 2.
    pub fuel_per_km: f64,
}

/// Weights of the three cost terms, Eq. 1; each >= 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Of the fuel, F1.
    pub fuel: f64,
    /// Of the exposure to threats, F2.
    pub threat: f64,
    /// Of the distance from the middle of the band, F3.
    pub altitude: f64,
}

/// How to search for the route.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannerSettings {
    /// A name out of the table of algorithms.
    pub algorithm: String,
    /// Free waypoints, N.
    pub waypoints: usize,
    /// Bats.
    pub population: usize,
    /// Iterations after the first evaluation.
    pub iterations: usize,
    /// Below 2^53, so that every JSON reader keeps it.
    pub seed: u64,
    /// A cap on the run, milliseconds; without it the result depends on the request alone.
    pub time_limit_ms: Option<u64>,
    /// Where the first bats come from.
    pub seeding: Seeding,
    /// Whether the best route is polished at the end.
    pub polish: bool,
    /// A known route to start from.
    pub warm_start: Option<WarmStart>,
    /// How the route is smoothed, Eq. 26-27.
    pub smoothing: Smoothing,
    /// How the threat integral of Eq. 4 is taken.
    pub quadrature: Quadrature,
    /// The search ends once its cost is proven to be no farther above the optimum than this share
    /// of it; 0 lets it go on.
    pub gap: f64,
    /// Threads that may price routes; the result does not depend on it.
    pub threads: usize,
    /// The algorithm's own constants that the caller set, by name.
    pub parameters: BTreeMap<String, f64>,
}

impl PlannerSettings {
    /// population * iterations * waypoints, as [`limits::Limits::work`] bounds it.
    #[must_use]
    pub fn work(&self) -> u64 {
        work([self.population, self.iterations, self.waypoints])
    }
}

/// The product of what makes a search long.
fn work(factors: [usize; 3]) -> u64 {
    let grow = |work: u64, factor: usize| work.saturating_mul(factor as u64);
    factors.into_iter().fold(1, grow)
}

#[cfg(test)]
impl PlannerSettings {
    /// The algorithm alone, as in the paper, at its least size.
    pub(crate) fn plain() -> Self {
        Self {
            algorithm: "tms-sba".to_owned(),
            waypoints: 1,
            population: 2,
            iterations: 1,
            seed: 0,
            time_limit_ms: None,
            seeding: Seeding::Random,
            polish: false,
            warm_start: None,
            smoothing: Smoothing {
                degree: 3,
                spacing: 5.0,
            },
            quadrature: Quadrature::Integral,
            gap: 0.0,
            threads: 1,
            parameters: BTreeMap::new(),
        }
    }
}

/// Where the first bats come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seeding {
    /// Routes along the common tangents of the threats, the best few ways round them.
    Tangent,
    /// Uniformly within the bounds of the coding, as in the paper.
    Random,
}

/// A known route to start from.
#[derive(Debug, Clone, PartialEq)]
pub enum WarmStart {
    /// That of a stored plan. Who keeps the plans puts its waypoints here instead before anything
    /// is planned.
    Plan(String),
    /// In order; start and target may be among them.
    Waypoints(Vec<Point3>),
}

/// The B-spline of Eq. 26-27.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothing {
    /// Degree of the spline, 1 to 5.
    pub degree: usize,
    /// Greatest distance between delivered samples, metres.
    pub spacing: f64,
}

/// How the threat integral of Eq. 4 is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quadrature {
    /// Exactly, along the whole leg.
    Integral,
    /// By five samples a leg, as printed; kept to reproduce the paper's tables.
    Paper,
}
