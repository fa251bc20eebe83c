//! Malformed files to convert: they are read or refused. What the readers make of valid files is tested beside
//! them.

use noctule::import::{self, Conversion, Flight, ImportError, Most, Syntax};
use proptest::prelude::*;

use crate::support::patience::at_little_cost;
use crate::support::size::cases;

const MOST: Most = Most {
    threats: 10_000,
    polygon_vertices: 20_000,
};

/// One file of each format, with everything that its reader handles.
const FILES: [&str; 6] = [GEOJSON, KML, PLAN, OPENAIR, ED_269, ED_318];

const GEOJSON: &str = r#"{"type": "FeatureCollection", "name": "flight", "features": [
  {"type": "Feature", "properties": {"name": "Start"}, "geometry": {"type": "Point", "coordinates": [8.5, 47.3, 500]}},
  {"type": "Feature", "properties": {"name": "target"}, "geometry": {"type": "Point", "coordinates": [8.6, 47.4, 520.5]}},
  {"type": "Feature", "properties": {"name": "radar", "radius": 150, "influence": 250, "base": 480, "top": 900},
   "geometry": {"type": "Point", "coordinates": [8.55, 47.35]}},
  {"type": "Feature", "properties": {"margin": 20}, "geometry": {"type": "GeometryCollection", "geometries": [
    {"type": "Polygon", "coordinates": [[[8.51, 47.31], [8.52, 47.31], [8.52, 47.32], [8.51, 47.31]]]},
    {"type": "MultiPolygon", "coordinates": [[[[8.53, 47.31], [8.54, 47.31], [8.54, 47.32], [8.53, 47.31]]]]},
    {"type": "LineString", "coordinates": [[8.5, 47.3], [8.6, 47.4]]}]}}]}"#;

const KML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document><name>flight</name><Folder>
<Placemark><name>Start</name><Point><coordinates>8.5,47.3,500</coordinates></Point></Placemark>
<Placemark><name>target</name><Point><coordinates> 8.6,47.4,520.5 </coordinates></Point></Placemark>
<Placemark><name>radar &amp; mast</name><ExtendedData><Data name="radius"><value>150</value></Data></ExtendedData>
<Point><coordinates>8.55,47.35,0</coordinates></Point></Placemark>
<Placemark><MultiGeometry><Polygon><outerBoundaryIs><LinearRing><coordinates>
8.51,47.31 8.52,47.31 8.52,47.32 8.51,47.31</coordinates></LinearRing></outerBoundaryIs></Polygon>
<LineString><coordinates>8.5,47.3 8.6,47.4</coordinates></LineString></MultiGeometry></Placemark>
</Folder></Document></kml>"#;

const PLAN: &str = r#"{"fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
  "mission": {"plannedHomePosition": [47.3, 8.5, 480], "vehicleType": 1, "cruiseSpeed": 12, "hoverSpeed": 4, "items": [
    {"type": "SimpleItem", "command": 22, "frame": 3, "params": [0, 0, 0, null, 47.3, 8.5, 30]},
    {"type": "SimpleItem", "command": 178, "frame": 2, "params": [1, 12, -1, 0, 0, 0, 0]},
    {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, null, 47.35, 8.55, 40]},
    {"type": "ComplexItem", "complexItemType": "survey"},
    {"type": "SimpleItem", "command": 16, "frame": 0, "params": [0, 0, 0, null, 47.4, 8.6, 530]}]},
  "geoFence": {
    "circles": [{"inclusion": false, "circle": {"center": [47.35, 8.56], "radius": 200}}],
    "polygons": [{"inclusion": false, "polygon": [[47.31, 8.51], [47.31, 8.52], [47.32, 8.52]]}]},
  "rallyPoints": {"points": [[47.3, 8.5, 10]]}}"#;

