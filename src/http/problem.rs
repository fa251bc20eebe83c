//! Which status for which error: RFC 9457 problem documents.
//!
//! A handler returns a [`Problem`]; its response carries it as an extension, and
//! [`super::request_id`] writes the body, because only there the request's id is known. What only
//! the operator should read goes to the log, not into a document.

use std::any::Any;
use std::time::Duration;

use axum::body::Body;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::{Value, json};

use super::auth::{Scope, TooMany, Unauthorized};
use crate::job::{Failure, PlanId, Status};
use crate::scenario::json::{Fault, Refusal};
use crate::store::{StoreError, Tombstone, Trouble};

/// Everything that a request can be refused for.
#[derive(Debug, Clone)]
pub(super) enum Problem {
    /// No route has this path.
    NoSuchResource(String),
    /// There never was such a plan, or nothing with that name can be one.
    NoSuchPlan(String),
    /// The plan was removed.
    Gone(Tombstone),
    /// The path exists, the method does not; axum adds `Allow`.
    MethodNotAllowed,
    /// None of the formats the caller accepts is there.
    NotAcceptable {
        /// What the caller named.
        asked: String,
        /// What there is.
        available: Vec<&'static str>,
    },
    /// The body is of another kind, or of an unnamed one.
    UnsupportedMediaType(Option<String>),
    /// The body is compressed or otherwise coded; how.
    UnsupportedCoding(String),
    /// The body is too long; the limit in bytes.
    BodyTooLarge(usize),
    /// The body came too slowly; the limit.
    BodyTooSlow(Duration),
    /// The body broke off.
    BodyIncomplete,
    /// The body is said to be gzip and is not; what the reader met.
    BodyNotGzip(String),
    /// The body is not JSON.
    InvalidJson {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// As far as the reader got.
        pointer: String,
        /// What the reader met.
        detail: String,
    },
    /// A query parameter or a header cannot be read.
    InvalidParameter {
        /// Its name.
        name: String,
        /// The value and what is allowed.
        detail: String,
    },
    /// A key stands in the address.
    KeyInUrl,
    /// The caller has shown nothing that lets them in.
    Unauthorized(Unauthorized),
    /// The caller's key has not this scope.
    Forbidden(Scope),
    /// The body is JSON, but not a scenario that can be planned.
    InvalidScenario(Vec<Fault>),
    /// The plan has not ended yet.
    NotReady {
        /// Which.
        id: PlanId,
        /// Where it stands.
        status: Status,
        /// When asking again makes sense, seconds.
        retry_after_s: u64,
    },
    /// The plan ended without a result.
    NoResult {
        /// Which.
        id: PlanId,
        /// How it ended.
        status: Status,
        /// Why, when it failed.
        failure: Option<Failure>,
    },
    /// As many plans wait as may.
    QueueFull {
        /// How many.
        queued: u64,
        /// See [`super::retry`].
        retry_after_s: u64,
    },
    /// The caller has as many active plans as it may.
    QuotaReached {
        /// How many.
        active: u64,
        /// See [`super::retry`].
        retry_after_s: u64,
    },
    /// The caller asks faster than their key may.
    RateLimited {
        /// Until the key may ask again.
        retry_after_s: u64,
    },
    /// As many event streams are open as may be.
    TooManyStreams(TooMany),
    /// The idempotency key came with another body before.
    IdempotencyKeyReused,
    /// Another request with the same idempotency key is being answered.
    IdempotencyInFlight,
    /// The service is about to end.
    Draining {
        /// See [`super::retry`].
        retry_after_s: u64,
    },
    /// The store cannot be read or written now; `None` when another process has it.
    StoreUnavailable(Option<Trouble>),
    /// A defect of the service.
    Internal,
}

/// What a kind of problem is called: status, the last part of `type`, title.
type Kind = (StatusCode, &'static str, &'static str);

