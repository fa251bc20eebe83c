//! Where the servers are, and what is asked of them.

use std::path::PathBuf;
use std::time::Duration;

/// The namespace when an address names none.
const NAMESPACE: &str = "noctule";

/// How the service is kept in a NATS system.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// Of one or more servers of one system.
    pub address: Address,
    /// A file with the user's credentials, as `nsc` writes it.
    pub credentials: Option<PathBuf>,
    /// Copies that the servers keep of everything: 1, 3 or 5.
    pub replicas: usize,
    /// How long a run is this node's after it last said so.
    pub lease: Duration,
    /// Plans that this node runs at a time; 0 for a node that only serves.
    pub slots: usize,
}

/// Servers, and the namespace of one service among others on them: `nats://a:4222,b:4222/noctule`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// Each with its scheme, `nats` or `tls`.
    pub servers: Vec<String>,
    /// First part of the name of every stream, bucket and subject; services of other namespaces on the
    /// same servers know nothing of this one.
    pub namespace: String,
}

impl Address {
    /// What an address looks like, for a refusal.
    pub const ALLOWED: &str = "nats://HOST:PORT or tls://HOST:PORT, more servers after commas, and perhaps \
        /NAMESPACE of at most 32 letters, digits, - and _";

    /// Whether a text means servers at all, rather than something else.
    #[must_use]
    pub fn is_meant(text: &str) -> bool {
        text.starts_with("nats://") || text.starts_with("tls://")
    }

    /// Read an address; `None` when it is not as [`Address::ALLOWED`] says.
    #[must_use]
    pub fn read(text: &str) -> Option<Self> {
        let (scheme, rest) = text.split_once("://")?;
        let scheme = ["nats", "tls"].into_iter().find(|one| *one == scheme)?;
        let (hosts, namespace) = rest.split_once('/').unwrap_or((rest, NAMESPACE));
        let named = !namespace.is_empty()
            && namespace.len() <= 32
            && namespace
                .bytes()
                .all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'));
        let servers: Vec<_> = hosts
            .split(',')
            .map(|host| format!("{scheme}://{host}"))
            .collect();
        let reachable = servers.iter().all(|server| {
            server.parse::<async_nats::ServerAddr>().is_ok() && !server.ends_with("//")
        });
        (named && reachable).then(|| Self {
            servers,
            namespace: namespace.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_names_servers_and_a_namespace() {
        let one = Address::read("nats://localhost:4222").expect("it is one");
        assert_eq!(one.servers, ["nats://localhost:4222"]);
        assert_eq!(one.namespace, "noctule");
        let more = Address::read("tls://a:1,b,[::1]:3/fleet_2").expect("it is one");
        assert_eq!(more.servers, ["tls://a:1", "tls://b", "tls://[::1]:3"]);
        assert_eq!(more.namespace, "fleet_2");
    }

    #[test]
    fn what_is_no_address_is_refused() {
        for text in [
            "",
            "sqlite",
            "http://a:4222",
            "nats://",
            "nats://a,,b",
            "nats://a/",
            "nats://a/b.c",
            "nats://a/b/c",
            "nats://a:port",
        ] {
            assert_eq!(Address::read(text), None, "{text}");
        }
    }
}
