//! Documents in degrees: projected onto a plane, written back unchanged, refused where no plane fits.

use noctule::geometry::Point2;
use noctule::geometry::geodesy::undulation_m;
use noctule::scenario::frame::{Datum, Wgs84};
use noctule::scenario::{Scenario, json};
use proptest::prelude::*;
use serde_json::{Value, json};

use super::{faults, read};
use crate::support::process::run;

/// Refusals specific to degrees: the document, the pointer, the code and the detail.
pub(super) fn cases() -> Vec<(String, &'static str, &'static str, &'static str)> {
    let mut wide = document();
    wide["area"] = json!({"min": {"lat": 35.5, "lon": -85.5}, "max": {"lat": 37.5, "lon": -83.0}});
    let mut bent = document();
    bent["area"] = json!({"min": {"lat": 86.6, "lon": -42.4}, "max": {"lat": 87.5, "lon": 143.4}});
    let mut cold = document();
    cold["area"] = json!({"min": {"lat": 36, "lon": -85}, "max": {"lat": 89.4, "lon": -84}});
    let mut far = document();
    far["area"] = json!({"min": {"lat": 36.4, "lon": -84.5}, "max": {"lat": 36.8, "lon": -84.0}});
    far["threats"][0]["center"]["lon"] = (-20).into();
    let mut outside = document();
    outside["area"] =
        json!({"min": {"lat": 36.4, "lon": -84.5}, "max": {"lat": 36.6599, "lon": -84}});
    vec![
        (
            outside.to_string(),
            "/target",
            "outside-area",
            "target is at lat 36.66, lon -84.15, must lie in the area, from lat 36.4, lon -84.5 to lat 36.6599, \
             lon -84",
        ),
        (
            wide.to_string(),
            "/area",
            "area-too-wide",
            "the area is 221061 m by 221204 m, must be at most 200000 m either way: a plane fits the earth no farther",
        ),
        (
            bent.to_string(),
            "/area",
            "area-too-wide",
            "the area reaches over 185.800000 degrees of longitude, must be at most 200000 m either way: a plane fits \
             the earth no farther",
        ),
        (
            cold.to_string(),
            "/area",
            "near-pole",
            "the area reaches latitude 89.400000, must stay within 89 degrees of the equator: beyond, degrees of \
             longitude tell too little",
        ),
        (
            far.to_string(),
            "/threats/0/center",
            "too-far",
            "center is 5621 km from the middle of the area, must be at most 500 km",
        ),
    ]
}

/// A flight of 27 km in Tennessee, around a radar and a polygon.
pub(crate) const IN_DEGREES: &str = r#"{
"frame":"wgs84",
"start":{"lat":36.5,"lon":-84.35,"alt":420},"target":{"lat":36.66,"lon":-84.15,"alt":500},
"threats":[
 {"kind":"cylinder","center":{"lat":36.58,"lon":-84.25},"radius":2500,"influence":4000},
 {"kind":"polygon","vertices":[{"lat":36.55,"lon":-84.32},{"lat":36.57,"lon":-84.32},{"lat":36.57,"lon":-84.29}]}],
"terrain":{"kind":"peaks","base":300,"peaks":[{"center":{"lat":36.6,"lon":-84.3},"height":80,"spread":{"x":900,"y":700}}]},
"altitude":{"min":50,"max":300},
"planner":{"warm_start":{"waypoints":[{"lat":36.55,"lon":-84.2,"alt":450}]}}}"#;

fn document() -> Value {
    serde_json::from_str(IN_DEGREES).expect("JSON")
}

fn earth(scenario: &Scenario) -> &Wgs84 {
    scenario.frame.wgs84().expect("a scenario in degrees")
}

fn accepted(document: &Value) -> Scenario {
    read(&document.to_string()).expect("no fault")
}

#[test]
fn a_document_in_degrees_is_written_back_unchanged() {
    let document = document();
    let scenario = accepted(&document);
    let text = json::write(&scenario);
    let written: Value = serde_json::from_str(&text).expect("JSON");
    for name in ["frame", "start", "target"] {
        assert_eq!(written[name], document[name], "{name}");
    }
    assert_eq!(written["altitude_datum"], "msl");
    assert_eq!(
        written["threats"][0]["center"],
        document["threats"][0]["center"]
    );
    assert_eq!(
        written["threats"][1]["vertices"],
        document["threats"][1]["vertices"]
    );
    assert_eq!(written["terrain"]["peaks"], document["terrain"]["peaks"]);
    let waypoints = &written["planner"]["warm_start"]["waypoints"];
    assert_eq!(*waypoints, document["planner"]["warm_start"]["waypoints"]);
    let again = accepted(&written);
    assert_eq!(again, scenario);
    assert_eq!(json::write(&again), text);
}

