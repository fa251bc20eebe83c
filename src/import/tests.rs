//! Valid and invalid files.

mod geojson;
mod kml;
mod plan;

use serde_json::json;

use super::*;

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
