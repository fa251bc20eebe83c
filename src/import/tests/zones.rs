//! Maps of airspace: OpenAir, ED-269 and ED-318.

use std::f64::consts::TAU;

use serde_json::Value;

use super::*;
use crate::geometry::geodesy::{LatLon, TangentPlane};
use crate::geometry::{Point2, ring};

/// From one side of the zones below to the other.
fn flight() -> Flight {
    Flight {
        start: "47.30,8.40,500".parse().ok(),
        target: "47.50, 8.70 ,450".parse().ok(),
        within_m: None,
    }
}

fn zones(text: &str) -> Conversion {
    let text = text.as_bytes();
    super::super::convert(text, Syntax::of(text), MOST, &flight()).expect("a scenario")
}

/// An airspace of OpenAir with a circle of one nautical mile.
fn circle(class: &str, name: &str, floor: &str, ceiling: &str, center: &str) -> String {
    format!("AC {class}\nAN {name}\nAL {floor}\nAH {ceiling}\nV X={center}\nDC 1\n\n")
}

const MIDDLE: &str = "47:24:00 N 008:33:00 E";

/// The reasons of what is assumed of the threats.
fn of_threats(conversion: &Conversion) -> Vec<&str> {
    let of_threats = conversion.assumed.iter();
    let of_threats = of_threats.filter(|assumed| assumed.pointer == "/threats");
    of_threats.map(|assumed| assumed.reason.as_str()).collect()
}

#[test]
fn airspaces_become_threats_between_their_floors_and_ceilings() {
    let file = [
        "* A comment\n".to_owned(),
        circle("R", "FIRING RANGE", "GND", "3000ft MSL", MIDDLE),
        circle("D", "TMA", "4500 ft MSL", "FL 195", MIDDLE),
        circle("P", "PLANT", "500ft AGL", "UNL", MIDDLE),
    ]
    .concat();
    let read = zones(&file);
    let kept = |index: usize| {
        let threat = &read.scenario["threats"][index];
        (
            threat["name"].clone(),
            threat["base"].clone(),
            threat["top"].clone(),
        )
    };
    assert_eq!(kept(0), (json!("FIRING RANGE"), json!(null), json!(914.4)));
    assert_eq!(kept(1), (json!("TMA"), json!(1371.6), json!(5943.6)));
    assert_eq!(kept(2), (json!("PLANT"), json!(null), json!(null)));
    assert_eq!(read.scenario["threats"][0]["radius"], 1852.0);
    assert_eq!(read.scenario["altitude_datum"], "msl");
    assert_eq!(
        read.scenario["start"],
        json!({"lat": 47.3, "lon": 8.4, "alt": 500.0})
    );
    assert_eq!(
        of_threats(&read),
        [
            "1 of them without a base: the floor in the file is above ground, or above something else that is not known here",
            "1 of them with flight levels as heights above mean sea level, which they are in the standard atmosphere",
        ]
    );
    assert_eq!(unused(&read), Vec::<String>::new());
}

#[test]
fn open_airspaces_are_left_out_and_others_kept() {
    let typed = |class: &str, of_type: &str| {
        let circle = circle(class, of_type, "GND", "FL95", MIDDLE);
        circle.replacen('\n', &format!("\nAY {of_type}\n"), 1)
    };
    let file = [
        circle("E", "open", "GND", "FL100", MIDDLE),
        circle("CTR", "as of old", "GND", "FL100", MIDDLE),
        typed("C", "FIR"),
        typed("G", "R"),
        typed("E", "RMZ"),
        typed("F", "TMA"),
        typed("UNC", "VFRSEC"),
    ]
    .concat();
    let read = zones(&file);
    let threats = read.scenario["threats"].as_array().expect("a list");
    let names: Vec<_> = threats.iter().map(|threat| &threat["name"]).collect();
    assert_eq!(names, ["as of old", "R", "RMZ"]);
    assert_eq!(
        unused(&read),
        [
            "line 1: open: class E, F or G, which needs no clearance",
            "line 15: FIR: a region or a sector of information, which closes nothing",
            "line 39: TMA: class E, F or G, which needs no clearance",
            "line 47: VFRSEC: a region or a sector of information, which closes nothing",
        ]
    );
}

