//! Every format of one plan, and refusals.

mod edges;

use serde_json::{Value, json};
use uuid::Uuid;

use super::document::{Origin, Position, ResultDocument, Timing};
use super::*;
use crate::digest::sha256_hex;
use crate::geometry::Vector2;
use crate::geometry::geodesy::{LatLon, undulation_m};
use crate::planner;
use crate::scenario::json::Unread;
use crate::scenario::limits::Limits;
use crate::scenario::{Frame, Scenario, json};
use crate::seeding;

/// A scenario as the service would accept it.
pub(super) fn accepted(document: &Value) -> Scenario {
    json::read(
        document.to_string().as_bytes(),
        &planner::rules(Limits::NONE),
        7,
    )
    .expect("a valid scenario")
}

/// A kilometre and a half over flat ground near Zurich, past a radar and over a low polygon.
fn scenario() -> Value {
    json!({
        "name": "Höhe <1> & \"zwei\"",
        "frame": "wgs84",
        "start": {"lat": 47.3977, "lon": 8.5456, "alt": 494},
        "target": {"lat": 47.4050, "lon": 8.5623, "alt": 540},
        "threats": [
            {"kind": "cylinder", "name": "radar", "center": {"lat": 47.4005, "lon": 8.5560},
             "radius": 150, "influence": 250},
            {"kind": "polygon", "vertices": [
                {"lat": 47.4020, "lon": 8.5500}, {"lat": 47.4035, "lon": 8.5500}, {"lat": 47.4035, "lon": 8.5520}],
             "margin": 20, "top": 510}],
        "terrain": {"kind": "flat", "elevation": 488},
        "altitude": {"min": 5, "max": 80},
        "vehicle": {"cruise_speed": 15, "fuel_per_km": 2},
        "planner": {"waypoints": 2, "smoothing": {"degree": 2, "spacing": 200}},
    })
}

/// The documents of a plan with waypoints `through`: degrees north and east and altitudes, or metres.
fn plan(document: &Value, through: &[(f64, f64, f64)]) -> (String, String) {
    let scenario = accepted(document);
    let mut route = vec![scenario.start];
    for &(x, y, z) in through {
        let (lat, lon, alt) = (x, y, z);
        let position = match scenario.frame {
            Frame::Local => Position::Local { x, y, z },
            Frame::Wgs84(_) => Position::Geodetic { lat, lon, alt },
        };
        route.push(position.within(&scenario.frame).expect("of this frame"));
    }
    route.push(scenario.target);
    let outcome = planner::so_far(&scenario, route, seeding::lower_bound(&scenario));
    let accepted = json::write(&scenario);
    let origin = Origin {
        plan_id: Some(Uuid::nil()),
        algorithm: "tms-sba".to_owned(),
        seed: 7,
        scenario_sha256: sha256_hex(accepted.as_bytes()),
        timing: Timing {
            queued_ms: 0.0,
            run_ms: 0.0,
        },
    };
    let result = ResultDocument::new(&outcome, origin);
    (result.to_json(), accepted)
}

const AROUND: [(f64, f64, f64); 2] = [(47.4005, 8.5520, 540.0), (47.4030, 8.5555, 540.0)];

/// Through the middle of the radar.
const THROUGH: [(f64, f64, f64); 1] = [(47.4005, 8.5560, 540.0)];

fn write(
    (result, scenario): &(String, String),
    format: &str,
    options: &[(&str, &str)],
) -> Result<String, ExportError> {
    let format = Format::named(format).expect("a format");
    let options = Options::read(format, options.iter().copied())?;
    let input = ResultInput {
        result,
        scenario,
        rules: &planner::rules(Limits::NONE),
    };
    format.write(&input, &options)
}

