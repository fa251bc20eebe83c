//! Where traces are sent, and with which headers.

use std::fmt;

use ::http::Uri;

use super::value::{Given, Value, quoted};

/// The address of a collector that speaks HTTP without encryption; it has no trailing slash.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd)]
pub struct Endpoint(String);

impl Endpoint {
    /// Where traces are sent: a valid URI.
    #[must_use]
    pub fn traces(&self) -> String {
        format!("{}/v1/traces", self.0)
    }
}

impl Value for Option<Endpoint> {
    const ALLOWED: &'static str = "an address such as http://127.0.0.1:4318, without encryption";

    fn read(given: &Given) -> Option<Self> {
        let text = given.text()?.trim_end_matches('/');
        let is_sane = |byte: u8| byte.is_ascii_graphic() && !b"@?#".contains(&byte);
        let endpoint = Endpoint(text.to_owned());
        // What is checked is what will be asked for, so that the exporter cannot refuse it later.
        let uri: Uri = endpoint.traces().parse().ok()?;
        let sane = text.bytes().all(is_sane) && uri.scheme_str() == Some("http");
        (sane && has_host(&uri)).then_some(Some(endpoint))
    }

    fn to_toml(&self) -> Option<String> {
        self.as_ref().map(|endpoint| quoted(&endpoint.0))
    }
}

/// Headers sent to a third party, credentials among them: never shown.
#[derive(Clone, PartialEq, Eq, PartialOrd, Default)]
pub struct Headers(Vec<(String, String)>);

impl Headers {
    /// Names in lower case, with their values.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        let headers = self.0.iter();
        headers.map(|(name, value)| (name.as_str(), value.as_str()))
    }
}

impl fmt::Debug for Headers {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_list()
            .entries(self.iter().map(|(name, _)| name))
            .finish()
    }
}

impl Value for Headers {
    const ALLOWED: &'static str =
        "name=value between commas, such as authorization=Bearer%20TOKEN, what is special as %XX";
    const IS_SECRET: bool = true;

    fn read(given: &Given) -> Option<Self> {
        let entries = given.text()?.split(',').map(str::trim);
        let headers = entries
            .filter(|entry| !entry.is_empty())
            .map(|entry| {
                let (name, value) = entry.split_once('=')?;
                let name = name.trim().to_ascii_lowercase();
                let is_part = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
                let named = !name.is_empty() && name.bytes().all(is_part);
                named.then_some((name, decoded(value.trim())?))
            })
            .collect::<Option<Vec<_>>>()?;
        Some(Self(headers))
    }

    fn to_toml(&self) -> Option<String> {
        let headers: Vec<String> = self
            .iter()
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        (!headers.is_empty()).then(|| quoted(&headers.join(",")))
    }
}

/// With `%XX` decoded; everything must be visible ASCII or a space.
fn decoded(text: &str) -> Option<String> {
    let mut parts = text.split('%');
    let mut decoded = parts.next()?.to_owned();
    for part in parts {
        let byte = u8::from_str_radix(part.get(..2)?, 16).ok()?;
        decoded.push(byte.into());
        decoded.push_str(&part[2..]);
    }
    let is_sane = |byte: u8| byte == b' ' || byte.is_ascii_graphic();
    decoded.bytes().all(is_sane).then_some(decoded)
}

/// Whether an address names a host, and a port at most.
fn has_host(uri: &Uri) -> bool {
    let Some(authority) = uri.authority() else {
        return false;
    };
    let host = authority.host();
    let port = authority.as_str().strip_prefix(host);
    let is_port = |port: &str| {
        let port = port.strip_prefix(':');
        port.is_some_and(|port| port.parse::<u16>().is_ok())
    };
    !host.trim_matches(['[', ']']).is_empty()
        && port.is_some_and(|port| port.is_empty() || is_port(port))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endpoint_is_an_http_url() {
        for (text, taken) in [
            ("http://127.0.0.1:4318", true),
            ("http://collector:4318/", true),
            ("http://[::1]:4318/otlp", true),
            ("http://[::1]", true),
            ("http://[::1]/otlp/", true),
            ("http://collector", true),
            ("http://collector:70000", false),
            ("http://collector:", false),
            ("http://::1:4318", false),
            ("http://::1", false),
            ("http://[::1", false),
            ("http://[::1]4318", false),
            ("http://[::1]:port", false),
            ("http://[]:4318", false),
            ("http:///otlp", false),
            ("http://a\"b", false),
            ("https://collector:4318", false),
            ("collector:4318", false),
            ("http://", false),
            ("http://:4318", false),
            ("http://user@collector", false),
            ("http://collector:port", false),
            ("http://a b", false),
        ] {
            let read = <Option<Endpoint>>::read(&Given::Word(text.to_owned()));
            assert_eq!(read.is_some(), taken, "{text}");
        }
    }

    #[test]
    fn an_endpoint_that_no_uri_can_hold_is_refused() {
        // The longest URI has 65,534 bytes, and the path of the traces is added to the address.
        for (bytes, taken) in [(65_500, true), (65_530, false)] {
            let text = format!("http://{}", "a".repeat(bytes - 7));
            let read = <Option<Endpoint>>::read(&Given::Word(text));
            assert_eq!(read.is_some(), taken, "{bytes}");
        }
    }

    #[test]
    fn headers_are_names_and_values() {
        let read = |text: &str| {
            let headers = Headers::read(&Given::Word(text.to_owned()))?;
            let lines = headers
                .iter()
                .map(|(name, value)| format!("{name}: {value}"));
            Some(lines.collect::<Vec<_>>().join("; "))
        };
        for (text, expected) in [
            (
                "Authorization=Bearer%20a%3Db",
                Some("authorization: Bearer a=b"),
            ),
            ("a=1, b=x=y,", Some("a: 1; b: x=y")),
            ("", Some("")),
            ("a", None),
            ("=a", None),
            ("a b=c", None),
            ("a=%0d%0ab", None),
            ("a=%4", None),
            ("a=%zz", None),
            ("a=\u{e9}", None),
        ] {
            assert_eq!(read(text).as_deref(), expected, "{text}");
        }
    }
}
