//! RFC 7946: points named start and target; points with a radius, and polygons, as threats. Heights are above the
//! ellipsoid, as the RFC says.

use geojson::{Feature, GeometryValue, JsonValue, Position};
use serde_json::Value;

use super::draft::{Draft, HEIGHTS_OF_A_POLYGON};
use super::facts::Facts;
use super::flight::Flight;
use super::place::Place;
use super::zones::ed318;
use super::{Conversion, ImportError, Most, antimeridian};

/// Names that older GeoJSON uses for the only reference system of RFC 7946. The last ones mean the latitude first, but
/// programs that write them put the longitude first all the same, as all GeoJSON does.
const WGS84: [&str; 4] = [
    "urn:ogc:def:crs:OGC:1.3:CRS84",
    "urn:ogc:def:crs:OGC::CRS84",
    "urn:ogc:def:crs:EPSG::4326",
    "EPSG:4326",
];

/// Convert a feature collection, or a feature, to a scenario.
pub(super) fn convert(
    mut document: Value,
    most: Most,
    flight: &Flight,
) -> Result<Conversion, ImportError> {
    refuse_other_systems(&document)?;
    let datum = if has_zones(&document) {
        "msl"
    } else {
        "ellipsoid"
    };
    let mut draft = Draft::new(datum, most, flight);
    draft.call(document["name"].as_str());
    match document["type"].as_str() {
        Some("FeatureCollection") => {
            let Value::Array(features) = document["features"].take() else {
                return Err(ImportError::no_scenario(
                    "a FeatureCollection has features, a list; this one has none",
                ));
            };
            for (index, value) in features.into_iter().enumerate() {
                feature(&mut draft, &format!("/features/{index}"), value);
            }
        }
        Some("Feature") => feature(&mut draft, "", document),
        found => {
            return Err(ImportError::no_scenario(format!(
                "type is {}, must be FeatureCollection; a plan of QGroundControl has fileType Plan",
                found.unwrap_or("missing")
            )));
        }
    }
    draft.finish()
}

fn refuse_other_systems(document: &Value) -> Result<(), ImportError> {
    match document.get("crs") {
        None | Some(Value::Null) => Ok(()),
        Some(crs) => {
            let name = crs["properties"]["name"].as_str();
            if name.is_some_and(|name| WGS84.contains(&name)) {
                return Ok(());
            }
            Err(ImportError::no_scenario(format!(
                "crs is {}, must be longitude and latitude of WGS 84",
                name.unwrap_or("none that is known here")
            )))
        }
    }
}

/// Whether any feature is a zone of ED-318, whose heights are above mean sea level.
fn has_zones(document: &Value) -> bool {
    let features = document["features"].as_array();
    features.map_or_else(
        || ed318::is_one(document),
        |features| features.iter().any(ed318::is_one),
    )
}

fn feature(draft: &mut Draft, at: &str, value: JsonValue) {
    if !value.is_object() {
        return draft.leave(at, "no feature: a feature is an object");
    }
    if !matches!(value["geometry"], JsonValue::Null | JsonValue::Object(_)) {
        return draft.leave(at, "a feature whose geometry is neither an object nor null");
    }
    if ed318::is_one(&value) {
        return ed318::zone(draft, at, &value);
    }
    let mut value = value;
    forget_null_heights(&mut value["geometry"]);
    let feature = match serde_json::from_value::<Feature>(value) {
        Ok(feature) => feature,
        Err(error) => return draft.leave(at, error.to_string()),
    };
    let facts = Facts::of(feature.properties.unwrap_or_default());
    match feature.geometry {
        None => draft.leave(at, "a feature without geometry"),
        Some(shape) => geometry(draft, at, &format!("{at}/geometry"), &facts, &shape.value),
    }
}

/// A position may end in a null, where a program has no height to write; the library refuses it.
fn forget_null_heights(geometry: &mut Value) {
    match geometry {
        Value::Object(members) => members.values_mut().for_each(forget_null_heights),
        Value::Array(items) => {
            if let [lon, lat, Value::Null] = items.as_slice()
                && lon.is_number()
                && lat.is_number()
            {
                items.pop();
            }
            items.iter_mut().for_each(forget_null_heights);
        }
        _ => {}
    }
}

