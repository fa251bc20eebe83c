//! ED-269, "Minimum operational performance standard for geofencing" (EUROCAE): geographical zones for unmanned
//! aircraft, as states of the European Union have published them. Each zone has a list of volumes.

use serde_json::Value;

use super::super::draft::Draft;
use super::super::flight::Flight;
use super::super::place::Place;
use super::super::{Conversion, ImportError, Most, antimeridian};
use super::{Height, Outline};

/// Whether a document holds such zones: the geometry of a feature is a list.
pub(in super::super) fn is_one(document: &Value) -> bool {
    let features = document["features"].as_array();
    features.is_some_and(|features| {
        features
            .iter()
            .any(|feature| feature["geometry"].is_array())
    })
}

/// Convert the zones of a document to a scenario.
pub(in super::super) fn convert(
    document: &Value,
    most: Most,
    flight: &Flight,
) -> Result<Conversion, ImportError> {
    let mut draft = Draft::new("msl", most, flight);
    draft.call(document["title"].as_str());
    let features = document["features"]
        .as_array()
        .map_or(&[][..], Vec::as_slice);
    for (index, feature) in features.iter().enumerate() {
        zone(&mut draft, &format!("/features/{index}"), feature);
    }
    draft.finish()
}

fn zone(draft: &mut Draft, at: &str, feature: &Value) {
    if is_open(&feature["restriction"]) {
        return draft.leave(at, OPEN);
    }
    let name = [&feature["name"], &feature["identifier"]];
    let name = name.into_iter().find_map(Value::as_str);
    let Some(volumes) = feature["geometry"].as_array() else {
        return draft.leave(at, "a zone without a list of volumes");
    };
    for (index, volume) in volumes.iter().enumerate() {
        let at = format!("{at}/geometry/{index}");
        let limit = |end: &str| {
            let from = volume[format!("{end}VerticalReference")].as_str();
            let unit = volume["uomDimensions"].as_str().unwrap_or("M");
            let limit = &volume[format!("{end}Limit")];
            Height::measured(limit, unit, from.unwrap_or_default())
        };
        let outlines = outlines(draft, &volume["horizontalProjection"]);
        super::add(draft, &at, name, outlines, [limit("lower"), limit("upper")]);
    }
}

/// Why a zone is not used that is for information only.
pub(super) const OPEN: &str = "a zone without restriction";

/// Whether the word for a restriction is that for none.
pub(super) fn is_open(restriction: &Value) -> bool {
    restriction == "NO_RESTRICTION"
}

/// A circle, or the outer rings of a polygon. Holes are a part of the zone here.
fn outlines(draft: &mut Draft, projection: &Value) -> Result<Vec<Outline>, String> {
    match projection["type"].as_str() {
        Some("Circle") => {
            let radius = projection["radius"].as_f64();
            let radius = radius.ok_or("a circle whose radius is no number")?;
            Ok(vec![circle(&projection["center"], radius)?])
        }
        Some("Polygon") => rings(draft, [&projection["coordinates"]]),
        _ => Err("a horizontal projection that is neither a Circle nor a Polygon".to_owned()),
    }
}

/// A circle round a position, its radius in metres.
pub(super) fn circle(center: &Value, radius_m: f64) -> Result<Outline, String> {
    let [lon, lat] = position(center).ok_or("a circle whose center is no position")?;
    Ok(Outline::Circle(Place::new(lon, lat)?, radius_m))
}

/// The outer rings of polygons, each given as a list of rings; those that were cut at the 180th meridian are joined.
pub(super) fn rings<'d>(
    draft: &mut Draft,
    polygons: impl IntoIterator<Item = &'d Value>,
) -> Result<Vec<Outline>, String> {
    let outer = polygons.into_iter().map(|polygon| {
        let ring = polygon[0].as_array().ok_or("a polygon without a ring")?;
        let corners: Option<Vec<[f64; 2]>> = ring.iter().map(position).collect();
        corners.ok_or("a corner that is not longitude and latitude")
    });
    let outer: Vec<_> = outer.collect::<Result<_, &str>>()?;
    let joined = antimeridian::joined(&outer).into_iter();
    joined
        .map(|(_, ring)| {
            let ring = draft.divided(&ring);
            let places = ring.iter().map(|[lon, lat]| Place::new(*lon, *lat));
            Ok(Outline::Ring(places.collect::<Result<_, String>>()?))
        })
        .collect()
}

/// East and north.
fn position(value: &Value) -> Option<[f64; 2]> {
    Some([value[0].as_f64()?, value[1].as_f64()?])
}
