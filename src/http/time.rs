//! Times in answers: RFC 3339, UTC, to the millisecond.

use jiff::Timestamp;
use serde::{Serialize, Serializer};

/// Milliseconds since 1970, written as UTC.
#[derive(Debug)]
pub(super) struct Time(pub(super) i64);

impl From<Timestamp> for Time {
    fn from(at: Timestamp) -> Self {
        Self(at.as_millisecond())
    }
}

impl Serialize for Time {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let time = Timestamp::from_millisecond(self.0).unwrap_or(Timestamp::UNIX_EPOCH);
        serializer.collect_str(&format_args!("{time:.3}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_utc_with_milliseconds() {
        for (ms, expected) in [
            (1_700_000_000_123, "2023-11-14T22:13:20.123Z"),
            (0, "1970-01-01T00:00:00.000Z"),
        ] {
            let written = serde_json::to_value(Time(ms)).expect("a text");
            assert_eq!(written, expected);
        }
    }
}