#[test]
fn the_plane_touches_at_the_middle_of_the_area() {
    let mut document = document();
    document["area"] =
        json!({"min": {"lat": 36.45, "lon": -84.41}, "max": {"lat": 36.73, "lon": -84.08}});
    let scenario = accepted(&document);
    let origin = earth(&scenario).plane.origin();
    assert!((origin.lat - 36.59).abs() < 1e-12 && (origin.lon + 84.245).abs() < 1e-12);
    let area = scenario.area;
    assert!(area.contains(scenario.start.xy()) && area.contains(scenario.target.xy()));
    // The rectangle lies within the box of degrees and spans it from south to north.
    let corners = [
        (area.min.x, area.min.y),
        (area.min.x, area.max.y),
        (area.max.x, area.min.y),
        (area.max.x, area.max.y),
    ];
    for (x, y) in corners {
        let place = earth(&scenario).plane.geodetic(Point2::new(x, y));
        assert!(
            (36.45 - 1e-9..=36.73 + 1e-9).contains(&place.lat),
            "{place:?}"
        );
        assert!(
            (-84.41 - 1e-9..=-84.08 + 1e-9).contains(&place.lon),
            "{place:?}"
        );
    }
    let degree = (area.max.y - area.min.y) / 0.28;
    assert!((110_800.0..111_100.0).contains(&degree), "{degree}");
}

#[test]
fn altitudes_are_above_the_named_datum() {
    let mut document = document();
    assert_eq!(earth(&accepted(&document)).datum, Datum::Msl);
    document["altitude_datum"] = "ellipsoid".into();
    let scenario = accepted(&document);
    let earth = earth(&scenario);
    assert_eq!(earth.datum, Datum::Ellipsoid);
    assert!((-31.5..-30.0).contains(&earth.undulation_m));
    // The geoid where the plane touches, and where the route begins.
    let geoid = earth.geoid();
    assert!((geoid.height_m([0.0, 0.0]) - earth.undulation_m).abs() < 1e-3);
    let there = undulation_m(earth.place(scenario.start.xy()));
    let start = geoid.height_m([scenario.start.x, scenario.start.y]);
    assert!((start - there).abs() < 1e-3);
    assert!((start - earth.undulation_m).abs() > 1e-2, "it slopes");
}

#[test]
fn documents_across_the_antimeridian_are_read_alike() {
    let mut document = document();
    let shifted = |node: &mut Value| {
        let lon = node["lon"].as_f64().expect("a longitude") + 84.25 + 180.0;
        node["lon"] = (if lon > 180.0 { lon - 360.0 } else { lon }).into();
    };
    let here = accepted(&document);
    for path in [
        "/start",
        "/target",
        "/threats/0/center",
        "/threats/1/vertices/0",
        "/threats/1/vertices/1",
        "/threats/1/vertices/2",
        "/terrain/peaks/0/center",
        "/planner/warm_start/waypoints/0",
    ] {
        shifted(document.pointer_mut(path).expect("a place"));
    }
    let there = accepted(&document);
    // The geoid differs there, and so does the height at which the plane is true to scale.
    assert!((here.start - there.start).norm() < 0.5);
    assert!((here.target - there.target).norm() < 0.5);
    assert!((here.area.min - there.area.min).norm() < 1.0);
    let area = earth(&there).area;
    assert!(area.min.lon > 0.0 && area.max.lon < 0.0, "{area:?}");
    assert_eq!(
        accepted(&serde_json::from_str(&json::write(&there)).expect("JSON")),
        there
    );
}