const OPENAIR: &str = "* Zones
AC R
AY TRA
AN LS-R 1
AL 500ft AGL
AH FL 100
V X=47:24:00 N 008:33:00 E
DC 2.5
AC D
AN TMA
AL 4500 ft MSL
AH UNL
V D=-
V X=47:24:30 N 008:33:30 E
DA 5,90,0
DB 47:30:00 N 008:33:00 E,47:24:00 N 008:42:00 E
DP 47:20:00 N 008:31:00 E
AC E
AN open
AL GND
AH FL100
DP 47:20:00 N 008:31:00 E
";

const ED_269: &str = r#"{"title": "zones", "features": [
  {"identifier": "A1", "name": "Airport", "restriction": "PROHIBITED", "geometry": [
    {"uomDimensions": "M", "lowerLimit": 0, "lowerVerticalReference": "AGL", "upperLimit": 2000, "upperVerticalReference": "AMSL",
     "horizontalProjection": {"type": "Circle", "center": [8.5, 47.4], "radius": 750}},
    {"uomDimensions": "FT", "lowerLimit": 400, "lowerVerticalReference": "AMSL",
     "horizontalProjection": {"type": "Polygon", "coordinates": [[[8.5, 47.35], [8.6, 47.35], [8.6, 47.4], [8.5, 47.35]]]}}]}]}"#;

const ED_318: &str = r#"{"type": "FeatureCollection", "features": [
  {"type": "Feature", "properties": {"identifier": "B1", "name": [{"lang": "en-GB", "text": "Aerodrome"}], "type": "PROHIBITED"},
   "geometry": {"type": "GeometryCollection", "geometries": [
     {"type": "Point", "coordinates": [8.5, 47.4], "extent": {"subType": "Circle", "radius": 900},
      "layer": {"lower": 0, "lowerReference": "AGL", "upper": 600, "upperReference": "AMSL", "uom": "m"}},
     {"type": "MultiPolygon", "coordinates": [[[[8.5, 47.35], [8.6, 47.35], [8.6, 47.4], [8.5, 47.35]]]],
      "layer": {"lower": 300, "lowerReference": "WGS84", "uom": "ft"}}]}}]}"#;

/// Within the limits that a service has by default, for a flight whose ends are known.
fn convert_for_a_flight(text: &[u8], syntax: Syntax) -> Result<Conversion, ImportError> {
    let flight = Flight {
        start: "47.3,8.5,500".parse().ok(),
        target: "47.4,8.6,520.5".parse().ok(),
        within_m: None,
    };
    import::convert(text, syntax, MOST, &flight)
}

/// Within the limits that a service has by default.
fn convert(text: &[u8], syntax: Syntax) -> Result<Conversion, ImportError> {
    import::convert(text, syntax, MOST, &Flight::default())
}

#[test]
fn complete_files_are_read() {
    for (file, expected) in [
        (GEOJSON, &["cylinder", "polygon", "polygon"][..]),
        (KML, &["cylinder", "polygon"]),
        (PLAN, &["cylinder", "polygon"]),
        (OPENAIR, &["cylinder", "polygon"]),
        (ED_269, &["cylinder", "polygon"]),
        (ED_318, &["cylinder", "polygon"]),
    ] {
        let text = file.as_bytes();
        let read = convert(text, Syntax::of(text));
        let read = read.or_else(|_| convert_for_a_flight(text, Syntax::of(text)));
        let read = read.expect("a scenario");
        let threats = read.scenario["threats"].as_array().expect("a list");
        let kinds: Vec<_> = threats.iter().map(|threat| &threat["kind"]).collect();
        assert_eq!(kinds, expected, "{file}");
    }
}

/// Broad or deep, the cost is proportional to the length.
#[test]
fn long_files_are_read_in_linear_time() {
    let check = |many: usize, open: &str, close: &str| {
        let text = format!("<kml>{}{}</kml>", open.repeat(many), close.repeat(many));
        let refused = at_little_cost(|| convert(text.as_bytes(), Syntax::Xml));
        let Err(ImportError::NoScenario { unused, .. }) = refused else {
            panic!("{refused:?}");
        };
        let counted = unused.last().expect("what is not used");
        assert_eq!(
            counted.reason,
            format!("{} more are not listed", many - 1000)
        );
    };
    check(200_000, "<Placemark/>", "");
    check(
        200_000,
        "<Placemark><ExtendedData>",
        "</ExtendedData></Placemark>",
    );
}

