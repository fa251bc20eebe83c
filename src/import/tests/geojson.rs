//! GeoJSON.

use serde_json::{Value, json};

use super::super::*;
use super::{convert, unused};

pub(super) fn geojson(features: &Value) -> Result<Conversion, ImportError> {
    convert(collection(features).as_bytes(), Syntax::Json)
}

/// The text of a file with these features.
pub(super) fn collection(features: &Value) -> String {
    json!({"type": "FeatureCollection", "name": "flight", "features": features}).to_string()
}

#[expect(
    clippy::needless_pass_by_value,
    reason = "read better where they are called"
)]
pub(super) fn feature(properties: Value, geometry: Value) -> Value {
    json!({"type": "Feature", "properties": properties, "geometry": geometry})
}

#[expect(
    clippy::needless_pass_by_value,
    reason = "reads better where it is called"
)]
pub(super) fn point(name: &str, coordinates: Value) -> Value {
    feature(
        json!({"name": name}),
        json!({"type": "Point", "coordinates": coordinates}),
    )
}

pub(super) fn ends() -> Vec<Value> {
    vec![
        point("Start", json!([8.5, 47.3, 500])),
        point(" target", json!([8.6, 47.4, 520.5])),
    ]
}

#[test]
fn points_circles_and_polygons_of_geojson() {
    let mut features = ends();
    features.push(feature(
        json!({"name": "radar", "radius": 150, "influence": 250, "base": 480, "top": 900, "fill": "#f00"}),
        json!({"type": "Point", "coordinates": [8.55, 47.35]}),
    ));
    features.push(feature(
        json!({"name": "town", "margin": 20}),
        json!({"type": "Polygon", "coordinates": [
            [[8.51, 47.31], [8.52, 47.31], [8.52, 47.32], [8.51, 47.31]],
            [[8.515, 47.311], [8.516, 47.311], [8.516, 47.312], [8.515, 47.311]]]}),
    ));
    features.push(feature(
        json!(null),
        json!({"type": "GeometryCollection", "geometries": [
            {"type": "MultiPolygon", "coordinates": [[[[8.53, 47.31], [8.54, 47.31], [8.54, 47.32], [8.53, 47.31]]]]},
            {"type": "LineString", "coordinates": [[8.5, 47.3], [8.6, 47.4]]}]}),
    ));
    let found = geojson(&features.into()).expect("a scenario");
    assert_eq!(
        found.scenario,
        json!({
            "name": "flight",
            "frame": "wgs84",
            "altitude_datum": "ellipsoid",
            "start": {"lat": 47.3, "lon": 8.5, "alt": 500.0},
            "target": {"lat": 47.4, "lon": 8.6, "alt": 520.5},
            "threats": [
                {"kind": "cylinder", "name": "radar", "center": {"lat": 47.35, "lon": 8.55}, "radius": 150.0,
                 "influence": 250.0, "base": 480.0, "top": 900.0},
                {"kind": "polygon", "name": "town", "vertices": [{"lat": 47.31, "lon": 8.51}, {"lat": 47.31, "lon": 8.52},
                 {"lat": 47.32, "lon": 8.52}], "margin": 20.0, "base": null, "top": null},
                {"kind": "polygon", "name": null, "vertices": [{"lat": 47.31, "lon": 8.53}, {"lat": 47.31, "lon": 8.54},
                 {"lat": 47.32, "lon": 8.54}], "margin": 0.0, "base": null, "top": null}],
            "terrain": {"kind": "flat", "elevation": 500.0},
            "altitude": {"min": 0.0, "max": 120.0},
        })
    );
    assert_eq!(
        unused(&found),
        [
            "/features/2: said and not used: fill",
            "/features/3/geometry/coordinates/1: the hole of a polygon: all of it is kept clear of",
            "/features/4/geometry/geometries/1: a line: points and polygons make a scenario",
        ]
    );
    let assumed: Vec<_> = found
        .assumed
        .iter()
        .map(|assumed| assumed.pointer.as_str())
        .collect();
    assert_eq!(assumed, ["/altitude", "/terrain"]);
}

#[test]
fn what_is_no_feature_is_told_in_words_of_the_format() {
    let mut features = ends();
    features.extend([json!(null), json!(5), json!(["a"])]);
    features.push(feature(json!({}), json!("here")));
    let found = geojson(&features.into()).expect("a scenario");
    let no_feature = "no feature: a feature is an object";
    assert_eq!(
        unused(&found),
        [
            format!("/features/2: {no_feature}"),
            format!("/features/3: {no_feature}"),
            format!("/features/4: {no_feature}"),
            "/features/5: a feature whose geometry is neither an object nor null".to_owned(),
        ]
    );
}

