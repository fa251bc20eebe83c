//! The fields of an object: required, with a default, and unknown ones.

use super::fault::Faults;
use super::path::Path;
use super::ranges::{MAX_NAME_CHARS, Range};
use super::tree::Node;
use super::value::{At, quote};

impl<'a> At<'a> {
    /// The fields of an object; unknown and repeated ones add faults.
    pub(super) fn fields(
        self,
        allowed: &'static [&'static str],
        faults: &mut Faults,
    ) -> Option<Fields<'a>> {
        let Node::Object(entries) = self.node else {
            return self.wrong_type("an object", faults);
        };
        let mut found: Vec<Option<&Node>> = vec![None; allowed.len()];
        for (key, node) in entries {
            let path = Path::Key(self.path, key);
            match allowed.iter().position(|name| *name == &**key) {
                None => unknown_key(
                    self.path,
                    key,
                    "unknown-field",
                    "field here",
                    allowed,
                    faults,
                ),
                Some(slot) if found[slot].is_some() => given_twice(&path, key, faults),
                Some(slot) => found[slot] = Some(node),
            }
        }
        Some(Fields {
            path: self.path,
            names: allowed,
            found,
        })
    }

    /// An object whose `kind` decides its fields: returns the kind and the fields.
    pub(super) fn variant<'k>(
        self,
        kinds: &[(&'k str, &'static [&'static str])],
        faults: &mut Faults,
    ) -> Option<(&'k str, Fields<'a>)> {
        if !matches!(self.node, Node::Object(_)) {
            return self.wrong_type("an object", faults);
        }
        let names: Vec<&str> = kinds.iter().map(|(name, _)| *name).collect();
        let path = Path::Key(self.path, "kind");
        let Some(node) = self.node.get("kind") else {
            faults.add(&path, "missing-field", || {
                format!("kind is missing, must be one of {}", names.join(", "))
            });
            return None;
        };
        let kind = At { node, path: &path }.choice(&names, faults)?;
        let (_, allowed) = kinds.iter().find(|(name, _)| *name == kind)?;
        Some((kind, self.fields(allowed, faults)?))
    }
}

/// The fields of one object.
#[derive(Debug)]
pub(super) struct Fields<'a> {
    pub(super) path: &'a Path<'a>,
    names: &'static [&'static str],
    found: Vec<Option<&'a Node<'a>>>,
}

impl<'a> Fields<'a> {
    /// The value of an allowed field, if the document has it.
    pub(super) fn find(&self, name: &str) -> Option<&'a Node<'a>> {
        let slot = self.names.iter().position(|known| *known == name);
        self.found[slot.expect("readers ask for the fields that they allow")]
    }

    /// Whether the document has the field.
    pub(super) fn has(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    /// A required field.
    pub(super) fn required<T>(
        &self,
        name: &str,
        faults: &mut Faults,
        read: impl FnOnce(At<'_>, &mut Faults) -> Option<T>,
    ) -> Option<T> {
        let path = Path::Key(self.path, name);
        if let Some(node) = self.find(name) {
            return read(At { node, path: &path }, faults);
        }
        faults.add(&path, "missing-field", || {
            format!("{name} is missing, must be given")
        });
        None
    }

    /// A field with a default.
    pub(super) fn or<T>(
        &self,
        name: &str,
        default: T,
        faults: &mut Faults,
        read: impl FnOnce(At<'_>, &mut Faults) -> Option<T>,
    ) -> Option<T> {
        let path = Path::Key(self.path, name);
        match self.find(name) {
            Some(node) => read(At { node, path: &path }, faults),
            None => Some(default),
        }
    }

    /// A required number.
    pub(super) fn number(&self, name: &str, range: Range, faults: &mut Faults) -> Option<f64> {
        self.required(name, faults, |at, faults| at.number(range, faults))
    }

    /// A number with a default.
    pub(super) fn number_or(
        &self,
        name: &str,
        default: f64,
        range: Range,
        faults: &mut Faults,
    ) -> Option<f64> {
        self.or(name, default, faults, |at, faults| at.number(range, faults))
    }

    /// A number that may be null or absent.
    #[expect(
        clippy::option_option,
        reason = "the outer one tells whether it could be read"
    )]
    pub(super) fn nullable(
        &self,
        name: &str,
        range: Range,
        faults: &mut Faults,
    ) -> Option<Option<f64>> {
        self.or(name, None, faults, |at, faults| match at.node {
            Node::Null => Some(None),
            _ => at.number(range, faults).map(Some),
        })
    }
}

/// Report a key that is not in `allowed`, and suggest the nearest spelling.
pub(super) fn unknown_key(
    parent: &Path<'_>,
    key: &str,
    code: &'static str,
    role: &str,
    allowed: &[&str],
    faults: &mut Faults,
) {
    let own = Path::Key(parent, key);
    // For a very long key, point to the object instead.
    let path = if key.len() <= MAX_NAME_CHARS {
        &own
    } else {
        parent
    };
    faults.add(path, code, || {
        let hint = hint(key, allowed);
        let allowed = if allowed.is_empty() {
            "nothing".to_owned()
        } else {
            allowed.join(", ")
        };
        format!("{} is no {role}, allowed: {allowed}{hint}", quote(key))
    });
}

/// Report a key that an object has more than once.
pub(super) fn given_twice(path: &Path<'_>, key: &str, faults: &mut Faults) {
    faults.add(path, "duplicate-key", || {
        format!("{key} is given twice, must be given once")
    });
}

/// The end of a message about a name that is not allowed: the one that it probably stands for.
pub(crate) fn hint(key: &str, allowed: &[&str]) -> String {
    nearest(key, allowed)
        .map(|name| format!(", did you mean {name}?"))
        .unwrap_or_default()
}

/// The allowed name that `key` probably stands for: ignoring case and separators, at most two edits away.
fn nearest<'n>(key: &str, allowed: &[&'n str]) -> Option<&'n str> {
    const MAX_CHARS: usize = 40;
    if key.len() > MAX_CHARS {
        return None;
    }
    let plain = |name: &str| -> Vec<char> {
        name.chars()
            .filter(|c| c.is_alphanumeric())
            .flat_map(char::to_lowercase)
            .collect()
    };
    let key = plain(key);
    allowed
        .iter()
        .map(|name| (edits(&key, &plain(name)), *name))
        .filter(|(edits, name)| *edits <= 2.min(name.len() / 3))
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, name)| name)
}

/// Levenshtein distance: characters to insert, delete or replace to turn one word into the other.
fn edits(a: &[char], b: &[char]) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn the_nearest_spelling_is_suggested() {
        let allowed = ["radius", "influence", "max_turn_deg", "x"];
        for (key, expected) in [
            ("raduis", Some("radius")),
            ("maxTurnDeg", Some("max_turn_deg")),
            ("Influence", Some("influence")),
            ("y", None),
            ("speed", None),
            ("", None),
        ] {
            assert_eq!(nearest(key, &allowed), expected, "{key}");
        }
        assert_eq!(nearest(&"r".repeat(1_000_000), &allowed), None);
    }
}