/// As long as a body may be by default.
const LONGEST: usize = 8 * 1024 * 1024;

/// `one` again and again, up to the length of a body.
fn long(begin: &str, one: impl Fn(usize) -> String, end: &str) -> String {
    let mut text = begin.to_owned();
    for index in 0.. {
        let next = one(index);
        if text.len() + next.len() + end.len() > LONGEST {
            break;
        }
        text.push_str(&next);
    }
    text + end
}

/// What the parser would compare with each other is limited, however it is spread over a file.
#[test]
fn namespaces_and_attributes_are_read_in_linear_time() {
    let prefix = |n: usize| format!(" xmlns:n{n}=\"u{n}\"");
    let prefixes = |many: usize| (0..many).map(prefix).collect::<Vec<_>>().concat();
    let refused = |text: String| {
        let refused = at_little_cost(|| convert(text.as_bytes(), Syntax::Xml));
        assert!(
            matches!(refused, Err(ImportError::NotXml(_))),
            "{refused:?}"
        );
    };
    let child = |_| "<a xmlns:z=\"z\"/>".to_owned();
    refused(long(&format!("<kml{}>", prefixes(2000)), child, "</kml>"));
    let attribute = |n: usize| format!(" a{n}=\"\"");
    refused(long("<kml><a", attribute, "/></kml>"));
    refused(long("<kml>", |n| format!("<a{}>", prefix(n)), ""));
    let alike = "x".repeat(1_000_000);
    let same = |n| format!("<a p:a{n}=\"\" q:a{n}=\"\"/>");
    refused(long(
        &format!("<kml xmlns:p=\"{alike}p\" xmlns:q=\"{alike}q\">"),
        same,
        "</kml>",
    ));

    // As much as there may be of each.
    let read = |text: String| {
        let read = at_little_cost(|| convert(text.as_bytes(), Syntax::Xml));
        assert!(
            matches!(read, Err(ImportError::NoScenario { .. })),
            "{read:?}"
        );
    };
    read(long(&format!("<kml{}>", prefixes(15)), child, "</kml>"));
    let attributes = (0..64).map(attribute).collect::<Vec<_>>().concat();
    read(long("<kml>", |_| format!("<a{attributes}/>"), "</kml>"));
}

/// Nothing can be worked out from such arcs: their airspaces are listed, and take nothing from the next.
#[test]
fn arcs_that_make_no_sense_are_listed() {
    let arcs = [
        ("DA 1,nan,90", "no number"),
        ("DA 1,0,nan", "no number"),
        ("DA 5000,0,180", "at most 1000000"),
        (
            "DB 47:30:00 N 008:33:00 E,47:24:00 N 060:42:00 E",
            "at most 1000000",
        ),
    ];
    for (arc, reason) in arcs {
        let file = format!(
            "AC R\nAN odd\nAL GND\nAH FL10\nV X=47:24:00 N 008:33:00 E\n{arc}\n\n\
             AC R\nAN next\nAL GND\nAH FL10\nV X=47:24:00 N 008:33:00 E\nDC 1\n"
        );
        let found = convert_for_a_flight(file.as_bytes(), Syntax::Lines).expect("a scenario");
        let threats = found.scenario["threats"].as_array().expect("a list");
        assert_eq!(threats.len(), 1, "{arc}");
        assert_eq!(threats[0]["name"], "next");
        let is_told = found.unused.iter().any(|part| part.reason.contains(reason));
        assert!(is_told, "{arc}: {:?}", found.unused);
    }
}

