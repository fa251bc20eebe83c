//! `Idempotency-Key`: the same request twice makes one plan.
//!
//! The store remembers a key together with its plan. Here we only track which keys are being worked on right now, so
//! that a request and its own repetition do not run side by side.

use std::collections::HashSet;
use std::sync::Arc;

use axum::http::{HeaderMap, HeaderName};
use parking_lot::Mutex;

use super::caller::Caller;
use super::params;
use super::problem::Problem;
use crate::job::{Idempotency, Owner};

const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");
/// Marks an answer as being an earlier request's plan.
pub(super) const IDEMPOTENCY_REPLAYED: HeaderName = HeaderName::from_static("idempotency-replayed");

/// Maximum length of a key.
const MAX_LENGTH: usize = 255;

/// The owner, and the key.
type Key = (Option<Owner>, String);

/// The keys whose first request has not been answered yet.
#[derive(Debug, Clone, Default)]
pub struct InFlight(Arc<Mutex<HashSet<Key>>>);

impl InFlight {
    /// Begin work under the request's key, if it has one.
    ///
    /// # Errors
    /// An invalid parameter when the key is malformed, and [`Problem::IdempotencyInFlight`] while another request with
    /// it has not been answered.
    pub(super) fn begin(
        &self,
        caller: &Caller,
        headers: &HeaderMap,
    ) -> Result<Option<Once>, Problem> {
        let Some(key) = read(headers)? else {
            return Ok(None);
        };
        let key = (caller.owner.clone(), key);
        if !self.0.lock().insert(key.clone()) {
            return Err(Problem::IdempotencyInFlight);
        }
        let keys = self.clone();
        Ok(Some(Once { keys, key }))
    }
}

/// A key that is being worked on, until this is dropped.
#[derive(Debug)]
pub(super) struct Once {
    keys: InFlight,
    key: Key,
}

impl Once {
    /// Combines the key with the checksum of the request's body.
    pub(super) fn with(&self, body_sha256: String) -> Idempotency {
        Idempotency {
            key: self.key.1.clone(),
            body_sha256,
        }
    }
}

impl Drop for Once {
    fn drop(&mut self) {
        self.keys.0.lock().remove(&self.key);
    }
}

/// The key, bare or as a quoted string of RFC 8941, where it is the text between the quotes.
fn read(headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let mut values = headers.get_all(IDEMPOTENCY_KEY).iter();
    let Some(value) = values.next() else {
        return Ok(None);
    };
    let text = String::from_utf8_lossy(value.as_bytes()).into_owned();
    let refused = || {
        let allowed = format!("one key of 1 to {MAX_LENGTH} visible ASCII characters");
        params::refused(IDEMPOTENCY_KEY.as_str(), &text, &allowed)
    };
    if values.next().is_some() {
        return Err(params::repeated(IDEMPOTENCY_KEY.as_str()));
    }
    let bare = text.trim();
    let key = bare
        .strip_prefix('"')
        .and_then(|rest| rest.strip_suffix('"'))
        .unwrap_or(bare);
    let sane = (1..=MAX_LENGTH).contains(&key.len()) && key.bytes().all(|b| b.is_ascii_graphic());
    if sane {
        Ok(Some(key.to_owned()))
    } else {
        Err(refused())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn with_key(key: &str) -> HeaderMap {
        let mut headers = HeaderMap::new();
        let value = HeaderValue::from_bytes(key.as_bytes()).expect("a header's value");
        headers.insert(IDEMPOTENCY_KEY, value);
        headers
    }

    #[test]
    fn a_key_may_be_bare_or_quoted() {
        let long = "k".repeat(256);
        for (text, expected) in [
            ("8e03978e-40d5", Some("8e03978e-40d5")),
            ("\"8e03978e-40d5\"", Some("8e03978e-40d5")),
            ("", None),
            ("\"\"", None),
            ("two words", None),
            ("caf\u{e9}", None),
            (long.as_str(), None),
        ] {
            let key = read(&with_key(text)).ok().flatten();
            assert_eq!(key.as_deref(), expected, "{text:?}");
        }
        assert!(matches!(read(&HeaderMap::new()), Ok(None)));
        let mut twice = with_key("a");
        twice.append(IDEMPOTENCY_KEY, HeaderValue::from_static("b"));
        assert!(read(&twice).is_err());
    }

    #[test]
    fn a_key_is_held_by_one_request_at_a_time() {
        let keys = InFlight::default();
        let begin = |owner: Option<&str>| {
            let caller = Caller {
                owner: owner.map(ToOwned::to_owned),
                ..Caller::ANYBODY
            };
            keys.begin(&caller, &with_key("k"))
        };
        let first = begin(None);
        assert!(matches!(begin(None), Err(Problem::IdempotencyInFlight)));
        assert!(begin(Some("alice")).is_ok(), "another owner's key");
        drop(first);
        assert!(begin(None).is_ok());
    }
}
