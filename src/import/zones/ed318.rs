//! ED-318, "Technical specification for geographical zones" (EUROCAE), which follows ED-269: GeoJSON whose geometries
//! have a `layer` of heights, and points an `extent`.

use serde_json::Value;

use super::super::draft::Draft;
use super::{Height, ed269};

/// Deepest nesting of geometries.
const DEEPEST: usize = 16;

/// Whether a feature is such a zone.
pub(in super::super) fn is_one(feature: &Value) -> bool {
    has_layer(&feature["geometry"], 0)
}

fn has_layer(geometry: &Value, depth: usize) -> bool {
    let inner = geometry["geometries"].as_array();
    let is_inside =
        |inner: &Vec<Value>| inner.iter().any(|geometry| has_layer(geometry, depth + 1));
    geometry["layer"].is_object() || (depth < DEEPEST && inner.is_some_and(is_inside))
}

/// Add the zone of a feature.
pub(in super::super) fn zone(draft: &mut Draft, at: &str, feature: &Value) {
    let properties = &feature["properties"];
    if ed269::is_open(&properties["type"]) {
        return draft.leave(at, ed269::OPEN);
    }
    geometry(draft, at, name(properties), &feature["geometry"], 0);
}

/// Its name, in English if it has one; else its identifier.
fn name(properties: &Value) -> Option<&str> {
    let named = match &properties["name"] {
        Value::Array(names) => {
            let is_english = |name: &&Value| {
                let lang = name["lang"].as_str();
                lang.is_some_and(|lang| lang.starts_with("en"))
            };
            let name = names.iter().find(is_english).or(names.first());
            name.and_then(|name| name["text"].as_str())
        }
        name => name.as_str(),
    };
    named.or(properties["identifier"].as_str())
}

fn geometry(draft: &mut Draft, at: &str, name: Option<&str>, value: &Value, depth: usize) {
    if let Some(inner) = value["geometries"].as_array() {
        if depth == DEEPEST {
            return draft.leave(at, "geometries nested deeper than 16 levels");
        }
        for (index, inner) in inner.iter().enumerate() {
            let at = format!("{at}/geometries/{index}");
            geometry(draft, &at, name, inner, depth + 1);
        }
        return;
    }
    let coordinates = &value["coordinates"];
    let outlines = match (value["type"].as_str(), value["extent"]["radius"].as_f64()) {
        (Some("Point"), Some(radius)) => ed269::circle(coordinates, radius).map(|one| vec![one]),
        (Some("Polygon"), _) => ed269::rings(draft, [coordinates]),
        (Some("MultiPolygon"), _) => {
            ed269::rings(draft, coordinates.as_array().into_iter().flatten())
        }
        _ => Err(
            "a zone that is neither a polygon nor a point with the radius of its extent".to_owned(),
        ),
    };
    let layer = &value["layer"];
    let limit = |end: &str| {
        let from = layer[format!("{end}Reference")].as_str();
        let unit = layer["uom"].as_str().unwrap_or("m");
        Height::measured(&layer[end], unit, from.unwrap_or_default())
    };
    super::add(draft, at, name, outlines, [limit("lower"), limit("upper")]);
}
