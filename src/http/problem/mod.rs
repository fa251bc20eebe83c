//! The reasons for refusing a request: RFC 9457 problem documents.
//!
//! A handler returns a [`Problem`]; its response carries it as an extension, and [`super::request_id`] writes the body,
//! because only there is the request's id known. Details for the operator only go to the log, not into a document.

mod detail;
mod document;
mod from;
mod kind;

use std::any::Any;
use std::time::Duration;

use axum::body::Body;
use axum::http::{HeaderValue, Uri, header};
use axum::response::{IntoResponse, Response};

pub(super) use document::FailureDocument;

use super::auth::{Allowance, Scope, TooMany, Unauthorized};
use super::shown::Shown;
use crate::import::Unused;
use crate::job::{Failure, PlanId, Status};
use crate::scenario::json::Fault;
use crate::store::{Tombstone, Trouble};

/// When to ask again for a place among streams, uploads or others' work, seconds: how long others take is not known.
const A_PLACE_S: u64 = 5;

/// Everything for which a request can be refused.
#[derive(Debug, Clone)]
pub(super) enum Problem {
    /// The input is not an HTTP request.
    Malformed,
    /// Address and headers are too long, or too many; the limit in bytes.
    HeadTooLarge(usize),
    /// No route has this path.
    NoSuchResource(Shown),
    /// This node only runs plans, and has no route for the path.
    NotServedHere(Shown),
    /// There never was such a plan, or the id is malformed.
    NoSuchPlan(Shown),
    /// No dataset has this name.
    NoSuchTerrain(Shown),
    /// The file cannot be used as a dataset; why.
    InvalidTerrain(String),
    /// Plans are queued or running over the dataset.
    TerrainInUse {
        /// Its name.
        name: String,
        /// How many.
        plans: u64,
    },
    /// The dataset is one of the operator's files.
    TerrainMounted(String),
    /// The dataset was not uploaded by the caller, who may not change those of others.
    TerrainOwned(String),
    /// The dataset that a plan was made over no longer exists; why.
    NoGround(String),
    /// The store no longer has the scenario of this plan.
    ScenarioLost(PlanId),
    /// A plan or a dataset is not what the request expects; which.
    PreconditionFailed(String),
    /// A dataset is too long; the limit in bytes.
    TerrainTooLarge(u64),
    /// All datasets together would be too long; the limit in bytes.
    TerrainsFull(u64),
    /// There are as many uploaded datasets as there may be.
    TooManyTerrains(usize),
    /// A dataset came too slowly; how long it may pause.
    UploadStalled(Duration),
    /// The maximum number of datasets is being uploaded.
    TooManyUploads(usize),
    /// The service does as much as it may at once; of what.
    Busy(Busy),
    /// The plan was removed.
    Gone(Tombstone),
    /// The path exists, the method does not; axum adds `Allow`.
    MethodNotAllowed,
    /// The caller accepts none of the available formats.
    NotAcceptable {
        /// What the caller accepts.
        asked: Shown,
        /// What is available.
        available: Vec<&'static str>,
    },
    /// The body has a wrong media type, or none.
    UnsupportedMediaType {
        /// The declared media type.
        found: Option<Shown>,
        /// The allowed one.
        allowed: &'static str,
    },
    /// The body is compressed or otherwise coded; how.
    UnsupportedCoding(Shown),
    /// The body is too long; the limit in bytes.
    BodyTooLarge(usize),
    /// The body came too slowly; the limit.
    BodyTooSlow(Duration),
    /// The body was cut short.
    BodyIncomplete,
    /// The body's chunked coding is malformed.
    BodyUnreadable,
    /// The body has an unsupported transfer coding; which.
    UnsupportedTransferCoding(Shown),
    /// The body is declared as gzip and is not; the reader's error.
    BodyNotGzip(String),
    /// The body is not JSON.
    InvalidJson {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// As far as the reader got.
        pointer: String,
        /// The reader's error.
        detail: String,
    },
    /// A query parameter or a header cannot be read.
    InvalidParameter {
        /// Its name.
        name: String,
        /// The value and what is allowed.
        detail: String,
    },
    /// The address contains a key.
    KeyInUrl,
    /// The request is for another host; which.
    Misdirected(Shown),
    /// The caller has sent nothing that grants access.
    Unauthorized(Unauthorized),
    /// The caller's key lacks this scope.
    Forbidden(Scope),
    /// The body is JSON, but not a scenario that can be planned.
    InvalidScenario(Vec<Fault>),
    /// The plan has not ended yet.
    NotReady {
        /// Which one.
        id: PlanId,
        /// Its present status.
        status: Status,
        /// Whether its best route so far would have done.
        partial: bool,
        /// When asking again makes sense, seconds.
        retry_after_s: u64,
    },
    /// The plan ended without a result.
    NoResult {
        /// Which one.
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
    /// No mission can be made with the requested options; why.
    Unflyable(String),
    /// The body is not XML that can be read; the reader's error.
    InvalidXml(String),
    /// The body is well-formed and holds no scenario.
    NoScenario {
        /// Why.
        detail: String,
        /// What it contains instead.
        unused: Vec<Unused>,
    },
    /// The maximum number of plans is waiting.
    QueueFull {
        /// Number of waiting plans.
        queued: u64,
        /// See [`super::retry`].
        retry_after_s: u64,
    },
    /// The caller has the maximum number of active plans.
    QuotaReached {
        /// Number of active plans.
        active: u64,
        /// Maximum number.
        quota: u64,
        /// See [`super::retry`].
        retry_after_s: u64,
    },
    /// The caller asks faster than their key may.
    RateLimited {
        /// Seconds until the key may be used again.
        retry_after_s: u64,
    },
    /// The maximum number of event streams is open.
    TooManyStreams(TooMany),
    /// The idempotency key was used before with another body.
    IdempotencyKeyReused,
    /// Another request with the same idempotency key has not been accepted yet.
    IdempotencyInFlight,
    /// The service is about to stop.
    Draining {
        /// See [`super::retry`].
        retry_after_s: u64,
    },
    /// The store cannot be read or written now; `None` when another process is using it.
    StoreUnavailable(Option<Trouble>),
    /// A defect of the service.
    Internal,
}

/// What there is too much of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Busy {
    /// Work for the processor's cores.
    Cores,
    /// Requests that need datasets.
    Datasets,
    /// Bodies that are being received or read; all may take this many bytes.
    Bodies(usize),
    /// Answers that are being made or have not been sent yet; all may take this many bytes.
    Answers(usize),
}

