//! Why a plan failed.

use serde::{Deserialize, Serialize};

/// Why a plan failed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Last part of the problem's `type`, as [`FailureKind::name`] gives it; a record of a later version may hold
    /// another one.
    pub kind: String,
    /// For people.
    pub detail: String,
}

/// Every reason for which a plan can fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureKind {
    /// The planner panicked because of a bug.
    PlannerPanic,
    /// One worker after another was lost while running the plan.
    WorkerLost,
    /// The dataset that it was accepted over is gone.
    NoGround,
    /// This version cannot read the document that was accepted.
    InvalidScenario,
    /// The store has lost the document that was accepted.
    ScenarioLost,
}

impl FailureKind {
    /// Every one, once.
    pub const ALL: [Self; 5] = [
        Self::PlannerPanic,
        Self::WorkerLost,
        Self::NoGround,
        Self::InvalidScenario,
        Self::ScenarioLost,
    ];

    /// The name in records and on the wire.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::PlannerPanic => "planner-panic",
            Self::WorkerLost => "worker-lost",
            Self::NoGround => "no-ground",
            Self::InvalidScenario => "invalid-scenario",
            Self::ScenarioLost => "scenario-lost",
        }
    }

    /// The kind with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// A failure of this kind; `detail` is for people.
    pub fn because(self, detail: impl Into<String>) -> Failure {
        Failure {
            kind: self.name().to_owned(),
            detail: detail.into(),
        }
    }
}
