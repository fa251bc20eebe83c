//! What a request can be refused for: RFC 9457 problem documents.
//!
//! A handler returns a [`Problem`]; its response carries it as an extension, and
//! [`super::request_id`] writes the body, because only there the request's id is known. What only
//! the operator should read goes to the log, not into a document.

mod detail;
mod document;
mod from;
mod kind;

use std::any::Any;
use std::time::Duration;

use axum::body::Body;
use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};

pub(super) use document::FailureDocument;

use super::auth::{Allowance, Scope, TooMany, Unauthorized};
use crate::import::Unused;
use crate::job::{Failure, PlanId, Status};
use crate::scenario::json::Fault;
use crate::store::{Tombstone, Trouble};

/// Everything that a request can be refused for.
#[derive(Debug, Clone)]
pub(super) enum Problem {
    /// What came is no request of HTTP.
    Malformed,
    /// Address and headers are too long, or too many; the limit in bytes.
    HeadTooLarge(usize),
    /// No route has this path.
    NoSuchResource(String),
    /// This node only runs plans, and has no route for the path.
    NotServedHere(String),
    /// There never was such a plan, or nothing with that name can be one.
    NoSuchPlan(String),
    /// No dataset is called so.
    NoSuchTerrain(String),
    /// The file cannot be used as a dataset; why.
    InvalidTerrain(String),
    /// Plans are queued or running over the dataset.
    TerrainInUse {
        /// Its name.
        name: String,
        /// How many.
        plans: u64,
    },
    /// The dataset is a file of the operator's.
    TerrainMounted(String),
    /// The dataset that a plan was made over is not there any more; why.
    NoGround(String),
    /// A plan or a dataset is not what the request expects; which.
    PreconditionFailed(String),
    /// A dataset is too long; the limit in bytes.
    TerrainTooLarge(u64),
    /// A dataset came too slowly; how long it may pause.
    UploadStalled(Duration),
    /// As many datasets are coming in as may.
    TooManyUploads(usize),
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
    UnsupportedMediaType {
        /// What it is said to be.
        found: Option<String>,
        /// What it may be.
        allowed: &'static str,
    },
    /// The body is compressed or otherwise coded; how.
    UnsupportedCoding(String),
    /// The body is too long; the limit in bytes.
    BodyTooLarge(usize),
    /// The body came too slowly; the limit.
    BodyTooSlow(Duration),
    /// The body broke off.
    BodyIncomplete,
    /// The chunks that the body comes in cannot be read.
    BodyUnreadable,
    /// The body's transfer is coded in a way that is not read here; how.
    UnsupportedTransferCoding(String),
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
    /// The request is for another host; which.
    Misdirected(String),
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
    /// The format needs degrees, the plan has metres; what would help.
    NoGeodeticFrame(String),
    /// The format is for flying, the route breaks constraints; what would help.
    Infeasible(String),
    /// No mission can be made as the options ask; why.
    Unflyable(String),
    /// The body is not XML that is read here; what the reader met.
    InvalidXml(String),
    /// The body is well-formed and holds no scenario.
    NoScenario {
        /// Why.
        detail: String,
        /// What it holds instead.
        unused: Vec<Unused>,
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
        /// How many it may have.
        quota: u64,
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
    /// Another request with the same idempotency key has not been accepted yet.
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

impl Problem {
    fn retry_after_s(&self) -> Option<u64> {
        match self {
            Self::NotReady { retry_after_s, .. }
            | Self::QueueFull { retry_after_s, .. }
            | Self::QuotaReached { retry_after_s, .. }
            | Self::RateLimited { retry_after_s }
            | Self::Draining { retry_after_s } => Some(*retry_after_s),
            Self::StoreUnavailable(_) | Self::IdempotencyInFlight => Some(1),
            Self::TooManyStreams(_) | Self::TooManyUploads(_) => Some(5),
            _ => None,
        }
    }

    /// What is left of the limit that the caller has met; the gate writes down that of a rate, which is told
    /// with every answer.
    fn allowance(&self) -> Option<Allowance> {
        match self {
            Self::QuotaReached { quota, .. } => Some(Allowance::none_left("plans", *quota)),
            Self::TooManyStreams(TooMany { limit, most }) => {
                Some(Allowance::none_left(limit, *most as u64))
            }
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
        if let Some(allowance) = self.allowance() {
            allowance.write(response.headers_mut());
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

/// Answers for a handler that panicked; the panic hook has written the log.
pub(super) fn after_panic(_: Box<dyn Any + Send>) -> axum::http::Response<Body> {
    Problem::Internal.into_response()
}
