//! The stored documents, parsed: the input of all formats.

use super::chart::Chart;
use super::document::{Position, ResultDocument};
use super::{ExportError, ResultInput};
use crate::geometry::Point3;
use crate::scenario::{Frame, Scenario, json};

/// A plan: its request and its result.
pub(super) struct Delivery {
    pub(super) scenario: Scenario,
    pub(super) result: ResultDocument,
    /// Points of the local plane.
    pub(super) waypoints: Vec<Point3>,
    /// Samples of the smoothed path, on the local plane; `None` when infeasible.
    pub(super) path: Option<Vec<Point3>>,
    /// Mapping of the local plane to the earth; `None` in a local frame.
    pub(super) chart: Option<Chart>,
}

/// Progress of the vehicle at a point of its route.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Passage {
    /// Distance flown so far, metres.
    pub(super) distance_m: f64,
    /// Time since the start at cruise speed, seconds.
    pub(super) time_s: f64,
    /// Fuel used so far, in the unit of `fuel_per_km`.
    pub(super) fuel: f64,
}

impl Delivery {
    /// Parse both documents.
    ///
    /// # Errors
    /// [`ExportError::Unread`] when the request cannot be read, [`ExportError::Damaged`] when the result cannot or its
    /// route has no extent.
    pub(super) fn read(input: &ResultInput) -> Result<Self, ExportError> {
        let scenario = json::read_accepted(input.scenario, input.rules)?;
        let result: ResultDocument = serde_json::from_str(input.result)
            .map_err(|error| ExportError::Damaged(format!("the result: {error}")))?;
        let frame = &scenario.frame;
        let waypoints = points(&result.waypoints, frame)?;
        let path = result.path.as_ref();
        let path = path.map(|path| points(&path.points, frame)).transpose()?;
        Ok(Self {
            waypoints,
            path,
            chart: Chart::of(frame),
            scenario,
            result,
        })
    }

    /// The best known route of the vehicle: the path, else the waypoints.
    pub(super) fn course(&self) -> &[Point3] {
        self.path.as_deref().unwrap_or(&self.waypoints)
    }

    /// Mapping of the local plane to the earth.
    ///
    /// # Panics
    /// In a local frame, for which no geodetic format is written.
    pub(super) fn chart(&self) -> &Chart {
        self.chart
            .as_ref()
            .expect("a format of degrees is asked for degrees alone")
    }

    /// `start`, `P1` and so on, `target`.
    pub(super) fn waypoint_name(&self, index: usize) -> String {
        match index {
            0 => "start".to_owned(),
            index if index + 1 == self.waypoints.len() => "target".to_owned(),
            index => format!("P{index}"),
        }
    }

    /// Name of the plan for display.
    pub(super) fn title(&self) -> &str {
        self.scenario.name.as_deref().unwrap_or("Noctule plan")
    }

    /// Height of `point` above the ground, metres.
    pub(super) fn agl(&self, point: Point3) -> f64 {
        self.scenario.terrain.height_of(point)
    }

    /// Progress along `points`, one entry per point.
    pub(super) fn passages(&self, points: &[Point3]) -> Vec<Passage> {
        let vehicle = &self.scenario.vehicle;
        let mut distance_m = 0.0;
        let mut before = points.first().copied();
        points
            .iter()
            .map(|&point| {
                distance_m += before.map_or(0.0, |before| (point - before).norm());
                before = Some(point);
                Passage {
                    distance_m,
                    time_s: distance_m / vehicle.cruise_speed,
                    fuel: distance_m / 1000.0 * vehicle.fuel_per_km,
                }
            })
            .collect()
    }

    /// A summary of the plan in a sentence or two.
    pub(super) fn summary(&self) -> String {
        let last = self.passages(self.course());
        let last = last.last().expect("a course has points");
        let feasible = if self.result.feasible {
            "feasible"
        } else {
            "INFEASIBLE: this route breaks constraints"
        };
        format!(
            "{feasible}; {:.0} m in {:.0} s; planned by noctule {} ({}, seed {})",
            last.distance_m,
            last.time_s,
            self.result.engine_version,
            self.result.algorithm,
            self.result.seed
        )
    }
}

fn points(positions: &[Position], frame: &Frame) -> Result<Vec<Point3>, ExportError> {
    if positions.len() < 2 {
        let count = positions.len();
        return Err(ExportError::Damaged(format!(
            "the result: a route of {count} points, must have two or more"
        )));
    }
    let points = positions.iter().map(|position| position.within(frame));
    let points: Option<Vec<Point3>> = points.collect();
    points.ok_or_else(|| {
        ExportError::Damaged("the result: in another frame than its scenario".to_owned())
    })
}
