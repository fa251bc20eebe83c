//! What the planner found, in the form of its document: positions in the request's frame.

use super::{
    Bound, Checks, Clearance, Convergence, Cost, FrameDocument, Incumbent, Leg, MeasuresDocument,
    Origin, Path, Position, ResultDocument, Violation,
};
use crate::geometry::Point3;
use crate::geometry::geodesy::LatLon;
use crate::planner::{self, ConvergencePoint, CostFigures, Measures, Outcome};
use crate::scenario::frame::{Datum, Frame, Geodetic, Wgs84};

impl ResultDocument {
    /// The wire form of `outcome`.
    #[must_use]
    pub fn new(outcome: &Outcome, origin: Origin) -> Self {
        Self {
            plan_id: origin.plan_id,
            algorithm: origin.algorithm,
            seed: origin.seed,
            engine_version: env!("CARGO_PKG_VERSION").to_owned(),
            scenario_sha256: origin.scenario_sha256,
            feasible: outcome.feasible,
            stop_reason: Some(outcome.stop_reason.name().to_owned()),
            is_final: None,
            cost: outcome.cost.into(),
            cost_integral: outcome.cost_integral.map(Into::into),
            bound: Bound {
                lower: outcome.bound.lower,
                gap: outcome.bound.gap,
            },
            frame: outcome.frame.wgs84().map(Into::into),
            waypoints: positions(&outcome.waypoints, &outcome.frame),
            legs: outcome.legs.iter().copied().map(Into::into).collect(),
            path: outcome
                .path
                .as_ref()
                .map(|path| Path::of(path, &outcome.frame)),
            checks: Checks {
                waypoints: (&outcome.waypoint_checks).into(),
                path: outcome.path_checks.as_ref().map(Into::into),
                violations: outcome.violations.iter().map(Into::into).collect(),
            },
            convergence: outcome.convergence.iter().map(Into::into).collect(),
            timing: origin.timing,
            evaluations: outcome.evaluations,
        }
    }
}

fn positions(points: &[Point3], frame: &Frame) -> Vec<Position> {
    let position = |point: &Point3| Position::of(*point, frame);
    points.iter().map(position).collect()
}

impl Position {
    /// `point` of the local plane in the coordinates of `frame`.
    #[must_use]
    pub fn of(point: Point3, frame: &Frame) -> Self {
        match frame {
            Frame::Local => Self::Local {
                x: point.x,
                y: point.y,
                z: point.z,
            },
            Frame::Wgs84(wgs84) => wgs84.geodetic(point).into(),
        }
    }

    /// The point of the local plane of `frame`; `None` if it belongs to another frame.
    #[must_use]
    pub fn within(self, frame: &Frame) -> Option<Point3> {
        match (self, frame) {
            (Self::Local { x, y, z }, Frame::Local) => Some(Point3::new(x, y, z)),
            (Self::Geodetic { lat, lon, alt }, Frame::Wgs84(wgs84)) => {
                let place = LatLon { lat, lon };
                Some(wgs84.local(Geodetic { place, alt }))
            }
            _ => None,
        }
    }
}

impl From<Geodetic> for Position {
    fn from(geodetic: Geodetic) -> Self {
        Self::Geodetic {
            lat: geodetic.place.lat,
            lon: geodetic.place.lon,
            alt: geodetic.alt,
        }
    }
}

impl From<&Wgs84> for FrameDocument {
    fn from(wgs84: &Wgs84) -> Self {
        let height = wgs84.plane.height_m();
        Self {
            kind: "wgs84".to_owned(),
            altitude_datum: wgs84.datum.name().to_owned(),
            origin: Geodetic {
                place: wgs84.plane.origin(),
                alt: match wgs84.datum {
                    Datum::Msl => height - wgs84.undulation_m,
                    Datum::Ellipsoid => height,
                },
            }
            .into(),
            undulation: wgs84.undulation_m,
        }
    }
}

impl From<CostFigures> for Cost {
    fn from(figures: CostFigures) -> Self {
        Self {
            total: figures.total,
            fuel: figures.fuel,
            threat: figures.threat,
            altitude: figures.altitude,
        }
    }
}

impl From<planner::Leg> for Leg {
    fn from(leg: planner::Leg) -> Self {
        Self {
            length: leg.length,
            turn_deg: leg.turn_deg,
            climb_deg: leg.climb_deg,
        }
    }
}

impl Path {
    fn of(path: &planner::Path, frame: &Frame) -> Self {
        Self {
            points: positions(&path.points, frame),
            length: path.length,
            degree: path.degree,
            knots: path.knots.clone(),
            control_points: positions(&path.control_points, frame),
            duration_s: path.duration_s,
        }
    }
}

impl From<&Measures> for MeasuresDocument {
    fn from(measures: &Measures) -> Self {
        Self {
            clearance: measures.clearance.iter().map(Into::into).collect(),
            min_agl: measures.min_agl,
            max_agl: measures.max_agl,
            max_turn_deg: measures.max_turn_deg,
            max_climb_deg: measures.max_climb_deg,
            min_leg: measures.min_leg,
        }
    }
}

impl From<&planner::Clearance> for Clearance {
    fn from(clearance: &planner::Clearance) -> Self {
        Self {
            threat: clearance.threat,
            name: clearance.name.clone(),
            distance: clearance.distance,
        }
    }
}

impl From<&planner::Violation> for Violation {
    fn from(violation: &planner::Violation) -> Self {
        Self {
            kind: violation.kind.to_owned(),
            place: violation.place,
            amount: violation.amount,
            message: violation.message.clone(),
        }
    }
}

impl From<&ConvergencePoint> for Convergence {
    fn from(point: &ConvergencePoint) -> Self {
        Self {
            iteration: point.iteration,
            evaluations: point.evaluations,
            elapsed_ms: point.elapsed_ms,
            best_cost: point.best_cost,
            best_violation: point.best_violation,
            mean_cost: point.mean_cost,
            feasible_fraction: point.feasible_fraction,
        }
    }
}

impl From<&planner::Incumbent> for Incumbent {
    fn from(incumbent: &planner::Incumbent) -> Self {
        Self {
            iteration: incumbent.iteration,
            elapsed_ms: incumbent.elapsed_ms,
            cost: incumbent.cost,
            feasible: incumbent.feasible,
            waypoints: positions(&incumbent.waypoints, &incumbent.frame),
        }
    }
}
