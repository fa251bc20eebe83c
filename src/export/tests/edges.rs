//! Where the degrees end: the date line and the poles.

use serde_json::{Value, json};

use super::*;

#[test]
fn across_the_date_line_a_line_is_cut() {
    let document = json!({
        "frame": "wgs84",
        "start": {"lat": -16.80, "lon": 179.99, "alt": 30},
        "target": {"lat": -16.80, "lon": -179.99, "alt": 30},
        "threats": [{"kind": "cylinder", "center": {"lat": -16.79, "lon": 180}, "radius": 500}],
        "altitude": {"min": 10, "max": 100},
        "planner": {"smoothing": {"degree": 1, "spacing": 700}},
    });
    let plan = plan(&document, &[(-16.80, 179.998, 40.0)]);
    let text = write(&plan, "geojson", &[]).expect("a plan");
    let read: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(read["features"][0]["geometry"]["type"], "MultiLineString");
    let threat = read["features"]
        .as_array()
        .expect("features")
        .last()
        .expect("a threat");
    assert_eq!(threat["geometry"]["type"], "MultiPolygon");
    let pieces = &read["features"][0]["geometry"]["coordinates"];
    let first = pieces[0]
        .as_array()
        .expect("a line")
        .last()
        .expect("its end");
    assert_eq!(first[0], 180.0);
    assert_eq!(pieces[1][0][0], -180.0);
    assert_eq!(first[1], pieces[1][0][1]);
}

/// Whether PX4 takes a place to be within a fence: its test of a polygon, which compares longitudes as numbers.
fn is_fenced(fence: &[[f64; 2]], [lat, lon]: [f64; 2]) -> bool {
    let mut inside = false;
    for (one, other) in fence.iter().zip(fence.iter().cycle().skip(1)) {
        let share = (lat - one[0]) / (other[0] - one[0]);
        if (one[0] > lat) != (other[0] > lat) && lon < one[1] + share * (other[1] - one[1]) {
            inside = !inside;
        }
    }
    inside
}

#[test]
fn across_the_date_line_a_fence_holds() {
    let corner = |lat: f64, lon: f64| json!({"lat": lat, "lon": lon});
    let check = |east: f64, n_fences: usize, outside: f64| {
        let document = json!({
            "frame": "wgs84",
            "start": {"lat": -16.80, "lon": 179.99, "alt": 30},
            "target": {"lat": -16.80, "lon": -179.99, "alt": 30},
            "threats": [{"kind": "polygon", "vertices": [
                corner(-16.795, 179.998), corner(-16.795, east), corner(-16.78, east), corner(-16.78, 179.998)]}],
            "altitude": {"min": 10, "max": 100},
            "planner": {"smoothing": {"degree": 1, "spacing": 700}},
        });
        let plan = plan(&document, &[(-16.80, 179.998, 40.0)]);
        let text = write(&plan, "qgc", &[]).expect("a plan");
        let read: Value = serde_json::from_str(&text).expect("JSON");
        let fences = read["geoFence"]["polygons"].as_array().expect("fences");
        let fences: Vec<_> = fences
            .iter()
            .map(|fence| corners(&fence["polygon"]))
            .collect();
        assert_eq!(fences.len(), n_fences, "{fences:?}");
        let is_fenced = |lon: f64| fences.iter().any(|fence| is_fenced(fence, [-16.79, lon]));
        assert!(is_fenced(179.999), "{fences:?}");
        assert_eq!(is_fenced(-179.999), n_fences > 1, "{fences:?}");
        for lon in [179.99, 179.9, 0.0, -179.9, outside] {
            assert!(!is_fenced(lon), "{lon}: {fences:?}");
        }
    };
    check(-179.998, 2, -179.997);
    // It only touches the meridian, whose longitude may be written either way.
    check(-180.0, 1, -179.999);
}

/// On the plane the northern edge bows 40 m beyond its parallel, which is where it is straight in degrees.
#[test]
fn a_long_edge_is_fenced_and_drawn_where_a_route_is_kept_clear_of_it() {
    let corner = |lat: f64, lon: f64| json!({"lat": lat, "lon": lon});
    let document = json!({
        "frame": "wgs84",
        "start": {"lat": 47.02, "lon": 8.2, "alt": 30},
        "target": {"lat": 47.02, "lon": 8.4, "alt": 30},
        "threats": [{"kind": "polygon", "vertices": [
            corner(47.0, 8.0), corner(47.0, 8.6), corner(46.9, 8.6), corner(46.9, 8.0)]}],
        "altitude": {"min": 10, "max": 100},
        "planner": {"smoothing": {"degree": 1, "spacing": 700}},
    });
    let scenario = accepted(&document);
    let crate::threat::Shape::Polygon(polygon) = &scenario.threats[0].shape else {
        panic!("{document}");
    };
    let middle = nalgebra::center(&polygon.vertices()[0], &polygon.vertices()[1]);
    let beside = |north: f64| {
        let LatLon { lat, lon } = scenario
            .frame
            .wgs84()
            .expect("degrees")
            .place(middle + Vector2::new(0.0, north));
        [lat, lon]
    };
    let plan = plan(&document, &[(47.02, 8.3, 40.0)]);
    let read = |format: &str| -> Value {
        let text = write(&plan, format, &[]).expect("a plan");
        serde_json::from_str(&text).expect("JSON")
    };
    let fences = read("qgc");
    let fence = corners(&fences["geoFence"]["polygons"][0]["polygon"]);
    let map = read("geojson");
    let threat = map["features"]
        .as_array()
        .and_then(|features| features.last());
    let ring = corners(&threat.expect("a threat")["geometry"]["coordinates"][0]);
    let ring: Vec<[f64; 2]> = ring.iter().map(|[lon, lat]| [*lat, *lon]).collect();
    for outline in [fence, ring] {
        assert!(is_fenced(&outline, beside(-0.2)));
        assert!(!is_fenced(&outline, beside(0.2)));
    }
}

