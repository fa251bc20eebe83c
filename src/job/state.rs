//! The one table of the allowed transitions.

use serde::{Deserialize, Serialize};

/// The state of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// Accepted, durable, waiting for a worker.
    Queued,
    /// A worker is planning it.
    Running,
    /// It has a result, feasible or not.
    Succeeded,
    /// It has no result and gets none; the record says which [`FailureKind`](super::FailureKind) it is.
    Failed,
    /// Ended on request, with the best route so far if it had begun.
    Cancelled,
}

impl Status {
    /// All of them, in the order of a plan's life.
    pub const ALL: [Self; 5] = [
        Self::Queued,
        Self::Running,
        Self::Succeeded,
        Self::Failed,
        Self::Cancelled,
    ];

    /// The name on the wire.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Succeeded => "succeeded",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

    /// The status with this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.name() == name)
    }

    /// Whether it is final.
    #[must_use]
    pub fn is_final(self) -> bool {
        self.next().is_empty()
    }

    /// Whether `next` may follow it.
    #[must_use]
    pub fn may_become(self, next: Self) -> bool {
        self.next().contains(&next)
    }

    /// The transition table.
    fn next(self) -> &'static [Self] {
        match self {
            // A queued plan that is cancelled has no route.
            Self::Queued => &[Self::Running, Self::Cancelled],
            // Back to the queue when its worker is lost or the service shuts down.
            Self::Running => &[Self::Succeeded, Self::Failed, Self::Cancelled, Self::Queued],
            Self::Succeeded | Self::Failed | Self::Cancelled => &[],
        }
    }
}

/// A step that the transition table does not allow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a {} plan cannot become {}", from.name(), to.name())]
pub struct Refused {
    /// The present status.
    pub from: Status,
    /// The status that was requested.
    pub to: Status,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transition_table() {
        use Status::{Cancelled, Failed, Queued, Running, Succeeded};
        let allowed = [
            (Queued, Running),
            (Queued, Cancelled),
            (Running, Succeeded),
            (Running, Failed),
            (Running, Cancelled),
            (Running, Queued),
        ];
        for from in Status::ALL {
            for to in Status::ALL {
                assert_eq!(
                    from.may_become(to),
                    allowed.contains(&(from, to)),
                    "{from:?} -> {to:?}"
                );
            }
        }
    }

    #[test]
    fn what_is_final() {
        let finals = Status::ALL.into_iter().filter(|status| status.is_final());
        assert!(finals.eq([Status::Succeeded, Status::Failed, Status::Cancelled]));
    }

    #[test]
    fn names_are_those_of_the_wire_and_lead_back() {
        for status in Status::ALL {
            assert_eq!(Status::from_name(status.name()), Some(status));
            assert_eq!(serde_json::json!(status), status.name());
        }
        assert_eq!(Status::from_name("Queued"), None);
    }
}
