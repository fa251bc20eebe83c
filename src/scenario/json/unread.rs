//! Why an accepted document cannot be read again, which is not its caller's fault.

use thiserror::Error;

use super::Refusal;

/// Why a document that was accepted before cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Unread {
    /// Its dataset is unreachable at present; a retry may succeed.
    #[error("{0}")]
    Unreachable(String),
    /// Its dataset is missing or unusable.
    #[error("the ground that it was accepted over is not there: {0}")]
    NoGround(String),
    /// Another version of this program accepted it, or it has been changed since.
    #[error("this version cannot read the accepted document: {0}")]
    Damaged(Refusal),
}

impl From<Refusal> for Unread {
    fn from(refusal: Refusal) -> Self {
        if let Some(fault) = refusal.unreachable_ground() {
            return Self::Unreachable(fault.detail.clone());
        }
        match refusal.lost_ground() {
            Some(fault) => Self::NoGround(fault.detail.clone()),
            None => Self::Damaged(refusal),
        }
    }
}