/// 180 and -180 degrees are the same meridian: a flight may begin on the edge of its area there, whichever way either
/// is written. The result has the start as it was given, and its route stays beside it.
#[test]
fn an_end_on_the_edge_at_the_antimeridian_may_be_written_either_way() {
    for (west, east, away) in [(-180.0, -179.9, -179.95), (179.9, 180.0, 179.95)] {
        for lon in [-180.0, 180.0] {
            let flight = json!({
                "frame": "wgs84",
                "start": {"lat": 10.05, "lon": lon, "alt": 100}, "target": {"lat": 10.02, "lon": away, "alt": 100},
                "area": {"min": {"lat": 10, "lon": west}, "max": {"lat": 10.1, "lon": east}},
                "altitude": {"min": 50, "max": 300},
                "planner": {"waypoints": 3, "population": 10, "iterations": 5, "smoothing": {"spacing": 500}},
            });
            let scenario = accepted(&flight);
            let written: Value = serde_json::from_str(&json::write(&scenario)).expect("JSON");
            assert_eq!(written["start"]["lon"], lon);
            assert_eq!(accepted(&written), scenario);

            let planned = run(&["plan", "-"], &flight.to_string());
            let result: Value = serde_json::from_slice(&planned.stdout).expect("JSON");
            assert_eq!(result["feasible"], true, "{result}");
            let way = |points: &Value| -> Vec<f64> {
                let points = points.as_array().expect("a list").iter();
                points
                    .map(|point| point["lon"].as_f64().expect("a number"))
                    .collect()
            };
            for points in [&result["waypoints"], &result["path"]["points"]] {
                let lons = way(points);
                assert!((lons[0] - lon).abs() < f64::EPSILON, "{lons:?}");
                let beside = |lon: &f64| (west - 1e-9..=east + 1e-9).contains(lon);
                assert!(lons[1..].iter().all(beside), "{lons:?}");
            }
            // A map draws it on one side, in one piece.
            let drawn = run(&["plan", "-", "--format", "geojson"], &flight.to_string());
            let drawn: Value = serde_json::from_slice(&drawn.stdout).expect("JSON");
            let route = &drawn["features"][0]["geometry"];
            assert_eq!(route["type"], "LineString", "{route}");
            let first = route["coordinates"][0][0].as_f64().expect("a number");
            assert!(
                (first - 180.0_f64.copysign(away)).abs() < f64::EPSILON,
                "{route}"
            );
        }
    }
}

/// Without an area, waypoints may be anywhere on the grid, and the written document is accepted unchanged.
#[test]
fn the_default_area_over_a_grid_is_all_of_it() {
    for (lat, lon) in [(36.4_f64, -84.45_f64), (-70.0, 179.9), (0.001, 8.5)] {
        let mut gridded = document();
        gridded["threats"] = json!([]);
        gridded["planner"] = json!({});
        gridded["terrain"] = json!({
            "kind": "grid", "origin": {"lat": lat, "lon": lon}, "cell": 4000, "columns": 6, "rows": 4,
            "elevations": vec![300; 24],
        });
        let place = |north: f64, east: f64| {
            let east = lon + east / 111_320.0 / libm::cos(lat.to_radians());
            let east = (east + 180.0).rem_euclid(360.0) - 180.0;
            json!({"lat": lat + north / 111_320.0, "lon": east, "alt": 420})
        };
        gridded["start"] = place(2000.0, 3000.0);
        gridded["target"] = place(9000.0, 14_000.0);
        let scenario = accepted(&gridded);
        let size = scenario.area.max - scenario.area.min;
        assert!((20_000.0 - size.x) < 200.0 && size.x <= 20_000.0, "{size}");
        assert!((12_000.0 - size.y) < 200.0 && size.y <= 12_000.0, "{size}");
        let written: Value = serde_json::from_str(&json::write(&scenario)).expect("JSON");
        assert_eq!(accepted(&written), scenario);
    }
}

#[test]
fn the_default_area_has_room_for_a_climb_that_is_steeper_than_the_vehicle() {
    let mut steep = document();
    steep["threats"] = json!([]);
    steep["planner"] = json!({});
    steep["start"] = json!({"lat": 36.5, "lon": -84.35, "alt": 420});
    steep["target"] = json!({"lat": 36.501, "lon": -84.35, "alt": 1420});
    steep["vehicle"] = json!({"max_climb_deg": 30});
    let scenario = accepted(&steep);
    let way_over_ground = 1000.0 / libm::tan(30.0_f64.to_radians());
    assert!(scenario.area.max.x - scenario.target.x > 0.49 * way_over_ground);
    steep["vehicle"] = json!({"max_climb_deg": 89});
    assert!(accepted(&steep).area.diagonal() < 300.0);
}

/// A flight nearly as long as an area may be leaves no room beyond its ends, but all of it beside the route.
#[test]
fn the_default_area_of_a_long_flight_is_narrowed_along_it_only() {
    let flight = |lat: f64, north: f64, east: f64| {
        json!({
            "frame": "wgs84",
            "start": {"lat": lat, "lon": 8, "alt": 100}, "target": {"lat": lat + north, "lon": 8.0 + east, "alt": 100},
            "altitude": {"min": 50, "max": 300}, "planner": {"smoothing": {"spacing": 50}},
        })
    };
    // To the north and to the east; one of them fills its area.
    for (document, along) in [
        (flight(0.0, 1.6, 0.0), 196e3),
        (flight(40.0, 1.71, 0.0), 196e3),
        (flight(40.0, 1.78, 0.0), 197e3),
        (flight(-0.1, 0.0, 1.71), 196e3),
        (flight(60.0, 0.0, 3.42), 190e3),
    ] {
        let scenario = accepted(&document);
        let size = scenario.area.max - scenario.area.min;
        let (long, wide) = (size.max(), size.min());
        assert!((along..200e3).contains(&long), "{document}: {size}");
        assert!((80e3..102e3).contains(&wide), "{document}: {size}");
    }
}