#[test]
fn each_format_of_a_plan() {
    let plan = plan(&scenario(), &AROUND);
    let ardupilot: &[(&str, &str)] = &[
        ("firmware", "ardupilot"),
        ("altitude", "terrain"),
        ("takeoff", "0"),
    ];
    let landing: &[(&str, &str)] = &[("landing", "true"), ("altitude", "absolute")];
    for (name, format, options) in [
        ("csv", "csv", &[][..]),
        ("geojson", "geojson", &[]),
        ("kml", "kml", &[]),
        ("czml", "czml", &[("epoch", "2026-03-01T08:00:00+01:00")]),
        ("gpx", "gpx", &[]),
        ("qgc", "qgc", &[]),
        ("qgc_ardupilot_terrain", "qgc", ardupilot),
        ("qgc_px4_terrain", "qgc", &[("altitude", "terrain")]),
        ("wpl", "wpl", landing),
        ("wpl_ardupilot_terrain", "wpl", ardupilot),
    ] {
        let text = write(&plan, format, options).expect("a plan that can be written");
        // The program's version is not compared.
        let text = text.replace(
            concat!("noctule ", env!("CARGO_PKG_VERSION")),
            "noctule VERSION",
        );
        // One feature per line, where the format has no line breaks.
        let text = match format {
            "geojson" => text.replace("{\"type\":\"Feature\"", "\n{\"type\":\"Feature\""),
            "czml" => text.replace("{\"id\":", "\n{\"id\":"),
            _ => text,
        };
        insta::assert_snapshot!(name, text);
    }
}

/// All below the base of what has no top may be flown.
#[test]
fn a_threat_above_the_route_is_a_lid_in_kml() {
    let mut document = scenario();
    document["threats"][0]["base"] = 560.into();
    let text = write(&plan(&document, &AROUND), "kml", &[]).expect("a plan");
    let read = roxmltree::Document::parse(&text).expect("well-formed");
    let walls = read
        .descendants()
        .filter(|node| node.has_tag_name("Polygon"));
    let extruded = walls.map(|wall| wall.first_element_child()?.text());
    assert_eq!(extruded.collect::<Vec<_>>(), [Some("0"), Some("1")]);
    assert!(text.contains(",560\n"));
}

/// A mast 250 m above all that the vehicle flies over.
#[test]
fn a_threat_on_a_summit_stands_out_of_it() {
    let mut document = scenario();
    let summit = json!({"lat": 47.408, "lon": 8.547});
    document["terrain"] = json!({
        "kind": "peaks", "base": 488,
        "peaks": [{"center": summit, "height": 300, "spread": {"x": 100, "y": 100}}],
    });
    document["threats"] = json!([{"kind": "cylinder", "center": summit, "radius": 30}]);
    let plan = plan(&document, &AROUND);
    let highest = |text: &str| {
        let numbers = text.split(|c: char| c != '.' && !c.is_ascii_digit());
        let numbers = numbers.filter_map(|number| number.parse::<f64>().ok());
        numbers.fold(0.0, f64::max)
    };
    let kml = write(&plan, "kml", &[]).expect("a plan");
    let read = roxmltree::Document::parse(&kml).expect("well-formed");
    let wall = read
        .descendants()
        .find(|node| node.has_tag_name("LinearRing"));
    let coordinates = wall.and_then(|wall| wall.last_element_child()?.text());
    let top = highest(coordinates.expect("a ring"));
    assert!((798.0..800.0).contains(&top), "{top}");
    let czml: Value =
        serde_json::from_str(&write(&plan, "czml", &[]).expect("a plan")).expect("JSON");
    let threat = czml.as_array().and_then(|packets| packets.last());
    let threat = threat.expect("packets");
    let height = threat["position"]["cartographicDegrees"][2].as_f64();
    let length = threat["cylinder"]["length"].as_f64();
    let top = height.expect("a number") + 0.5 * length.expect("a number");
    let place = LatLon {
        lat: 47.408,
        lon: 8.547,
    };
    let top = top - undulation_m(place);
    assert!((797.5..800.0).contains(&top), "{top}");
}

#[test]
fn the_result_itself_is_not_touched() {
    let plan = plan(&scenario(), &AROUND);
    assert_eq!(write(&plan, "json", &[]).as_ref(), Ok(&plan.0));
}

/// Ground at a constant height above mean sea level, as a grid of heights above the ellipsoid.
fn level_with_the_sea(document: &Value, height_m: f64) -> Value {
    let scenario = accepted(document);
    let plane = &scenario.frame.wgs84().expect("degrees").plane;
    let origin = plane.local(LatLon {
        lat: 47.39,
        lon: 8.53,
    });
    let elevation = |node: u32| {
        let (column, row) = (f64::from(node % 10), f64::from(node / 10));
        let at = origin + Vector2::new(500.0 * column, 500.0 * row);
        height_m + undulation_m(plane.geodetic(at))
    };
    json!({
        "kind": "grid", "origin": {"lat": 47.39, "lon": 8.53}, "cell": 500, "columns": 10, "rows": 10,
        "elevations": (0..100).map(elevation).collect::<Vec<_>>(),
    })
}

