//! A request's id: taken from the caller or generated; it appears in the log's span, on the answer and in its problem
//! document.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::{MatchedPath, Request};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, header};
use axum::response::{IntoResponse as _, Response};
use futures_util::FutureExt as _;
use tracing::{Instrument, Level, Span};
use uuid::Uuid;

use super::layer::{Answering, Around, Next};
use super::problem::Problem;
use super::{auth, browser};
use crate::telemetry::traceparent::{self, TraceParent};
use crate::telemetry::{Instruments, spans};

const X_REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Longest id taken from a caller.
const MAX_LENGTH: usize = 128;

/// The outermost layer: every answer passes through here.
#[derive(Clone)]
pub(super) struct Assign(pub(super) Arc<Instruments>);

impl Around for Assign {
    fn answer<S: Next>(&self, mut request: Request, next: &mut S) -> Answering {
        let begun = Instant::now();
        let id = of_caller(request.headers()).unwrap_or_else(|| Uuid::now_v7().to_string());
        let method = request.method().clone();
        let path = tracing::enabled!(Level::DEBUG)
            .then(|| printable(request.uri().path()).to_owned())
            .unwrap_or_default();
        let route = request.extensions().get::<MatchedPath>().cloned();
        let caller = traceparent_of(request.headers());
        let (span, origin) = spans::of_request(id.clone(), caller);
        request.extensions_mut().insert(origin);
        let answering = span.in_scope(|| next.run(request));
        let instruments = Arc::clone(&self.0);
        let answered = answering.map(move |mut answer| {
            if let Some(problem) = answer.extensions_mut().remove::<Problem>() {
                write_problem(&mut answer, &problem, &id, &method);
            }
            dress(answer.headers_mut(), &id);
            let took = begun.elapsed();
            let route = route.as_ref().map(MatchedPath::as_str);
            let status = answer.status().as_u16();
            instruments
                .metrics
                .answered(method.as_str(), route, status, took);
            spans::answered(&Span::current(), method.as_str(), route, status);
            let duration_ms = took.as_secs_f64() * 1e3;
            tracing::debug!(%method, path, status, duration_ms, "answered");
            Ok(answer)
        });
        Box::pin(answered.instrument(span))
    }
}

/// The path in a form safe to log.
fn printable(path: &str) -> &str {
    if auth::holds_a_key(path) {
        "(with a key in it)"
    } else {
        path
    }
}

/// The caller's own id, if it is safe in a log line and in a URI reference.
fn of_caller(headers: &HeaderMap) -> Option<String> {
    let id = headers.get(X_REQUEST_ID)?.to_str().ok()?;
    let sane = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~=;+/@,".contains(&byte);
    let is_safe =
        (1..=MAX_LENGTH).contains(&id.len()) && id.bytes().all(sane) && !auth::holds_a_key(id);
    is_safe.then(|| id.to_owned())
}

/// A header that cannot be read counts as absent.
fn traceparent_of(headers: &HeaderMap) -> Option<TraceParent> {
    headers
        .get(traceparent::HEADER)?
        .to_str()
        .ok()?
        .parse()
        .ok()
}

/// The whole answer where no request could be read.
pub(super) fn refuse(problem: Problem, instruments: &Instruments) -> Response<String> {
    let id = Uuid::now_v7().to_string();
    let body = problem.document(&id);
    let (mut head, _) = problem.into_response().into_parts();
    describe(&mut head.headers, &body);
    dress(&mut head.headers, &id);
    let status = head.status.as_u16();
    let metrics = &instruments.metrics;
    metrics.answered("", None, status, Duration::ZERO);
    tracing::debug!(request_id = id, status, "no request could be read");
    Response::from_parts(head, body)
}

fn write_problem(response: &mut Response, problem: &Problem, id: &str, method: &Method) {
    let body = problem.document(id);
    describe(response.headers_mut(), &body);
    *response.body_mut() = if method == Method::HEAD {
        Body::empty()
    } else {
        Body::from(body)
    };
}

/// Headers of a problem document.
fn describe(headers: &mut HeaderMap, document: &str) {
    let media_type = HeaderValue::from_static("application/problem+json");
    headers.insert(header::CONTENT_TYPE, media_type);
    headers.insert(header::CONTENT_LENGTH, HeaderValue::from(document.len()));
}

/// Headers of every answer.
fn dress(headers: &mut HeaderMap, id: &str) {
    let id = HeaderValue::from_str(id).expect("an id is visible ASCII");
    headers.insert(X_REQUEST_ID, id);
    browser::secure(headers);
    headers
        .entry(header::CACHE_CONTROL)
        .or_insert(HeaderValue::from_static("no-store"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_safe_request_ids_are_accepted() {
        let long = "x".repeat(129);
        for (given, taken) in [
            ("a", true),
            ("Root=1-67891233-abcdef012345678912345678", true),
            ("7f1c9f6e-0b2b-7c3d-8e4f-001122334455", true),
            ("", false),
            ("two words", false),
            ("<script>", false),
            ("caf\u{e9}", false),
            (long.as_str(), false),
        ] {
            let mut headers = HeaderMap::new();
            headers.insert(
                X_REQUEST_ID,
                HeaderValue::from_bytes(given.as_bytes()).expect("a header"),
            );
            assert_eq!(
                of_caller(&headers).as_deref(),
                taken.then_some(given),
                "{given:?}"
            );
        }
    }
}