#[test]
fn an_airspace_that_cannot_be_read_takes_nothing_from_the_next() {
    let broken = "AC R\nAN broken\nAL GND\nAH FL100\nDP 47:00:00 N 008:00:00 E\nDP nowhere\nDP 47:10:00 N 008:10:00 E\n";
    let file = [broken, &circle("R", "whole", "GND", "FL100", MIDDLE)].concat();
    let read = zones(&file);
    assert_eq!(unused(&read), ["line 1: Invalid coord: \"nowhere\""]);
    assert_eq!(read.scenario["threats"].as_array().map(Vec::len), Some(1));
    assert_eq!(read.scenario["threats"][0]["kind"], "cylinder");
}

/// The corners of the only threat, on the plane round its middle.
fn corners(read: &Conversion, plane: &TangentPlane) -> Vec<Point2> {
    let vertices = read.scenario["threats"][0]["vertices"].as_array();
    let corner = |vertex: &Value| {
        let degrees = |name: &str| vertex[name].as_f64().expect("a number");
        plane.local(LatLon {
            lat: degrees("lat"),
            lon: degrees("lon"),
        })
    };
    vertices.expect("a polygon").iter().map(corner).collect()
}

/// A bulge and a bay, either way round: no place of the zone is outside of the polygon, which is larger by a thousandth
/// of the radius at most.
#[test]
fn arcs_leave_nothing_of_a_zone_out() {
    let plane = TangentPlane::at(
        LatLon {
            lat: 47.4,
            lon: 8.55,
        },
        0.0,
    );
    let radius = 5.0 * 1852.0;
    let at = |bearing: f64, share: f64| {
        let (sin, cos) = libm::sincos(bearing * TAU / 360.0);
        Point2::new(radius * share * sin, radius * share * cos)
    };
    let head = format!("AC R\nAN arcs\nAL GND\nAH FL100\nV X={MIDDLE}\n");
    // A quarter of the circle, from north to east, back along its radii.
    let clockwise = format!("{head}V D=+\nDA 5,0,90\nDP {MIDDLE}\n");
    let counter = format!("{head}V D=-\nDA 5,90,0\nDP {MIDDLE}\n");
    for file in [clockwise, counter] {
        let ring = corners(&zones(&file), &plane);
        for step in 1..900 {
            let bearing = f64::from(step) * 0.1;
            assert!(ring::contains(&ring, at(bearing, 0.999_999)), "{bearing}");
            assert!(!ring::contains(&ring, at(bearing, 1.001)), "{bearing}");
        }
    }
    // The corner between east and north, without that quarter.
    let corner = "DP 47:29:00 N 008:41:00 E";
    let clockwise = format!("{head}V D=-\nDA 5,90,0\n{corner}\n");
    let counter = format!("{head}V D=+\nDA 5,0,90\n{corner}\n");
    for file in [clockwise, counter] {
        let ring = corners(&zones(&file), &plane);
        for step in 1..900 {
            let bearing = f64::from(step) * 0.1;
            assert!(ring::contains(&ring, at(bearing, 1.000_001)), "{bearing}");
            assert!(!ring::contains(&ring, at(bearing, 0.998)), "{bearing}");
        }
    }
}

#[test]
fn arcs_between_places_begin_and_end_there_and_whole_ones_close() {
    let plane = TangentPlane::at(
        LatLon {
            lat: 47.4,
            lon: 8.55,
        },
        0.0,
    );
    let head = format!("AC R\nAN arcs\nAL GND\nAH FL100\nV X={MIDDLE}\n");
    let (north, east) = ("47:29:00 N 008:33:00 E", "47:24:00 N 008:40:22 E");
    let file = format!("{head}DB {north},{east}\nDP {east}\nDP {MIDDLE}\n");
    let ring = corners(&zones(&file), &plane);
    let radius = plane
        .local(LatLon {
            lat: 47.0 + 29.0 / 60.0,
            lon: 8.55,
        })
        .y;
    for step in 1..90 {
        let (sin, cos) = libm::sincos(f64::from(step) * TAU / 360.0);
        assert!(ring::contains(
            &ring,
            Point2::new(0.995 * radius * sin, 0.995 * radius * cos)
        ));
    }
    // 18 corners outside the arc, its ends, and the middle: none twice.
    assert_eq!(ring.len(), 21);
    let whole = format!("{head}DB {north},{north}\n");
    let ring = corners(&zones(&whole), &plane);
    assert!(ring.len() >= 72);
    assert!(
        (ring::twice_area(&ring).abs() / 2.0 / (TAU / 2.0 * radius * radius) - 1.0).abs() < 0.01
    );
}

