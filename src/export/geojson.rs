//! RFC 7946: path, waypoints and threats as features; heights above the ellipsoid.

use geojson::{Feature, FeatureCollection, GeometryValue, JsonObject};
use serde_json::{Value, json};

use super::chart::{Chart, rounded};
use super::{Delivery, Options, antimeridian, outline};
use crate::geometry::geodesy::LatLon;
use crate::geometry::{Point2, Point3};
use crate::planner::Place;
use crate::threat::{Shape, Threat};

/// Write a plan. An infeasible one is also written, because its violations are best seen on a map.
pub(super) fn write(delivery: &Delivery, _: &Options) -> String {
    let path = delivery.path.iter().map(|points| path(delivery, points));
    let waypoints = (0..delivery.waypoints.len()).map(|index| waypoint(delivery, index));
    let threats = delivery.scenario.threats.iter().enumerate();
    let threats = threats.map(|(index, threat)| self::threat(delivery, index, threat));
    let mut collection = FeatureCollection::new(path.chain(waypoints).chain(threats));
    // As GDAL names a layer, and our own importer a scenario.
    collection.foreign_members = delivery.scenario.name.clone().map(|name| {
        let member = ("name".to_owned(), Value::String(name));
        JsonObject::from_iter([member])
    });
    format!("{collection}\n")
}

fn path(delivery: &Delivery, points: &[Point3]) -> Feature {
    let result = &delivery.result;
    let last = delivery.passages(points);
    let last = last.last().expect("a path has points");
    let line: Vec<_> = points
        .iter()
        .map(|&point| position(delivery, point))
        .collect();
    feature(
        antimeridian::line(&line),
        json!({
            "role": "path",
            "name": delivery.scenario.name,
            "plan_id": result.plan_id,
            "feasible": result.feasible,
            "cost": result.cost.total,
            "length_m": rounded(last.distance_m, 1e3),
            "duration_s": rounded(last.time_s, 1e3),
            "fuel": rounded(last.fuel, 1e3),
            "cruise_speed": delivery.scenario.vehicle.cruise_speed,
        }),
    )
}

fn waypoint(delivery: &Delivery, index: usize) -> Feature {
    let point = delivery.waypoints[index];
    let leg = index
        .checked_sub(1)
        .and_then(|leg| delivery.result.legs.get(leg));
    let broken: Vec<&str> = violations(delivery, index).collect();
    feature(
        GeometryValue::new_point(position(delivery, point)),
        json!({
            "role": "waypoint",
            "name": delivery.waypoint_name(index),
            "index": index,
            "alt_msl": delivery.chart().msl_m(point),
            "agl": rounded(delivery.agl(point), 1e3),
            "leg_length_m": leg.map(|leg| rounded(leg.length, 1e3)),
            "violations": broken,
        }),
    )
}

/// Violations at a waypoint or on the leg that leads to it.
fn violations(delivery: &Delivery, index: usize) -> impl Iterator<Item = &str> {
    let places = [
        Some(Place::Waypoint(index)),
        index.checked_sub(1).map(Place::Leg),
    ];
    let violations = delivery.result.checks.violations.iter();
    violations
        .filter(move |violation| places.contains(&Some(violation.place)))
        .map(|violation| violation.message.as_str())
}

/// A circle is a ring with its centre and radius as properties, from which the importer restores the circle.
fn threat(delivery: &Delivery, index: usize, threat: &Threat) -> Feature {
    let chart = delivery.chart();
    let ring = outline::ring_in_degrees(chart, threat);
    let ring: Vec<_> = ring.iter().map(|at| vec![at.lon, at.lat]).collect();
    let middle = outline::middle(threat);
    let height = |z: Option<f64>| z.map(|z| chart.ellipsoid_m(Point3::new(middle.x, middle.y, z)));
    let mut properties = json!({
        "role": "threat",
        "name": outline::name(threat, index),
        "index": index,
        "base": height(threat.base),
        "top": height(threat.top),
    });
    match &threat.shape {
        Shape::Cylinder(cylinder) => {
            properties["kind"] = "cylinder".into();
            properties["center"] = flat(chart, cylinder.center).into();
            properties["radius"] = cylinder.radius.into();
            properties["influence"] = cylinder.influence.into();
        }
        Shape::Polygon(polygon) => {
            properties["kind"] = "polygon".into();
            properties["margin"] = polygon.margin().into();
        }
    }
    feature(antimeridian::ring(&ring), properties)
}

fn flat(chart: &Chart, point: Point2) -> Vec<f64> {
    let LatLon { lat, lon } = chart.place(point);
    vec![lon, lat]
}

fn position(delivery: &Delivery, point: Point3) -> Vec<f64> {
    let mut position = flat(delivery.chart(), point.xy());
    position.push(delivery.chart().ellipsoid_m(point));
    position
}

fn feature(geometry: GeometryValue, properties: Value) -> Feature {
    let Value::Object(properties) = properties else {
        unreachable!("properties are written as an object");
    };
    let properties: JsonObject = properties.into_iter().collect();
    Feature {
        bbox: None,
        geometry: Some(geometry.into()),
        id: None,
        properties: Some(properties),
        foreign_members: None,
    }
}
