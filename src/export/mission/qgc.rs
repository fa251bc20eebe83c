//! A QGroundControl plan: mission, fences and rally points in one JSON document.

use geojson::Position;
use serde_json::{Value, json};

use super::items::{Item, Mission, Place, mission};
use crate::cost::Tolerance;
use crate::export::chart::Chart;
use crate::export::{Altitude, Delivery, ExportError, Firmware, Options, antimeridian, outline};
use crate::geometry::geodesy::LatLon;
use crate::geometry::{Point3, Segment};
use crate::threat::{Shape, Threat};

/// MAVLink autopilots (`MAV_AUTOPILOT`).
const PX4: u8 = 12;
const ARDUPILOT: u8 = 3;

/// A quadrotor in MAVLink's `MAV_TYPE`: it can fly every route planned here.
const QUADROTOR: u8 = 2;

/// Write the mission of a plan, with its threats as fences.
pub(in crate::export) fn write(
    delivery: &Delivery,
    options: &Options,
) -> Result<String, ExportError> {
    let chart = delivery.chart();
    let mission = mission(delivery, options)?;
    let mode = altitude_mode(options);
    let items = mission.items.iter().enumerate();
    let items: Vec<Value> = items
        .map(|(index, item)| simple(index, item, mode))
        .collect();
    let Place {
        lat, lon, msl_m, ..
    } = mission.home;
    let speed = delivery.scenario.vehicle.cruise_speed;
    let (fence, left_out) = fence(delivery, chart, &mission);
    let document = json!({
        "fileType": "Plan",
        "version": 1,
        "groundStation": "Noctule",
        "mission": {
            "version": 2,
            "firmwareType": match options.firmware {
                Firmware::Px4 => PX4,
                Firmware::ArduPilot => ARDUPILOT,
            },
            "vehicleType": QUADROTOR,
            "globalPlanAltitudeMode": mode,
            "cruiseSpeed": speed,
            "hoverSpeed": speed,
            "plannedHomePosition": [lat, lon, msl_m],
            "items": items,
        },
        "geoFence": fence,
        "rallyPoints": {"version": 2, "points": []},
        "noctule": {
            "plan_id": delivery.result.plan_id,
            "feasible": delivery.result.feasible,
            "summary": delivery.summary(),
            "threats_without_fence": left_out,
        },
    });
    Ok(format!("{document:#}\n"))
}

/// The ground station's number for the altitude mode.
fn altitude_mode(options: &Options) -> u8 {
    match (options.altitude, options.firmware) {
        (Altitude::Relative, _) => 1,
        (Altitude::Absolute, _) => 2,
        (Altitude::Terrain, Firmware::Px4) => 3,
        (Altitude::Terrain, Firmware::ArduPilot) => 4,
    }
}

fn simple(index: usize, item: &Item, mode: u8) -> Value {
    let [one, two, three, four] = item.params;
    let mut document = json!({
        "type": "SimpleItem",
        "autoContinue": true,
        "command": item.command,
        "doJumpId": index + 1,
        "frame": item.frame,
        "params": [one, two, three, four, 0, 0, 0],
    });
    if let Some(place) = item.place {
        document["params"] = json!([
            one,
            two,
            three,
            four,
            place.lat,
            place.lon,
            place.altitude_m
        ]);
        // The altitude as a user would enter it in this mode, and the resulting one.
        let typed = if mode == 3 {
            place.agl_m
        } else {
            place.altitude_m
        };
        document["Altitude"] = typed.into();
        document["AltitudeMode"] = mode.into();
        document["AMSLAltAboveTerrain"] = (mode >= 3).then_some(place.msl_m).into();
    }
    document
}

/// The threats as fences, and those left out: a fence has no height, so one for a threat that the mission passes
/// above or below would stop it.
fn fence(delivery: &Delivery, chart: &Chart, mission: &Mission) -> (Value, Vec<Value>) {
    let tolerance_m = Tolerance::of(&delivery.scenario).length_m;
    let (mut circles, mut polygons, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
    for (index, threat) in delivery.scenario.threats.iter().enumerate() {
        if is_passed_at_another_height(threat, &mission.route, tolerance_m) {
            left_out.push(json!({"threat": index, "name": threat.name}));
            continue;
        }
        match &threat.shape {
            Shape::Cylinder(cylinder) => {
                let at = chart.place(cylinder.center);
                circles.push(json!({
                    "version": 1,
                    "inclusion": false,
                    "circle": {"center": [at.lat, at.lon], "radius": cylinder.radius},
                }));
            }
            Shape::Polygon(_) => {
                polygons.extend(polygon_fences(&outline::ring_in_degrees(chart, threat)));
            }
        }
    }
    let fence = json!({"version": 2, "circles": circles, "polygons": polygons});
    (fence, left_out)
}

/// A fence for each part of a ring between 180 degrees west and 180 degrees east: PX4 compares longitudes as numbers, and
/// would take a ring with corners on either side for one round the rest of the earth.
fn polygon_fences(ring: &[LatLon]) -> Vec<Value> {
    let corners = ring.iter().map(|LatLon { lat, lon }| vec![*lon, *lat]);
    let parts = antimeridian::parts(&corners.collect::<Vec<_>>()).into_iter();
    let fence = |part: Vec<Position>| {
        let corners: Vec<_> = part.iter().map(|corner| [corner[1], corner[0]]).collect();
        json!({"version": 1, "inclusion": false, "polygon": corners})
    };
    parts.map(fence).collect()
}

/// Whether `route` would enter the threat if it had neither base nor top, by more than a feasible route may.
fn is_passed_at_another_height(threat: &Threat, route: &[Point3], tolerance_m: f64) -> bool {
    if threat.base.is_none() && threat.top.is_none() {
        return false;
    }
    let everywhere = Threat {
        base: None,
        top: None,
        ..threat.clone()
    };
    route.windows(2).any(|ends| {
        let leg = Segment {
            a: ends[0],
            b: ends[1],
        };
        everywhere
            .clearance(&leg)
            .is_some_and(|clear| clear < -tolerance_m)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point2;
    use crate::threat::Cylinder;

    #[test]
    fn what_is_flown_round_is_not_passed_at_another_height() {
        let route = [
            Point3::new(-500.0, 0.0, 50.0),
            Point3::new(500.0, 0.0, 50.0),
        ];
        let check = |radius: f64, top: Option<f64>, expected: bool| {
            let threat = Threat {
                name: None,
                shape: Shape::Cylinder(Cylinder {
                    center: Point2::new(0.0, 100.0),
                    radius,
                    influence: radius,
                }),
                base: None,
                top,
            };
            let passed = is_passed_at_another_height(&threat, &route, 1e-6);
            assert_eq!(passed, expected, "{radius} {top:?}");
        };
        check(99.0, Some(40.0), false);
        // As close as a feasible route may come.
        check(100.0 + 5e-7, Some(40.0), false);
        check(100.1, Some(40.0), true);
        check(100.1, None, false);
    }
}
