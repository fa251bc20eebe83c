//! Zones of ED-269 and ED-318.

use serde_json::Value;

use super::*;

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
