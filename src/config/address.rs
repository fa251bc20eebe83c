//! A shared set of servers, and the namespace of one service on them.

use std::fmt;
use std::net::Ipv6Addr;

/// The namespace when an address names none.
const NAMESPACE: &str = "noctule";

/// The form of an address, as a literal, for use within other literals.
macro_rules! allowed {
    () => {
        "nats://HOST:PORT or tls://HOST:PORT without user and password (store_credentials has those), \
         more servers after commas, and perhaps /NAMESPACE of at most 32 letters, digits, - and _"
    };
}
pub(super) use allowed;

/// Servers of a NATS system, and the namespace of this service on them: `nats://a:4222,b:4222/noctule`.
///
/// Whatever servers require a client to present is in its credentials file, never in an address: addresses are logged
/// and printed.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd)]
pub struct Address {
    /// Each with its scheme, `nats` or `tls`.
    pub servers: Vec<String>,
    /// First part of the name of every stream, bucket and subject; services in other namespaces on the same servers are
    /// unaware of this one.
    pub namespace: String,
}

impl Address {
    /// The form of an address, for a refusal.
    pub const ALLOWED: &str = allowed!();

    /// Read an address; `None` when it does not have the form of [`Address::ALLOWED`].
    #[must_use]
    pub fn read(text: &str) -> Option<Self> {
        let (scheme, rest) = text.split_once("://")?;
        let (hosts, namespace) = rest.split_once('/').unwrap_or((rest, NAMESPACE));
        let taken = ["nats", "tls"].contains(&scheme)
            && is_namespace(namespace)
            && hosts.split(',').all(is_host);
        taken.then(|| Self {
            servers: hosts
                .split(',')
                .map(|host| format!("{scheme}://{host}"))
                .collect(),
            namespace: namespace.to_owned(),
        })
    }
}

/// In the form that [`Address::read`] takes.
impl fmt::Display for Address {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (nth, server) in self.servers.iter().enumerate() {
            let host = server.split_once("://").map_or("", |(_, host)| host);
            match nth {
                0 => write!(to, "{server}")?,
                _ => write!(to, ",{host}")?,
            }
        }
        write!(to, "/{}", self.namespace)
    }
}

fn is_namespace(text: &str) -> bool {
    let is_part = |byte: u8| byte.is_ascii_alphanumeric() || b"-_".contains(&byte);
    (1..=32).contains(&text.len()) && text.bytes().all(is_part)
}

/// A name or an address, optionally with a port. An IPv6 address must be in brackets because of its colons.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_names_servers_and_a_namespace() {
        for (text, servers, namespace) in [
            ("nats://localhost", &["nats://localhost"][..], "noctule"),
            (
                "tls://nats.example:4222",
                &["tls://nats.example:4222"],
                "noctule",
            ),
            ("tls://127.0.0.1:1/x", &["tls://127.0.0.1:1"], "x"),
            (
                "nats://a:4222,b.example,[::1]:3/fleet-2_x",
                &["nats://a:4222", "nats://b.example", "nats://[::1]:3"],
                "fleet-2_x",
            ),
        ] {
            let address = Address::read(text).expect(text);
            assert_eq!(address.servers, servers);
            assert_eq!(address.namespace, namespace);
            assert_eq!(Address::read(&address.to_string()), Some(address));
        }
    }

    #[test]
    fn what_is_no_address_is_refused() {
        for text in [
            "",
            "sqlite",
            "sqlite:///data",
            "http://a:4222",
            "nats://",
            "nats:///fleet",
            "nats://a,,b",
            "nats://a,",
            "nats://a:port",
            "nats://a:0",
            "nats://a:70000",
            "nats://a:1:2",
            "nats://[::1",
            "nats://[a]:1",
            "nats://a/",
            "nats://a/b.c",
            "nats://a/b/c",
            "nats://a/b?c",
            "nats://a b",
            "nats://user:hush@a:4222",
            "nats://a:4222,hush@b:4222",
            "nats://abc/0123456789012345678901234567890123",
        ] {
            assert_eq!(Address::read(text), None, "{text}");
        }
    }
}
