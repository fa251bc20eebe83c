//! Entity tags as conditional requests list them, RFC 9110 section 13.1.

use std::convert::Infallible;

use axum::extract::OptionalFromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};

use super::header_list;

/// The entity tags of a header.
pub(super) struct EntityTags(Vec<String>);

impl EntityTags {
    /// The tags in the header `name`; `None` without such a header. An unreadable one counts as a tag that nothing has.
    pub(super) fn of(headers: &HeaderMap, name: HeaderName) -> Option<Self> {
        let mut tags = Vec::new();
        for value in headers.get_all(name) {
            let value = String::from_utf8_lossy(value.as_bytes());
            tags.extend(header_list::split(&value, ',').map(str::to_owned));
        }
        (!tags.is_empty()).then_some(Self(tags))
    }

    /// Tags of the versions that the caller already has.
    pub(super) fn known(headers: &HeaderMap) -> Option<Self> {
        Self::of(headers, header::IF_NONE_MATCH)
    }

    /// The tags as they were sent.
    pub(super) fn iter(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(String::as_str)
    }

    /// Weak comparison, RFC 9110 section 8.8.3.2.
    pub(super) fn contain(&self, tag: &HeaderValue) -> bool {
        let tag = opaque(tag.to_str().unwrap_or_default());
        self.iter()
            .any(|listed| listed == "*" || opaque(listed) == tag)
    }
}

/// A tag without its weakness prefix.
pub(super) fn opaque(tag: &str) -> &str {
    tag.strip_prefix("W/").unwrap_or(tag)
}

/// Tags of the versions that the caller already has.
impl<S: Sync> OptionalFromRequestParts<S> for EntityTags {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Option<Self>, Infallible> {
        Ok(Self::known(&parts.headers))
    }
}
