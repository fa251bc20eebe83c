//! What a setting is: its names, and how a given value is put into its field.

use std::fmt::Write as _;
use std::ops::{RangeFrom, RangeFull, RangeInclusive};

use super::Config;
use super::value::{Given, Value};

/// One setting.
pub(super) struct Setting {
    /// Key in the file: `table.key`, or `key` at the top level.
    pub(super) key: &'static str,
    /// Placeholder for its value in the help.
    pub(super) placeholder: &'static str,
    /// Help text: one sentence without its full stop.
    pub(super) help: &'static str,
    /// A variable shared with other programs, used when its own is not set.
    pub(super) shared_variable: Option<&'static str>,
    field: Box<dyn AnyField>,
}

impl Setting {
    /// Let the variable `name`, which is shared with other programs, set it too.
    pub(super) fn or_variable(mut self, name: &'static str) -> Self {
        self.shared_variable = Some(name);
        self
    }

    /// Its table in the file, empty at the top level, and its key there.
    pub(super) fn path(&self) -> (&'static str, &'static str) {
        self.key.split_once('.').unwrap_or(("", self.key))
    }

    /// Name of its flag, without the leading dashes.
    pub(super) fn flag(&self) -> String {
        self.key.replace(['.', '_'], "-")
    }

    /// Its environment variable.
    pub(super) fn variable(&self) -> String {
        format!("NOCTULE_{}", self.key.replace('.', "_").to_uppercase())
    }

    /// Put `given` into `config`.
    ///
    /// # Errors
    /// The allowed values, when it is not one of them.
    pub(super) fn set(&self, config: &mut Config, given: &Given) -> Result<(), String> {
        self.field.set(config, given)
    }

    /// The value in `config`, as TOML; `None` when there is none.
    pub(super) fn shown(&self, config: &Config) -> Option<String> {
        self.field.shown(config)
    }

    /// Whether its value is never shown.
    pub(super) fn is_secret(&self) -> bool {
        self.field.is_secret()
    }

    /// Whether a refusal of `given` must not show it.
    pub(super) fn hides(&self, given: &Given) -> bool {
        self.field.hides(given)
    }

    /// Whether its flag may be given without a value.
    pub(super) fn is_switch(&self) -> bool {
        self.field.is_switch()
    }
}

/// The setting for a field of [`Config`], with values in `range`.
pub(super) fn row<T: Value>(
    key: &'static str,
    placeholder: &'static str,
    help: &'static str,
    range: impl Into<Range<T>>,
    field: fn(&mut Config) -> &mut T,
) -> Setting {
    let range = range.into();
    Setting {
        key,
        placeholder,
        help,
        shared_variable: None,
        field: Box::new(Field { range, field }),
    }
}

/// Gives access to a setting's field, whatever its type.
trait AnyField {
    fn set(&self, config: &mut Config, given: &Given) -> Result<(), String>;
    fn shown(&self, config: &Config) -> Option<String>;
    fn is_switch(&self) -> bool;
    fn is_secret(&self) -> bool;
    fn hides(&self, given: &Given) -> bool;
}

struct Field<T> {
    range: Range<T>,
    field: fn(&mut Config) -> &mut T,
}

impl<T: Value> AnyField for Field<T> {
    fn set(&self, config: &mut Config, given: &Given) -> Result<(), String> {
        let value = T::read(given).filter(|value| self.range.holds(value));
        *(self.field)(config) = value.ok_or_else(|| self.range.allowed())?;
        Ok(())
    }

    fn shown(&self, config: &Config) -> Option<String> {
        (self.field)(&mut config.clone()).to_toml()
    }

    fn is_switch(&self) -> bool {
        T::IS_SWITCH
    }

    fn is_secret(&self) -> bool {
        T::IS_SECRET
    }

    fn hides(&self, given: &Given) -> bool {
        T::is_secret(given)
    }
}

/// Limits on a value beyond those of its type.
pub(super) struct Range<T> {
    least: Option<T>,
    most: Option<T>,
}

impl<T: Value> Range<T> {
    fn holds(&self, value: &T) -> bool {
        self.least.as_ref().is_none_or(|least| value >= least)
            && self.most.as_ref().is_none_or(|most| value <= most)
    }

    fn allowed(&self) -> String {
        let mut text = T::ALLOWED.to_owned();
        for (word, bound) in [("from", &self.least), ("to", &self.most)] {
            if let Some(bound) = bound.as_ref().and_then(Value::to_toml) {
                write!(text, " {word} {bound}").expect("writing to a string cannot fail");
            }
        }
        text
    }
}

impl<T> From<RangeFull> for Range<T> {
    fn from(RangeFull: RangeFull) -> Self {
        let (least, most) = (None, None);
        Self { least, most }
    }
}

impl<T> From<RangeFrom<T>> for Range<T> {
    fn from(range: RangeFrom<T>) -> Self {
        Self {
            least: Some(range.start),
            most: None,
        }
    }
}

impl<T> From<RangeInclusive<T>> for Range<T> {
    fn from(range: RangeInclusive<T>) -> Self {
        let (least, most) = range.into_inner();
        Self {
            least: Some(least),
            most: Some(most),
        }
    }
}
