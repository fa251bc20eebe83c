//! What goes wrong below, as problems.

use super::Problem;
use crate::export::ExportError;
use crate::import::ImportError;
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

impl From<ExportError> for Problem {
    fn from(error: ExportError) -> Self {
        let detail = error.to_string();
        match error {
            ExportError::NoGeodeticFrame { .. } => Self::NoGeodeticFrame(detail),
            ExportError::Infeasible { .. } => Self::Infeasible(detail),
            ExportError::Unflyable(detail) => Self::Unflyable(detail),
            ExportError::Option(fault) => Self::InvalidParameter {
                name: fault.name,
                detail: fault.detail,
            },
            ExportError::Damaged(_) => {
                tracing::error!(%error, "a stored plan cannot be read");
                Self::Internal
            }
        }
    }
}

impl From<ImportError> for Problem {
    fn from(error: ImportError) -> Self {
        match error {
            ImportError::NotJson {
                line,
                column,
                detail,
            } => Self::InvalidJson {
                line,
                column,
                pointer: String::new(),
                detail,
            },
            ImportError::NotXml(detail) => Self::InvalidXml(detail),
            ImportError::NoScenario { detail, unused } => Self::NoScenario { detail, unused },
        }
    }
}
