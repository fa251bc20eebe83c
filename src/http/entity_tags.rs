//! Entity tags as conditional requests list them, RFC 9110 section 13.1.

use std::convert::Infallible;

use axum::extract::OptionalFromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};

use super::header_list;

/// The entity tags of a header, as it was sent: requests that wait keep them.
pub(super) struct EntityTags(Vec<HeaderValue>);

impl EntityTags {
    /// The tags in the header `name`; `None` without such a header. An unreadable one has tags that nothing has.
    pub(super) fn of(headers: &HeaderMap, name: HeaderName) -> Option<Self> {
        let values: Vec<_> = headers.get_all(name).into_iter().cloned().collect();
        (!values.is_empty()).then_some(Self(values))
    }

    /// Tags of the versions that the caller already has.
    pub(super) fn known(headers: &HeaderMap) -> Option<Self> {
        Self::of(headers, header::IF_NONE_MATCH)
    }

    /// The tags as they were sent.
    pub(super) fn iter(&self) -> impl Iterator<Item = &str> {
        header_list::entries(&self.0)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn known(values: &[&[u8]]) -> Option<EntityTags> {
        let mut headers = HeaderMap::new();
        for value in values {
            let value = HeaderValue::from_bytes(value).expect("a value");
            headers.append(header::IF_NONE_MATCH, value);
        }
        EntityTags::known(&headers)
    }

    #[test]
    fn the_tags_of_all_lines_are_listed_but_for_unreadable_ones() {
        assert!(known(&[]).is_none());
        let tags = known(&[br#""a", W/"b""#, b"\"\xff\"", "\"\u{e9}\"".as_bytes()]);
        let tags = tags.expect("four tags");
        let listed: Vec<&str> = tags.iter().collect();
        assert_eq!(listed, [r#""a""#, r#"W/"b""#, "\"\u{e9}\""]);
        assert!(tags.contain(&HeaderValue::from_static("\"b\"")));
        assert!(!tags.contain(&HeaderValue::from_static("\"c\"")));
    }
}
