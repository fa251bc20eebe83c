//! Where a webhook may be sent: to hosts of the public internet, over TLS. Callers name the address, so anything else
//! would let them reach what only this machine can.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use axum::http::Uri;

/// Maximum length of an address, bytes.
const MAX_LENGTH: usize = 2_000;

/// An address that a webhook can be sent to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::http) struct Target {
    pub(super) uri: Uri,
    pub(super) host: String,
    pub(super) port: u16,
    pub(super) tls: bool,
}

impl Target {
    /// The allowed addresses, for a refusal.
    pub(in crate::http) fn allowed(private: bool) -> &'static str {
        if private {
            "an http or https address, without user or fragment, of at most 2000 characters, all of ASCII"
        } else {
            "an https address of a public host, without user or fragment, of at most 2000 characters, all of ASCII"
        }
    }

    /// Read an address; plain `http` is accepted only where private receivers are allowed.
    pub(in crate::http) fn read(text: &str, private: bool) -> Option<Self> {
        if text.len() > MAX_LENGTH || text.contains('#') || !text.is_ascii() {
            return None;
        }
        let uri: Uri = text.parse().ok()?;
        let tls = match uri.scheme_str()? {
            "https" => true,
            "http" if private => false,
            _ => return None,
        };
        let authority = uri.authority()?;
        if authority.as_str().contains('@') || authority.host().is_empty() {
            return None;
        }
        let host = authority.host().trim_matches(['[', ']']).to_owned();
        let port = match authority.as_str().strip_prefix(authority.host())? {
            "" | ":" if tls => 443,
            "" | ":" => 80,
            port => port
                .strip_prefix(':')?
                .parse()
                .ok()
                .filter(|port| *port > 0)?,
        };
        let numeric = host.parse::<IpAddr>().ok();
        if !private && numeric.is_some_and(|address| !is_public(address)) {
            return None;
        }
        Some(Self {
            uri,
            host,
            port,
            tls,
        })
    }
}

/// Whether an address is one of the public internet.
pub(super) fn is_public(address: IpAddr) -> bool {
    match address {
        IpAddr::V4(address) => is_public_v4(address),
        IpAddr::V6(address) => match address.to_ipv4_mapped() {
            Some(mapped) => is_public_v4(mapped),
            None => is_public_v6(address),
        },
    }
}

/// All but multicast and the blocks that IANA's registry of special-purpose addresses does not call globally
/// reachable. The two addresses of 192.0.0.0/24 that it does are left out with their block.
fn is_public_v4(address: Ipv4Addr) -> bool {
    let [a, b, c, _] = address.octets();
    !(a == 0
        || a == 10
        || (a == 100 && (64..128).contains(&b))
        || a == 127
        || (a == 169 && b == 254)
        || (a == 172 && (16..32).contains(&b))
        || (a == 192 && b == 0 && (c == 0 || c == 2))
        || (a == 192 && b == 88 && c == 99)
        || (a == 192 && b == 168)
        || (a == 198 && (b == 18 || b == 19))
        || (a == 198 && b == 51 && c == 100)
        || (a == 203 && b == 0 && c == 113)
        || a >= 224)
}

/// Global unicast, `2000::/3`, except its special blocks and those that embed an IPv4 address.
fn is_public_v6(address: Ipv6Addr) -> bool {
    let [a, b, ..] = address.segments();
    (0x2000..0x4000).contains(&a)
        && !(a == 0x2001 && b < 0x0200)
        && !(a == 0x2001 && b == 0x0db8)
        && a != 0x2002
        && !(a == 0x3fff && b < 0x1000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_public_addresses_are_called() {
        for (text, public) in [
            ("1.1.1.1", true),
            ("93.184.215.14", true),
            ("0.0.0.0", false),
            ("10.1.2.3", false),
            ("100.64.0.1", false),
            ("127.0.0.1", false),
            ("169.254.169.254", false),
            ("172.15.0.1", true),
            ("172.16.0.1", false),
            ("192.168.1.1", false),
            ("198.19.0.1", false),
            ("224.0.0.1", false),
            ("255.255.255.255", false),
            ("2606:4700:4700::1111", true),
            ("::", false),
            ("::1", false),
            ("::ffff:127.0.0.1", false),
            ("::ffff:1.1.1.1", true),
            ("64:ff9b::7f00:1", false),
            ("2001:0:7f00:1::", false),
            ("2001:db8::1", false),
            ("2002:7f00:1::", false),
            ("fc00::1", false),
            ("fe80::1", false),
            ("ff02::1", false),
        ] {
            assert_eq!(
                is_public(text.parse().expect("an address")),
                public,
                "{text}"
            );
        }
    }

    #[test]
    fn a_webhook_address_must_be_https_and_name_a_host() {
        for (text, public, private) in [
            ("https://hooks.example/plan?x=1", true, true),
            ("https://hooks.example:8443/", true, true),
            ("https://[2606:4700:4700::1111]/", true, true),
            ("http://hooks.example/", false, true),
            ("https://127.0.0.1/", false, true),
            ("https://[::1]:9000/", false, true),
            ("https://hooks.example:/", true, true),
            ("https://hooks.example:0/", false, false),
            ("https://hooks.example:65536/", false, false),
            ("https://user:word@hooks.example/", false, false),
            ("https://hooks.example/#a", false, false),
            ("https://hooks.example/gr\u{fc}n", false, false),
            ("https://hooks.example/gr%C3%BCn", true, true),
            ("ftp://hooks.example/", false, false),
            ("hooks.example", false, false),
            ("/plans", false, false),
            ("", false, false),
        ] {
            assert_eq!(Target::read(text, false).is_some(), public, "{text}");
            assert_eq!(Target::read(text, true).is_some(), private, "{text}");
        }
        let long = format!("https://hooks.example/{}", "a".repeat(2_000));
        assert_eq!(Target::read(&long, true), None);
    }
}
