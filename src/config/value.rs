//! The types of settings' values: how each is read and written.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// A value as the operator gave it.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Given {
    /// Text of a flag or variable, whatever its type will be.
    Word(String),
    /// A string in the file.
    Text(String),
    /// A number in the file without a fraction. A count may exceed 2^63, the limit of TOML's own.
    Integer(i128),
    /// Another number in the file.
    Float(f64),
    /// A boolean in the file.
    Bool(bool),
    /// An array of strings in the file.
    List(Vec<String>),
    /// Anything else in the file; the name of its type.
    Other(&'static str),
}

impl Given {
    /// As shown in a refusal.
    pub(super) fn shown(&self) -> String {
        match self {
            Self::Word(text) | Self::Text(text) => format!("{text:?}"),
            Self::Integer(number) => number.to_string(),
            Self::Float(number) => number.to_string(),
            Self::Bool(truth) => truth.to_string(),
            Self::List(items) => format!("{items:?}"),
            Self::Other(kind) => format!("of type {kind}"),
        }
    }

    /// The value as a text, in quotes or not.
    pub(super) fn text(&self) -> Option<&str> {
        match self {
            Self::Word(text) | Self::Text(text) => Some(text),
            _ => None,
        }
    }
}

/// What a value is, unless it `hides`, and what it must be: for a refusal, after the place.
pub(super) fn refused(given: &Given, hides: bool, allowed: &str) -> String {
    let found = if hides {
        "wrong".to_owned()
    } else {
        given.shown()
    };
    format!("is {found}, must be {allowed}")
}

/// The type of a setting's value.
pub(super) trait Value: Clone + PartialOrd + 'static {
    /// For a refusal: what follows "must be".
    const ALLOWED: &'static str;

    /// Whether its flag alone, without a value, means `true`.
    const IS_SWITCH: bool = false;

    /// Whether it is never shown, neither by `--print-config` nor in a refusal.
    const IS_SECRET: bool = false;

    /// `None` when it is not valid.
    fn read(given: &Given) -> Option<Self>;

    /// Whether a refusal of this value must not show it.
    fn is_secret(_given: &Given) -> bool {
        Self::IS_SECRET
    }

    /// As written in the file; `None` when there is no value.
    fn to_toml(&self) -> Option<String>;
}

/// How log lines are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
pub enum LogFormat {
    /// For people.
    Text,
    /// One object a line.
    Json,
}

impl Value for LogFormat {
    const ALLOWED: &'static str = "text or json";

    fn read(given: &Given) -> Option<Self> {
        match given.text()? {
            "text" => Some(Self::Text),
            "json" => Some(Self::Json),
            _ => None,
        }
    }

    fn to_toml(&self) -> Option<String> {
        let name = match self {
            Self::Text => "text",
            Self::Json => "json",
        };
        Some(quoted(name))
    }
}

impl Value for SocketAddr {
    const ALLOWED: &'static str = "an address and a port such as 127.0.0.1:8080";

    fn read(given: &Given) -> Option<Self> {
        given.text()?.parse().ok()
    }

    fn to_toml(&self) -> Option<String> {
        Some(quoted(&self.to_string()))
    }
}

impl Value for Option<PathBuf> {
    const ALLOWED: &'static str = "a path";

    fn read(given: &Given) -> Option<Self> {
        let path = given.text().filter(|path| !path.is_empty())?;
        Some(Some(path.into()))
    }

    fn to_toml(&self) -> Option<String> {
        self.as_ref().map(|path| quoted(&path.to_string_lossy()))
    }
}

impl Value for bool {
    const ALLOWED: &'static str = "true or false";
    const IS_SWITCH: bool = true;

    fn read(given: &Given) -> Option<Self> {
        match given {
            Given::Bool(truth) => Some(*truth),
            Given::Word(word) => word.parse().ok(),
            _ => None,
        }
    }

    fn to_toml(&self) -> Option<String> {
        Some(self.to_string())
    }
}

/// Separated by commas in a flag or variable.
impl Value for Vec<String> {
    const ALLOWED: &'static str = "a list of texts";

    fn read(given: &Given) -> Option<Self> {
        match given {
            Given::List(items) => Some(items.clone()),
            Given::Word(word) => {
                let items = word.split(',').map(str::trim);
                let items = items.filter(|item| !item.is_empty());
                Some(items.map(str::to_owned).collect())
            }
            _ => None,
        }
    }