#[test]
fn the_same_altitudes_come_out_of_either_datum() {
    let above_sea = scenario();
    let mut above_ellipsoid = above_sea.clone();
    above_ellipsoid["altitude_datum"] = "ellipsoid".into();
    let raise = |height: &Value, lat: f64, lon: f64| -> Value {
        (height.as_f64().expect("a number") + undulation_m(LatLon { lat, lon })).into()
    };
    for end in ["start", "target"] {
        let [lat, lon] = ["lat", "lon"].map(|name| above_sea[end][name].as_f64().expect("degrees"));
        above_ellipsoid[end]["alt"] = raise(&above_sea[end]["alt"], lat, lon);
    }
    // In the middle of the polygon.
    above_ellipsoid["threats"][1]["top"] = raise(&above_sea["threats"][1]["top"], 47.40275, 8.551);
    above_ellipsoid["terrain"] = level_with_the_sea(&above_sea, 488.0);
    let around = AROUND.map(|(lat, lon, alt)| (lat, lon, alt + undulation_m(LatLon { lat, lon })));
    let (one, other) = (plan(&above_sea, &AROUND), plan(&above_ellipsoid, &around));
    for format in ["geojson", "kml", "czml", "gpx", "qgc", "wpl", "csv"] {
        let numbers = |text: String| -> Vec<f64> {
            let words =
                text.split(|letter: char| !(letter.is_ascii_digit() || "+-.e".contains(letter)));
            words.filter_map(|word| word.parse().ok()).collect()
        };
        let options: &[(&str, &str)] = if format == "wpl" {
            &[("altitude", "absolute")]
        } else {
            &[]
        };
        let one = numbers(write(&one, format, options).expect("a plan"));
        let other = numbers(write(&other, format, options).expect("a plan"));
        assert_eq!(one.len(), other.len(), "{format}");
        for (one, other) in one.into_iter().zip(other) {
            assert!((one - other).abs() < 2e-3, "{format}: {one} {other}");
        }
    }
}

#[test]
fn what_cannot_be_written_is_refused() {
    let check =
        |plan: &(String, String), format: &str, options: &[(&str, &str)], expected: &str| {
            let refused = write(plan, format, options).expect_err(format);
            assert_eq!(refused.to_string(), expected, "{format} {options:?}");
        };
    let through = plan(&scenario(), &THROUGH);
    for format in ["kml", "czml", "gpx", "qgc", "wpl"] {
        let refused = format!(
            "the plan has no feasible route and {format} is for flying: allow_infeasible=true writes it all the same"
        );
        check(&through, format, &[], &refused);
        let written = write(&through, format, &[("allow_infeasible", "true")]);
        assert!(!written.expect("the caller insists").is_empty());
    }
    let seen = write(&through, "geojson", &[]).expect("violations are for looking at");
    assert!(seen.contains("enters threat 0 (radar) by"), "{seen}");
    assert!(
        write(&through, "csv", &[])
            .is_ok_and(|text| text.contains("waypoint,1,47.4005,8.556,540,"))
    );

    let local = json!({
        "start": {"x": 0, "y": 0, "z": 10}, "target": {"x": 500, "y": 0, "z": 20},
        "altitude": {"min": 0, "max": 50},
    });
    let local = plan(&local, &[(250.0, 0.0, 20.0)]);
    for format in ALL.iter().filter(|format| format.geodetic) {
        let refused = write(&local, format.name, &[]);
        let expected = ExportError::NoGeodeticFrame {
            format: format.name,
        };
        assert_eq!(refused, Err(expected));
    }
    assert!(write(&local, "csv", &[]).is_ok_and(|text| text.starts_with("kind,index,x,y,z,agl,")));

    let around = plan(&scenario(), &AROUND);
    check(
        &around,
        "wpl",
        &[("altitude", "terrain")],
        "altitude is \"terrain\", must be relative or absolute for px4, which knows no other frame",
    );
    let other = (around.0.clone(), local.1.clone());
    check(
        &other,
        "kml",
        &[],
        "the result: in another frame than its scenario",
    );
    let cut = |document: &str| document[..200].to_owned();
    assert!(matches!(
        write(&(cut(&around.0), around.1.clone()), "gpx", &[]),
        Err(ExportError::Damaged(_))
    ));
    assert!(matches!(
        write(&(around.0, cut(&around.1)), "gpx", &[]),
        Err(ExportError::Unread(Unread::Damaged(_)))
    ));
}

