//! What happens to a plan, in order.

use serde::{Deserialize, Serialize};

use super::{Plan, Status};
use crate::export::document::{Convergence, Incumbent};

/// Something that happened to a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", content = "data", rename_all = "lowercase")]
pub enum Event {
    /// Its status changed; holds the record at that time.
    Status(Box<Plan>),
    /// An iteration was completed.
    Convergence(Convergence),
    /// A better route was found.
    Incumbent(Incumbent),
    /// It ended; nothing follows.
    End(Status),
}

impl Event {
    /// About how many bytes it takes as JSON.
    #[must_use]
    pub fn bytes(&self) -> usize {
        const FIGURES: usize = 256;
        const RECORD: usize = 1024;
        const WAYPOINT: usize = 70;
        match self {
            Self::Incumbent(route) => FIGURES + WAYPOINT * route.waypoints.len(),
            Self::Status(_) => RECORD,
            Self::Convergence(_) | Self::End(_) => FIGURES,
        }
    }
}

/// An event with its number in its plan's own sequence, which grows from 1 and may have gaps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NumberedEvent {
    /// Greater than that of every event before it.
    pub id: u64,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}
