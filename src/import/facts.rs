//! What a file says of one thing by name: properties of a feature, data of a placemark.

use serde_json::{Map, Value};

/// Names that nothing is said under here, but that our own exports write.
const OURS: [&str; 6] = [
    "agl",
    "alt_msl",
    "index",
    "leg_length_m",
    "role",
    "violations",
];

/// Names and values.
#[derive(Debug, Clone, Default)]
pub(super) struct Facts(pub(super) Map<String, Value>);

impl Facts {
    /// A finite number, also one that is written as text; `None` when there is none or it is null.
    pub(super) fn number(&self, name: &str) -> Result<Option<f64>, String> {
        let value = match self.0.get(name) {
            None | Some(Value::Null) => return Ok(None),
            Some(value) => value,
        };
        let number = match value {
            Value::String(text) => text.trim().parse().ok(),
            value => value.as_f64(),
        };
        let number = number.filter(|number: &f64| number.is_finite());
        number
            .map(Some)
            .ok_or_else(|| format!("{name} is {value}, must be a number"))
    }

    /// What the thing is called.
    pub(super) fn name(&self) -> Option<&str> {
        self.0.get("name")?.as_str().map(str::trim)
    }

    /// `start` or `target`, by name.
    pub(super) fn end(&self) -> Option<&'static str> {
        let name = self.name()?;
        ["start", "target"]
            .into_iter()
            .find(|end| name.eq_ignore_ascii_case(end))
    }

    /// Degrees east and north of a circle that is drawn as a ring.
    pub(super) fn center(&self) -> Option<[f64; 2]> {
        match self.0.get("center")? {
            Value::Array(pair) => {
                let [lon, lat] = pair.as_slice() else {
                    return None;
                };
                Some([lon.as_f64()?, lat.as_f64()?])
            }
            Value::String(text) => {
                let (lon, lat) = text.split_once(',')?;
                Some([lon.trim().parse().ok()?, lat.trim().parse().ok()?])
            }
            _ => None,
        }
    }

    /// Whether the thing says that it is a part of a route, as our own exports do.
    pub(super) fn is_of_a_route(&self) -> bool {
        matches!(self.0.get("role"), Some(role) if role == "path" || role == "waypoint")
    }

    /// The names that are none of `used`.
    pub(super) fn beside(&self, used: &[&str]) -> Vec<&str> {
        let known = |name: &&str| used.contains(name) || OURS.contains(name);
        let names = self.0.keys().map(String::as_str);
        names.filter(|name| !known(name)).collect()
    }
}
