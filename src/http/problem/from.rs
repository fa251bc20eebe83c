//! Converts errors from lower layers into problems.

use std::io::ErrorKind;

use super::Problem;
use crate::catalogue::CatalogueError;
use crate::export::ExportError;
use crate::http::shown::Shown;
use crate::import::ImportError;
use crate::scenario::json::{Refusal, Unread};
use crate::store::{StoreError, Trouble};

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::NotFound(id) => Self::no_such_plan(id),
            StoreError::Gone(tombstone) => Self::Gone(tombstone),
            StoreError::Changed(plan) => Self::PreconditionFailed(format!(
                "plan {} has changed since its entity tag was compared",
                plan.id
            )),
            StoreError::KeyReused => Self::IdempotencyKeyReused,
            StoreError::KeyInFlight => Self::IdempotencyInFlight,
            StoreError::QuotaReached { active, quota } => Self::QuotaReached {
                active,
                quota,
                retry_after_s: 1,
            },
            StoreError::QueueFull { queued } => Self::QueueFull {
                queued,
                retry_after_s: 1,
            },
            StoreError::ScenarioLost(id) => {
                tracing::error!(plan_id = %id, "the store has lost the scenario of a plan");
                Self::ScenarioLost(id)
            }
            error @ (StoreError::Unavailable { .. } | StoreError::InUse(_)) => {
                tracing::error!(%error, "the store did not answer");
                Self::store_unavailable(&error)
            }
            error @ StoreError::LeaseLost(_) => {
                tracing::error!(%error, "a handler met an error that only workers meet");
                Self::Internal
            }
        }
    }
}

impl Problem {
    /// For a store that does not answer, which has been logged already.
    pub(in crate::http) fn store_unavailable(error: &StoreError) -> Self {
        Self::StoreUnavailable(match error {
            StoreError::Unavailable { trouble, .. } => Some(*trouble),
            _ => None,
        })
    }
}

impl From<Refusal> for Problem {
    fn from(refusal: Refusal) -> Self {
        if let Some(fault) = refusal.unreachable_ground() {
            return Self::unreachable_datasets(&fault.detail);
        }
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

impl Problem {
    /// For a stored plan that cannot be read, of which its caller need not know more.
    fn damaged(error: &str) -> Self {
        tracing::error!(error, "a stored plan cannot be read");
        Self::Internal
    }
}

impl From<Unread> for Problem {
    fn from(unread: Unread) -> Self {
        match unread {
            Unread::Unreachable(error) => Self::unreachable_datasets(&error),
            Unread::NoGround(_) => Self::NoGround(unread.to_string()),
            Unread::Damaged(_) => Self::damaged(&unread.to_string()),
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
            ExportError::Unread(unread) => unread.into(),
            ExportError::Damaged(_) => Self::damaged(&detail),
        }
    }
}

impl Problem {
    /// The caller is not to blame.
    pub(in crate::http) fn unreachable_datasets(error: &str) -> Self {
        tracing::error!(error, "the datasets cannot be reached");
        Self::StoreUnavailable(Some(Trouble::Other))
    }
}

impl From<CatalogueError> for Problem {
    fn from(error: CatalogueError) -> Self {
        let detail = error.to_string();
        match error {
            CatalogueError::Unknown { name } => Self::NoSuchTerrain(Shown::of(&name)),
            CatalogueError::Mounted { name } => Self::TerrainMounted(name),
            CatalogueError::Exists { .. }
            | CatalogueError::Absent { .. }
            | CatalogueError::Changed { .. } => Self::PreconditionFailed(detail),
            CatalogueError::Owned { name } => Self::TerrainOwned(name),
            CatalogueError::Unreadable(_) => Self::InvalidTerrain(detail),
            CatalogueError::TooLarge { limit } => Self::TerrainTooLarge(limit),
            CatalogueError::Full { room } => Self::TerrainsFull(room),
            CatalogueError::TooMany { most } => Self::TooManyTerrains(most),
            CatalogueError::Unavailable { error, .. } => {
                tracing::error!(error = detail, "the datasets cannot be reached");
                Self::StoreUnavailable(Some(match error.kind() {
                    ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Trouble::Full,
                    ErrorKind::ReadOnlyFilesystem | ErrorKind::PermissionDenied => {
                        Trouble::ReadOnly
                    }
                    _ => Trouble::Other,
                }))
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
