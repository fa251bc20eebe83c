//! `Prefer: wait=N`, RFC 7240: how long the caller would rather wait than ask again.

use std::convert::Infallible;
use std::num::IntErrorKind;
use std::time::Duration;

use axum::extract::OptionalFromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue};

use super::header_list;

const PREFER: HeaderName = HeaderName::from_static("prefer");
pub(super) const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");

/// Longest wait, seconds; a longer one is cut to this.
pub(super) const MAX_WAIT_S: u8 = 30;

/// A requested wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Wait(u8);

impl Wait {
    /// The first `wait` of the headers; one that cannot be read counts as none, RFC 7240 section 2.
    pub(super) fn of(headers: &HeaderMap) -> Option<Self> {
        header_list::entries(headers.get_all(PREFER))
            .filter_map(|preference| header_list::split(preference, ';').next()?.split_once('='))
            .find(|(name, _)| name.trim().eq_ignore_ascii_case("wait"))
            .and_then(|(_, value)| seconds(value.trim().trim_matches('"')))
            .map(|seconds| Self(seconds.min(MAX_WAIT_S)))
    }

    pub(super) fn duration(self) -> Duration {
        Duration::from_secs(self.0.into())
    }

    /// The value of `Preference-Applied`.
    pub(super) fn applied(self) -> HeaderValue {
        HeaderValue::from_str(&format!("wait={}", self.0)).expect("digits are visible ASCII")
    }
}

/// A number of seconds; one of any length is a number.
fn seconds(text: &str) -> Option<u8> {
    match text.parse::<u8>() {
        Ok(seconds) => Some(seconds),
        Err(error) if *error.kind() == IntErrorKind::PosOverflow => Some(u8::MAX),
        Err(_) => None,
    }
}

impl<S: Sync> OptionalFromRequestParts<S> for Wait {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Option<Self>, Infallible> {
        Ok(Self::of(&parts.headers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wait_is_found_among_the_preferences() {
        for (value, expected) in [
            ("wait=10", Some(10)),
            ("respond-async, wait=10", Some(10)),
            ("Wait=5; foo=bar", Some(5)),
            ("wait=\"7\"", Some(7)),
            ("wait=99", Some(30)),
            ("wait=18446744073709551616", Some(30)),
            ("wait=0", Some(0)),
            ("wait=-1", None),
            ("wait=soon", None),
            ("wait", None),
            ("return=minimal", None),
            ("wait=soon, wait=10", None),
            ("wait=3, wait=10", Some(3)),
            ("foo=\"x, wait=3\"", None),
            ("foo=\"a, wait=0\", wait=5", Some(5)),
            ("wait=5; foo=\"a;b, wait=1\"", Some(5)),
        ] {
            let mut headers = HeaderMap::new();
            headers.insert(PREFER, HeaderValue::from_static(value));
            assert_eq!(Wait::of(&headers), expected.map(Wait), "{value}");
        }
    }
}
