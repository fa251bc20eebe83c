//! What a run delivers. Lengths are in metres, angles in degrees.

use super::Place;
use crate::cost::CostFigures;
use crate::geometry::Point3;
use crate::scenario::Frame;

/// The end of a run: the best route, its price, its certificate and how it was found. Here and in what follows, lengths
/// are in metres and angles in degrees.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The meaning of the request's coordinates; all coordinates here are in the local plane.
    pub frame: Frame,
    /// Whether the waypoints meet every constraint.
    pub feasible: bool,
    /// Why the search ended.
    pub stop_reason: StopReason,
    /// The figures that were minimised.
    pub cost: CostFigures,
    /// With the paper's quadrature, the same route priced by the exact integral.
    pub cost_integral: Option<CostFigures>,
    /// How far from the optimum the route can be.
    pub bound: Bound,
    /// Start, the N free waypoints, target.
    pub waypoints: Vec<Point3>,
    /// N + 1 legs.
    pub legs: Vec<Leg>,
    /// The smoothed route; `None` when no feasible route was found.
    pub path: Option<Path>,
    /// Measured on the waypoints.
    pub waypoint_checks: Measures,
    /// Measured on the path; `None` without one.
    pub path_checks: Option<Measures>,
    /// Every constraint that the waypoints break.
    pub violations: Vec<Violation>,
    /// One point an iteration, the first evaluation included, and one for what improved routes after the last.
    pub convergence: Vec<ConvergencePoint>,
    /// Routes priced in all.
    pub evaluations: u64,
}

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// All iterations were done.
    Iterations,
    /// The proven gap closed.
    Converged,
    /// The request's time limit passed.
    TimeLimit,
    /// Somebody asked for it.
    Cancelled,
}

impl StopReason {
    /// The name on the wire.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Iterations => "iterations",
            Self::Converged => "converged",
            Self::TimeLimit => "time-limit",
            Self::Cancelled => "cancelled",
        }
    }
}

/// A proven lower bound on the total cost of any feasible route for the scenario.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// No feasible route costs less.
    pub lower: f64,
    /// `total / lower - 1`; `None` when infeasible or when `lower` is 0.
    pub gap: Option<f64>,
}

/// One straight piece of the route.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// 3-D length, metres.
    pub length: f64,
    /// Heading change at the leg's start, left positive; 0 on the first.
    pub turn_deg: f64,
    /// Up positive.
    pub climb_deg: f64,
}

/// The smoothed route, Eq. 26-27: what a vehicle flies.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Samples of the spline; the polyline through them is free of violations.
    pub points: Vec<Point3>,
    /// Length of that polyline, metres.
    pub length: f64,
    /// Degree of the spline.
    pub degree: usize,
    /// `control_points + degree + 1` clamped knots.
    pub knots: Vec<f64>,
    /// Control points of the spline.
    pub control_points: Vec<Point3>,
    /// `length` over the cruise speed, seconds.
    pub duration_s: f64,
}

/// What was measured along a polyline, continuously.
#[derive(Debug, Clone, PartialEq)]
pub struct Measures {
    /// One per threat, in order.
    pub clearance: Vec<Clearance>,
    /// Least height above ground outside the terminal zones, metres; `None` when the route never leaves them.
    pub min_agl: Option<f64>,
    /// Greatest height above ground outside the terminal zones, metres.
    pub max_agl: Option<f64>,
    /// Largest heading change, degrees.
    pub max_turn_deg: f64,
    /// Climb of the steepest leg, up or down, degrees.
    pub max_climb_deg: f64,
    /// Length of the shortest leg, metres.
    pub min_leg: f64,
}

/// How close a route comes to one threat.
#[derive(Debug, Clone, PartialEq)]
pub struct Clearance {
    /// Index of the threat in the scenario.
    pub threat: usize,
    /// The threat's name.
    pub name: Option<String>,
    /// Horizontal metres to its boundary, negative inside; `None` when the route is never between
    /// its base and top.
    pub distance: Option<f64>,
}

/// One broken constraint.
#[derive(Debug, Clone, PartialEq)]
pub struct Violation {
    /// One of `threat`, `altitude`, `terrain`, `turn`, `climb`, `leg` and `area`.
    pub kind: &'static str,
    /// Where.
    pub place: Place,
    /// Metres or degrees beyond the limit.
    pub amount: f64,
    /// For people.
    pub message: String,
}

/// The state of the search after an iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConvergencePoint {
    /// 0 is the first evaluation.
    pub iteration: usize,
    /// Routes priced so far.
    pub evaluations: u64,
    /// Since the run began, milliseconds.
    pub elapsed_ms: f64,
    /// Of the best feasible route; `None` until there is one.
    pub best_cost: Option<f64>,
    /// Total violation of the best route; 0 when feasible.
    pub best_violation: f64,
    /// Mean cost of the population.
    pub mean_cost: f64,
    /// Share of the population that is feasible.
    pub feasible_fraction: f64,
}

/// A new best route.
#[derive(Debug, Clone, PartialEq)]
pub struct Incumbent {
    /// What the request's coordinates mean; those here are in the local plane.
    pub frame: Frame,
    /// When it was found.
    pub iteration: usize,
    /// Since the run began, milliseconds.
    pub elapsed_ms: f64,
    /// Its total cost.
    pub cost: f64,
    /// Whether it meets every constraint.
    pub feasible: bool,
    /// Start, free waypoints, target.
    pub waypoints: Vec<Point3>,
}