/// Also of shapes within shapes, and where the file is one feature.
#[test]
fn places_are_pointers_into_the_file() {
    let rings = json!([[[1, 1], [2, 1], [2, 2], [1, 1]], [[1, 1]], [[2, 2]]]);
    let polygon = json!({"type": "Polygon", "coordinates": rings});
    let many = json!({"type": "MultiPolygon", "coordinates": [rings, [[[1, 1]]], rings]});
    let line = json!({"type": "LineString", "coordinates": [[1, 1], [2, 2]]});
    let of = |shapes: &[&Value]| json!({"type": "GeometryCollection", "geometries": shapes});
    let nested = of(&[&line, &of(&[&polygon, &many])]);
    let check = |document: Value, expected: &[&str]| {
        let refused = convert(document.to_string().as_bytes(), Syntax::Json).expect_err("no ends");
        let ImportError::NoScenario { unused, .. } = refused else {
            panic!("{refused}");
        };
        let places: Vec<_> = unused.iter().map(|unused| unused.place.as_str()).collect();
        assert_eq!(places, expected);
        for place in places {
            assert!(document.pointer(place).is_some(), "{place}");
        }
    };
    check(
        feature(json!({}), polygon.clone()),
        &["/geometry/coordinates/1", "/geometry/coordinates/2"],
    );
    let features = [feature(json!({}), many.clone()), feature(json!({}), nested)];
    check(
        json!({"type": "FeatureCollection", "features": features}),
        &[
            "/features/0/geometry/coordinates/0/1",
            "/features/0/geometry/coordinates/0/2",
            "/features/0/geometry/coordinates/2/1",
            "/features/0/geometry/coordinates/2/2",
            "/features/0/geometry/coordinates/1",
            "/features/1/geometry/geometries/0",
            "/features/1/geometry/geometries/1/geometries/0/coordinates/1",
            "/features/1/geometry/geometries/1/geometries/0/coordinates/2",
            "/features/1/geometry/geometries/1/geometries/1/coordinates/0/1",
            "/features/1/geometry/geometries/1/geometries/1/coordinates/0/2",
            "/features/1/geometry/geometries/1/geometries/1/coordinates/2/1",
            "/features/1/geometry/geometries/1/geometries/1/coordinates/2/2",
            "/features/1/geometry/geometries/1/geometries/1/coordinates/1",
        ],
    );
}

#[test]
fn what_a_feature_gets_wrong_is_listed() {
    let circle = |properties| {
        feature(
            properties,
            json!({"type": "Point", "coordinates": [8.5, 47.3]}),
        )
    };
    for (wrong, reason) in [
        (circle(json!({"radius": -3})), "radius is -3, must be > 0"),
        (
            circle(json!({"radius": "wide"})),
            "radius is \"wide\", must be a number",
        ),
        (
            circle(json!({"name": "hut"})),
            "a point that is not named start or target and has no radius",
        ),
        (
            circle(json!({"role": "waypoint", "name": "P1"})),
            "a waypoint of a route: a plan finds its own",
        ),
        (
            point("start", json!([8.5, 47.3])),
            "another point is the start already",
        ),
        (
            point("radar", json!([190, 47.3])),
            "longitude is 190, must be from -180 to 180",
        ),
        (
            point("radar", json!([8.5, 97])),
            "latitude is 97, must be from -90 to 90",
        ),
        (
            feature(
                json!({}),
                json!({"type": "Polygon", "coordinates": [[[1, 1], [2, 2], [1, 1]]]}),
            ),
            "a polygon of 2 corners, must have three or more",
        ),
        (
            feature(json!({}), json!({"type": "Polygon", "coordinates": []})),
            "a polygon without a ring",
        ),
        (
            feature(
                json!({}),
                json!({"type": "Polygon", "coordinates": [[[1], [2], [3]]]}),
            ),
            "a corner that is not longitude and latitude",
        ),
        (
            feature(json!({}), json!(null)),
            "a feature without geometry",
        ),
    ] {
        let mut features = ends();
        features.push(wrong);
        let found = geojson(&features.into()).expect("the rest is a scenario");
        assert_eq!(unused(&found), [format!("/features/2: {reason}")]);
        assert_eq!(found.scenario["threats"], json!([]));
    }
    for broken in [
        json!(3),
        json!({"type": "Feature", "geometry": {"type": "Point", "coordinates": ["x"]}, "properties": {}}),
        json!({"type": "Feature", "geometry": {"type": "Blob"}, "properties": {}}),
        json!({"type": "Feature", "geometry": {"type": "Point", "coordinates": [1]}, "properties": {}}),
        json!({"type": "Feature", "geometry": {"type": "MultiPolygon", "coordinates": [[[[1, 1], [2], []]]]}, "properties": {}}),
    ] {
        let mut features = ends();
        features.push(broken.clone());
        let found = geojson(&features.into()).expect("the rest is a scenario");
        assert_eq!(found.unused.len(), 1, "{broken}");
    }
}

