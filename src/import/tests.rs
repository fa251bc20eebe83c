//! Valid and invalid files.

use serde_json::{Value, json};

use super::*;

fn geojson(features: &Value) -> Result<Conversion, ImportError> {
    let document = json!({"type": "FeatureCollection", "name": "flight", "features": features});
    convert(document.to_string().as_bytes(), Syntax::Json)
}

#[expect(
    clippy::needless_pass_by_value,
    reason = "read better where they are called"
)]
fn feature(properties: Value, geometry: Value) -> Value {
    json!({"type": "Feature", "properties": properties, "geometry": geometry})
}

#[expect(
    clippy::needless_pass_by_value,
    reason = "reads better where it is called"
)]
fn point(name: &str, coordinates: Value) -> Value {
    feature(
        json!({"name": name}),
        json!({"type": "Point", "coordinates": coordinates}),
    )
}

fn ends() -> Vec<Value> {
    vec![
        point("Start", json!([8.5, 47.3, 500])),
        point(" target", json!([8.6, 47.4, 520.5])),
    ]
}

/// The reasons, each with its place.
fn unused(conversion: &Conversion) -> Vec<String> {
    let line = |unused: &Unused| format!("{}: {}", unused.place, unused.reason);
    conversion.unused.iter().map(line).collect()
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
            "/features/3: hole 0: the hole of a polygon: all of it is kept clear of",
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
            circle(json!({"radius": 5, "influence": 2})),
            "influence is 2, must be >= the radius, 5",
        ),
        (
            circle(json!({"radius": 5, "base": 9, "top": 9})),
            "base is 9, must be < the top, 9",
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
        "no start and no target in the file: a point of that name makes one",
    );
    check(
        &point("start", json!([1, 2, 3])).to_string(),
        "no target in the file: a point of that name makes one",
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

/// As our own exports write a triangle round a pole.
#[test]
fn a_polygon_closed_over_a_pole_is_a_ring_round_it() {
    let mut features = ends();
    features.push(feature(
        json!({"name": "ice"}),
        json!({"type": "Polygon", "coordinates": [
            [[-180, 88], [-120, 88], [0, 89], [120, 88], [180, 88], [180, 90], [-180, 90], [-180, 88]]]}),
    ));
    let found = geojson(&features.into()).expect("a scenario");
    let corner = |lat: f64, lon: f64| json!({"lat": lat, "lon": lon});
    assert_eq!(
        found.scenario["threats"][0]["vertices"],
        json!([
            corner(88.0, -120.0),
            corner(89.0, 0.0),
            corner(88.0, 120.0),
            corner(88.0, 180.0)
        ])
    );
    assert_eq!(unused(&found), [""; 0]);
}

const KML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document><name>flight</name>
<NetworkLink><Link><href>http://localhost/</href></Link></NetworkLink>
<Folder>
<Placemark><name>start</name><Point><altitudeMode>absolute</altitudeMode><coordinates> 8.5,47.3,500 </coordinates></Point></Placemark>
<Placemark><name>Target</name><Point><coordinates>8.6,47.4,33</coordinates></Point></Placemark>
<Placemark><name>radar</name>
<ExtendedData><Data name="radius"><value>150</value></Data><Data name="colour"><value>red</value></Data></ExtendedData>
<Point><coordinates>8.55,47.35</coordinates></Point></Placemark>
<Placemark><name>town</name><ExtendedData><SchemaData><SimpleData name="margin">20</SimpleData></SchemaData></ExtendedData>
<MultiGeometry><Polygon><outerBoundaryIs><LinearRing><coordinates>
8.51,47.31 8.52,47.31 8.52,47.32 8.51,47.31</coordinates></LinearRing></outerBoundaryIs><innerBoundaryIs/></Polygon>
<LineString><coordinates>8.5,47.3 8.6,47.4</coordinates></LineString></MultiGeometry></Placemark>
<Placemark><name>odd</name><Point><coordinates>8.5;47.3</coordinates></Point></Placemark>
<Placemark><name>empty</name></Placemark>
</Folder></Document></kml>"#;

#[test]
fn placemarks_of_kml() {
    let found = convert(KML.as_bytes(), Syntax::of(KML.as_bytes())).expect("a scenario");
    assert_eq!(
        found.scenario,
        json!({
            "name": "flight",
            "frame": "wgs84",
            "altitude_datum": "msl",
            "start": {"lat": 47.3, "lon": 8.5, "alt": 500.0},
            "target": {"lat": 47.4, "lon": 8.6, "alt": 0.0},
            "threats": [
                {"kind": "cylinder", "name": "radar", "center": {"lat": 47.35, "lon": 8.55}, "radius": 150.0,
                 "influence": 150.0, "base": null, "top": null},
                {"kind": "polygon", "name": "town", "vertices": [{"lat": 47.31, "lon": 8.51}, {"lat": 47.31, "lon": 8.52},
                 {"lat": 47.32, "lon": 8.52}], "margin": 20.0, "base": null, "top": null}],
            "terrain": {"kind": "flat", "elevation": 0.0},
            "altitude": {"min": 0.0, "max": 120.0},
        })
    );
    assert_eq!(
        unused(&found),
        [
            "line 3: a NetworkLink, which is not read",
            "line 7: radar: said and not used: colour",
            "line 10: town: hole 0: the hole of a polygon: all of it is kept clear of",
            "line 10: town: a line: points and polygons make a scenario",
            "line 14: odd: coordinates are \"8.5;47.3\", must be longitude,latitude,altitude",
            "line 15: empty: a placemark without geometry",
        ]
    );
    assert_eq!(found.assumed[0].pointer, "/target/alt");
}

#[test]
fn missions_and_fences_of_a_plan() {
    let item = |command: u16, frame: u8, lat: f64, lon: f64, alt: f64| {
        json!({"type": "SimpleItem", "command": command, "frame": frame,
               "params": [0, 0, 0, null, lat, lon, alt]})
    };
    let plan = json!({
        "fileType": "Plan", "version": 1,
        "mission": {
            "vehicleType": 2, "cruiseSpeed": 20, "hoverSpeed": 5, "plannedHomePosition": [47.3, 8.5, 480],
            "items": [
                item(22, 3, 0.0, 0.0, 15.0),
                {"type": "SimpleItem", "command": 178, "frame": 2, "params": [1, 12, -1, 0, 0, 0, 0]},
                item(16, 3, 47.35, 8.55, 40.0),
                {"type": "ComplexItem", "complexItemType": "survey"},
                item(20, 2, 0.0, 0.0, 0.0),
                item(16, 0, 47.4, 8.6, 530.0),
            ]},
        "geoFence": {
            "circles": [
                {"inclusion": false, "circle": {"center": [47.35, 8.56], "radius": 200}},
                {"inclusion": true, "circle": {"center": [47.35, 8.55], "radius": 20000}},
                {"inclusion": false, "circle": {"center": [47.35], "radius": 200}}],
            "polygons": [{"inclusion": false, "polygon": [[47.31, 8.51], [47.31, 8.52], [47.32, 8.52]]}]},
        "rallyPoints": {"points": [[47.3, 8.5, 10]]},
    });
    let found = convert(plan.to_string().as_bytes(), Syntax::Json).expect("a scenario");
    assert_eq!(
        found.scenario,
        json!({
            "name": null,
            "frame": "wgs84",
            "altitude_datum": "msl",
            "start": {"lat": 47.3, "lon": 8.5, "alt": 480.0},
            "target": {"lat": 47.4, "lon": 8.6, "alt": 530.0},
            "threats": [
                {"kind": "cylinder", "name": null, "center": {"lat": 47.35, "lon": 8.56}, "radius": 200.0,
                 "influence": 200.0, "base": null, "top": null},
                {"kind": "polygon", "name": null, "vertices": [{"lat": 47.31, "lon": 8.51}, {"lat": 47.31, "lon": 8.52},
                 {"lat": 47.32, "lon": 8.52}], "margin": 0.0, "base": null, "top": null}],
            "terrain": {"kind": "flat", "elevation": 480.0},
            "altitude": {"min": 0.0, "max": 120.0},
            "vehicle": {"cruise_speed": 12.0},
        })
    );
    assert_eq!(
        unused(&found),
        [
            "/mission/items/3: a complex item (survey), which is not read",
            "/mission/items/4: command 20, which no scenario has",
            "/mission/items/2: a stop on the way: a plan finds its own",
            "/geoFence/circles/1: a fence to stay within, where a scenario has a box, its area",
            "/geoFence/circles/2: a circle without center",
            "/rallyPoints/points/0: a rally point, which no scenario has",
        ]
    );
}

/// Beside a height above terrain, a ground station keeps the altitude above sea that it amounts to.
#[test]
fn ends_above_terrain_are_at_their_altitude_above_sea() {
    let item = |frame: u8, lat: f64, height: Value, above_sea: Value| {
        json!({"type": "SimpleItem", "command": 16, "frame": frame, "AMSLAltAboveTerrain": above_sea,
               "params": [0, 0, 0, null, lat, 8.5, height]})
    };
    let converted = |items: Value| {
        let plan = json!({
            "fileType": "Plan",
            "mission": {"plannedHomePosition": [47.2, 8.5, 480], "items": items},
        });
        convert(plan.to_string().as_bytes(), Syntax::Json)
    };
    let check = |items: Value, start: Value, target: Value| {
        let found = converted(items).expect("a scenario");
        assert_eq!(found.scenario["start"], start);
        assert_eq!(found.scenario["target"], target);
        let between = "a stop on the way: a plan finds its own";
        assert!(
            found.unused.iter().all(|unused| unused.reason == between),
            "{:?}",
            found.unused
        );
    };
    check(
        json!([
            item(10, 47.3, json!(60), json!(541.5)),
            item(10, 47.4, json!(60), json!(null)),
            item(11, 47.5, json!(40), json!(652.25)),
        ]),
        json!({"lat": 47.3, "lon": 8.5, "alt": 541.5}),
        json!({"lat": 47.5, "lon": 8.5, "alt": 652.25}),
    );
    check(
        json!([item(10, 47.5, json!(40), json!(652.25))]),
        json!({"lat": 47.2, "lon": 8.5, "alt": 480.0}),
        json!({"lat": 47.5, "lon": 8.5, "alt": 652.25}),
    );
    // In the other frames it is left aside: there, some files have what it was before.
    check(
        json!([
            item(3, 47.3, json!(60), json!(1)),
            item(0, 47.5, json!(530), json!(1))
        ]),
        json!({"lat": 47.3, "lon": 8.5, "alt": 540.0}),
        json!({"lat": 47.5, "lon": 8.5, "alt": 530.0}),
    );
    let known = item(0, 47.3, json!(500), json!(null));
    for (items, expected) in [
        (
            json!([known, item(10, 47.5, json!(40), json!(null))]),
            "the target, /mission/items/1, is 40 m above terrain (frame 10), and AMSLAltAboveTerrain is null, must be its altitude above sea",
        ),
        (
            json!([item(11, 47.5, json!(40), json!("high")), known]),
            "the start, /mission/items/0, is 40 m above terrain (frame 11), and AMSLAltAboveTerrain is \"high\", must be its altitude above sea",
        ),
        (
            json!([known, item(0, 47.5, json!(null), json!(null))]),
            "the target, /mission/items/1, has the altitude null, must be a number",
        ),
        (
            json!([known, item(7, 47.5, json!(40), json!(null))]),
            "the target, /mission/items/1, has frame 7, must be 0, 3, 5, 6, 10 or 11",
        ),
    ] {
        let refused = converted(items).expect_err(expected);
        assert_eq!(refused.to_string(), expected);
    }
}

#[test]
fn speeds_of_a_plan() {
    let check = |params: Value, expected: Result<f64, &str>| {
        let plan = json!({
            "fileType": "Plan",
            "mission": {"hoverSpeed": 5, "plannedHomePosition": [47.3, 8.5, 480], "items": [
                {"type": "SimpleItem", "command": 178, "frame": 2, "params": params},
                {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, null, 47.4, 8.6, 30]}]},
        });
        let found = convert(plan.to_string().as_bytes(), Syntax::Json).expect("a scenario");
        let (speed, reasons) = match expected {
            Ok(speed) => (speed, vec![]),
            Err(reason) => (5.0, vec![format!("/mission/items/0: {reason}")]),
        };
        assert_eq!(found.scenario["vehicle"]["cruise_speed"], speed, "{params}");
        assert_eq!(unused(&found), reasons);
    };
    check(json!([0, 12, -1, 0, 0, 0, 0]), Ok(12.0));
    check(json!([1.0, 12.5, -1, 0, 0, 0, 0]), Ok(12.5));
    for kind in [json!(2), json!(3), json!(null)] {
        let reason = format!("a speed of type {kind}, must be 0 (air) or 1 (ground)");
        check(json!([kind, 12, -1, 0, 0, 0, 0]), Err(&reason));
    }
    check(
        json!([1, -1, 50, 0, 0, 0, 0]),
        Err("speed is -1, must be > 0"),
    );
    check(
        json!([]),
        Err("a speed of type null, must be 0 (air) or 1 (ground)"),
    );
}