    fn to_toml(&self) -> Option<String> {
        if self.is_empty() {
            return None;
        }
        let items: Vec<String> = self.iter().map(|item| quoted(item)).collect();
        Some(format!("[{}]", items.join(", ")))
    }
}

/// Whole numbers, which includes all counts.
macro_rules! whole {
    ($($number:ty),*) => {$(
        impl Value for $number {
            const ALLOWED: &'static str = "a whole number";

            fn read(given: &Given) -> Option<Self> {
                match given {
                    Given::Integer(number) => Self::try_from(*number).ok(),
                    Given::Word(word) => word.parse().ok(),
                    _ => None,
                }
            }

            fn to_toml(&self) -> Option<String> {
                Some(self.to_string())
            }
        }
    )*};
}
whole!(u64, usize);

impl Value for Duration {
    const ALLOWED: &'static str =
        "seconds, or a number with a unit such as 250ms, 30s, 15m, 12h or 30d,";

    fn read(given: &Given) -> Option<Self> {
        let seconds = match given {
            Given::Integer(seconds) => *seconds as f64,
            Given::Float(seconds) => *seconds,
            Given::Word(text) => read_seconds(text).or_else(|| text.parse().ok())?,
            Given::Text(text) => read_seconds(text)?,
            _ => return None,
        };
        Self::try_from_secs_f64(seconds).ok()
    }

    fn to_toml(&self) -> Option<String> {
        Some(self.as_secs_f64().to_string())
    }
}

/// A number with a unit, converted to seconds.
fn read_seconds(text: &str) -> Option<f64> {
    const UNITS: [(&str, f64); 5] = [
        ("ms", 0.001),
        ("s", 1.0),
        ("m", 60.0),
        ("h", 3600.0),
        ("d", 86_400.0),
    ];
    let (number, seconds) = UNITS
        .iter()
        .find_map(|(unit, seconds)| Some((text.strip_suffix(unit)?, seconds)))?;
    Some(number.trim_end().parse::<f64>().ok()? * seconds)
}

/// As a TOML string.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_seconds_or_have_a_unit() {
        let word = |text: &str| Given::Word(text.to_owned());
        let text = |text: &str| Given::Text(text.to_owned());
        for (given, expected_ms) in [
            (word("30"), Some(30_000)),
            (word("0.5"), Some(500)),
            (word("250ms"), Some(250)),
            (word("15m"), Some(900_000)),
            (word("1.5h"), Some(5_400_000)),
            (text("30d"), Some(2_592_000_000)),
            (text("30"), None),
            (Given::Integer(2), Some(2_000)),
            (Given::Float(0.25), Some(250)),
            (Given::Float(f64::NAN), None),
            (Given::Integer(-2), None),
            (word("-1s"), None),
            (word("s"), None),
            (word("soon"), None),
            (word("inf"), None),
            (Given::Bool(true), None),
        ] {
            let expected = expected_ms.map(Duration::from_millis);
            assert_eq!(Duration::read(&given), expected, "{given:?}");
        }
    }

    #[test]
    fn the_file_has_types_and_the_command_line_has_words() {
        let word = |text: &str| Given::Word(text.to_owned());
        let text = |text: &str| Given::Text(text.to_owned());
        assert_eq!(usize::read(&word("12")), Some(12));
        assert_eq!(usize::read(&text("12")), None);
        assert_eq!(usize::read(&Given::Integer(-1)), None);
        assert_eq!(usize::read(&Given::Float(1.0)), None);
        assert_eq!(bool::read(&word("true")), Some(true));
        assert_eq!(bool::read(&text("true")), None);
        assert_eq!(bool::read(&Given::Bool(false)), Some(false));
        let list = || Some(vec!["a".to_owned(), "b".to_owned()]);
        assert_eq!(Vec::read(&word("a, b,")), list());
        assert_eq!(Vec::read(&Given::List(list().expect("two"))), list());
        assert_eq!(Vec::<String>::read(&text("a, b")), None);
    }

    #[test]
    fn what_is_written_can_be_read_as_toml() {
        #[track_caller]
        fn check<T: Value>(value: &T, expected: &str) {
            let shown = value.to_toml().expect("a value");
            assert_eq!(shown, expected);
            toml::from_str::<toml::Table>(&format!("key = {shown}")).expect("TOML");
        }
        check(&Duration::from_secs(30), "30");
        check(&Duration::from_millis(1_250), "1.25");
        check(&vec!["a\"b".to_owned(), "c".to_owned()], "['a\"b', \"c\"]");
        check(&Some(PathBuf::from("/data\\x")), r"'/data\x'");
        check(&true, "true");
    }
}