#[test]
fn a_file_without_ends_is_no_scenario() {
    let check = |text: &str, expected: &str| {
        let refused = convert(text.as_bytes(), Syntax::of(text.as_bytes())).expect_err(text);
        assert_eq!(refused.to_string(), expected);
    };
    check(
        r#"{"type": "FeatureCollection", "features": []}"#,
        "no start and no target in the file: a point of that name makes one in GeoJSON and KML, the options start and target do with any file",
    );
    check(
        &point("start", json!([1, 2, 3])).to_string(),
        "no target in the file: a point of that name makes one in GeoJSON and KML, the options start and target do with any file",
    );
    check(
        r#"{"type": "FeatureCollection"}"#,
        "a FeatureCollection has features, a list; this one has none",
    );
    check(
        "[]",
        "type is missing, must be FeatureCollection; a plan of QGroundControl has fileType Plan",
    );
    check(
        r#"{"type": "FeatureCollection", "features": [], "crs": {"type": "name", "properties": {"name": "EPSG:2056"}}}"#,
        "crs is EPSG:2056, must be longitude and latitude of WGS 84",
    );
    check("{\"type\":\n oops}", "line 2, column 2: expected value");
    check("", "line 1, column 1: EOF while parsing a value");
    check(
        "PK\u{3}\u{4}...",
        "a zip archive, as KMZ is: unpack it and take the doc.kml in it",
    );
    check("<gpx/>", "the root element is gpx, must be kml");
    check("<kml>", "the root node was opened but never closed");
    check(
        r#"{"fileType": "Plan", "mission": {}}"#,
        "a plan has mission.items, a list; this one has none",
    );
}

#[test]
fn heights_of_polygons_and_those_that_are_null_are_told_or_forgotten() {
    let mut features = ends();
    let ring = |alt: Value| {
        json!([
            [8.5, 47.3, alt],
            [8.51, 47.3, alt],
            [8.51, 47.31, alt],
            [8.5, 47.3, alt]
        ])
    };
    let polygon = |alt: Value| json!({"type": "Polygon", "coordinates": [ring(alt)]});
    features.push(feature(json!({"name": 12}), polygon(json!(300))));
    features.push(feature(json!({"top": 500}), polygon(json!(300))));
    features.push(feature(json!({}), polygon(json!(null))));
    features.push(feature(
        json!({"radius": 90}),
        json!({"type": "Point", "coordinates": [8.5, 47.3, null]}),
    ));
    let found = geojson(&features.into()).expect("a scenario");
    let threats = &found.scenario["threats"];
    assert_eq!(threats.as_array().map(Vec::len), Some(4));
    assert_eq!(threats[0]["name"], "12");
    assert_eq!(
        unused(&found),
        [
            "/features/2: the heights of a polygon: it is kept clear of at any height, unless its data have a base or a top"
        ]
    );
}

/// To leave a threat out would let a route through.
#[test]
fn a_threat_whose_heights_cannot_be_read_is_kept_clear_of_at_any() {
    let mut features = ends();
    let at = || json!({"type": "Point", "coordinates": [8.5, 47.3]});
    features.push(feature(
        json!({"radius": 90, "base": 20, "top": "300 m"}),
        at(),
    ));
    features.push(feature(
        json!({"radius": 90, "base": 20, "top": 20, "influence": 20}),
        at(),
    ));
    let found = geojson(&features.into()).expect("a scenario");
    let threats = found.scenario["threats"].as_array().expect("a list");
    assert_eq!(threats.len(), 2);
    for threat in threats {
        assert_eq!(
            (&threat["base"], &threat["top"], &threat["influence"]),
            (&json!(null), &json!(null), &json!(90.0))
        );
    }
    assert_eq!(
        unused(&found),
        [
            "/features/2: top is \"300 m\", must be a number: it is kept clear of at any height",
            "/features/3: base is 20, must be < the top, 20: it is kept clear of at any height",
            "/features/3: influence is 20, must be >= 90: it has no soft zone",
        ]
    );
}

