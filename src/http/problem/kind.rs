//! Which status, type and title each error has: the one table.

use axum::http::StatusCode;

use super::Problem;
use crate::job::FailureKind;

/// The type of a problem: status, the last part of `type`, title.
pub(super) type Kind = (StatusCode, &'static str, &'static str);

const NO_GROUND: Kind = (
    StatusCode::CONFLICT,
    "no-ground",
    "The plan's ground is gone",
);

const INVALID_SCENARIO: Kind = (
    StatusCode::UNPROCESSABLE_ENTITY,
    "invalid-scenario",
    "The scenario cannot be planned",
);

const SCENARIO_LOST: Kind = (
    StatusCode::CONFLICT,
    "scenario-lost",
    "The plan's scenario is lost",
);

/// Status and title for the reason of a plan's failure; the same as for a request refused for that reason.
pub(super) fn of_failure(name: &str) -> (StatusCode, &'static str) {
    let (status, _, title) = match FailureKind::named(name) {
        Some(FailureKind::NoGround) => NO_GROUND,
        Some(FailureKind::InvalidScenario) => INVALID_SCENARIO,
        Some(FailureKind::ScenarioLost) => SCENARIO_LOST,
        Some(FailureKind::PlannerPanic | FailureKind::WorkerLost) | None => {
            return (StatusCode::INTERNAL_SERVER_ERROR, "The plan failed");
        }
    };
    (status, title)
}

impl Problem {
    /// The one table from error to status. Slugs are stable; `docs/PROBLEMS.md` has a section for each.
    #[expect(clippy::too_many_lines, reason = "one table")]
    pub(super) fn kind(&self) -> Kind {
        match self {
            Self::Malformed => (
                StatusCode::BAD_REQUEST,
                "malformed-request",
                "The request is not HTTP",
            ),
            Self::HeadTooLarge(_) => (
                StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE,
                "head-too-large",
                "The request's head is too large",
            ),
            Self::InvalidJson { .. } => (
                StatusCode::BAD_REQUEST,
                "invalid-json",
                "The body is not JSON",
            ),
            Self::BodyIncomplete | Self::BodyUnreadable => (
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
            Self::Misdirected(_) => (
                StatusCode::MISDIRECTED_REQUEST,
                "misdirected-request",
                "The request is for another host",
            ),
            Self::Unauthorized(_) => (StatusCode::UNAUTHORIZED, "unauthorized", "A key is needed"),
            Self::Forbidden(_) | Self::TerrainOwned(_) => (
                StatusCode::FORBIDDEN,
                "forbidden",
                "The key may not do this",
            ),
            Self::NoSuchResource(_)
            | Self::NotServedHere(_)
            | Self::NoSuchPlan(_)
            | Self::NoSuchTerrain(_) => (StatusCode::NOT_FOUND, "not-found", "No such resource"),
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
            Self::BodyTooSlow(_) | Self::UploadStalled(_) => (
                StatusCode::REQUEST_TIMEOUT,
                "request-timeout",
                "The body came too slowly",
            ),
            Self::NotReady { .. } => (StatusCode::CONFLICT, "not-ready", "The plan has not ended"),
            Self::NoGeodeticFrame(_) => (
                StatusCode::CONFLICT,
                "no-geodetic-frame",
                "The plan has no degrees",
            ),
            Self::Infeasible(_) => (
                StatusCode::CONFLICT,
                "infeasible",
                "The route breaks constraints",
            ),
            Self::Unflyable(_) => (StatusCode::CONFLICT, "unflyable", "No mission as asked for"),
            Self::InvalidXml(_) => (
                StatusCode::BAD_REQUEST,
                "invalid-xml",
                "The body is not XML",
            ),
            Self::NoScenario { .. } => (
                StatusCode::UNPROCESSABLE_ENTITY,
                "no-scenario",
                "The file holds no scenario",
            ),
            Self::TerrainInUse { .. } => (
                StatusCode::CONFLICT,
                "terrain-in-use",
                "Plans need the dataset",
            ),
            Self::TerrainMounted(_) => (
                StatusCode::CONFLICT,
                "terrain-mounted",
                "The dataset is the operator's",
            ),
            Self::NoGround(_) => NO_GROUND,
            Self::ScenarioLost(_) => SCENARIO_LOST,
            Self::PreconditionFailed(_) => (
                StatusCode::PRECONDITION_FAILED,
                "precondition-failed",
                "The resource is not as expected",
            ),
            Self::InvalidTerrain(_) => (
                StatusCode::UNPROCESSABLE_ENTITY,
                "invalid-terrain",
                "The file cannot be used as terrain",
            ),
            Self::TooManyUploads(_) => (
                StatusCode::SERVICE_UNAVAILABLE,
                "too-many-uploads",
                "Too many uploads",
            ),
            Self::Busy(_) => (
                StatusCode::SERVICE_UNAVAILABLE,
                "busy",
                "The service is busy",
            ),
            Self::NoResult { .. } => (StatusCode::CONFLICT, "no-result", "The plan has no result"),
            Self::IdempotencyInFlight => (
                StatusCode::CONFLICT,
                "idempotency-in-flight",
                "The same request is being accepted",
            ),
            Self::Gone(_) => (StatusCode::GONE, "gone", "The plan was removed"),
            Self::BodyTooLarge(_) | Self::TerrainTooLarge(_) => (
                StatusCode::PAYLOAD_TOO_LARGE,
                "body-too-large",
                "The body is too large",
            ),
            Self::TerrainsFull(_) | Self::TooManyTerrains(_) => (
                StatusCode::PAYLOAD_TOO_LARGE,
                "terrains-full",
                "The datasets have no more room",
            ),
            Self::UnsupportedMediaType { .. } | Self::UnsupportedCoding(_) => (
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "unsupported-media-type",
                "Unsupported media type",
            ),
            Self::InvalidScenario(_) => INVALID_SCENARIO,
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
            Self::UnsupportedTransferCoding(_) => (
                StatusCode::NOT_IMPLEMENTED,
                "unsupported-transfer-coding",
                "Unsupported transfer coding",
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
}
