//! Writes a scenario as a document: every default filled in, the same bytes for equal scenarios.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use crate::geometry::geodesy::LatLon;
use crate::geometry::{Point2, Point3};
use crate::scenario::{Frame, PlannerSettings, Scenario, WarmStart};
use crate::terrain::{Peak, Terrain};
use crate::threat::{Shape, Threat};

use super::tree::whole_or_float;

/// Initial capacity, bytes; enough for most documents.
const ROOM: usize = 2_048;

/// The accepted document as compact JSON; reading it gives an equal scenario.
pub(super) fn write(scenario: &Scenario) -> String {
    let mut text = Vec::with_capacity(ROOM);
    serde_json::to_writer(&mut text, &Document::from(scenario))
        .expect("wire structs have text keys and finite numbers");
    String::from_utf8(text).expect("JSON is UTF-8")
}

/// A number, written `3` rather than `3.0`; what is no finite number, as only a scenario made by hand has, is written
/// `null`, which the reader refuses.
#[derive(Debug, Clone, Copy)]
struct Figure(f64);

impl Serialize for Figure {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let finite = self.0.is_finite().then(|| whole_or_float(self.0));
        finite.serialize(serializer)
    }
}

#[derive(Serialize)]
struct Document<'a> {
    name: Option<&'a str>,
    frame: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    altitude_datum: Option<&'static str>,
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

/// A point in its frame's coordinates.
#[derive(Serialize)]
#[serde(untagged)]
#[expect(clippy::upper_case_acronyms, reason = "named for its fields")]
enum XYZ {
    Local {
        x: Figure,
        y: Figure,
        z: Figure,
    },
    Geodetic {
        lat: Figure,
        lon: Figure,
        alt: Figure,
    },
}

/// A place in its frame's coordinates.
#[derive(Serialize)]
#[serde(untagged)]
enum XY {
    Local { x: Figure, y: Figure },
    Geodetic { lat: Figure, lon: Figure },
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
        sha256: &'a str,
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
        let frame = &scenario.frame;
        Self {
            name: scenario.name.as_deref(),
            frame: match scenario.frame {
                Frame::Local => "local",
                Frame::Wgs84(_) => "wgs84",
            },
            altitude_datum: scenario.frame.wgs84().map(|wgs84| wgs84.datum.name()),
            start: XYZ::of(scenario.start, frame),
            target: XYZ::of(scenario.target, frame),
            area: Area::of(scenario),
            threats: scenario
                .threats
                .iter()
                .map(|threat| WireThreat::of(threat, frame))
                .collect(),
            terrain: WireTerrain::of(&scenario.terrain, frame),
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
            planner: WirePlanner::of(&scenario.planner, frame),
        }
    }
}

impl XYZ {
    fn of(point: Point3, frame: &Frame) -> Self {
        match XY::of(point.xy(), frame) {
            XY::Local { x, y } => Self::Local {
                x,
                y,
                z: Figure(point.z),
            },
            XY::Geodetic { lat, lon } => Self::Geodetic {
                lat,
                lon,
                alt: Figure(point.z),
            },
        }
    }
}

impl XY {
    fn of(point: Point2, frame: &Frame) -> Self {
        match frame {
            Frame::Local => Self::pair(point),
            Frame::Wgs84(wgs84) => wgs84.place(point).into(),
        }
    }

    /// Metres along two axes, whatever the frame.
    fn pair(point: Point2) -> Self {
        Self::Local {
            x: Figure(point.x),
            y: Figure(point.y),
        }
    }
}

impl From<LatLon> for XY {
    fn from(place: LatLon) -> Self {
        Self::Geodetic {
            lat: Figure(place.lat),
            lon: Figure(place.lon),
        }
    }
}

impl Area {
    fn of(scenario: &Scenario) -> Self {
        match &scenario.frame {
            Frame::Local => Self {
                min: XY::pair(scenario.area.min),
                max: XY::pair(scenario.area.max),
            },
            Frame::Wgs84(wgs84) => Self {
                min: wgs84.area.min.into(),
                max: wgs84.area.max.into(),
            },
        }
    }
}

impl<'a> WireThreat<'a> {
    fn of(threat: &'a Threat, frame: &Frame) -> Self {
        let (name, base, top) = (
            threat.name.as_deref(),
            threat.base.map(Figure),
            threat.top.map(Figure),
        );
        match &threat.shape {
            Shape::Cylinder(cylinder) => Self::Cylinder {
                name,
                center: XY::of(cylinder.center, frame),
                radius: Figure(cylinder.radius),
                influence: Figure(cylinder.influence),
                base,
                top,
            },
            Shape::Polygon(polygon) => Self::Polygon {
                name,
                vertices: polygon
                    .vertices()
                    .iter()
                    .map(|vertex| XY::of(*vertex, frame))
                    .collect(),
                margin: Figure(polygon.margin()),
                base,
                top,
            },
        }
    }
}

impl<'a> WireTerrain<'a> {
    fn of(terrain: &'a Terrain, frame: &Frame) -> Self {
        match terrain {
            Terrain::Flat(flat) => Self::Flat {
                elevation: Figure(flat.elevation),
            },
            Terrain::Peaks(peaks) => Self::Peaks {
                base: Figure(peaks.base),
                peaks: peaks
                    .peaks
                    .iter()
                    .map(|peak| WirePeak::of(peak, frame))
                    .collect(),
            },
            Terrain::Grid(grid) => Self::Grid {
                origin: XY::of(grid.origin, frame),
                cell: Figure(grid.cell),
                columns: grid.columns,
                rows: grid.rows,
                elevations: &grid.elevations,
            },
            Terrain::Dem(dem) => Self::Dataset {
                name: dem.name(),
                sha256: dem.sha256(),
            },
        }
    }
}

impl WirePeak {
    fn of(peak: &Peak, frame: &Frame) -> Self {
        Self {
            center: XY::of(peak.center, frame),
            height: Figure(peak.height),
            spread: XY::pair(peak.spread),
        }
    }
}

impl<'a> WireWarmStart<'a> {
    fn of(start: &'a WarmStart, frame: &Frame) -> Self {
        match start {
            WarmStart::Plan(id) => Self::PlanId(id),
            WarmStart::Waypoints(points) => {
                Self::Waypoints(points.iter().map(|point| XYZ::of(*point, frame)).collect())
            }
        }
    }
}

impl<'a> WirePlanner<'a> {
    fn of(planner: &'a PlannerSettings, frame: &Frame) -> Self {
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
            seeding: planner.seeding.name(),
            polish: planner.polish,
            warm_start: planner
                .warm_start
                .as_ref()
                .map(|start| WireWarmStart::of(start, frame)),
            smoothing: WireSmoothing {
                degree: planner.smoothing.degree,
                spacing: Figure(planner.smoothing.spacing),
            },
            parameters: WireParameters {
                quadrature: planner.quadrature.name(),
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
