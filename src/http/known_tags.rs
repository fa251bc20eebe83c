//! Which versions a caller has already.

use std::convert::Infallible;

use axum::extract::OptionalFromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, header};

/// The entity tags of `If-None-Match`.
pub(super) struct KnownTags(Vec<String>);

impl KnownTags {
    pub(super) fn of(headers: &HeaderMap) -> Option<Self> {
        let values = headers.get_all(header::IF_NONE_MATCH).iter();
        let tags: Vec<String> = values
            .filter_map(|value| value.to_str().ok())
            .flat_map(|value| value.split(','))
            .map(|tag| tag.trim().to_owned())
            .collect();
        (!tags.is_empty()).then_some(Self(tags))
    }

    /// Weak comparison, RFC 9110 section 8.8.3.2.
    pub(super) fn contain(&self, tag: &HeaderValue) -> bool {
        let opaque = |tag: &str| tag.strip_prefix("W/").unwrap_or(tag).to_owned();
        let tag = opaque(tag.to_str().unwrap_or_default());
        self.0
            .iter()
            .any(|known| known == "*" || opaque(known) == tag)
    }
}

impl<S: Sync> OptionalFromRequestParts<S> for KnownTags {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Option<Self>, Infallible> {
        Ok(Self::of(&parts.headers))
    }
}