#[test]
fn a_polygon_closed_over_a_pole_is_a_ring_round_it() {
    let mut features = ends();
    features.push(feature(
        json!({"name": "ice"}),
        json!({"type": "Polygon", "coordinates": [
            [[-180, 88], [-120, 88], [0, 89], [120, 88], [180, 88], [180, 90], [-180, 90], [-180, 88]]]}),
    ));
    let found = geojson(&features.into()).expect("a scenario");
    let vertices = found.scenario["threats"][0]["vertices"].as_array();
    let corner =
        |vertex: &Value| ["lon", "lat"].map(|name| vertex[name].as_f64().expect("a number"));
    let ring: Vec<[f64; 2]> = vertices.expect("a polygon").iter().map(corner).collect();
    // Its edges are straight in degrees, and have corners on their way: once round the pole, along the parallel too.
    let given = [[-120.0, 88.0], [0.0, 89.0], [120.0, 88.0], [180.0, 88.0]];
    let places = given.map(|corner| {
        ring.iter()
            .position(|there| there.map(f64::to_bits) == corner.map(f64::to_bits))
    });
    assert_eq!(places[0], Some(0));
    assert!(
        places.is_sorted() && places.iter().all(Option::is_some),
        "{places:?}"
    );
    let at_most = [[-120.0, 0.0], [0.0, 120.0], [120.0, 180.0], [180.0, 240.0]];
    for (index, [lon, lat]) in ring.iter().enumerate() {
        let edge = places
            .iter()
            .filter(|place| place.is_some_and(|place| place <= index))
            .count()
            - 1;
        let lon = if edge == 3 && *lon < 0.0 {
            lon + 360.0
        } else {
            *lon
        };
        assert!(
            (at_most[edge][0]..=at_most[edge][1]).contains(&lon),
            "{index}: {lon}"
        );
        let along = match edge {
            0 => 88.0 + (lon + 120.0) / 120.0,
            1 => 89.0 - lon / 120.0,
            _ => 88.0,
        };
        assert!((lat - along).abs() < 1e-9, "{index}: {lat}");
    }
    assert_eq!(unused(&found), [""; 0]);
}

#[test]
fn what_is_said_of_many_shapes_is_short() {
    let polygons = vec![json!([[[1, 1], [1.01, 1], [1.01, 1.01]]]); 1000];
    let check = |properties: Value, expected: &str| {
        let mut features = ends();
        let coordinates = polygons.clone();
        features.push(feature(
            properties,
            json!({"type": "MultiPolygon", "coordinates": coordinates}),
        ));
        let found = geojson(&features.into()).expect("a scenario");
        let answer = serde_json::to_string(&found).expect("JSON");
        assert!(answer.contains(expected), "{}", &answer[..2000]);
        assert!(answer.len() < 1_000_000, "{}", answer.len());
    };
    let long = "x".repeat(100_000);
    check(json!({"name": long}), &"x".repeat(200));
    check(json!({"margin": long}), "must be a number");
    check(json!({"margin": vec![1; 10_000]}), "must be a number");
    check(json!({&long: 1}), "said and not used");
    let many: serde_json::Map<_, _> = (0..10_000).map(|n| (format!("n{n}"), json!(n))).collect();
    check(many.into(), "9990 more");
}

/// What ogr2ogr makes of a file of placemarks.
#[test]
fn names_in_capitals_points_of_one_and_other_names_of_wgs_84() {
    let point = |name: &str, lon: f64| {
        feature(
            json!({"Name": name, "NOTE": "seen"}),
            json!({"type": "MultiPoint", "coordinates": [[lon, 47.3, 500]]}),
        )
    };
    let both = feature(
        json!({"name": "Other"}),
        json!({"type": "MultiPoint", "coordinates": [[8.5, 47.3], [8.6, 47.3]]}),
    );
    let file = json!({
        "type": "FeatureCollection",
        "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::4326"}},
        "features": [point("start", 8.5), point("TARGET", 8.6), both],
    });
    let found = convert(file.to_string().as_bytes(), Syntax::Json).expect("a scenario");
    assert_eq!(found.scenario["start"]["lon"], 8.5);
    assert_eq!(found.scenario["target"]["lon"], 8.6);
    assert_eq!(
        unused(&found),
        [
            "/features/0: said and not used: NOTE",
            "/features/1: said and not used: NOTE",
            "/features/2: many points in one: each must be a feature of its own",
        ]
    );
}
