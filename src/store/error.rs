//! Errors of a store.

use super::Tombstone;
use crate::job::state::Refused;
use crate::job::{Plan, PlanId};

/// Refuses unless `plan` has this `revision`, if one is given.
pub(super) fn expected(plan: &Plan, revision: Option<u64>) -> Result<(), StoreError> {
    match revision {
        Some(revision) if revision != plan.revision => {
            Err(StoreError::Changed(Box::new(plan.clone())))
        }
        Some(_) | None => Ok(()),
    }
}

/// Why a store did not do what was asked.
#[derive(Debug, Clone, thiserror::Error)]
pub enum StoreError {
    /// There never was such a plan, or its tombstone has expired.
    #[error("no plan {0}")]
    NotFound(PlanId),
    /// It was removed, less than a day ago.
    #[error("plan {} is gone", .0.id)]
    Gone(Tombstone),
    /// Its record is not the expected one: this is the record now.
    #[error("plan {} has changed", .0.id)]
    Changed(Box<Plan>),
    /// The queue holds as many plans as the store was opened for.
    #[error("the queue holds {queued} plans, its limit")]
    QueueFull {
        /// Number of queued plans.
        queued: u64,
    },
    /// The owner has as many active plans as the submission allows.
    #[error("the owner has {active} active plans, its quota is {quota}")]
    QuotaReached {
        /// Number of active plans.
        active: u64,
        /// Maximum number of active plans.
        quota: u64,
    },
    /// The idempotency key was used before with another body.
    #[error("the idempotency key was used with another body")]
    KeyReused,
    /// Another request with the idempotency key is being accepted, or was interrupted a moment ago.
    #[error("another request with the idempotency key has not been answered")]
    KeyInFlight,
    /// The plan ended, was deleted or was claimed by another worker.
    #[error("plan {0} is no longer this worker's to run")]
    LeaseLost(PlanId),
    /// The scenario that was accepted is not in the store, though its plan is.
    #[error("plan {0} has lost its scenario")]
    ScenarioLost(PlanId),
    /// Another process uses the data directory.
    #[error("data directory {0} is in use by another process")]
    InUse(std::path::PathBuf),
    /// It cannot be read or written now.
    #[error("store unavailable: {detail}")]
    Unavailable {
        /// What an operator would look at first.
        trouble: Trouble,
        /// For the log.
        detail: String,
    },
}

impl StoreError {
    /// Unavailable for a reason that has no [`Trouble`] of its own.
    pub fn unavailable(detail: impl Into<String>) -> Self {
        Self::Unavailable {
            trouble: Trouble::Other,
            detail: detail.into(),
        }
    }

    /// Asked after [`Store::close`](super::Store::close).
    pub(crate) fn closed() -> Self {
        Self::unavailable("the store is closed")
    }
}

impl From<Refused> for StoreError {
    fn from(refused: Refused) -> Self {
        Self::unavailable(refused.to_string())
    }
}

/// Why a store is unavailable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// There is no room on the disk.
    Full,
    /// The directory or its files cannot be written or made.
    ReadOnly,
    /// The file's content is not what was written.
    Damaged,
    /// Another file, or none, is where the open one was.
    Moved,
    /// The file was written by a newer version of the program.
    Newer,
    /// What it keeps on the servers is no longer there.
    Vanished,
    /// The file with the credentials for the servers cannot be read.
    NoCredentials,
    /// The servers let nobody in with these credentials, or without any.
    Forbidden,
    /// See the log.
    Other,
}