#[test]
fn what_is_said_of_many_shapes_is_short() {
    let polygons = vec![json!([[[1, 1], [2, 1], [2, 2]]]); 1000];
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

#[test]
fn hostile_files_are_refused_and_soon() {
    let bomb =
        "<!DOCTYPE kml [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;\">]><kml>&b;</kml>";
    let fetch = "<!DOCTYPE kml SYSTEM \"http://localhost/kml.dtd\"><kml/>";
    for text in [bomb, fetch] {
        let refused = convert(text.as_bytes(), Syntax::Xml);
        assert_eq!(
            refused,
            Err(ImportError::NotXml("XML with DTD detected".to_owned()))
        );
    }
    for (text, syntax) in [
        ("<kml>".repeat(500_000), Syntax::Xml),
        ("[".repeat(500_000), Syntax::Json),
        (
            format!(
                "{{\"type\":\"FeatureCollection\",\"features\":{}",
                "[".repeat(200)
            ),
            Syntax::Json,
        ),
    ] {
        assert!(convert(text.as_bytes(), syntax).is_err());
    }
    // Deep but well-formed: nothing recurses.
    let deep = format!(
        "<kml>{}{}</kml>",
        "<Folder>".repeat(300_000),
        "</Folder>".repeat(300_000)
    );
    assert!(matches!(
        convert(deep.as_bytes(), Syntax::Xml),
        Err(ImportError::NoScenario { .. })
    ));
    let shapes = format!(
        "{}{}",
        "<MultiGeometry>".repeat(100_000),
        "</MultiGeometry>".repeat(100_000)
    );
    let nested = format!("<kml><Placemark>{shapes}</Placemark></kml>");
    let refused = convert(nested.as_bytes(), Syntax::Xml).expect_err("no ends");
    let ImportError::NoScenario { unused, .. } = refused else {
        panic!("{refused}");
    };
    assert_eq!(unused[0].reason, "geometries nested deeper than 16 levels");
    assert!(convert(b"\xff\xfe<kml/>", Syntax::Xml).is_err());
    // A long list of unused parts is truncated.
    let many = vec![point("hut", json!([1, 2])); 3000];
    let refused = geojson(&many.into()).expect_err("no ends");
    let ImportError::NoScenario { unused, .. } = refused else {
        panic!("{refused}");
    };
    assert_eq!(unused.len(), 1001);
    assert_eq!(unused[1000].reason, "2000 more are not listed");
}
