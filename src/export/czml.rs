//! CZML: the vehicle moving over time, threats as volumes; heights above the ellipsoid.

use serde_json::{Value, json};

use super::chart::{Chart, rounded};
use super::outline;
use super::{Delivery, Options};
use crate::geometry::{Point2, Point3};
use crate::threat::{Shape, Threat};

/// Playback speed: seconds of the plan per second of the viewer.
const HURRY: f64 = 10.0;

/// Colours: red, green, blue and opacity.
const ROUTE: [u8; 4] = [0, 122, 255, 255];
const BROKEN: [u8; 4] = [208, 2, 27, 255];
const THREAT: [u8; 4] = [208, 2, 27, 90];

/// Write a plan. Without a path, the vehicle flies the waypoints.
pub(super) fn write(delivery: &Delivery, options: &Options) -> String {
    let course = delivery.course();
    let passages = delivery.passages(course);
    let duration_s = passages[passages.len() - 1].time_s;
    let (begin, end) = (options.epoch, options.instant(duration_s));
    let interval = format!("{begin}/{end}");
    let chart = delivery.chart();
    let mut positions: Vec<f64> = Vec::with_capacity(4 * course.len());
    for (&point, passage) in course.iter().zip(&passages) {
        let fix = chart.fix(point);
        positions.extend([
            rounded(passage.time_s, 1e3),
            fix.lon,
            fix.lat,
            fix.ellipsoid_m,
        ]);
    }
    let color = if delivery.result.feasible {
        ROUTE
    } else {
        BROKEN
    };
    let mut packets = vec![
        json!({
            "id": "document",
            "name": delivery.title(),
            "version": "1.0",
            "clock": {
                "interval": interval,
                "currentTime": begin.to_string(),
                "multiplier": HURRY,
                "range": "LOOP_STOP",
            },
        }),
        json!({
            "id": "vehicle",
            "name": delivery.title(),
            "description": delivery.summary(),
            "availability": interval,
            "position": {
                "epoch": begin.to_string(),
                "interpolationAlgorithm": "LINEAR",
                "cartographicDegrees": positions,
            },
            "point": {"pixelSize": 10, "color": {"rgba": color}},
            "path": {
                "width": 3,
                "leadTime": rounded(duration_s, 1e3),
                "trailTime": rounded(duration_s, 1e3),
                "material": {"solidColor": {"color": {"rgba": color}}},
            },
        }),
    ];
    packets.extend((0..delivery.waypoints.len()).map(|index| waypoint(delivery, index)));
    let shown = shown_heights(delivery);
    let threats = delivery.scenario.threats.iter().enumerate();
    packets.extend(threats.map(|(index, threat)| volume(chart, index, threat, shown)));
    format!("{}\n", Value::Array(packets))
}

fn waypoint(delivery: &Delivery, index: usize) -> Value {
    let fix = delivery.chart().fix(delivery.waypoints[index]);
    json!({
        "id": format!("waypoint-{index}"),
        "name": delivery.waypoint_name(index),
        "position": {"cartographicDegrees": [fix.lon, fix.lat, fix.ellipsoid_m]},
        "point": {"pixelSize": 5, "color": {"rgba": [255, 255, 255, 255]}},
    })
}

/// Heights between which a threat without base or top is shown, in the scenario's frame: from the lowest ground below
/// the route to as far above its highest point, but at least 10 m.
fn shown_heights(delivery: &Delivery) -> (f64, f64) {
    let mut lowest = f64::INFINITY;
    let mut highest = f64::NEG_INFINITY;
    for &point in delivery.course() {
        lowest = lowest.min(point.z - delivery.agl(point));
        highest = highest.max(point.z);
    }
    (lowest, highest + (highest - lowest).max(10.0))
}

fn volume(chart: &Chart, index: usize, threat: &Threat, shown: (f64, f64)) -> Value {
    let base = threat.base.unwrap_or(shown.0);
    let top = threat.top.unwrap_or(shown.1.max(base + 10.0));
    let base = base.min(top - 1.0);
    let look = json!({"solidColor": {"color": {"rgba": THREAT}}});
    let mut packet = json!({
        "id": format!("threat-{index}"),
        "name": outline::name(threat, index),
    });
    match &threat.shape {
        Shape::Cylinder(cylinder) => {
            let Point2 { coords: middle, .. } = cylinder.center;
            let fix = chart.fix(Point3::new(middle.x, middle.y, f64::midpoint(base, top)));
            packet["position"] =
                json!({"cartographicDegrees": [fix.lon, fix.lat, fix.ellipsoid_m]});
            packet["cylinder"] = json!({
                "length": rounded(top - base, 1e3),
                "topRadius": cylinder.radius,
                "bottomRadius": cylinder.radius,
                "material": look,
            });
        }
        Shape::Polygon(_) => {
            let ring = outline::ring(chart, threat, base);
            let corners: Vec<f64> = ring
                .iter()
                .flat_map(|fix| [fix.lon, fix.lat, fix.ellipsoid_m])
                .collect();
            packet["polygon"] = json!({
                "positions": {"cartographicDegrees": corners},
                "height": chart.ellipsoid_m(base),
                "extrudedHeight": chart.ellipsoid_m(top),
                "material": look,
            });
        }
    }
    packet
}