#[test]
fn wrong_documents_in_degrees_are_refused() {
    let cases = [
        ("/target/lon", json!(-81.0), "/target", "area-too-wide"),
        (
            "/area",
            json!({"min": {"lat": 30, "lon": -90}, "max": {"lat": 40, "lon": -80}}),
            "/area",
            "area-too-wide",
        ),
        (
            "/area",
            json!({"min": {"lat": 88, "lon": -90}, "max": {"lat": 89.5, "lon": -80}}),
            "/area",
            "near-pole",
        ),
        (
            "/area",
            json!({"min": {"lat": 37, "lon": -84}, "max": {"lat": 36, "lon": -83}}),
            "/area",
            "empty-area",
        ),
        (
            "/area",
            json!({"min": {"lat": 36.4, "lon": -84.4}, "max": {"lat": 36.6, "lon": -84.1}}),
            "/target",
            "outside-area",
        ),
        (
            "/area/min",
            json!({"x": 0, "y": 0}),
            "/area/min/x",
            "unknown-field",
        ),
        ("/start/lat", json!(91), "/start/lat", "out-of-range"),
        (
            "/start",
            json!({"x": 1, "y": 2, "z": 3}),
            "/start/x",
            "unknown-field",
        ),
        (
            "/altitude_datum",
            json!("agl"),
            "/altitude_datum",
            "unknown-value",
        ),
        ("/start/alt", json!(290), "/start", "below-ground"),
    ];
    for (path, value, pointer, code) in cases {
        let mut document = document();
        document["area"] =
            json!({"min": {"lat": 36.4, "lon": -84.5}, "max": {"lat": 36.8, "lon": -84.0}});
        if path == "/target/lon" {
            document.as_object_mut().expect("an object").remove("area");
        }
        document["altitude_datum"] = "msl".into();
        *document.pointer_mut(path).expect("a place") = value;
        let found = faults(&document.to_string());
        assert!(
            found
                .iter()
                .any(|fault| fault.pointer == pointer && fault.code == code),
            "{path}: {found:#?}"
        );
    }
}

#[test]
fn a_default_area_too_large_for_a_plane_is_blamed_on_what_extends_it() {
    for (path, value, pointer, code) in [
        ("/target/lon", json!(-81.0), "/target", "area-too-wide"),
        ("/target/lat", json!(89.5), "/target", "near-pole"),
        (
            "/threats/0/center/lat",
            json!(39.0),
            "/threats/0",
            "area-too-wide",
        ),
        (
            "/threats/0/influence",
            json!(150e3),
            "/threats/0",
            "area-too-wide",
        ),
        (
            "/threats/1/vertices/0/lon",
            json!(-90),
            "/threats/1",
            "area-too-wide",
        ),
        (
            "/threats/1/vertices/0/lat",
            json!(-90),
            "/threats/1",
            "near-pole",
        ),
    ] {
        let mut document = document();
        *document.pointer_mut(path).expect("a place") = value;
        let faults = faults(&document.to_string());
        let found = faults.iter().find(|fault| fault.code == code);
        let found = found.unwrap_or_else(|| panic!("{path}: {faults:#?}"));
        assert_eq!(found.pointer, pointer, "{path}");
        let detail = &found.detail;
        assert!(
            detail.starts_with("the area, by default the box"),
            "{detail}"
        );
    }
}

proptest! {
    /// Anywhere on the earth: an accepted document reads back to the same bits.
    #[test]
    fn an_accepted_document_reads_back_to_the_same_bits(
        lat in -88.5..88.5f64, lon in -180.0..180.0f64, north in -0.3..0.3f64, east in -0.3..0.3f64,
        alt in -100.0..4000.0f64, ellipsoid: bool,
    ) {
        prop_assume!(north.abs() + east.abs() > 0.01);
        let lon2 = lon + east;
        let document = json!({
            "frame": "wgs84", "altitude_datum": if ellipsoid { "ellipsoid" } else { "msl" },
            "start": {"lat": lat, "lon": lon, "alt": alt},
            "target": {"lat": lat + north, "lon": if lon2 > 180.0 { lon2 - 360.0 } else if lon2 < -180.0 { lon2 + 360.0 } else { lon2 }, "alt": alt},
            "terrain": {"kind": "flat", "elevation": alt - 100.0},
            "altitude": {"min": 50, "max": 300}, "planner": {"smoothing": {"spacing": 50}}
        });
        let scenario = accepted(&document);
        let text = json::write(&scenario);
        let again = read(&text).expect("no fault");
        prop_assert_eq!(json::write(&again), text);
        prop_assert_eq!(again, scenario);
    }
}
