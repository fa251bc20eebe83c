//! JSON text to a tree that keeps everything a fault may refer to: object entries stay in order, duplicates included,
//! and a syntax error has its line, column and pointer.
//!
//! Deliberately absent: the meaning of fields.

use std::borrow::Cow;
use std::fmt;

use serde::de::{Deserialize, DeserializeSeed, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::Number;

use super::fault::Refusal;
use super::path::escape;

/// A JSON value, 24 bytes. Arrays of numbers take 8 bytes per item, to keep grids small. Keys, which are most of the
/// strings in a document, borrow from the text where possible.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Node<'t> {
    Null,
    Bool(bool),
    /// Finite.
    Number(Number),
    Text(Box<str>),
    /// An array of numbers only; also the empty array.
    Numbers(Box<[f64]>),
    /// Any other array.
    Array(Box<[Node<'t>]>),
    /// Entries in document order, duplicate keys included.
    Object(Box<[(Cow<'t, str>, Node<'t>)]>),
}

impl<'t> Node<'t> {
    /// The first entry with this name, if this is an object that has one.
    pub(super) fn get(&self, key: &str) -> Option<&Node<'t>> {
        match self {
            Node::Object(entries) => entries
                .iter()
                .find(|(known, _)| **known == *key)
                .map(|(_, node)| node),
            _ => None,
        }
    }
}

/// Parse JSON text (RFC 8259, UTF-8, with nothing after the value).
///
/// # Errors
/// [`Refusal::Syntax`] for anything that is not JSON, nesting deeper than 127, and numbers outside the range of a
/// 64-bit float.
pub(super) fn parse(text: &[u8]) -> Result<Node<'_>, Refusal> {
    let mut trail = Vec::new();
    let mut reader = serde_json::Deserializer::from_slice(text);
    Element { trail: &mut trail }
        .deserialize(&mut reader)
        .and_then(|node| reader.end().map(|()| node))
        .map_err(|error| refuse(text, &trail, &error))
}

/// One step from the root to the value being parsed.
enum Step<'t> {
    Key(Cow<'t, str>),
    Index(usize),
}

/// Parses one value. Steps are removed from the trail only on success, so that after an error the trail still leads
/// to the place.
struct Element<'a, 't> {
    trail: &'a mut Vec<Step<'t>>,
}

impl<'de> DeserializeSeed<'de> for Element<'_, 'de> {
    type Value = Node<'de>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Node<'de>, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Element<'_, 'de> {
    type Value = Node<'de>;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Node<'de>, E> {
        Ok(Node::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Node<'de>, E> {
        Ok(Node::Bool(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Node<'de>, E> {
        Ok(Node::Number(value.into()))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Node<'de>, E> {
        Ok(Node::Number(value.into()))
    }

    fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Node<'de>, E> {
        let number = Number::from_f64(value).ok_or_else(|| E::custom("number out of range"))?;
        Ok(Node::Number(number))
    }

    fn visit_str<E>(self, value: &str) -> Result<Node<'de>, E> {
        Ok(Node::Text(value.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Node<'de>, A::Error> {
        let mut numbers = Vec::new();
        let mut items = Vec::new();
        self.trail.push(Step::Index(0));
        while let Some(item) = seq.next_element_seed(Element {
            trail: &mut *self.trail,
        })? {
            match item {
                Node::Number(number) if items.is_empty() => numbers.push(float(&number)),
                item => {
                    items.extend(
                        numbers
                            .drain(..)
                            .map(|number| Node::Number(whole_or_float(number))),
                    );
                    items.push(item);
                }
            }
            if let Some(Step::Index(index)) = self.trail.last_mut() {
                *index += 1;
            }
        }
        self.trail.pop();
        if items.is_empty() {
            Ok(Node::Numbers(numbers.into()))
        } else {
            Ok(Node::Array(items.into()))
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Node<'de>, A::Error> {
        let mut entries = Vec::new();
        while let Some(Key(key)) = map.next_key()? {
            self.trail.push(Step::Key(key));
            let value = map.next_value_seed(Element {
                trail: &mut *self.trail,
            })?;
            if let Some(Step::Key(key)) = self.trail.pop() {
                entries.push((key, value));
            }
        }
        Ok(Node::Object(entries.into()))
    }
}

/// A key, always read as a string.
struct Key<'t>(Cow<'t, str>);

impl<'de> Deserialize<'de> for Key<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(KeyVisitor).map(Key)
    }
}

struct KeyVisitor;

impl<'de> Visitor<'de> for KeyVisitor {
    type Value = Cow<'de, str>;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a key")
    }

    fn visit_borrowed_str<E>(self, key: &'de str) -> Result<Cow<'de, str>, E> {
        Ok(Cow::Borrowed(key))
    }

    /// With escapes.
    fn visit_str<E>(self, key: &str) -> Result<Cow<'de, str>, E> {
        Ok(Cow::Owned(key.to_owned()))
    }
}

/// The nearest 64-bit float.
pub(super) fn float(number: &Number) -> f64 {
    // Adding 0 turns -0 into 0, so that equal documents give bit-equal scenarios.
    number.as_f64().expect("numbers of the tree are finite") + 0.0
}

/// A number as a person would write it: `3`, not `3.0`.
#[expect(
    clippy::cast_possible_truncation,
    reason = "whole and below 2^53, so exact"
)]
pub(super) fn whole_or_float(number: f64) -> Number {
    if number.fract() == 0.0 && number.abs() < 9_007_199_254_740_992.0 {
        Number::from(number as i64)
    } else {
        Number::from_f64(number).unwrap_or_else(|| Number::from(0))
    }
}

