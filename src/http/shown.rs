//! What a caller sent, as far as an answer repeats it.

use std::fmt;

/// Most characters that are repeated.
const MOST_CHARS: usize = 100;

/// The beginning of what a caller sent: the head of a request may have 64 KiB, and no answer needs them to be
/// understood.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Shown(String);

impl Shown {
    pub(super) fn of(sent: &str) -> Self {
        match sent.char_indices().nth(MOST_CHARS) {
            Some((end, _)) => Self(format!("{}...", &sent[..end])),
            None => Self(sent.to_owned()),
        }
    }

    pub(super) fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_long_is_cut_between_characters() {
        for (sent, expected) in [
            ("", String::new()),
            ("short", "short".to_owned()),
            (&"\u{e9}".repeat(100), "\u{e9}".repeat(100)),
            (
                &"\u{e9}".repeat(101),
                format!("{}...", "\u{e9}".repeat(100)),
            ),
        ] {
            assert_eq!(Shown::of(sent).as_str(), expected);
        }
    }
}