#[test]
fn an_outline_that_crosses_itself_becomes_its_hull() {
    let corners = "DP 47:20:00 N 008:30:00 E\nDP 47:25:00 N 008:40:00 E\nDP 47:25:00 N 008:30:00 E\nDP 47:20:00 N 008:40:00 E\n";
    let file = format!("AC R\nAN bow tie\nAL GND\nAH FL100\n{corners}");
    let read = zones(&file);
    let vertices = read.scenario["threats"][0]["vertices"].as_array();
    assert_eq!(vertices.map(Vec::len), Some(4));
    assert_eq!(
        of_threats(&read)[1],
        "1 of them as convex hulls: their outlines cross or touch themselves"
    );
    let two = "DP 47:20:00 N 008:30:00 E\nDP 47:21:00 N 008:30:00 E\nDP 47:20:00 N 008:30:00 E\n";
    let read = zones(&format!("AC R\nAN line\nAL GND\nAH FL100\n{two}"));
    assert_eq!(
        unused(&read),
        ["line 1: line: an outline of 2 corners that has no inside"]
    );
}

/// 900 m are 2952.76 feet, of which the library makes 2953, and 1500 m 4921.26, 4921.
#[test]
fn limits_in_metres_lose_nothing_of_an_airspace() {
    let corners =
        "DP 47:20:00 N 008:30:00 E\nDP 47:21:00 N 008:30:00 E\nDP 47:21:00 N 008:31:00 E\n";
    let within = |limits: &str| {
        let read = zones(&format!("AC R\nAN metres\n{limits}{corners}"));
        let threat = &read.scenario["threats"][0];
        [&threat["base"], &threat["top"]].map(|limit| limit.as_f64().expect("a limit"))
    };
    for limits in ["AL 900m\nAH 1500 m\n", "AL 900 M AMSL\nAH 1500M\n"] {
        let [base, top] = within(limits);
        assert!((899.8..=900.0).contains(&base), "{base}");
        assert!((1500.0..=1500.2).contains(&top), "{top}");
    }
    let [base, top] = within("AL 2953ft MSL\nAH 4921ft MSL\n");
    assert!((base - 900.0744).abs() < 1e-3 && (top - 1499.9208).abs() < 1e-3);
}

#[test]
fn volumes_of_ed_269_are_read() {
    let volume = |lower: Value, from: &str, unit: &str, projection: Value| {
        json!({"uomDimensions": unit, "lowerLimit": lower, "lowerVerticalReference": from,
            "upperLimit": 2000, "upperVerticalReference": "AMSL", "horizontalProjection": projection})
    };
    let disc = json!({"type": "Circle", "center": [8.5, 47.4], "radius": 750.5});
    let ring = json!([[8.5, 47.35], [8.52, 47.35], [8.52, 47.36], [8.5, 47.35]]);
    let file = json!({"title": "zones", "features": [
        {"identifier": "A1", "name": "Airport", "restriction": "REQ_AUTHORISATION", "geometry": [
            volume(json!(0), "AGL", "M", disc.clone()),
            volume(json!(1000), "AMSL", "FT", json!({"type": "Polygon", "coordinates": [ring]})),
        ]},
        {"identifier": "A2", "restriction": "PROHIBITED", "geometry": [
            volume(json!(50), "AGL", "M", disc.clone()),
            volume(json!("300"), "AMSL", "M", disc.clone()),
        ]},
        {"identifier": "A3", "restriction": "NO_RESTRICTION", "geometry": [volume(json!(0), "AGL", "M", disc)]},
        {"identifier": "A4", "restriction": "PROHIBITED", "geometry": [volume(json!(0), "AGL", "M", json!({"type": "Line"}))]},
    ]});
    let read = zones(&file.to_string());
    let threats = &read.scenario["threats"];
    assert_eq!(read.scenario["name"], "zones");
    assert_eq!(threats.as_array().map(Vec::len), Some(4));
    assert_eq!(
        threats[0],
        json!({"kind": "cylinder", "name": "Airport", "center": {"lat": 47.4, "lon": 8.5}, "radius": 750.5,
            "influence": 750.5, "base": null, "top": 2000.0})
    );
    assert_eq!(threats[1]["base"], 304.8);
    assert_eq!(threats[1]["top"], 609.6);
    assert_eq!(threats[1]["vertices"].as_array().map(Vec::len), Some(3));
    assert_eq!(threats[2]["name"], "A2");
    // Above ground, and no number.
    assert_eq!(
        [&threats[2]["base"], &threats[3]["base"]],
        [&json!(null); 2]
    );
    assert_eq!(
        unused(&read),
        [
            "/features/2: a zone without restriction",
            "/features/3/geometry/0: a horizontal projection that is neither a Circle nor a Polygon",
        ]
    );
    assert!(of_threats(&read)[0].starts_with("2 of them without a base"));
}