#[test]
fn along_the_date_line_a_line_is_whole() {
    let document = json!({
        "frame": "wgs84",
        "start": {"lat": -16.80, "lon": 180, "alt": 30},
        "target": {"lat": -16.82, "lon": -180, "alt": 30},
        "altitude": {"min": 10, "max": 100},
        "planner": {"smoothing": {"degree": 1, "spacing": 700}},
    });
    let plan = plan(&document, &[(-16.81, 180.0, 40.0)]);
    let text = write(&plan, "geojson", &[]).expect("a plan");
    let read: Value = serde_json::from_str(&text).expect("JSON");
    let path = &read["features"][0]["geometry"];
    assert_eq!(path["type"], "LineString");
    for position in path["coordinates"].as_array().expect("a line") {
        assert_eq!(position[0], 180.0, "{path}");
    }
    // A longitude of GPX is less than 180.
    let text = write(&plan, "gpx", &[]).expect("a plan");
    assert!(text.contains("lon=\"-180"), "{text}");
    assert!(!text.contains("lon=\"180"), "{text}");
}

/// The exported threats of a flight beside a pole.
fn threats_near_a_pole(threats: &Value) -> Vec<Value> {
    let document = json!({
        "frame": "wgs84",
        "start": {"lat": 88.5, "lon": 10, "alt": 80},
        "target": {"lat": 88.6, "lon": 14, "alt": 80},
        "area": {"min": {"lat": 88.3, "lon": 5}, "max": {"lat": 88.8, "lon": 20}},
        "threats": threats,
        "altitude": {"min": 20, "max": 150},
        "planner": {"smoothing": {"degree": 1, "spacing": 1000}},
    });
    let plan = plan(&document, &[(88.55, 12.0, 85.0)]);
    let text = write(&plan, "geojson", &[]).expect("a plan");
    let mut read: Value = serde_json::from_str(&text).expect("JSON");
    let features = read["features"].as_array_mut().expect("features");
    features.retain(|feature| feature["properties"]["role"] == "threat");
    features
        .iter_mut()
        .map(|feature| feature["geometry"].take())
        .collect()
}

/// Degrees east and north of a ring's corners.
fn corners(ring: &Value) -> Vec<[f64; 2]> {
    let corner =
        |corner: &Value| [0, 1].map(|index: usize| corner[index].as_f64().expect("a number"));
    ring.as_array()
        .expect("a ring")
        .iter()
        .map(corner)
        .collect()
}

#[test]
#[expect(
    clippy::float_cmp,
    reason = "a ring is closed by its very first corner"
)]
fn a_threat_over_a_pole_is_a_polygon_over_all_longitudes() {
    let threats = threats_near_a_pole(&json!([
        {"kind": "cylinder", "center": {"lat": 89.9, "lon": 12}, "radius": 30000},
        {"kind": "cylinder", "center": {"lat": 89.5, "lon": 100}, "radius": 60000},
        {"kind": "polygon", "vertices": [
            {"lat": 89.5, "lon": 0}, {"lat": 89.5, "lon": 120}, {"lat": 89.5, "lon": -120}]},
    ]));
    for threat in &threats {
        assert_eq!(threat["type"], "Polygon", "{threat}");
        let ring = corners(&threat["coordinates"][0]);
        let n = ring.len();
        assert_eq!(ring[0], ring[n - 1]);
        assert_eq!(ring[n - 3..n - 1], [[180.0, 90.0], [-180.0, 90.0]]);
        // Eastward all round, then back over the pole.
        let lons: Vec<f64> = ring[..n - 3].iter().map(|corner| corner[0]).collect();
        assert!(lons.is_sorted(), "{lons:?}");
        assert_eq!((lons[0], lons[lons.len() - 1]), (-180.0, 180.0));
    }
}

/// Straight on the plane is far from straight in degrees: without corners between, these would be lines along one
/// parallel, and the triangle would have no area.
#[test]
fn a_long_edge_beside_a_pole_has_corners_between() {
    let threats = threats_near_a_pole(&json!([
        {"kind": "polygon", "vertices": [
            {"lat": 89.5, "lon": 0}, {"lat": 89.5, "lon": 80}, {"lat": 89.5, "lon": 160}]},
    ]));
    let ring = corners(&threats[0]["coordinates"][0]);
    for step in ring.windows(2) {
        assert!((step[1][0] - step[0][0]).abs() <= 30.0, "{ring:?}");
    }
    // The middle of the edge from 160 to 0 degrees east is nearest to the pole.
    let highest = ring.iter().map(|corner| corner[1]).fold(0.0, f64::max);
    let middle = 90.0 - 0.5 * libm::cos(80_f64.to_radians());
    assert!((highest - middle).abs() < 1e-3, "{highest} {middle}");
}