impl Problem {
    /// The one table from error to status. Slugs are stable; `docs/PROBLEMS.md` has a section for each.
    #[expect(clippy::too_many_lines, reason = "one table")]
    fn kind(&self) -> Kind {
        match self {
            Self::InvalidJson { .. } => (
                StatusCode::BAD_REQUEST,
                "invalid-json",
                "The body is not JSON",
            ),
            Self::BodyIncomplete => (
                StatusCode::BAD_REQUEST,
                "incomplete-body",
                "The body broke off",
            ),
            Self::BodyNotGzip(_) => (
                StatusCode::BAD_REQUEST,
                "invalid-gzip",
                "The body is not gzip",
            ),
            Self::InvalidParameter { .. } => (
                StatusCode::BAD_REQUEST,
                "invalid-parameter",
                "Invalid parameter",
            ),
            Self::KeyInUrl => (
                StatusCode::BAD_REQUEST,
                "key-in-url",
                "Keys do not belong in URLs",
            ),
            Self::Unauthorized(_) => (StatusCode::UNAUTHORIZED, "unauthorized", "A key is needed"),
            Self::Forbidden(_) => (
                StatusCode::FORBIDDEN,
                "forbidden",
                "The key may not do this",
            ),
            Self::NoSuchResource(_) | Self::NoSuchPlan(_) => {
                (StatusCode::NOT_FOUND, "not-found", "No such resource")
            }
            Self::MethodNotAllowed => (
                StatusCode::METHOD_NOT_ALLOWED,
                "method-not-allowed",
                "Method not allowed",
            ),
            Self::NotAcceptable { .. } => (
                StatusCode::NOT_ACCEPTABLE,
                "not-acceptable",
                "No acceptable format",
            ),
            Self::BodyTooSlow(_) => (
                StatusCode::REQUEST_TIMEOUT,
                "request-timeout",
                "The body came too slowly",
            ),
            Self::NotReady { .. } => (StatusCode::CONFLICT, "not-ready", "The plan has not ended"),
            Self::NoResult { .. } => (StatusCode::CONFLICT, "no-result", "The plan has no result"),
            Self::IdempotencyInFlight => (
                StatusCode::CONFLICT,
                "idempotency-in-flight",
                "The same request is being answered",
            ),
            Self::Gone(_) => (StatusCode::GONE, "gone", "The plan was removed"),
            Self::BodyTooLarge(_) => (
                StatusCode::PAYLOAD_TOO_LARGE,
                "body-too-large",
                "The body is too large",
            ),
            Self::UnsupportedMediaType(_) | Self::UnsupportedCoding(_) => (
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "unsupported-media-type",
                "Unsupported media type",
            ),
            Self::InvalidScenario(_) => (
                StatusCode::UNPROCESSABLE_ENTITY,
                "invalid-scenario",
                "The scenario cannot be planned",
            ),
            Self::IdempotencyKeyReused => (
                StatusCode::UNPROCESSABLE_ENTITY,
                "idempotency-key-reused",
                "The idempotency key was used before",
            ),
            Self::QuotaReached { .. } => (
                StatusCode::TOO_MANY_REQUESTS,
                "quota-reached",
                "The quota of active plans is reached",
            ),
            Self::RateLimited { .. } => (
                StatusCode::TOO_MANY_REQUESTS,
                "rate-limited",
                "Too many requests",
            ),
            Self::TooManyStreams(_) => (
                StatusCode::TOO_MANY_REQUESTS,
                "too-many-streams",
                "Too many event streams",
            ),
            Self::Internal => (
                StatusCode::INTERNAL_SERVER_ERROR,
                "internal",
                "Internal error",
            ),
            Self::Draining { .. } => (
                StatusCode::SERVICE_UNAVAILABLE,
                "draining",
                "The service is shutting down",
            ),
            Self::QueueFull { .. } => (
                StatusCode::SERVICE_UNAVAILABLE,
                "queue-full",
                "The queue is full",
            ),
            Self::StoreUnavailable(_) => (
                StatusCode::SERVICE_UNAVAILABLE,
                "store-unavailable",
                "The store is unavailable",
            ),
        }
    }

