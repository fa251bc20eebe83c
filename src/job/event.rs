//! What happens to a plan, in the order in which it happens.

use serde::{Deserialize, Serialize};

use super::{Plan, Status};
use crate::export::document::{Convergence, Incumbent};

/// Something that happened to a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", content = "data", rename_all = "lowercase")]
pub enum Event {
    /// Its status changed; the record as it then was.
    Status(Box<Plan>),
    /// An iteration was done.
    Convergence(Convergence),
    /// A better route was found.
    Incumbent(Incumbent),
    /// It ended; nothing follows.
    End(Status),
}

/// An event with its place in its plan's own sequence, which grows from 1 and may have holes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NumberedEvent {
    /// Greater than that of every event before it.
    pub id: u64,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}
