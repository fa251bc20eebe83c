//! Valid and invalid files.

mod geojson;
mod kml;
mod plan;
mod zones;

use serde_json::json;

use super::*;

const MOST: Most = Most {
    threats: 10_000,
    polygon_vertices: 20_000,
};

/// Within the limits that a service has by default.
fn convert(text: &[u8], syntax: Syntax) -> Result<Conversion, ImportError> {
    super::convert(text, syntax, MOST, &Flight::default())
}

/// The reasons, each with its place.
fn unused(conversion: &Conversion) -> Vec<String> {
    let line = |unused: &Unused| format!("{}: {}", unused.place, unused.reason);
    conversion.unused.iter().map(line).collect()
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
    let many = vec![geojson::point("hut", json!([1, 2])); 3000];
    let refused = geojson::geojson(&many.into()).expect_err("no ends");
    let ImportError::NoScenario { unused, .. } = refused else {
        panic!("{refused}");
    };
    assert_eq!(unused.len(), 1001);
    assert_eq!(unused[1000].reason, "2000 more are not listed");
}

/// To the most that a scenario accepts, 200 characters.
#[test]
fn long_names_are_cut() {
    let check = |file: &str, expected: &str| {
        let found = convert(file.as_bytes(), Syntax::of(file.as_bytes())).expect("a scenario");
        assert_eq!(found.scenario["name"], expected);
    };
    for (len, kept) in [(200, 200), (201, 200), (5000, 200)] {
        let (name, expected) = ("ä".repeat(len), "ä".repeat(kept));
        let features = geojson::ends();
        let collection = json!({"type": "FeatureCollection", "name": name, "features": features});
        check(&collection.to_string(), &expected);
        let end = |name: &str| {
            format!(
                "<Placemark><name>{name}</name><Point><coordinates>8.5,47.3</coordinates></Point></Placemark>"
            )
        };
        let ends = end("start") + &end("target");
        let kml = format!("<kml><Document><name>{name}</name>{ends}</Document></kml>");
        check(&kml, &expected);
    }
}

/// What a scenario may have at most, a file may have too; one more is refused.
#[test]
fn files_of_too_many_threats_are_refused() {
    let circles = |many: usize| {
        let circle = geojson::feature(
            json!({"radius": 5}),
            json!({"type": "Point", "coordinates": [8.5, 47.3]}),
        );
        geojson::collection(&[geojson::ends(), vec![circle; many]].concat().into())
    };
    let parts = |many: usize| {
        let triangle = json!([[[8.5, 47.3], [8.51, 47.3], [8.51, 47.31], [8.5, 47.3]]]);
        let coordinates = vec![triangle; many];
        let parts = geojson::feature(
            json!({}),
            json!({"type": "MultiPolygon", "coordinates": coordinates}),
        );
        geojson::collection(&[geojson::ends(), vec![parts]].concat().into())
    };
    let point = |name: &str, more: &str| {
        format!(
            "<Placemark><name>{name}</name>{more}<Point><coordinates>8.5,47.3,9</coordinates></Point></Placemark>"
        )
    };
    let placemarks = |many: usize| {
        let radius = "<ExtendedData><Data name=\"radius\"><value>5</value></Data></ExtendedData>";
        let radars = point("radar", radius).repeat(many);
        format!(
            "<kml>{}{}{radars}</kml>",
            point("start", ""),
            point("target", "")
        )
    };
    let fences = |many: usize| {
        let item = json!({"type": "SimpleItem", "command": 16, "frame": 0,
            "params": [0, 0, 0, null, 47.3, 8.5, 30]});
        let corners = [[47.3, 8.5], [47.3, 8.51], [47.31, 8.51]];
        let fence = json!({"inclusion": false, "polygon": corners});
        let plan = json!({"fileType": "Plan", "mission": {"items": [item, item]},
            "geoFence": {"polygons": vec![fence; many]}});
        plan.to_string()
    };
    let check = |file: &dyn Fn(usize) -> String, most: Most, expected: &str| {
        let converted = |text: String| {
            super::convert(
                text.as_bytes(),
                Syntax::of(text.as_bytes()),
                most,
                &Flight::default(),
            )
        };
        let read = converted(file(4)).expect("no more than may be");
        assert_eq!(read.scenario["threats"].as_array().map(Vec::len), Some(4));
        let refused = converted(file(5)).expect_err(expected);
        assert_eq!(refused.to_string(), expected);
    };
    let threats = Most { threats: 4, ..MOST };
    for file in [
        &circles as &dyn Fn(usize) -> String,
        &parts,
        &placemarks,
        &fences,
    ] {
        check(
            file,
            threats,
            "the file has 5 threats, must have at most 4 (limit threats)",
        );
    }
    let vertices = Most {
        polygon_vertices: 12,
        ..MOST
    };
    for file in [&parts as &dyn Fn(usize) -> String, &fences] {
        check(
            file,
            vertices,
            "the polygons of the file have 15 vertices together, must have at most 12 (limit polygon_vertices)",
        );
    }
}

/// Small values take many times their length.
#[test]
fn a_file_of_more_values_than_memory_is_meant_for_is_refused() {
    let refused = |feature: &str, count: usize| {
        let features = vec![feature; count].join(",");
        let text = format!(r#"{{"type":"FeatureCollection","features":[{features}]}}"#);
        let refused = convert(text.as_bytes(), Syntax::Json).expect_err("no start");
        refused.to_string().contains("128 MiB")
    };
    assert!(refused(r#"{"":0}"#, 300_000));
    assert!(!refused(r#"{"":0}"#, 200_000));
    assert!(!refused(r#""a,,\",,,,,,,,,,,,,,,,,,""#, 200_000));
}