#[test]
fn a_mission_neither_climbs_nor_lands_through_a_threat() {
    let mut above = scenario();
    above["threats"][1] =
        json!({"kind": "cylinder", "center": above["start"].clone(), "radius": 20, "base": 496});
    above["threats"][1]["center"]
        .as_object_mut()
        .expect("a point")
        .remove("alt");
    let mut low = scenario();
    low["start"]["alt"] = 520.into();
    low["threats"][1] = json!({"kind": "cylinder", "center": above["threats"][1]["center"], "radius": 20, "top": 495});
    for document in [above, low] {
        let plan = plan(&document, &AROUND);
        let refused = write(&plan, "qgc", &[("takeoff", "10")]);
        assert!(
            matches!(refused, Err(ExportError::Unflyable(_))),
            "{refused:?}"
        );
        assert!(write(&plan, "qgc", &[("takeoff", "0")]).is_ok());
    }
    let mut tower = scenario();
    let mut center = tower["target"].clone();
    center.as_object_mut().expect("a point").remove("alt");
    tower["threats"][1] = json!({"kind": "cylinder", "center": center, "radius": 5, "top": 500});
    let plan = plan(&tower, &AROUND);
    assert!(write(&plan, "wpl", &[]).is_ok());
    let refused = write(&plan, "wpl", &[("landing", "true")]);
    assert!(
        matches!(refused, Err(ExportError::Unflyable(_))),
        "{refused:?}"
    );
}

#[test]
fn words_of_callers_stay_words() {
    let mut document = scenario();
    document["name"] = "a\u{0}\u{b}</name><Document>&amp;]]>\u{202e}\n\"".into();
    document["threats"][0]["name"] = "\u{1}<!-- x".into();
    let plan = plan(&document, &AROUND);
    for format in ["kml", "gpx"] {
        let text = write(&plan, format, &[]).expect("a plan");
        let document = roxmltree::Document::parse(&text).expect("well-formed");
        assert!(document.descendants().any(|node| {
            node.text()
                .is_some_and(|text| text.contains("</name><Document>&amp;"))
        }));
    }
    for format in ["geojson", "czml"] {
        let text = write(&plan, format, &[]).expect("a plan");
        let document: Value = serde_json::from_str(&text).expect("JSON");
        assert!(says(&document, "</name><Document>&amp;"), "{text}");
        assert!(says(&document, "<!-- x"), "{text}");
    }
    // It names neither the plan nor what is fenced.
    let text = write(&plan, "qgc", &[]).expect("a plan");
    serde_json::from_str::<Value>(&text).expect("JSON");
}

/// Whether a text of the document contains `words`.
fn says(document: &Value, words: &str) -> bool {
    match document {
        Value::String(text) => text.contains(words),
        Value::Array(items) => items.iter().any(|item| says(item, words)),
        Value::Object(members) => members.values().any(|member| says(member, words)),
        Value::Null | Value::Bool(_) | Value::Number(_) => false,
    }
}

#[test]
fn samples_closer_than_a_millisecond_have_times_of_their_own() {
    let mut document = scenario();
    document["vehicle"]["cruise_speed"] = 1000.into();
    document["planner"]["smoothing"]["spacing"] = 0.5.into();
    let plan = plan(&document, &AROUND);
    let text = write(&plan, "czml", &[]).expect("a plan");
    let read: Value = serde_json::from_str(&text).expect("JSON");
    let samples = read[1]["position"]["cartographicDegrees"].as_array();
    let samples = samples.expect("numbers").chunks(4);
    let times: Vec<f64> = samples.filter_map(|sample| sample[0].as_f64()).collect();
    for pair in times.windows(2) {
        assert!(pair[0] < pair[1], "{pair:?}");
    }
    // The vehicle is there until its last sample, and no longer.
    let interval = read[1]["availability"].as_str().expect("an interval");
    let (_, end) = interval.split_once('/').expect("two instants");
    let end: jiff::Timestamp = end.parse().expect("an instant");
    let duration_s = end.duration_since(Options::default().epoch).as_secs_f64();
    let last = times[times.len() - 1];
    assert!((duration_s - last).abs() < 1e-9, "{duration_s} {last}");
}
