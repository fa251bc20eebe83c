//! CZML: the vehicle moving over time, threats as volumes; heights above the ellipsoid.

use serde_json::{Value, json};

use super::chart::{Chart, rounded};
use super::options::Digit;
use super::outline;
use super::{Delivery, Options};
use crate::geometry::geodesy::LatLon;
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
    let begin = options.epoch;
    let end = options.instant(duration_s, Digit::Microsecond);
    let interval = format!("{begin}/{end}");
    let chart = delivery.chart();
    let mut positions: Vec<f64> = Vec::with_capacity(4 * course.len());
    for (&point, passage) in course.iter().zip(&passages) {
        // A fast vehicle passes several samples in a millisecond.
        positions.push(rounded(passage.time_s, 1e6));
        positions.extend(degrees(chart, point));
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
                // The viewer's end of the interval may lie a rounding error after the last sample.
                "forwardExtrapolationType": "HOLD",
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
    packets.extend(threats.map(|(index, threat)| volume(delivery, index, threat, shown)));
    format!("{}\n", Value::Array(packets))
}

fn waypoint(delivery: &Delivery, index: usize) -> Value {
    json!({
        "id": format!("waypoint-{index}"),
        "name": delivery.waypoint_name(index),
        "position": {"cartographicDegrees": degrees(delivery.chart(), delivery.waypoints[index])},
        "point": {"pixelSize": 5, "color": {"rgba": [255, 255, 255, 255]}},
    })
}

/// Heights above the ellipsoid between which a threat without base or top is shown: from the lowest ground below the
/// route to as far above its highest point, but at least 10 m.
fn shown_heights(delivery: &Delivery) -> (f64, f64) {
    let chart = delivery.chart();
    let mut lowest = f64::INFINITY;
    let mut highest = f64::NEG_INFINITY;
    for &point in delivery.course() {
        let height = chart.ellipsoid_m(point);
        lowest = lowest.min(height - delivery.agl(point));
        highest = highest.max(height);
    }
    (lowest, highest + (highest - lowest).max(10.0))
}

/// As CZML's `cartographicDegrees`: longitude, latitude, height above the ellipsoid.
fn degrees(chart: &Chart, point: Point3) -> [f64; 3] {
    let LatLon { lat, lon } = chart.place(point.xy());
    [lon, lat, chart.ellipsoid_m(point)]
}

/// `shown` are the heights between which it is shown at least, where it has no base or top.
fn volume(delivery: &Delivery, index: usize, threat: &Threat, shown: (f64, f64)) -> Value {
    let chart = delivery.chart();
    let middle = outline::middle(threat);
    let height = |z: f64| chart.ellipsoid_m(Point3::new(middle.x, middle.y, z));
    let over_ground = || outline::over_ground(&delivery.scenario.terrain, threat);
    let lowest = || shown.0.min(height(over_ground().0));
    let base = threat.base.map_or_else(lowest, height);
    let highest = || shown.1.max(height(over_ground().1)).max(base + 10.0);
    let top = threat.top.map_or_else(highest, height);
    let (base, top) = (rounded(base.min(top - 1.0), 1e3), rounded(top, 1e3));
    let look = json!({"solidColor": {"color": {"rgba": THREAT}}});
    let mut packet = json!({
        "id": format!("threat-{index}"),
        "name": outline::name(threat, index),
    });
    match &threat.shape {
        Shape::Cylinder(cylinder) => {
            let LatLon { lat, lon } = chart.place(middle);
            let height = rounded(f64::midpoint(base, top), 1e3);
            packet["position"] = json!({"cartographicDegrees": [lon, lat, height]});
            packet["cylinder"] = json!({
                "length": rounded(top - base, 1e3),
                "topRadius": cylinder.radius,
                "bottomRadius": cylinder.radius,
                "material": look,
            });
        }
        Shape::Polygon(_) => {
            let corner = |corner: Point2| {
                let LatLon { lat, lon } = chart.place(corner);
                [lon, lat, base]
            };
            let corners: Vec<f64> = outline::ring(threat).into_iter().flat_map(corner).collect();
            packet["polygon"] = json!({
                "positions": {"cartographicDegrees": corners},
                "height": base,
                "extrudedHeight": top,
                "material": look,
            });
        }
    }
    packet
}
