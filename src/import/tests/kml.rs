//! KML.

use serde_json::json;

use super::super::*;
use super::{convert, unused};

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
fn comments_are_not_read() {
    let file = KML
        .replace("<name>radar</name>", "<name>radar<!-- a draft --></name>")
        .replace("<value>150</value>", "<value>1<!-- 9 -->50</value>")
        .replace(
            ">20</SimpleData>",
            "><!-- metres -->2<!-- 7 -->0</SimpleData>",
        )
        .replace(
            "8.52,47.31 8.52,47.32",
            "8.52,47.31 <!-- 8.6,47.4 --> 8.52,47.32",
        );
    assert_ne!(file, KML);
    let read = |text: &str| convert(text.as_bytes(), Syntax::Xml).expect("a scenario");
    assert_eq!(read(&file), read(KML));
}

/// Both halves have the placemark's name and margin; between two threats a route could pass.
#[test]
fn a_polygon_cut_at_180_degrees_is_one_again() {
    let half = |corners: &str| {
        format!(
            "<Polygon><outerBoundaryIs><LinearRing><coordinates>{corners}</coordinates></LinearRing></outerBoundaryIs></Polygon>"
        )
    };
    let ends =
        "<Placemark><name>start</name><Point><coordinates>179.5,0</coordinates></Point></Placemark>
<Placemark><name>target</name><Point><coordinates>-179.5,0</coordinates></Point></Placemark>";
    let (west, east) = (
        half("179.9,1 180,1 180,2 179.9,2 179.9,1"),
        half("-180,1 -179.9,1 -179.9,2 -180,2 -180,1"),
    );
    let kml = format!(
        "<kml><Document>{ends}<Placemark><name>atoll</name><ExtendedData><Data name=\"margin\"><value>20</value></Data></ExtendedData>
<MultiGeometry>{west}<MultiGeometry>{east}</MultiGeometry></MultiGeometry></Placemark></Document></kml>"
    );
    let found = convert(kml.as_bytes(), Syntax::of(kml.as_bytes())).expect("a scenario");
    let corner = |lat: f64, lon: f64| json!({"lat": lat, "lon": lon});
    assert_eq!(
        found.scenario["threats"],
        json!([{"kind": "polygon", "name": "atoll", "vertices": [
            corner(2.0, 179.9), corner(1.0, 179.9), corner(1.0, 180.0), corner(1.0, -179.9), corner(2.0, -179.9),
            corner(2.0, -180.0)], "margin": 20.0, "base": null, "top": null}])
    );
}

#[test]
fn heights_of_polygons_that_are_not_read_are_told() {
    let town = |mode: &str, data: &str| {
        let ends = ["start", "target"].map(|end| {
            let lon = if end == "start" { 8.5 } else { 8.6 };
            format!("<Placemark><name>{end}</name><Point><altitudeMode>absolute</altitudeMode><coordinates>{lon},47.3,500</coordinates></Point></Placemark>")
        });
        let kml = format!(
            "<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document>{}<Placemark><name>town</name>{data}<Polygon>{mode}\
             <outerBoundaryIs><LinearRing><coordinates>8.51,47.31,30 8.52,47.31,30 8.52,47.32,30 8.51,47.31,30</coordinates>\
             </LinearRing></outerBoundaryIs></Polygon></Placemark></Document></kml>",
            ends.concat()
        );
        let found = convert(kml.as_bytes(), Syntax::of(kml.as_bytes())).expect("a scenario");
        unused(&found)
    };
    let top = "<ExtendedData><Data name=\"top\"><value>530</value></Data></ExtendedData>";
    for mode in ["absolute", "relativeToGround"] {
        let mode = format!("<altitudeMode>{mode}</altitudeMode>");
        assert_eq!(
            town(&mode, ""),
            [
                "line 1: town: the heights of a polygon: it is kept clear of at any height, unless its data have a base or a top"
            ]
        );
        assert!(town(&mode, top).is_empty());
    }
    assert!(town("<altitudeMode>clampToGround</altitudeMode>", "").is_empty());
    assert!(town("", "").is_empty());
}