impl Problem {
    /// Nothing has the path of this address.
    pub(super) fn no_such_resource(uri: &Uri) -> Self {
        Self::NoSuchResource(Shown::of(uri.path()))
    }

    /// This node serves nothing at the path of this address.
    pub(super) fn not_served_here(uri: &Uri) -> Self {
        Self::NotServedHere(Shown::of(uri.path()))
    }

    /// There is no plan of this id.
    pub(super) fn no_such_plan(id: PlanId) -> Self {
        Self::NoSuchPlan(Shown::of(&id.to_string()))
    }

    fn retry_after_s(&self) -> Option<u64> {
        match self {
            Self::NotReady { retry_after_s, .. }
            | Self::QueueFull { retry_after_s, .. }
            | Self::QuotaReached { retry_after_s, .. }
            | Self::RateLimited { retry_after_s }
            | Self::Draining { retry_after_s } => Some(*retry_after_s),
            Self::StoreUnavailable(_) | Self::IdempotencyInFlight => Some(1),
            Self::TooManyStreams(_) | Self::TooManyUploads(_) | Self::Busy(_) => Some(A_PLACE_S),
            _ => None,
        }
    }

    /// What is left of the limit that the caller has reached; the gate writes that of a rate, which is sent with every
    /// answer.
    fn allowance(&self) -> Option<Allowance> {
        match self {
            Self::QuotaReached { quota, .. } => Some(Allowance::none_left("plans", *quota)),
            Self::TooManyStreams(TooMany { limit, most }) => {
                Some(Allowance::none_left(limit, *most as u64))
            }
            _ => None,
        }
    }

    /// What would give the caller access, RFC 6750 section 3.
    fn challenge(&self) -> Option<HeaderValue> {
        match self {
            Self::Unauthorized(Unauthorized::Nothing) => {
                Some(HeaderValue::from_static("Bearer realm=\"noctule\""))
            }
            Self::Unauthorized(_) => Some(HeaderValue::from_static(
                "Bearer realm=\"noctule\", error=\"invalid_token\"",
            )),
            _ => {
                let scope = self.scope()?.name();
                let text = format!(
                    "Bearer realm=\"noctule\", error=\"insufficient_scope\", scope=\"{scope}\""
                );
                Some(HeaderValue::from_str(&text).expect("names are visible ASCII"))
            }
        }
    }

    /// The scope that the caller's key would need.
    fn scope(&self) -> Option<Scope> {
        match self {
            Self::Forbidden(scope) => Some(*scope),
            Self::TerrainOwned(_) => Some(Scope::Admin),
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

/// Answers for a handler that panicked; the panic hook has logged it.
pub(super) fn after_panic(_: Box<dyn Any + Send>) -> axum::http::Response<Body> {
    Problem::Internal.into_response()
}