    /// For people: what happened this time, and what would help.
    #[expect(clippy::too_many_lines, reason = "one table")]
    fn detail(&self) -> String {
        match self {
            Self::InvalidJson {
                line,
                column,
                pointer,
                detail,
            } if pointer.is_empty() => {
                format!("line {line}, column {column}: {detail}")
            }
            Self::InvalidJson {
                line,
                column,
                pointer,
                detail,
            } => {
                format!("line {line}, column {column}, at {pointer}: {detail}")
            }
            Self::BodyIncomplete => "the connection ended before the body did".to_owned(),
            Self::BodyNotGzip(detail) => format!("content-encoding is gzip, but: {detail}"),
            Self::InvalidParameter { detail, .. } => detail.clone(),
            Self::KeyInUrl => {
                "URLs are written down on their way: send the key as Authorization: Bearer, and replace this one".to_owned()
            }
            Self::Unauthorized(why) => why.detail().to_owned(),
            Self::Forbidden(scope) => format!("the key has not the scope {}", scope.name()),
            Self::RateLimited { retry_after_s } => {
                format!("the key has asked more often than it may; try again in {retry_after_s} s")
            }
            Self::TooManyStreams(TooMany { limit, most }) => {
                format!("{most} event streams are open, the limit {limit} of GET /limits; close one, or wait")
            }
            Self::NoSuchResource(path) => {
                format!("nothing is at {path}; GET /docs lists what is")
            }
            Self::NoSuchPlan(id) => format!("there is no plan {id}"),
            Self::MethodNotAllowed => {
                "the header Allow lists the methods of this resource".to_owned()
            }
            Self::NotAcceptable { asked, available } => {
                format!("asked for {asked}; available: {}", available.join(", "))
            }
            Self::BodyTooSlow(limit) => {
                format!("the body was not complete after {} s", limit.as_secs_f64())
            }
            Self::NotReady { id, status, .. } => format!(
                "plan {id} is {}; GET /plans/{id} with Prefer: wait=30 waits for it",
                status.name()
            ),
            Self::NoResult {
                id,
                failure: Some(failure),
                ..
            } => format!("plan {id} failed: {}", failure.detail),
            Self::NoResult {
                id,
                status,
                failure: None,
            } => {
                format!("plan {id} was {} before it had a route", status.name())
            }
            Self::Gone(Tombstone { id, expired, .. }) if *expired => {
                format!("plan {id} was kept as long as the service keeps plans, and removed")
            }
            Self::Gone(Tombstone { id, .. }) => format!("plan {id} was deleted"),
            Self::IdempotencyInFlight => {
                "a request with this Idempotency-Key has not been answered yet; try again for its answer".to_owned()
            }
            Self::IdempotencyKeyReused => {
                "a request with this Idempotency-Key had another body; take a new key for a new request".to_owned()
            }
            Self::QuotaReached { active, retry_after_s } => {
                format!("{active} plans of this key are queued or running, its quota; try again in {retry_after_s} s")
            }
            Self::BodyTooLarge(limit) => {
                format!(
                    "the body is longer than {limit} bytes, the limit body_bytes of GET /limits"
                )
            }
            Self::UnsupportedMediaType(found) => unsupported_media_type(found.as_deref()),
            Self::UnsupportedCoding(found) => {
                format!("content-encoding is {found}; send the body as it is, or as gzip")
            }
            Self::InvalidScenario(faults) if faults.len() == 1 => "1 fault; see errors".to_owned(),
            Self::InvalidScenario(faults) => format!("{} faults; see errors", faults.len()),
            Self::Internal => {
                "a defect of the service; its log has more under this request's id".to_owned()
            }
            Self::Draining { retry_after_s } => {
                format!("no new plans are taken; try again in {retry_after_s} s")
            }
            Self::QueueFull {
                queued,
                retry_after_s,
            } => {
                format!("{queued} plans wait, the limit; try again in {retry_after_s} s")
            }
            Self::StoreUnavailable(trouble) => {
                let why = match trouble {
                    Some(Trouble::Full) => "the disk of the store is full",
                    Some(Trouble::ReadOnly) => "the data directory cannot be written",
                    Some(Trouble::Damaged) => "the store's file is damaged",
                    Some(Trouble::Newer) => "the store was written by a newer version",
                    Some(Trouble::Other) => "the store does not answer",
                    None => "another process uses the data directory",
                };
                format!("{why}; plans are taken again when that is mended, the service's log says more")
            }
        }
    }

    fn retry_after_s(&self) -> Option<u64> {
        match self {
            Self::NotReady { retry_after_s, .. }
            | Self::QueueFull { retry_after_s, .. }
            | Self::QuotaReached { retry_after_s, .. }
            | Self::RateLimited { retry_after_s }
            | Self::Draining { retry_after_s } => Some(*retry_after_s),
            Self::StoreUnavailable(_) | Self::IdempotencyInFlight => Some(1),
            Self::TooManyStreams(_) => Some(5),
            _ => None,
        }
    }

    /// What would let the caller in, RFC 6750 section 3.
    fn challenge(&self) -> Option<HeaderValue> {
        match self {
            Self::Unauthorized(Unauthorized::Nothing) => {
                Some(HeaderValue::from_static("Bearer realm=\"noctule\""))
            }
            Self::Unauthorized(_) => Some(HeaderValue::from_static(
                "Bearer realm=\"noctule\", error=\"invalid_token\"",
            )),
            Self::Forbidden(scope) => {
                let scope = scope.name();
                let text = format!(
                    "Bearer realm=\"noctule\", error=\"insufficient_scope\", scope=\"{scope}\""
                );
                Some(HeaderValue::from_str(&text).expect("names are visible ASCII"))
            }
            _ => None,
        }
    }