#[test]
fn layers_of_ed_318_are_read() {
    let layer = json!({"lower": 0, "lowerReference": "AGL", "upper": 600, "upperReference": "AMSL", "uom": "m"});
    let disc = json!({"type": "Point", "coordinates": [8.5, 47.4], "layer": layer,
        "extent": {"subType": "Circle", "radius": 900}});
    let square = json!({"type": "Polygon", "layer": {"lower": 300, "lowerReference": "WGS84", "uom": "m"},
        "coordinates": [[[8.5, 47.35], [8.6, 47.35], [8.6, 47.4], [8.5, 47.4], [8.5, 47.35]]]});
    let names =
        json!([{"lang": "de-CH", "text": "Flugplatz"}, {"lang": "en-GB", "text": "Aerodrome"}]);
    let file = json!({"type": "FeatureCollection", "features": [
        {"type": "Feature", "properties": {"identifier": "B1", "name": names, "type": "PROHIBITED"},
            "geometry": {"type": "GeometryCollection", "geometries": [disc.clone(), square]}},
        {"type": "Feature", "properties": {"identifier": "B2", "type": "NO_RESTRICTION"}, "geometry": disc},
    ]});
    let read = zones(&file.to_string());
    let threats = &read.scenario["threats"];
    assert_eq!(read.scenario["altitude_datum"], "msl");
    assert_eq!(threats.as_array().map(Vec::len), Some(2));
    assert_eq!(
        (&threats[0]["name"], &threats[0]["top"]),
        (&json!("Aerodrome"), &json!(600.0))
    );
    assert_eq!(
        (&threats[1]["base"], &threats[1]["top"]),
        (&json!(null), &json!(null))
    );
    assert_eq!(unused(&read), ["/features/1: a zone without restriction"]);
}

#[test]
fn what_lies_elsewhere_is_left_out_and_the_area_says_so() {
    let file = [
        circle("R", "near", "GND", "FL100", MIDDLE),
        circle("R", "far", "GND", "FL100", "49:00:00 N 008:33:00 E"),
        circle(
            "R",
            "other side of the earth",
            "GND",
            "FL100",
            "47:24:00 S 171:27:00 W",
        ),
    ]
    .concat();
    let read = zones(&file);
    assert_eq!(read.scenario["threats"].as_array().map(Vec::len), Some(1));
    let area = read
        .assumed
        .iter()
        .find(|assumed| assumed.pointer == "/area");
    assert_eq!(
        area.expect("an area").reason,
        "15869 m beyond start and target on each side; threats of the file that lie outside and are left out: 2"
    );
    let area = &read.scenario["area"];
    let degrees = |corner: &str, name: &str| area[corner][name].as_f64().expect("a number");
    assert!((47.15..47.17).contains(&degrees("min", "lat")), "{area}");
    assert!((8.18..8.20).contains(&degrees("min", "lon")), "{area}");
    assert!((47.63..47.65).contains(&degrees("max", "lat")), "{area}");
    assert!((8.90..8.92).contains(&degrees("max", "lon")), "{area}");
    // Wide enough for the second.
    let flight = Flight {
        within_m: Some(170e3),
        ..flight()
    };
    let read = super::super::convert(file.as_bytes(), Syntax::Lines, MOST, &flight);
    let threats = &read.expect("a scenario").scenario["threats"];
    assert_eq!(threats.as_array().map(Vec::len), Some(2));
}

