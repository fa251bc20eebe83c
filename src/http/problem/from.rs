//! What goes wrong below, as problems.

use super::Problem;
use crate::scenario::json::Refusal;
use crate::store::StoreError;

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
