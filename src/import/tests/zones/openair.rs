//! Airspaces of OpenAir.

use std::f64::consts::TAU;

use super::*;
use crate::geometry::geodesy::{LatLon, TangentPlane};
use crate::geometry::{Point2, ring};

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
fn a_record_that_is_not_read_is_named_as_it_is_written() {
    let airway = circle("A", "airway", "GND", "FL100", MIDDLE).replacen("V X", "V W=1\r\nV X", 1);
    let file = [airway, circle("R", "whole", "GND", "FL100", MIDDLE)].concat();
    let read = zones(&file);
    assert_eq!(read.scenario["threats"].as_array().map(Vec::len), Some(1));
    assert_eq!(
        unused(&read),
        ["line 1: line 5 is \"V W=1\", a record that is not read"]
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