/// A geometry. `within` points to it, and so does `at` within a collection; otherwise `at` points to its feature.
fn geometry(draft: &mut Draft, at: &str, within: &str, facts: &Facts, value: &GeometryValue) {
    if let GeometryValue::Polygon { .. } | GeometryValue::MultiPolygon { .. } = value
        && draft.drawn_circle(at, facts)
    {
        return;
    }
    match value {
        GeometryValue::Point { coordinates } => point(draft, at, facts, coordinates),
        GeometryValue::Polygon { coordinates } => {
            let rings_at = format!("{within}/coordinates");
            if let Some(ring) = outer(draft, facts, at, &rings_at, coordinates) {
                for (_, ring) in antimeridian::joined(&[ring]) {
                    let ring = draft.divided(&ring);
                    draft.polygon(at, facts, &ring);
                }
            }
        }
        GeometryValue::MultiPolygon { coordinates } => polygons(draft, within, facts, coordinates),
        GeometryValue::GeometryCollection { geometries } => {
            for (index, inner) in geometries.iter().enumerate() {
                let at = format!("{within}/geometries/{index}");
                geometry(draft, &at, &at, facts, &inner.value);
            }
        }
        GeometryValue::LineString { .. } | GeometryValue::MultiLineString { .. } => {
            draft.leave(at, "a line: points and polygons make a scenario");
        }
        GeometryValue::MultiPoint { coordinates } => {
            if let [only] = coordinates.as_slice() {
                return point(draft, at, facts, only);
            }
            draft.leave(at, "many points in one: each must be a feature of its own");
        }
    }
}

fn point(draft: &mut Draft, at: &str, facts: &Facts, position: &Position) {
    let Some([lon, lat]) = degrees(position) else {
        return draft.leave(at, "a point that is not longitude and latitude");
    };
    match Place::new(lon, lat) {
        Ok(place) => draft.point(at, facts, place, position.as_slice().get(2).copied()),
        Err(reason) => draft.leave(at, reason),
    }
}

fn polygons(draft: &mut Draft, within: &str, facts: &Facts, polygons: &[Vec<Vec<Position>>]) {
    let place = |index: usize| format!("{within}/coordinates/{index}");
    let (mut indices, mut outer_rings) = (Vec::new(), Vec::new());
    for (index, rings) in polygons.iter().enumerate() {
        let at = place(index);
        if let Some(ring) = outer(draft, facts, &at, &at, rings) {
            indices.push(index);
            outer_rings.push(ring);
        }
    }
    for (first, ring) in antimeridian::joined(&outer_rings) {
        let ring = draft.divided(&ring);
        draft.polygon(&place(indices[first]), facts, &ring);
    }
}

/// The outer ring of a polygon, whose list of rings is at `rings_at`.
fn outer(
    draft: &mut Draft,
    facts: &Facts,
    at: &str,
    rings_at: &str,
    rings: &[Vec<Position>],
) -> Option<Vec<[f64; 2]>> {
    let Some((outer, holes)) = rings.split_first() else {
        draft.leave(at, "a polygon without a ring");
        return None;
    };
    for index in 1..=holes.len() {
        let hole = format!("{rings_at}/{index}");
        draft.leave(hole, "the hole of a polygon: all of it is kept clear of");
    }
    let is_high = |position: &Position| position.as_slice().get(2).is_some_and(|alt| *alt != 0.0);
    if outer.iter().any(is_high) && !facts.says_any(&["kind", "base", "top"]) {
        draft.leave(at, HEIGHTS_OF_A_POLYGON);
    }
    let ring: Option<_> = outer.iter().map(degrees).collect();
    if ring.is_none() {
        draft.leave(at, "a corner that is not longitude and latitude");
    }
    ring
}

/// East and north; the library does not check that positions within a ring have both.
fn degrees(position: &Position) -> Option<[f64; 2]> {
    let [lon, lat, ..] = position.as_slice() else {
        return None;
    };
    Some([*lon, *lat])
}