    /// The problem document; `instance` is the request's id.
    pub(super) fn document(&self, instance: &str) -> String {
        let (status, slug, title) = self.kind();
        let document = Document {
            r#type: format!("/problems/{slug}"),
            title,
            status: status.as_u16(),
            detail: self.detail(),
            instance,
            more: self.more(),
        };
        serde_json::to_string(&document).expect("every map key is a string")
    }

    /// The members that only this kind of problem has.
    fn more(&self) -> Value {
        match self {
            Self::InvalidScenario(faults) => {
                json!({"errors": faults.iter().map(error).collect::<Vec<_>>()})
            }
            Self::InvalidJson {
                line,
                column,
                pointer,
                ..
            } => {
                json!({"line": line, "column": column, "pointer": pointer})
            }
            Self::InvalidParameter { name, .. } => json!({"parameter": name}),
            Self::NotAcceptable { available, .. } => json!({"available": available}),
            Self::Forbidden(scope) => json!({"scope": scope.name()}),
            Self::TooManyStreams(TooMany { limit, .. }) => json!({"limit": limit}),
            _ => json!({}),
        }
    }
}

/// A problem document, in the order in which people read it.
#[derive(Serialize)]
struct Document<'a> {
    r#type: String,
    title: &'static str,
    status: u16,
    detail: String,
    instance: &'a str,
    #[serde(flatten)]
    more: Value,
}

fn error(fault: &Fault) -> Value {
    json!({"pointer": fault.pointer, "code": fault.code, "detail": fault.detail})
}

fn unsupported_media_type(found: Option<&str>) -> String {
    match found {
        None => "no content-type was sent; send application/json".to_owned(),
        Some(found) if found.starts_with("application/x-www-form-urlencoded") => format!(
            "content-type is {found}, which curl -d sends by itself; add -H 'content-type: application/json'"
        ),
        Some(found) => format!("content-type is {found}; send application/json in UTF-8"),
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let (status, ..) = self.kind();
        let mut response = status.into_response();
        if let Some(seconds) = self.retry_after_s() {
            response
                .headers_mut()
                .insert(header::RETRY_AFTER, HeaderValue::from(seconds));
        }
        if let Some(challenge) = self.challenge() {
            response
                .headers_mut()
                .insert(header::WWW_AUTHENTICATE, challenge);
        }
        if matches!(self, Self::UnsupportedCoding(_)) {
            response.headers_mut().insert(
                header::ACCEPT_ENCODING,
                HeaderValue::from_static("gzip, identity"),
            );
        }
        response.extensions_mut().insert(self);
        response
    }
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::NotFound(id) => Self::NoSuchPlan(id.to_string()),
            StoreError::Gone(tombstone) => Self::Gone(tombstone),
            StoreError::KeyReused => Self::IdempotencyKeyReused,
            StoreError::QuotaReached { active } => Self::QuotaReached {
                active,
                retry_after_s: 1,
            },
            StoreError::QueueFull { queued } => Self::QueueFull {
                queued,
                retry_after_s: 1,
            },
            error @ (StoreError::Unavailable { .. } | StoreError::InUse(_)) => {
                tracing::error!(%error, "the store did not answer");
                Self::StoreUnavailable(match error {
                    StoreError::Unavailable { trouble, .. } => Some(trouble),
                    _ => None,
                })
            }
            error @ StoreError::LeaseLost(_) => {
                tracing::error!(%error, "a handler met an error that only workers meet");
                Self::Internal
            }
        }
    }
}

impl From<Refusal> for Problem {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Syntax {
                line,
                column,
                pointer,
                detail,
            } => Self::InvalidJson {
                line,
                column,
                pointer,
                detail,
            },
            Refusal::Invalid(faults) => Self::InvalidScenario(faults),
        }
    }
}

/// What stands in a status document for a failed plan: a problem without an instance.
#[derive(Debug, Serialize)]
pub(super) struct FailureDocument {
    r#type: String,
    title: &'static str,
    status: u16,
    detail: String,
}

impl From<Failure> for FailureDocument {
    fn from(failure: Failure) -> Self {
        Self {
            r#type: format!("/problems/{}", failure.kind),
            title: "The plan failed",
            status: StatusCode::INTERNAL_SERVER_ERROR.as_u16(),
            detail: failure.detail,
        }
    }
}

/// Answers for a handler that panicked; the panic hook has written the log.
pub(super) fn after_panic(_: Box<dyn Any + Send>) -> axum::http::Response<Body> {
    Problem::Internal.into_response()
}
