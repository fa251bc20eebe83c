//! Where plans are kept, and which part a node plays there.

use std::net::Ipv6Addr;

use super::value::{Given, Value, quoted};

/// The store.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd)]
pub enum Place {
    /// A file in the data directory, for one process.
    #[default]
    Sqlite,
    /// The servers of a NATS system at this address, for many.
    Nats(String),
}

impl Place {
    const SQLITE: &'static str = "sqlite";

    /// Whether several nodes can share it.
    #[must_use]
    pub fn is_shared(&self) -> bool {
        matches!(self, Self::Nats(_))
    }
}

/// Who and what servers want to know of a client stands in its credentials file, never in an address: addresses
/// are logged and printed.
impl Value for Place {
    const ALLOWED: &'static str = "sqlite, or nats://HOST:PORT or tls://HOST:PORT without user and password \
        (store_credentials has those), more servers after commas, and perhaps /NAMESPACE of at most \
        32 letters, digits, - and _";

    fn read(given: &Given) -> Option<Self> {
        let text = given.text()?;
        if text == Self::SQLITE {
            return Some(Self::Sqlite);
        }
        let servers = text
            .strip_prefix("nats://")
            .or_else(|| text.strip_prefix("tls://"))?;
        let (hosts, namespace) = match servers.split_once('/') {
            Some((hosts, namespace)) => (hosts, Some(namespace)),
            None => (servers, None),
        };
        let named = namespace.is_none_or(is_namespace);
        (named && hosts.split(',').all(is_host)).then(|| Self::Nats(text.to_owned()))
    }

    fn to_toml(&self) -> Option<String> {
        Some(match self {
            Self::Sqlite => quoted(Self::SQLITE),
            Self::Nats(address) => quoted(address),
        })
    }

    /// One with a password would be shown by its refusal.
    fn is_secret(given: &Given) -> bool {
        given.text().is_none_or(|text| text.contains('@'))
    }
}

fn is_namespace(text: &str) -> bool {
    let is_part = |byte: u8| byte.is_ascii_alphanumeric() || b"-_".contains(&byte);
    (1..=32).contains(&text.len()) && text.bytes().all(is_part)
}

/// A name or an address, perhaps with a port. An address of version 6 stands in brackets, for it has colons.
fn is_host(text: &str) -> bool {
    let bracketed = text.strip_prefix('[').map(|rest| rest.split_once(']'));
    let (is_name, port) = if let Some(bracketed) = bracketed {
        let Some((address, port)) = bracketed else {
            return false;
        };
        (address.parse::<Ipv6Addr>().is_ok(), port)
    } else {
        let (name, port) = text.split_at(text.find(':').unwrap_or(text.len()));
        let is_part = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
        (!name.is_empty() && name.bytes().all(is_part), port)
    };
    let is_port = |port: &str| port.parse::<u16>().is_ok_and(|port| port > 0);
    is_name && (port.is_empty() || port.strip_prefix(':').is_some_and(is_port))
}

/// How many copies the servers keep of everything.
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
    /// It answers, and runs no plans.
    Api,
    /// It runs plans, and answers those alone who look after it.
    Worker,
}

impl Role {
    const ALL: [Self; 3] = [Self::All, Self::Api, Self::Worker];

    /// As it is given.
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
    fn a_place_is_a_file_or_servers() {
        for (text, taken) in [
            ("sqlite", true),
            ("nats://localhost", true),
            ("nats://a:4222,b.example:4222,[::1]:4222/fleet-2_x", true),
            ("tls://nats.example:4222", true),
            ("tls://127.0.0.1:1", true),
            ("", false),
            ("SQLite", false),
            ("sqlite:///data", false),
            ("http://a:4222", false),
            ("nats://", false),
            ("nats:///fleet", false),
            ("nats://a,,b", false),
            ("nats://a,", false),
            ("nats://a:port", false),
            ("nats://a:0", false),
            ("nats://a:70000", false),
            ("nats://a:1:2", false),
            ("nats://[::1", false),
            ("nats://[a]:1", false),
            ("nats://a/", false),
            ("nats://a/b.c", false),
            ("nats://a/b/c", false),
            ("nats://a/b?c", false),
            ("nats://a b", false),
            ("nats://user:hush@a:4222", false),
            ("nats://a:4222,hush@b:4222", false),
            ("nats://abc/0123456789012345678901234567890123", false),
        ] {
            let read = Place::read(&Given::Word(text.to_owned()));
            assert_eq!(read.is_some(), taken, "{text}");
        }
    }

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