fn refuse(text: &[u8], trail: &[Step<'_>], error: &serde_json::Error) -> Refusal {
    let (line, column) = (error.line().max(1), error.column().max(1));
    Refusal::Syntax {
        line,
        column,
        pointer: pointer(trail),
        detail: explain(text, line, column, error),
    }
}

/// The trail as a JSON pointer, truncated if a hostile key makes it long.
fn pointer(trail: &[Step<'_>]) -> String {
    const MAX_CHARS: usize = 500;
    let mut pointer = String::new();
    for step in trail {
        pointer.push('/');
        match step {
            Step::Key(key) => {
                pointer.push_str(&escape(&key.chars().take(MAX_CHARS).collect::<String>()));
            }
            Step::Index(index) => pointer.push_str(&index.to_string()),
        }
    }
    match pointer.char_indices().nth(MAX_CHARS) {
        Some((end, _)) => format!("{}...", &pointer[..end]),
        None => pointer,
    }
}

/// What the parser found, in words, with hints for frequent mistakes.
fn explain(text: &[u8], line: usize, column: usize, error: &serde_json::Error) -> String {
    if text.iter().all(u8::is_ascii_whitespace) {
        return "the document is empty, must be a JSON object".to_owned();
    }
    if text.starts_with(b"\xEF\xBB\xBF") && (line, column) == (1, 1) {
        return "the document starts with a byte order mark, must be plain UTF-8".to_owned();
    }
    let message = error.to_string();
    let message = message
        .rfind(" at line ")
        .map_or(message.as_str(), |end| &message[..end]);
    let word = word_at(text, line, column);
    let bare = word.trim_start_matches(['-', '+']).to_ascii_lowercase();
    if message == "number out of range" {
        format!("{word} is out of range, must fit a 64-bit float")
    } else if ["nan", "inf", "infinity"].contains(&bare.as_str()) {
        format!("{word} is not JSON, numbers must be finite")
    } else if message == "trailing characters" {
        "something follows the document, must be one JSON value and nothing after it".to_owned()
    } else if message == "recursion limit exceeded" {
        "the document is nested too deeply, at most 127 levels are read".to_owned()
    } else {
        message.to_owned()
    }
}

/// The number or bare word at a position, truncated if long.
fn word_at(text: &[u8], line: usize, column: usize) -> String {
    const MAX_BYTES: usize = 40;
    let part_of_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-._".contains(byte);
    let row = text
        .split(|byte| *byte == b'\n')
        .nth(line - 1)
        .unwrap_or_default();
    let at = (column - 1).min(row.len());
    let begin = row[..at]
        .iter()
        .rposition(|byte| !part_of_word(byte))
        .map_or(0, |before| before + 1);
    let len = row[begin..].iter().take_while(|byte| part_of_word(byte));
    let word = &row[begin..][..len.count()];
    let shown = String::from_utf8_lossy(&word[..word.len().min(MAX_BYTES)]);
    if word.len() > MAX_BYTES {
        format!("{shown}...")
    } else {
        shown.into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: impl AsRef<[u8]>, expected: (usize, usize, &str, &str)) {
        let refusal = parse(text.as_ref()).expect_err("not JSON");
        let Refusal::Syntax {
            line,
            column,
            pointer,
            detail,
        } = refusal
        else {
            panic!("a syntax error was expected, not {refusal:?}");
        };
        assert_eq!((line, column, pointer.as_str(), detail.as_str()), expected);
    }

    #[test]
    fn a_syntax_error_says_where_it_is() {
        check(
            "",
            (1, 1, "", "the document is empty, must be a JSON object"),
        );
        check(
            " \n ",
            (2, 1, "", "the document is empty, must be a JSON object"),
        );
        check(
            "{\n \"a\": [1, 1e999]}",
            (
                2,
                15,
                "/a/1",
                "1e999 is out of range, must fit a 64-bit float",
            ),
        );
        check(
            format!("[1{}]", "0".repeat(400)),
            (
                1,
                402,
                "/0",
                &format!(
                    "1{}... is out of range, must fit a 64-bit float",
                    "0".repeat(39)
                ),
            ),
        );
        check(
            "{\"a\":{\"b~/\":NaN}}",
            (1, 13, "/a/b~0~1", "NaN is not JSON, numbers must be finite"),
        );
        check(
            "[1, nan]",
            (1, 6, "/1", "nan is not JSON, numbers must be finite"),
        );
        check(
            "[-Infinity]",
            (1, 3, "/0", "-Infinity is not JSON, numbers must be finite"),
        );
        check(
            "\u{feff}{}",
            (
                1,
                1,
                "",
                "the document starts with a byte order mark, must be plain UTF-8",
            ),
        );
        check(
            "{} {}",
            (
                1,
                4,
                "",
                "something follows the document, must be one JSON value and nothing after it",
            ),
        );
        check(
            "{\"a\":\"\\ud800\"}",
            (1, 13, "/a", "unexpected end of hex escape"),
        );
        check(
            b"{\"a\":\"\xFF\"}",
            (1, 7, "/a", "invalid unicode code point"),
        );
        check("{\"a\":1,}", (1, 8, "", "trailing comma"));
        check("{\"a\":01}", (1, 7, "/a", "invalid number"));
        check(
            format!("{}{}", "[".repeat(200), "]".repeat(200)),
            (
                1,
                128,
                &"/0".repeat(127),
                "the document is nested too deeply, at most 127 levels are read",
            ),
        );
    }

    #[test]
    fn a_long_key_does_not_make_a_long_pointer() {
        let Err(Refusal::Syntax { pointer, .. }) =
            parse(format!("{{\"{}\":?}}", "é".repeat(9000)).as_bytes())
        else {
            panic!("a syntax error was expected");
        };
        assert_eq!(pointer.chars().count(), 503);
    }

    #[test]
    fn entries_keep_their_order_and_their_duplicates() {
        let node = parse(br#"{"b":1,"a":[1,2.5],"b":[1,null]}"#).expect("JSON");
        let Node::Object(entries) = node else {
            panic!("an object was expected")
        };
        let keys: Vec<&str> = entries.iter().map(|(key, _)| &**key).collect();
        assert_eq!(keys, ["b", "a", "b"]);
        assert_eq!(entries[1].1, Node::Numbers([1.0, 2.5].into()));
        assert_eq!(
            entries[2].1,
            Node::Array([Node::Number(1.into()), Node::Null].into())
        );
        assert!(size_of::<Node>() <= 24);
    }
}
