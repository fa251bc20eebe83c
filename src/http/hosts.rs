//! Which host a request is for, and whether this service is that host.
//!
//! A service without keys relies on its loopback address to keep strangers out. A browser on the same machine can reach
//! it, and so can every page whose name has been made to resolve to it (DNS rebinding); such a page cannot hide that
//! name, because the browser sends it.

use std::net::{Ipv4Addr, Ipv6Addr};
use std::sync::Arc;

use axum::http::uri::Authority;
use axum::http::{HeaderMap, Uri, Version, header};

use super::browser::Origins;
use super::params;
use super::problem::Problem;
use super::shown::Shown;

/// The hosts that this service answers for.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Hosts(Option<Arc<[String]>>);

impl Hosts {
    /// Answers for any host.
    #[must_use]
    pub fn any() -> Self {
        Self(None)
    }

    /// This machine, by its address or as localhost, and the hosts of `origins`.
    #[must_use]
    pub fn of_this_machine(origins: &Origins) -> Self {
        Self(Some(origins.hosts().collect()))
    }

    /// # Errors
    /// Where HTTP requires a host and there is none, or more than one, or an unreadable one; and where the host is not
    /// this service's.
    pub(super) fn check(
        &self,
        uri: &Uri,
        version: Version,
        headers: &HeaderMap,
    ) -> Result<(), Problem> {
        if version == Version::HTTP_11 && !headers.contains_key(header::HOST) {
            return Err(refused("is missing, must name the host that is asked"));
        }
        match (named(uri, headers)?, &self.0) {
            (Some(host), Some(known)) if !is_of_this_machine(&host, known) => {
                Err(Problem::Misdirected(Shown::of(&host)))
            }
            _ => Ok(()),
        }
    }
}

/// The host, without its port, in lower case: from the address where it has one, as in HTTP/2, otherwise from the
/// header.
fn named(uri: &Uri, headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let mut values = headers.get_all(header::HOST).iter();
    let value = values.next();
    if values.next().is_some() {
        return Err(refused("is given twice, must be given once"));
    }
    let of_header = value
        .map(|value| {
            let text = value.to_str().unwrap_or_default();
            let read = text.parse::<Authority>().ok();
            read.filter(|authority| !authority.as_str().contains('@'))
                .ok_or_else(|| {
                    let sent = String::from_utf8_lossy(value.as_bytes());
                    params::refused("host", &sent, "a host and maybe a port")
                })
        })
        .transpose()?;
    let authority = uri.authority().or(of_header.as_ref());
    Ok(authority.map(|authority| authority.host().to_ascii_lowercase()))
}

fn refused(detail: &str) -> Problem {
    Problem::InvalidParameter {
        name: "host".to_owned(),
        detail: format!("host {detail}"),
    }
}

/// `known` are additional hosts. An IP address cannot be rebound, whoever names it.
fn is_of_this_machine(host: &str, known: &[String]) -> bool {
    let name = host.strip_suffix('.').unwrap_or(host);
    let v6 = host
        .strip_prefix('[')
        .and_then(|host| host.strip_suffix(']'));
    name == "localhost"
        || name.ends_with(".localhost")
        || host.parse::<Ipv4Addr>().is_ok()
        || v6.is_some_and(|v6| v6.parse::<Ipv6Addr>().is_ok())
        || known.iter().any(|known| known == name)
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;
    use axum::response::IntoResponse as _;

    use super::*;
    use crate::config::Origin;

    #[test]
    fn host_names_that_others_control_are_rejected() {
        let known = ["plans.example".to_owned()];
        for (host, expected) in [
            ("localhost", true),
            ("localhost.", true),
            ("noctule.localhost", true),
            ("127.0.0.1", true),
            ("192.0.2.7", true),
            ("[::1]", true),
            ("plans.example", true),
            ("x.plans.example", false),
            ("evil.example", false),
            ("localhost.evil.example", false),
            ("127.0.0.1.evil.example", false),
            ("evillocalhost", false),
            ("127.1", false),
            ("[evil]", false),
            ("", false),
        ] {
            assert_eq!(is_of_this_machine(host, &known), expected, "{host}");
        }
    }

    #[test]
    fn a_request_must_name_one_valid_host() {
        #[track_caller]
        fn check(version: Version, uri: &str, values: &[&[u8]], expected: Option<u16>) {
            let mut headers = HeaderMap::new();
            for value in values {
                let value = HeaderValue::from_bytes(value).expect("a header");
                headers.append(header::HOST, value);
            }
            let uri = uri.parse().expect("an address");
            let origin = Origin::read("https://plans.example:8443").expect("an origin");
            let hosts = Hosts::of_this_machine(&Origins::new(&[origin]));
            let problem = hosts.check(&uri, version, &headers).err();
            let status = problem.map(|problem| problem.into_response().status().as_u16());
            assert_eq!(status, expected, "{version:?} {uri} {headers:?}");
        }
        let (v1, v11, v2) = (Version::HTTP_10, Version::HTTP_11, Version::HTTP_2);
        check(v11, "/", &[b"localhost:8080"], None);
        check(v11, "/", &[b"LocalHost"], None);
        check(v11, "/", &[b"[::1]:8080"], None);
        check(v11, "/", &[b"plans.example"], None);
        check(v11, "/", &[], Some(400));
        check(v11, "/", &[b""], Some(400));
        check(v11, "/", &[b"localhost", b"localhost"], Some(400));
        check(v11, "/", &[b"two words"], Some(400));
        check(v11, "/", &[b"me@localhost"], Some(400));
        check(v11, "/", &[b"caf\xe9"], Some(400));
        check(v11, "/", &[b"evil.example:8080"], Some(421));
        // A host in the address takes precedence over the header.
        check(v11, "http://evil.example/", &[b"localhost"], Some(421));
        check(v11, "http://localhost/", &[], Some(400));
        check(v1, "/", &[], None);
        check(v1, "/", &[b"evil.example"], Some(421));
        check(v2, "http://localhost:8080/", &[], None);
        check(v2, "http://evil.example/", &[], Some(421));
        check(v2, "/", &[b"evil.example"], Some(421));
    }

    /// A header may have 64 KiB.
    #[test]
    fn a_long_host_is_repeated_in_part() {
        let long = "x".repeat(10_000);
        for host in [long.clone(), format!("me@{long}")] {
            let value = HeaderValue::from_str(&host).expect("a header");
            let headers = HeaderMap::from_iter([(header::HOST, value)]);
            let hosts = Hosts::of_this_machine(&Origins::default());
            let refused = hosts.check(&Uri::from_static("/"), Version::HTTP_11, &headers);
            let document = refused.expect_err("another host").document("id");
            assert!(document.contains("xxx..."), "{document:.300}");
            assert!(document.len() < 1000, "{document:.300}");
        }
    }
}
