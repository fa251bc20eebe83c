//! Named values of one object in a file: properties of a feature, data of a placemark.

use serde_json::{Map, Value};

/// Most characters kept of a name or a value: no scenario name and no number is longer.
const LONGEST: usize = 200;

/// Most unused names listed.
const MOST_NAMES: usize = 10;

/// Names that describe a threat.
pub(super) const OF_A_THREAT: [&str; 8] = [
    "base",
    "center",
    "influence",
    "kind",
    "margin",
    "name",
    "radius",
    "top",
];

/// Names that are not reported as unused, because our own exports write them.
const OURS: [&str; 6] = [
    "agl",
    "alt_msl",
    "index",
    "leg_length_m",
    "role",
    "violations",
];

/// Names and values. They are repeated for each of many shapes, so all of them are kept short.
#[derive(Debug, Clone, Default)]
pub(super) struct Facts {
    known: Map<String, Value>,
    /// The first few of the other names.
    others: Vec<String>,
}

impl Facts {
    /// The known values, truncated if long, and a few names of the others. Some programs write `Name` for `name`.
    pub(super) fn of(mut said: Map<String, Value>) -> Self {
        let is_known = |name: &str| OF_A_THREAT.contains(&name) || OURS.contains(&name);
        let other_cases: Vec<(String, String)> = said
            .keys()
            .map(|name| (name.clone(), name.to_ascii_lowercase()))
            .filter(|(name, lower)| !is_known(name) && is_known(lower))
            .collect();
        for (name, lower) in other_cases {
            if !said.contains_key(&lower)
                && let Some(value) = said.remove(&name)
            {
                said.insert(lower, value);
            }
        }
        if let Some(name @ Value::Number(_)) = said.get_mut("name") {
            *name = Value::String(name.to_string());
        }
        let (known, rest): (Map<_, _>, Map<_, _>) =
            said.into_iter().partition(|(name, _)| is_known(name));
        let mut others: Vec<String> = rest
            .keys()
            .take(MOST_NAMES)
            .map(|name| begin(name))
            .collect();
        if rest.len() > MOST_NAMES {
            others.push(format!("{} more", rest.len() - MOST_NAMES));
        }
        let known = known.into_iter().map(|(name, value)| (name, short(value)));
        Self {
            known: known.collect(),
            others,
        }
    }

    /// A finite number, possibly written as text; `None` if it is absent or null.
    pub(super) fn number(&self, name: &str) -> Result<Option<f64>, String> {
        let value = match self.known.get(name) {
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

    /// Whether any of these is there, and not null.
    pub(super) fn says_any(&self, names: &[&str]) -> bool {
        let is_said = |name: &&str| self.known.get(*name).is_some_and(|value| !value.is_null());
        names.iter().any(is_said)
    }

    /// Name of the object, if it is a text; a number is one.
    pub(super) fn name(&self) -> Option<&str> {
        self.known.get("name")?.as_str().map(str::trim)
    }

    /// `start` or `target`, by name.
    pub(super) fn end(&self) -> Option<&'static str> {
        let name = self.name()?;
        ["start", "target"]
            .into_iter()
            .find(|end| name.eq_ignore_ascii_case(end))
    }

    /// Centre, degrees east and north, of a circle that is drawn as a ring.
    pub(super) fn center(&self) -> Option<[f64; 2]> {
        match self.known.get("center")? {
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

    /// Whether the object is marked as a part of a route, as our own exports do.
    pub(super) fn is_of_a_route(&self) -> bool {
        matches!(self.known.get("role"), Some(role) if role == "path" || role == "waypoint")
    }

    /// The names that are not in `used`.
    pub(super) fn beside(&self, used: &[&str]) -> Vec<&str> {
        let is_used =
            |name: &&String| used.contains(&name.as_str()) || OURS.contains(&name.as_str());
        let known = self.known.keys().filter(|name| !is_used(name));
        known.chain(&self.others).map(String::as_str).collect()
    }
}

/// `value`, or the beginning of its text if that is longer than any useful value.
fn short(value: Value) -> Value {
    let text = match &value {
        Value::String(text) => begin(text),
        other => begin(&other.to_string()),
    };
    if text.chars().count() < LONGEST {
        value
    } else {
        Value::String(text)
    }
}

/// A value as JSON, truncated if long: it may be as long as the file.
pub(super) fn shown(value: &Value) -> String {
    begin(&value.to_string())
}

/// As much of a text as a scenario accepts of a name.
pub(super) fn begin(text: &str) -> String {
    text.chars().take(LONGEST).collect()
}
