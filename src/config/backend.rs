//! Where plans are kept, and the node's role there.

use std::str::FromStr;

use super::address::{self, Address};
use super::value::{Given, Value, quoted, refused};

/// The store.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd)]
pub enum Backend {
    /// A file in the data directory, for one process.
    #[default]
    Sqlite,
    /// The servers of a NATS system, shared by many processes.
    Nats(Address),
}

impl Backend {
    const SQLITE: &'static str = "sqlite";

    /// What kind it is, without its address.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Sqlite => Self::SQLITE,
            Self::Nats(_) => "nats",
        }
    }

    /// Whether several nodes can share it.
    #[must_use]
    pub fn is_shared(&self) -> bool {
        matches!(self, Self::Nats(_))
    }
}

impl FromStr for Backend {
    type Err = String;

    /// As a flag or a variable gives it.
    ///
    /// # Errors
    /// What it is, unless that may hold a password, and what it must be.
    fn from_str(word: &str) -> Result<Self, String> {
        let given = Given::Word(word.to_owned());
        let hides = Self::is_secret(&given);
        Self::read(&given).ok_or_else(|| refused(&given, hides, Self::ALLOWED))
    }
}

impl Value for Backend {
    const ALLOWED: &'static str = concat!("sqlite, or ", address::allowed!());

    fn read(given: &Given) -> Option<Self> {
        match given.text()? {
            Self::SQLITE => Some(Self::Sqlite),
            text => Address::read(text).map(Self::Nats),
        }
    }

    fn to_toml(&self) -> Option<String> {
        Some(match self {
            Self::Sqlite => quoted(self.name()),
            Self::Nats(address) => quoted(&address.to_string()),
        })
    }

    /// A refusal would otherwise show an address with a password.
    fn is_secret(given: &Given) -> bool {
        given.text().is_none_or(|text| text.contains('@'))
    }
}

/// Number of copies that the servers keep of everything.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
pub struct Replicas(usize);

impl Replicas {
    /// 1, 3 or 5.
    #[must_use]
    pub fn count(self) -> usize {
        self.0
    }
}

impl Default for Replicas {
    fn default() -> Self {
        Self(1)
    }
}

impl Value for Replicas {
    const ALLOWED: &'static str = "1, 3 or 5";

    fn read(given: &Given) -> Option<Self> {
        let count = usize::read(given)?;
        [1, 3, 5].contains(&count).then_some(Self(count))
    }

    fn to_toml(&self) -> Option<String> {
        self.0.to_toml()
    }
}

/// What a node does for the others that share its store.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd)]
pub enum Role {
    /// Everything.
    #[default]
    All,
    /// It serves requests, and runs no plans.
    Api,
    /// It runs plans, and serves only its operators' requests.
    Worker,
}

impl Role {
    const ALL: [Self; 3] = [Self::All, Self::Api, Self::Worker];

    /// As written in the settings.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Api => "api",
            Self::Worker => "worker",
        }
    }

    /// Whether it takes plans and answers about them.
    #[must_use]
    pub fn serves(self) -> bool {
        self != Self::Worker
    }

    /// Whether it runs plans.
    #[must_use]
    pub fn runs(self) -> bool {
        self != Self::Api
    }
}

impl Value for Role {
    const ALLOWED: &'static str = "all, api or worker";

    fn read(given: &Given) -> Option<Self> {
        let text = given.text()?;
        Self::ALL.into_iter().find(|role| role.name() == text)
    }

    fn to_toml(&self) -> Option<String> {
        Some(quoted(self.name()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_are_as_many_as_can_vote() {
        for (text, count) in [
            ("1", Some(1)),
            ("3", Some(3)),
            ("5", Some(5)),
            ("2", None),
            ("0", None),
            ("7", None),
            ("many", None),
        ] {
            let read = Replicas::read(&Given::Word(text.to_owned()));
            assert_eq!(read.map(Replicas::count), count, "{text}");
        }
    }
}
