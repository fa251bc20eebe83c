//! The lanes of the queue: who may claim a plan, and who waits for whom.

use serde::{Deserialize, Serialize};

use crate::digest::sha256_hex;
use crate::job::Submission;

/// From this [`Submission::work`] on a plan is large: ten times the default, and some tenths of a second.
const LARGE: u64 = 4_000_000;

/// A version of the program, as `major.minor.patch` orders them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(super) struct Version([u64; 3]);

impl Version {
    /// This program's.
    pub(super) fn own() -> Self {
        Self::read(env!("CARGO_PKG_VERSION")).expect("cargo only takes such versions")
    }

    /// Read `major.minor.patch`; what follows a `-` or `+` is left out.
    pub(super) fn read(text: &str) -> Option<Self> {
        let core = text.split(['-', '+']).next()?;
        let mut numbers = core.split('.').map(str::parse);
        let mut next = || numbers.next()?.ok();
        let version = [next()?, next()?, next()?];
        numbers.next().is_none().then_some(Self(version))
    }
}

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [major, minor, patch] = self.0;
        write!(f, "{major}.{minor}.{patch}")
    }
}

/// How much work a plan is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Size {
    /// Over in a moment.
    Small,
    /// May keep a worker busy while others wait.
    Large,
}

impl Size {
    fn name(self) -> &'static str {
        match self {
            Self::Small => "small",
            Self::Large => "large",
        }
    }
}

/// Plans of one lane are run in the order of their acceptance.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(super) struct Lane {
    /// Version of the program that accepted them; older workers leave them alone.
    pub(super) version: Version,
    /// See [`Size`].
    pub(super) size: Size,
    /// Derived from the owner's name.
    pub(super) owner: String,
}

impl Lane {
    pub(super) fn of(submission: &Submission) -> Self {
        Self {
            version: Version::own(),
            size: if submission.work < LARGE {
                Size::Small
            } else {
                Size::Large
            },
            owner: submission.owner.as_deref().map_or_else(
                || "-".to_owned(),
                |owner| sha256_hex(owner.as_bytes())[..16].to_owned(),
            ),
        }
    }

    /// Three tokens of a subject.
    pub(super) fn subject(&self) -> String {
        let [major, minor, patch] = self.version.0;
        let (size, owner) = (self.size.name(), &self.owner);
        format!("{major}-{minor}-{patch}.{size}.{owner}")
    }

    /// Name of the consumer.
    pub(super) fn name(&self) -> String {
        self.subject().replace('.', "_")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_ordered_numerically() {
        let version = |text| Version::read(text).expect("it is one");
        assert!(version("0.9.10") < version("0.10.0"));
        assert!(version("2.11.0-preview.2") == version("2.11.0"));
        assert!(version("2.9.99") < version("2.10.0+build"));
        for text in ["", "1", "1.2", "1.2.x", "1.2.3.4", "v1.2.3"] {
            assert_eq!(Version::read(text), None, "{text}");
        }
        assert_eq!(version("1.2.3").to_string(), "1.2.3");
    }
}