/// A short line may stand for many corners: there is an end to them.
#[test]
fn arcs_and_long_edges_are_worked_out_at_little_cost() {
    let refused = |text: String| {
        let syntax = Syntax::of(text.as_bytes());
        let refused = at_little_cost(|| convert_for_a_flight(text.as_bytes(), syntax));
        let Err(ImportError::NoScenario { detail, .. }) = refused else {
            panic!("{refused:?}");
        };
        detail
    };
    let most = "the arcs and long edges of the file have over 50000 corners: leave out what lies far from the flight";
    let head = "AC R\nAN a\nAL GND\nAH FL10\nV X=47:24:00 N 008:33:00 E\n";
    let arcs = "DA 1,0,360\n".repeat(700_000);
    assert_eq!(refused(format!("{head}{arcs}")), most);
    let airspaces = format!("{head}DA 1,0,359\n").repeat(60_000);
    assert_eq!(refused(airspaces), most);
    let far = |n: i64| format!("[{},{}]", n % 7 * 25 - 80, n % 5 * 30 - 60);
    let ring: Vec<String> = (0..500_000).map(far).collect();
    let map = format!(
        r#"{{"type":"Feature","properties":{{}},"geometry":{{"type":"Polygon","coordinates":[[{}]]}}}}"#,
        ring.join(",")
    );
    assert_eq!(refused(map), most);
    // A comb, whose teeth a sweep would look at together.
    let tooth = |n: usize| {
        format!(
            "DP {}:00:00 N 008:{:02}:{:02} E\n",
            47 + n % 2,
            n / 60 % 60,
            n % 60
        )
    };
    let comb: String = (0..300_000).map(tooth).collect();
    let detail = refused(format!("{head}{comb}"));
    assert!(detail.contains("300000 vertices together"), "{detail}");
}

fn use_up(bytes: &[u8]) {
    let _ = at_little_cost(|| convert(bytes, Syntax::of(bytes)));
    let _ = at_little_cost(|| convert_for_a_flight(bytes, Syntax::of(bytes)));
}

proptest! {
    #![proptest_config(cases(64, 20_000))]

    /// One byte changed, a part duplicated elsewhere, then cut anywhere.
    #[test]
    fn damaged_files_never_break_the_readers(
        at: prop::sample::Index, byte: u8, from: prop::sample::Index, long in 1..60_usize, cut: prop::sample::Index,
    ) {
        for file in FILES {
            let mut bytes = file.as_bytes().to_vec();
            bytes[at.index(file.len())] = byte;
            use_up(&bytes);
            let part = bytes[from.index(file.len() - long)..][..long].to_vec();
            let at = at.index(file.len());
            bytes.splice(at..at, part);
            use_up(&bytes);
            bytes.truncate(cut.index(file.len()));
            use_up(&bytes);
        }
    }

    /// A position in a plan or GeoJSON has too few numbers.
    #[test]
    fn short_positions_never_break_the_readers(which: prop::sample::Index, left in 0..3_usize) {
        for file in [GEOJSON, PLAN] {
            let begins = |at: &usize| file[*at..].starts_with(|c: char| c.is_ascii_digit());
            let lists: Vec<_> = file.match_indices('[').map(|(at, _)| at + 1).filter(begins).collect();
            let at = *which.get(&lists);
            let (numbers, rest) = file[at..].split_once(']').expect("a list ends");
            let numbers: Vec<_> = numbers.split(',').take(left).collect();
            use_up([&file[..at], &numbers.join(","), "]", rest].concat().as_bytes());
        }
    }

    /// A number in a plan or GeoJSON is replaced.
    #[test]
    fn other_values_never_break_the_readers(which: prop::sample::Index, with in prop::sample::select(vec![
        "null", "true", "-1", "1e308", "1e-320", "18446744073709551615", "\"12\"", "[]", "{}", "[[8.5, 47.3]]",
    ])) {
        for file in [GEOJSON, PLAN] {
            let is_digit = |c: char| c.is_ascii_digit() || c == '.';
            let numbers: Vec<_> = file.match_indices(|c: char| c.is_ascii_digit()).map(|(at, _)| at)
                .filter(|at| !file[..*at].ends_with(is_digit)).collect();
            let at = *which.get(&numbers);
            let rest = file[at..].trim_start_matches(is_digit);
            use_up([&file[..at], with, rest].concat().as_bytes());
        }
    }
}
