//! How a run ends, and what that makes of its plan's record.

use std::sync::Arc;

use crate::job::state::Refused;
use crate::job::{Event, Failure, Plan, Status};

/// How a run ended.
#[derive(Debug, Clone)]
pub enum Ending {
    /// With a result.
    Result {
        /// Whether it was asked to stop; such a plan is `cancelled`, any other `succeeded`.
        cancelled: bool,
        /// Why the search ended.
        stop_reason: String,
        /// Whether the route meets every constraint.
        feasible: bool,
        /// Cost of the route, when feasible.
        best_cost: Option<f64>,
        /// Routes priced.
        evaluations: u64,
        /// Iterations done.
        iteration: u64,
        /// The result document.
        document: String,
    },
    /// Without a result.
    Failed(Failure),
}

impl Ending {
    /// At this time, with no events since the last [`Store::append`](super::Store::append).
    #[must_use]
    pub fn at(self, at_ms: i64) -> Arc<End> {
        self.after(Vec::new(), at_ms)
    }

    /// At this time, with `events` the events since the last [`Store::append`](super::Store::append). Shared, because a
    /// failed store call is retried.
    #[must_use]
    pub fn after(self, events: Vec<Event>, at_ms: i64) -> Arc<End> {
        let ending = self;
        Arc::new(End {
            events,
            ending,
            at_ms,
        })
    }
}

/// The end of a run.
#[derive(Debug)]
pub struct End {
    /// Events of the run since the last [`Store::append`](super::Store::append).
    pub events: Vec<Event>,
    /// How it ended.
    pub ending: Ending,
    /// When, milliseconds since 1970.
    pub at_ms: i64,
}

impl End {
    /// Apply this end to the record; the result document is left to the store.
    ///
    /// # Errors
    /// [`Refused`] when the plan is not running.
    pub(super) fn apply(&self, plan: &mut Plan) -> Result<(), Refused> {
        plan.advance(&self.events);
        match &self.ending {
            Ending::Result {
                cancelled,
                stop_reason,
                feasible,
                best_cost,
                evaluations,
                iteration,
                document: _,
            } => {
                let status = if *cancelled {
                    Status::Cancelled
                } else {
                    Status::Succeeded
                };
                plan.end(status, self.at_ms)?;
                plan.stop_reason = Some(stop_reason.clone());
                plan.feasible = Some(*feasible);
                plan.best_cost = *best_cost;
                plan.progress = 1.0;
                plan.iteration = *iteration;
                plan.evaluations = *evaluations;
                Ok(())
            }
            Ending::Failed(failure) => plan.fail(failure.clone(), self.at_ms),
        }
    }
}
