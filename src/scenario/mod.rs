//! A planning request: a [`Scenario`], which is validated once and always valid afterwards.
//!
//! [`json`] reads the wire document and reports all faults at once; [`limits`] holds the operator's limits.
//! Deliberately absent: HTTP, and defaults that depend on a clock or a machine.

pub mod frame;
pub mod json;
pub mod limits;

use std::collections::BTreeMap;

use crate::geometry::{Point3, Rect};
use crate::terrain::Terrain;
use crate::threat::Threat;
pub use frame::Frame;

/// A validated planning request: every field is finite and within its range; the start and the target are outside all
/// threats, on or above ground and inside the area.
///
/// [`json::read`] makes sure of that, and everything that takes a scenario relies on it: with a scenario that is not
/// valid, a search may panic, not end, or deliver wrong figures. Whoever fills in or changes fields in code can check
/// them by reading what [`json::write`] makes of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The caller's name for it.
    pub name: Option<String>,
    /// Meaning of the coordinates in the request; all coordinates below are in the local plane.
    pub frame: Frame,
    /// Start of the route; `z` is the height in the frame, not above ground.
    pub start: Point3,
    /// End of the route.
    pub target: Point3,
    /// Bounds of the free waypoints.
    pub area: Rect,
    /// In the order of the request.
    pub threats: Vec<Threat>,
    /// The ground under the area.
    pub terrain: Terrain,
    /// Allowed heights above ground, Eq. 6.
    pub altitude: AltitudeBand,
    /// The aircraft's capabilities.
    pub vehicle: Vehicle,
    /// Weights of Eq. 1.
    pub weights: Weights,
    /// How to search.
    pub planner: PlannerSettings,
}

impl Scenario {
    /// The straight way from the start to the target, metres.
    #[must_use]
    pub fn direct(&self) -> f64 {
        (self.target - self.start).norm()
    }
}

/// Allowed heights above ground, metres; `0 <= min < max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AltitudeBand {
    /// Lowest, `h_min`.
    pub min: f64,
    /// Highest, `h_max`.
    pub max: f64,
}

impl AltitudeBand {
    /// Where a waypoint costs nothing, Eq. 6.
    #[inline]
    #[must_use]
    pub fn middle(&self) -> f64 {
        0.5 * (self.min + self.max)
    }
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
    /// Metres per second.
    pub cruise_speed: f64,
    /// Fuel used per kilometre; with 1000 a metre costs 1, Eq. 2.
    pub fuel_per_km: f64,
}

impl Vehicle {
    /// Largest heading change between legs, radians.
    #[must_use]
    pub fn max_turn(&self) -> f64 {
        self.max_turn_deg.to_radians()
    }

    /// Largest climb or descent angle of a leg, radians.
    #[must_use]
    pub fn max_climb(&self) -> f64 {
        self.max_climb_deg.to_radians()
    }

    /// Metres that a leg may climb or descend per metre seen from above.
    #[must_use]
    pub fn steepest(&self) -> f64 {
        libm::tan(self.max_climb())
    }

    /// Cosine of the largest heading change: legs with a smaller one turn too sharply.
    #[must_use]
    pub fn sharpest(&self) -> f64 {
        libm::cos(self.max_turn())
    }
}

/// Weights of the three cost terms, Eq. 1; each >= 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Of the fuel cost, F1.
    pub fuel: f64,
    /// Of the threat exposure, F2.
    pub threat: f64,
    /// Of the distance from the middle of the altitude band, F3.
    pub altitude: f64,
}

/// How to search for the route.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannerSettings {
    /// A name from the table of algorithms.
    pub algorithm: String,
    /// Free waypoints, N.
    pub waypoints: usize,
    /// Number of bats.
    pub population: usize,
    /// Iterations after the first evaluation.
    pub iterations: usize,
    /// Below 2^53, which every JSON parser represents exactly.
    pub seed: u64,
    /// Time limit of the run, milliseconds; without it the result depends on the request alone.
    pub time_limit_ms: Option<u64>,
    /// How the initial population is generated.
    pub seeding: Seeding,
    /// Whether the best route is polished at the end.
    pub polish: bool,
    /// A known route to start from.
    pub warm_start: Option<WarmStart>,
    /// How the route is smoothed, Eq. 26-27.
    pub smoothing: Smoothing,
    /// How the threat integral of Eq. 4 is evaluated.
    pub quadrature: Quadrature,
    /// The search ends once its cost is proven to exceed the optimum by at most this fraction of it; 0 disables this.
    pub gap: f64,
    /// Threads that may evaluate routes; the result does not depend on it.
    pub threads: usize,
    /// Constants of the algorithm by name; one that is left out has its default, which [`json::read`] fills in.
    pub parameters: BTreeMap<String, f64>,
}

impl PlannerSettings {
    /// population * iterations * waypoints, limited by [`limits::Limits::work`].
    #[must_use]
    pub fn work(&self) -> u64 {
        work([self.population, self.iterations, self.waypoints])
    }
}

/// The product of the factors that make a search long.
fn work(factors: [usize; 3]) -> u64 {
    let grow = |work: u64, factor: usize| work.saturating_mul(factor as u64);
    factors.into_iter().fold(1, grow)
}

#[cfg(test)]
impl PlannerSettings {
    /// The algorithm as in the paper, without additions, at its smallest size.
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

/// How the initial population is generated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seeding {
    /// Routes along common tangents of the threats: the best few ways around them.
    Tangent,
    /// Uniformly within the bounds of the coding, as in the paper.
    Random,
}

impl Seeding {
    /// Every one.
    pub const ALL: [Self; 2] = [Self::Tangent, Self::Random];

    /// The name used in `seeding`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tangent => "tangent",
            Self::Random => "random",
        }
    }
}

/// A known route to start from.
#[derive(Debug, Clone, PartialEq)]
pub enum WarmStart {
    /// The route of a stored plan. The plan store replaces this by its waypoints before planning.
    Plan(String),
    /// In order, with or without start and target.
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

/// How the threat integral of Eq. 4 is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quadrature {
    /// Exactly, along the whole leg.
    Integral,
    /// By five samples per leg, as printed; kept to reproduce the paper's tables.
    Paper,
}

impl Quadrature {
    /// Every one; the first is the default.
    pub const ALL: [Self; 2] = [Self::Integral, Self::Paper];

    /// The name used in `quadrature`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Integral => "integral",
            Self::Paper => "paper",
        }
    }
}
