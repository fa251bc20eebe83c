//! A scenario to its document: every default filled in, the same bytes for equal scenarios.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use crate::geometry::{Point2, Point3, Rect};
use crate::scenario::{Quadrature, Scenario, Seeding, WarmStart};
use crate::terrain::{Peak, Terrain};
use crate::threat::{Shape, Threat};

use super::tree::whole_or_float;

/// The accepted document as compact JSON; reading it gives an equal scenario.
pub(super) fn write(scenario: &Scenario) -> String {
    serde_json::to_string(&Document::from(scenario))
        .expect("wire structs have text keys and finite numbers")
}

/// A number, written `3` rather than `3.0`.
#[derive(Debug, Clone, Copy)]
struct Figure(f64);

impl Serialize for Figure {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        whole_or_float(self.0).serialize(serializer)
    }
}

#[derive(Serialize)]
struct Document<'a> {
    name: Option<&'a str>,
    frame: &'static str,
    start: XYZ,
    target: XYZ,
    area: Area,
    threats: Vec<WireThreat<'a>>,
    terrain: WireTerrain<'a>,
    altitude: Band,
    vehicle: WireVehicle,
    weights: WireWeights,
    planner: WirePlanner<'a>,
}

#[derive(Serialize)]
#[expect(clippy::upper_case_acronyms, reason = "named for its fields")]
struct XYZ {
    x: Figure,
    y: Figure,
    z: Figure,
}

#[derive(Serialize)]
struct XY {
    x: Figure,
    y: Figure,
}

#[derive(Serialize)]
struct Area {
    min: XY,
    max: XY,
}

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum WireThreat<'a> {
    Cylinder {
        name: Option<&'a str>,
        center: XY,
        radius: Figure,
        influence: Figure,
        base: Option<Figure>,
        top: Option<Figure>,
    },
    Polygon {
        name: Option<&'a str>,
        vertices: Vec<XY>,
        margin: Figure,
        base: Option<Figure>,
        top: Option<Figure>,
    },
}

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum WireTerrain<'a> {
    Flat {
        elevation: Figure,
    },
    Peaks {
        base: Figure,
        peaks: Vec<WirePeak>,
    },
    Grid {
        origin: XY,
        cell: Figure,
        columns: usize,
        rows: usize,
        #[serde(serialize_with = "figures")]
        elevations: &'a [f64],
    },
    Dataset {
        name: &'a str,
    },
}

#[derive(Serialize)]
struct WirePeak {
    center: XY,
    height: Figure,
    spread: XY,
}

#[derive(Serialize)]
struct Band {
    min: Figure,
    max: Figure,
}

#[derive(Serialize)]
struct WireVehicle {
    max_turn_deg: Figure,
    max_climb_deg: Figure,
    min_leg: Figure,
    cruise_speed: Figure,
    fuel_per_km: Figure,
}

#[derive(Serialize)]
struct WireWeights {
    fuel: Figure,
    threat: Figure,
    altitude: Figure,
}

#[derive(Serialize)]
struct WirePlanner<'a> {
    algorithm: &'a str,
    waypoints: usize,
    population: usize,
    iterations: usize,
    seed: u64,
    time_limit_ms: Option<u64>,
    seeding: &'static str,
    polish: bool,
    warm_start: Option<WireWarmStart<'a>>,
    smoothing: WireSmoothing,
    parameters: WireParameters<'a>,
}

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum WireWarmStart<'a> {
    PlanId(&'a str),
    Waypoints(Vec<XYZ>),
}

#[derive(Serialize)]
struct WireSmoothing {
    degree: usize,
    spacing: Figure,
}

#[derive(Serialize)]
struct WireParameters<'a> {
    quadrature: &'static str,
    gap: Figure,
    threads: usize,
    #[serde(flatten)]
    constants: BTreeMap<&'a str, Figure>,
}

impl<'a> From<&'a Scenario> for Document<'a> {
    fn from(scenario: &'a Scenario) -> Self {
        let (vehicle, weights) = (&scenario.vehicle, &scenario.weights);
        Self {
            name: scenario.name.as_deref(),
            frame: "local",
            start: scenario.start.into(),
            target: scenario.target.into(),
            area: scenario.area.into(),
            threats: scenario.threats.iter().map(WireThreat::from).collect(),
            terrain: (&scenario.terrain).into(),
            altitude: Band {
                min: Figure(scenario.altitude.min),
                max: Figure(scenario.altitude.max),
            },
            vehicle: WireVehicle {
                max_turn_deg: Figure(vehicle.max_turn_deg),
                max_climb_deg: Figure(vehicle.max_climb_deg),
                min_leg: Figure(vehicle.min_leg),
                cruise_speed: Figure(vehicle.cruise_speed),
                fuel_per_km: Figure(vehicle.fuel_per_km),
            },
            weights: WireWeights {
                fuel: Figure(weights.fuel),
                threat: Figure(weights.threat),
                altitude: Figure(weights.altitude),
            },
            planner: WirePlanner::from(&scenario.planner),
        }
    }
}

