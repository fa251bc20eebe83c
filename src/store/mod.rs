//! Where plans are kept: the contract that every store meets, and the table of stores.
//!
//! A store holds the queue, the records, the documents and the events of all plans, and makes each
//! step durable before it answers. Deliberately absent: what a plan means, and who may see it.

use std::sync::Arc;

use async_trait::async_trait;
use tokio::sync::watch;

use crate::job::{Event, Failure, NumberedEvent, Plan, PlanId, Status, Submission};

/// The queue, the records, the documents and the events of all plans.
///
/// Every method that changes something returns after the change is durable.
#[async_trait]
pub trait Store: Send + Sync + 'static {
    /// Put a plan at the end of the queue; its first event is its `queued` status.
    ///
    /// # Errors
    /// [`StoreError::QueueFull`] when as many plans are queued as the store was opened for.
    async fn submit(&self, submission: Submission) -> Result<Plan, StoreError>;

    /// Wait for the plan at the head of the queue and take it: queued -> running.
    /// Dropping the future before it is done takes nothing.
    async fn claim(&self, now_ms: i64) -> Result<Lease, StoreError>;

    /// Add what a run tells; convergence points also move the record's progress.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn append(&self, lease: &Lease, events: Vec<Event>) -> Result<(), StoreError>;

    /// End a run: state, result, last status and `end` event in one step.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn finish(&self, lease: &Lease, ending: Ending, now_ms: i64) -> Result<Plan, StoreError>;

    /// Give a plan back, to the head of the queue: running -> queued.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn release(&self, lease: &Lease) -> Result<(), StoreError>;

    /// Ask for the end of a plan. A queued one ends at once; a running one's lease is told; at the
    /// end of its life nothing changes.
    ///
    /// # Errors
    /// [`StoreError::NotFound`], [`StoreError::Gone`].
    async fn request_cancel(&self, id: PlanId, now_ms: i64) -> Result<Plan, StoreError>;

    /// Remove a plan and all that belongs to it, stopping it first; a tombstone remains. Removing
    /// it again is no error.
    ///
    /// # Errors
    /// [`StoreError::NotFound`] when there was never such a plan.
    async fn delete(&self, id: PlanId, now_ms: i64) -> Result<(), StoreError>;

    /// The record.
    ///
    /// # Errors
    /// [`StoreError::NotFound`], or [`StoreError::Gone`] within a day of its removal.
    async fn get(&self, id: PlanId) -> Result<Plan, StoreError>;

    /// The accepted scenario document.
    ///
    /// # Errors
    /// As [`Store::get`].
    async fn scenario(&self, id: PlanId) -> Result<String, StoreError>;

    /// The result document, byte for byte as it was finished; `None` while there is none.
    ///
    /// # Errors
    /// As [`Store::get`].
    async fn result(&self, id: PlanId) -> Result<Option<String>, StoreError>;

    /// Newest first.
    async fn list(&self, query: ListQuery) -> Result<Vec<Plan>, StoreError>;

    /// At most about `limit` events after the one numbered `after`, in order; none when there are
    /// none yet.
    ///
    /// # Errors
    /// As [`Store::get`].
    async fn events(&self, id: PlanId, after: u64, limit: usize) -> Result<Vec<NumberedEvent>, StoreError>;

    /// Ticks after each change of the plan or its events has become readable, and once more when it is deleted.
    /// Subscribe before reading, and no change is missed.
    fn changes(&self, id: PlanId) -> watch::Receiver<u64>;

    /// Counts for the queue's head-room and `Retry-After`.
    async fn stats(&self) -> Result<Stats, StoreError>;

    /// Whether the store can take a write now.
    async fn health(&self) -> Result<(), StoreError>;

    /// Finish what is being written and let go of files. Later calls fail.
    async fn close(&self);
}

/// The right to run one plan, from [`Store::claim`] to [`Store::finish`] or [`Store::release`].
#[derive(Debug, Clone)]
pub struct Lease {
    /// The record at the time of the claim.
    pub plan: Plan,
    /// The accepted scenario document.
    pub scenario: Arc<str>,
    /// Fences off earlier runs of the same plan.
    pub attempt: u64,
    /// Becomes true when somebody asks for the end of the plan or deletes it.
    pub cancel: watch::Receiver<bool>,
}

/// How a run ended.
#[derive(Debug, Clone)]
pub enum Ending {
    /// With a result: `succeeded`, or `cancelled` when it was asked to stop.
    Result {
        /// [`Status::Succeeded`] or [`Status::Cancelled`].
        status: Status,
        /// Why the search ended.
        stop_reason: String,
        /// Whether the route meets every constraint.
        feasible: bool,
        /// Of the route when feasible.
        best_cost: Option<f64>,
        /// Routes priced.
        evaluations: u64,
        /// Iterations done.
        iteration: u64,
        /// The result document.
        document: String,
    },
    /// Without one.
    Failed(Failure),
}

/// What [`Store::list`] returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ListQuery {
    /// Only these, or all.
    pub status: Option<Status>,
    /// Only plans older than this one.
    pub before: Option<PlanId>,
    /// At most so many.
    pub limit: usize,
}

/// Counts of a store.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stats {
    /// Plans waiting.
    pub queued: u64,
    /// Plans being run.
    pub running: u64,
    /// Mean run time of the last few plans that ended with a result, milliseconds; `None` before the first.
    pub mean_run_ms: Option<f64>,
}

/// Why a store did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// There never was such a plan, or its tombstone has expired.
    #[error("no plan {0}")]
    NotFound(PlanId),
    /// It was deleted.
    #[error("plan {0} was deleted")]
    Gone(PlanId),
    /// As many plans are queued as the store was opened for.
    #[error("the queue holds {queued} plans, its limit")]
    QueueFull {
        /// How many.
        queued: u64,
    },
    /// The plan ended, was deleted or was claimed by another worker.
    #[error("plan {0} is no longer this worker's to run")]
    LeaseLost(PlanId),
    /// Another process uses the data directory.
    #[error("data directory {0} is in use by another process")]
    InUse(std::path::PathBuf),
    /// The file or the disk failed; details are for the log.
    #[error("store unavailable: {0}")]
    Unavailable(String),
}
