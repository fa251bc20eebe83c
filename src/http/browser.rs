//! What an answer tells browsers: which pages may read it, and what it may do.

use std::time::Duration;

use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, Uri, header};
use tower::layer::util::Identity;
use tower::util::{Either, option_layer};
use tower_http::cors::{AllowOrigin, CorsLayer};

use crate::config::Origin;

const CROSS_ORIGIN_RESOURCE_POLICY: HeaderName =
    HeaderName::from_static("cross-origin-resource-policy");

/// The policy for data, when somebody opens it as a page.
const CSP_OF_DATA: HeaderValue =
    HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'");

/// The policy for a drawing: nothing but itself, including its styles.
const CSP_OF_SVG: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; sandbox",
);

/// How long a browser may cache the answer to a preflight.
const PREFLIGHT_AGE: Duration = Duration::from_secs(600);

/// Headers of answers that other origins' pages may read, beside those that every page may.
const EXPOSED: [HeaderName; 12] = [
    header::CONTENT_DISPOSITION,
    header::ETAG,
    header::LINK,
    header::LOCATION,
    header::RETRY_AFTER,
    header::WWW_AUTHENTICATE,
    header::ACCEPT_ENCODING,
    HeaderName::from_static("idempotency-replayed"),
    HeaderName::from_static("preference-applied"),
    HeaderName::from_static("ratelimit"),
    HeaderName::from_static("ratelimit-policy"),
    HeaderName::from_static("x-request-id"),
];

/// Headers that other origins' pages may send.
const ALLOWED: [HeaderName; 12] = [
    header::ACCEPT,
    header::AUTHORIZATION,
    header::CONTENT_ENCODING,
    header::CONTENT_TYPE,
    header::IF_MATCH,
    header::IF_NONE_MATCH,
    HeaderName::from_static("idempotency-key"),
    HeaderName::from_static("last-event-id"),
    HeaderName::from_static("noctule-webhook"),
    HeaderName::from_static("prefer"),
    HeaderName::from_static("traceparent"),
    HeaderName::from_static("x-request-id"),
];

/// Pages of other origins that may use this service, by their exact origins.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Origins(Vec<HeaderValue>);

impl Origins {
    /// None but these.
    ///
    /// # Panics
    /// Never: an origin is visible ASCII.
    #[must_use]
    pub fn new(origins: &[Origin]) -> Self {
        let value = |origin: &Origin| {
            HeaderValue::from_str(origin.as_str()).expect("an origin is visible ASCII")
        };
        Self(origins.iter().map(value).collect())
    }

    /// The hosts without their ports.
    pub(super) fn hosts(&self) -> impl Iterator<Item = String> {
        self.0.iter().filter_map(|origin| {
            let uri: Uri = origin.to_str().ok()?.parse().ok()?;
            uri.host().map(str::to_owned)
        })
    }

    /// Answers preflights, and lets these pages read answers. Adds nothing when there are no origins.
    pub(super) fn layer(&self) -> Either<CorsLayer, Identity> {
        let layer = CorsLayer::new()
            .allow_origin(AllowOrigin::list(self.0.clone()))
            .allow_methods([Method::GET, Method::POST, Method::PUT, Method::DELETE])
            .allow_headers(ALLOWED)
            .expose_headers(EXPOSED)
            .max_age(PREFLIGHT_AGE);
        option_layer((!self.0.is_empty()).then_some(layer))
    }
}

/// Headers of every answer.
pub(super) fn secure(headers: &mut HeaderMap) {
    headers.insert(
        header::X_CONTENT_TYPE_OPTIONS,
        HeaderValue::from_static("nosniff"),
    );
    headers.insert(
        header::REFERRER_POLICY,
        HeaderValue::from_static("no-referrer"),
    );
    let readers = if headers.contains_key(header::ACCESS_CONTROL_ALLOW_ORIGIN) {
        "cross-origin"
    } else {
        "same-origin"
    };
    headers.insert(
        CROSS_ORIGIN_RESOURCE_POLICY,
        HeaderValue::from_static(readers),
    );
    let drawn = headers
        .get(header::CONTENT_TYPE)
        .is_some_and(|media_type| media_type.as_bytes().starts_with(b"image/svg+xml"));
    headers
        .entry(header::CONTENT_SECURITY_POLICY)
        .or_insert(if drawn { CSP_OF_SVG } else { CSP_OF_DATA });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_keeps_its_own_policy() {
        let mut headers = HeaderMap::new();
        let own = HeaderValue::from_static("default-src 'self'");
        headers.insert(header::CONTENT_SECURITY_POLICY, own.clone());
        secure(&mut headers);
        assert_eq!(headers[header::CONTENT_SECURITY_POLICY], own);
    }
}
