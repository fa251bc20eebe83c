//! Values of a document: numbers in a range, strings from a list, items of an array. An invalid value adds a fault
//! and gives `None`, and reading continues.

use std::borrow::Cow;

use super::fault::Faults;
use super::path::Path;
use super::ranges::{MAX_NAME_CHARS, Range};
use super::tree::{Node, float, whole_or_float};

/// A value and its path.
#[derive(Debug, Clone, Copy)]
pub(super) struct At<'a> {
    pub(super) node: &'a Node<'a>,
    pub(super) path: &'a Path<'a>,
}

impl<'a> At<'a> {
    /// A number within `range`.
    pub(super) fn number(self, range: Range, faults: &mut Faults) -> Option<f64> {
        let Node::Number(number) = self.node else {
            return self.wrong_type("a number", faults);
        };
        let value = float(number);
        if range.contains(value) {
            return Some(value);
        }
        faults.add(self.path, "out-of-range", || {
            format!(
                "{} is {}, must be {}",
                self.path.label(),
                show(self.node),
                range.advice(value)
            )
        });
        None
    }

    /// A whole number within `range`; `7.0` is one.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole and within range"
    )]
    pub(super) fn whole(self, range: Range, faults: &mut Faults) -> Option<u64> {
        self.integer(faults)?;
        self.number(range, faults).map(|value| value as u64)
    }

    /// A whole number of at least `min` and at most the operator's limit of that name.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole and within range"
    )]
    pub(super) fn count(
        self,
        min: usize,
        limit: (&str, usize),
        faults: &mut Faults,
    ) -> Option<usize> {
        let value = self.integer(faults)?;
        if value < min as f64 {
            faults.add(self.path, "out-of-range", || {
                format!(
                    "{} is {}, must be >= {min}",
                    self.path.label(),
                    show(self.node)
                )
            });
            return None;
        }
        if value > limit.1 as f64 {
            faults.add(self.path, "too-many", || {
                format!(
                    "{} is {}, must be <= {} (limit {})",
                    self.path.label(),
                    show(self.node),
                    limit.1,
                    limit.0
                )
            });
            return None;
        }
        Some(value as usize)
    }

    fn integer(self, faults: &mut Faults) -> Option<f64> {
        let Node::Number(number) = self.node else {
            return self.wrong_type("a whole number", faults);
        };
        let value = float(number);
        if value.fract() == 0.0 {
            return Some(value);
        }
        faults.add(self.path, "not-an-integer", || {
            format!(
                "{} is {}, must be a whole number",
                self.path.label(),
                show(self.node)
            )
        });
        None
    }

    pub(super) fn boolean(self, faults: &mut Faults) -> Option<bool> {
        match self.node {
            Node::Bool(value) => Some(*value),
            _ => self.wrong_type("true or false", faults),
        }
    }

    pub(super) fn text(self, faults: &mut Faults) -> Option<&'a str> {
        match self.node {
            Node::Text(text) => Some(text),
            _ => self.wrong_type("a text", faults),
        }
    }

    /// One of `choices`.
    pub(super) fn choice<'c>(self, choices: &[&'c str], faults: &mut Faults) -> Option<&'c str> {
        let text = self.text(faults)?;
        if let Some(choice) = choices.iter().find(|choice| **choice == text) {
            return Some(choice);
        }
        faults.add(self.path, "unknown-value", || {
            let allowed = if choices.len() == 1 {
                "must be"
            } else {
                "must be one of"
            };
            format!(
                "{} is {}, {allowed} {}",
                self.path.label(),
                show(self.node),
                choices.join(", ")
            )
        });
        None
    }

    /// The one of `all` that has this name.
    pub(super) fn named<T: Copy, const N: usize>(
        self,
        all: [T; N],
        name: impl Fn(T) -> &'static str,
        faults: &mut Faults,
    ) -> Option<T> {
        let choice = self.choice(&all.map(&name), faults)?;
        all.into_iter().find(|one| name(*one) == choice)
    }

    /// How many items the array has.
    pub(super) fn len(self, faults: &mut Faults) -> Option<usize> {
        match self.node {
            Node::Numbers(numbers) => Some(numbers.len()),
            Node::Array(items) => Some(items.len()),
            _ => self.wrong_type("an array", faults),
        }
    }

    /// Every item of the array; those that cannot be read are `None` and have added a fault.
    pub(super) fn items<T>(
        self,
        faults: &mut Faults,
        mut read: impl FnMut(At<'_>, &mut Faults) -> Option<T>,
    ) -> Vec<Option<T>> {
        let mut item = |index: usize, node: &Node| {
            let path = Path::Index(self.path, index);
            read(At { node, path: &path }, faults)
        };
        match self.node {
            Node::Array(items) => items
                .iter()
                .enumerate()
                .map(|(index, node)| item(index, node))
                .collect(),
            Node::Numbers(numbers) => {
                let nodes = numbers
                    .iter()
                    .map(|number| Node::Number(whole_or_float(*number)));
                nodes
                    .enumerate()
                    .map(|(index, node)| item(index, &node))
                    .collect()
            }
            _ => Vec::new(),
        }
    }

    /// Numbers within `range`; fast, because a grid may have a million.
    pub(super) fn numbers(self, range: Range, faults: &mut Faults) -> Option<Vec<f64>> {
        self.len(faults)?;
        if let Node::Numbers(numbers) = self.node
            && numbers.iter().all(|number| range.contains(*number))
        {
            return Some(numbers.to_vec());
        }
        self.items(faults, |item, faults| item.number(range, faults))
            .into_iter()
            .collect()
    }

    pub(super) fn wrong_type<T>(self, wanted: &str, faults: &mut Faults) -> Option<T> {
        faults.add(self.path, "wrong-type", || {
            format!(
                "{} is {}, must be {wanted}",
                self.path.label(),
                show(self.node)
            )
        });
        None
    }
}

/// A name; null means none.
#[expect(
    clippy::option_option,
    reason = "the outer one tells whether it could be read"
)]
pub(super) fn name(at: At<'_>, faults: &mut Faults) -> Option<Option<String>> {
    if *at.node == Node::Null {
        return Some(None);
    }
    let text = at.text(faults)?;
    let chars = text.chars().count();
    if chars <= MAX_NAME_CHARS {
        return Some(Some(text.to_owned()));
    }
    faults.add(at.path, "too-long", || {
        format!(
            "{} has {chars} characters, must have at most {MAX_NAME_CHARS}",
            at.path.label()
        )
    });
    None
}

/// The offending value, short enough for a message.
fn show(node: &Node) -> Cow<'static, str> {
    match node {
        Node::Null => "null".into(),
        Node::Bool(value) => value.to_string().into(),
        Node::Number(number) if number.is_f64() => figure(float(number)).into(),
        Node::Number(number) => number.to_string().into(),
        Node::Text(text) => quote(text).into(),
        Node::Numbers(_) | Node::Array(_) => "an array".into(),
        Node::Object(_) => "an object".into(),
    }
}

/// A string in quotes, with control characters escaped, truncated if long.
pub(super) fn quote(text: &str) -> String {
    const MAX_CHARS: usize = 40;
    match text.char_indices().nth(MAX_CHARS) {
        Some((end, _)) => format!("{:?}...", &text[..end]),
        None => format!("{text:?}"),
    }
}

/// A number as a person would write it.
pub(super) fn figure(value: f64) -> String {
    whole_or_float(value).to_string()
}

/// A length in metres, rounded to the millimetre.
pub(super) fn metres(value: f64) -> String {
    figure((value * 1000.0).round() / 1000.0)
}