impl From<Point3> for XYZ {
    fn from(point: Point3) -> Self {
        Self {
            x: Figure(point.x),
            y: Figure(point.y),
            z: Figure(point.z),
        }
    }
}

impl From<Point2> for XY {
    fn from(point: Point2) -> Self {
        Self {
            x: Figure(point.x),
            y: Figure(point.y),
        }
    }
}

impl From<Rect> for Area {
    fn from(rect: Rect) -> Self {
        Self {
            min: rect.min.into(),
            max: rect.max.into(),
        }
    }
}

impl<'a> From<&'a Threat> for WireThreat<'a> {
    fn from(threat: &'a Threat) -> Self {
        let (name, base, top) = (
            threat.name.as_deref(),
            threat.base.map(Figure),
            threat.top.map(Figure),
        );
        match &threat.shape {
            Shape::Cylinder(cylinder) => Self::Cylinder {
                name,
                center: cylinder.center.into(),
                radius: Figure(cylinder.radius),
                influence: Figure(cylinder.influence),
                base,
                top,
            },
            Shape::Polygon(polygon) => Self::Polygon {
                name,
                vertices: polygon.vertices().iter().copied().map(XY::from).collect(),
                margin: Figure(polygon.margin()),
                base,
                top,
            },
        }
    }
}

impl<'a> From<&'a Terrain> for WireTerrain<'a> {
    fn from(terrain: &'a Terrain) -> Self {
        match terrain {
            Terrain::Flat(flat) => Self::Flat {
                elevation: Figure(flat.elevation),
            },
            Terrain::Peaks(peaks) => Self::Peaks {
                base: Figure(peaks.base),
                peaks: peaks.peaks.iter().map(WirePeak::from).collect(),
            },
            Terrain::Grid(grid) => Self::Grid {
                origin: grid.origin.into(),
                cell: Figure(grid.cell),
                columns: grid.columns,
                rows: grid.rows,
                elevations: &grid.elevations,
            },
            Terrain::Dem(dem) => Self::Dataset { name: dem.name() },
        }
    }
}

impl From<&Peak> for WirePeak {
    fn from(peak: &Peak) -> Self {
        Self {
            center: peak.center.into(),
            height: Figure(peak.height),
            spread: peak.spread.into(),
        }
    }
}

impl<'a> From<&'a WarmStart> for WireWarmStart<'a> {
    fn from(start: &'a WarmStart) -> Self {
        match start {
            WarmStart::Plan(id) => Self::PlanId(id),
            WarmStart::Waypoints(points) => {
                Self::Waypoints(points.iter().copied().map(XYZ::from).collect())
            }
        }
    }
}

impl<'a> From<&'a crate::scenario::PlannerSettings> for WirePlanner<'a> {
    fn from(planner: &'a crate::scenario::PlannerSettings) -> Self {
        let constants = planner
            .parameters
            .iter()
            .map(|(name, value)| (name.as_str(), Figure(*value)));
        Self {
            algorithm: &planner.algorithm,
            waypoints: planner.waypoints,
            population: planner.population,
            iterations: planner.iterations,
            seed: planner.seed,
            time_limit_ms: planner.time_limit_ms,
            seeding: match planner.seeding {
                Seeding::Tangent => "tangent",
                Seeding::Random => "random",
            },
            polish: planner.polish,
            warm_start: planner.warm_start.as_ref().map(WireWarmStart::from),
            smoothing: WireSmoothing {
                degree: planner.smoothing.degree,
                spacing: Figure(planner.smoothing.spacing),
            },
            parameters: WireParameters {
                quadrature: match planner.quadrature {
                    Quadrature::Integral => "integral",
                    Quadrature::Paper => "paper",
                },
                gap: Figure(planner.gap),
                threads: planner.threads,
                constants: constants.collect(),
            },
        }
    }
}

fn figures<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(values.iter().map(|value| Figure(*value)))
}
