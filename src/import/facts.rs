//! What a file says of one thing by name: properties of a feature, data of a placemark.

use serde_json::{Map, Value};

/// Letters of a name or a value that are kept: no name of a scenario has more, and no number.
const LONGEST: usize = 200;

/// Names that are listed of what is not looked at.
const MOST_NAMES: usize = 10;

/// Names of facts of a threat.
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

/// Names that nothing is said under here, but that our own exports write.
const OURS: [&str; 6] = [
    "agl",
    "alt_msl",
    "index",
    "leg_length_m",
    "role",
    "violations",
];

/// Names and values. They are told of each of many shapes, so that all of them are short.
#[derive(Debug, Clone, Default)]
pub(super) struct Facts {
    known: Map<String, Value>,
    /// The first few names of the rest.
    others: Vec<String>,
}

impl Facts {
    /// What is looked at, cut where it is long, and of what is not a few names.
    pub(super) fn of(said: Map<String, Value>) -> Self {
        let is_known = |name: &str| OF_A_THREAT.contains(&name) || OURS.contains(&name);
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

    /// A finite number, also one that is written as text; `None` when there is none or it is null.
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

    /// What the thing is called.
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

    /// Degrees east and north of a circle that is drawn as a ring.
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

    /// Whether the thing says that it is a part of a route, as our own exports do.
    pub(super) fn is_of_a_route(&self) -> bool {
        matches!(self.known.get("role"), Some(role) if role == "path" || role == "waypoint")
    }

    /// The names that are none of `used`.
    pub(super) fn beside(&self, used: &[&str]) -> Vec<&str> {
        let is_used =
            |name: &&String| used.contains(&name.as_str()) || OURS.contains(&name.as_str());
        let known = self.known.keys().filter(|name| !is_used(name));
        known.chain(&self.others).map(String::as_str).collect()
    }
}

/// A value whose text is longer than any that means something, as the beginning of that text.
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

fn begin(text: &str) -> String {
    text.chars().take(LONGEST).collect()
}