#[test]
fn a_flight_across_the_antimeridian_has_zones_on_both_sides() {
    let file = [
        circle("R", "west", "GND", "FL100", "17:00:00 S 179:58:00 E"),
        circle("R", "east", "GND", "FL100", "17:00:00 S 179:58:00 W"),
    ]
    .concat();
    let flight = Flight {
        start: "-17,179.9,100".parse().ok(),
        target: "-17,-179.9,100".parse().ok(),
        within_m: Some(5000.0),
    };
    let read = super::super::convert(file.as_bytes(), Syntax::Lines, MOST, &flight);
    let scenario = read.expect("a scenario").scenario;
    assert_eq!(scenario["threats"].as_array().map(Vec::len), Some(2));
    let lon = |corner: &str| scenario["area"][corner]["lon"].as_f64().expect("a number");
    assert!((179.8..179.9).contains(&lon("min")) && (-179.9..-179.8).contains(&lon("max")));
}

#[test]
fn ends_of_the_request_count_before_those_of_the_file() {
    let file = json!([
        geojson::point("start", json!([8.0, 47.0, 10])),
        geojson::point("target", json!([8.1, 47.0, 10]))
    ]);
    let file = json!({"type": "FeatureCollection", "features": file});
    let flight = Flight {
        start: "47.1,8.2".parse().ok(),
        ..Flight::default()
    };
    let read = super::super::convert(file.to_string().as_bytes(), Syntax::Json, MOST, &flight);
    let read = read.expect("a scenario");
    assert_eq!(
        read.scenario["start"],
        json!({"lat": 47.1, "lon": 8.2, "alt": 0.0})
    );
    assert_eq!(read.scenario["target"]["lon"], 8.1);
    assert_eq!(read.scenario["area"], json!(null));
    assert_eq!(
        unused(&read),
        ["/features/0: another point is the start already"]
    );
    assert_eq!(read.assumed[0].pointer, "/start/alt");
}

#[test]
fn a_map_without_ends_is_refused_and_told_how_to_give_them() {
    let file = circle("R", "range", "GND", "FL100", MIDDLE);
    let refused = convert(file.as_bytes(), Syntax::of(file.as_bytes())).expect_err("no ends");
    assert_eq!(
        refused.to_string(),
        "no start and no target in the file: a point of that name makes one in GeoJSON and KML, the options start and target do with any file"
    );
}

#[test]
fn ends_are_degrees_and_metres() {
    for text in [
        "",
        "47.3",
        "47.3;8.4",
        "47.3,8.4,1,2",
        "x,8",
        "47.3,8.4,NaN",
        "47.3,8.4,inf",
        "NaN,8",
        "8.4,247.3",
        "98.4,7",
    ] {
        let refused = text.parse::<End>().expect_err(text);
        assert_eq!(
            refused,
            "must be latitude,longitude or latitude,longitude,altitude, in degrees (-90 to 90, -180 to 180) and metres"
        );
    }
    assert!("-90, 180".parse::<End>().is_ok());
}

#[test]
fn files_may_be_in_utf_16_or_latin_1() {
    let latin = circle("R", "Z?RICH", "GND", "FL100", MIDDLE);
    let latin: Vec<u8> = latin
        .bytes()
        .map(|byte| if byte == b'?' { 0xdc } else { byte })
        .collect();
    let read = super::super::convert(&latin, Syntax::of(&latin), MOST, &flight());
    assert_eq!(
        read.expect("a scenario").scenario["threats"][0]["name"],
        "ZÜRICH"
    );
    let kml = "<kml><Document><name>Flug über</name></Document></kml>";
    for (mark, bytes) in [
        ([0xff, 0xfe], u16::to_le_bytes as fn(u16) -> [u8; 2]),
        ([0xfe, 0xff], u16::to_be_bytes),
    ] {
        let units = kml.encode_utf16().flat_map(bytes);
        let wide: Vec<u8> = mark.into_iter().chain(units).collect();
        let read = super::super::convert(&wide, Syntax::of(&wide), MOST, &flight());
        assert_eq!(read.expect("a scenario").scenario["name"], "Flug über");
    }
}
