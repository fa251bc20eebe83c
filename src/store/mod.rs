//! Where plans are kept: the contract that every store meets, and the table of stores.
//!
//! A store holds the queue, the records, the documents and the events of all plans, and makes each
//! step durable before it answers. Deliberately absent: what a plan means, and who may see it.

pub mod measured;
pub mod sqlite;

use std::sync::Arc;

use async_trait::async_trait;
use tokio::sync::watch;

use crate::job::state::Refused;
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

    /// Wait for the plan at the head of the queue and take it: queued -> running, at the time that
    /// the store's clock shows then. Dropping the future before it is done takes nothing.
    ///
    /// # Errors
    /// [`StoreError::Unavailable`] when the store fails or is closed meanwhile.
    async fn claim(&self) -> Result<Lease, StoreError>;

    /// Add what a run tells; convergence points also move the record's progress.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn append(&self, lease: &Lease, events: Vec<Event>) -> Result<(), StoreError>;

    /// End a run: state, result, last status and `end` event in one step.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    ///
    /// # Panics
    /// When the status of an [`Ending::Result`] is none of the two that have a result.
    async fn finish(&self, lease: &Lease, ending: Ending, now_ms: i64) -> Result<Plan, StoreError>;

    /// Give a plan back, to its old place in the queue, which is the head: running -> queued. Its
    /// next run begins again from its seed. When its end has been asked for, it is cancelled
    /// instead, without a result.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn release(&self, lease: &Lease) -> Result<(), StoreError>;

    /// Ask for the end of a plan. A queued one ends at once, without a result; a running one's lease
    /// is told; at the end of its life nothing changes.
    ///
    /// # Errors
    /// [`StoreError::NotFound`], [`StoreError::Gone`].
    async fn request_cancel(&self, id: PlanId, now_ms: i64) -> Result<Plan, StoreError>;

    /// Remove a plan and all that belongs to it; a running one's lease is told, and lost. A tombstone
    /// remains for [`TOMBSTONE_MS`]; while it does, removing the plan again is no error.
    ///
    /// # Errors
    /// [`StoreError::NotFound`] when there is neither such a plan nor its tombstone.
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

    /// Newest first: by id, from the greatest down.
    async fn list(&self, query: ListQuery) -> Result<Vec<Plan>, StoreError>;

    /// At most `limit` events after the one numbered `after`, in order; none when there are none yet.
    ///
    /// # Errors
    /// As [`Store::get`].
    async fn events(
        &self,
        id: PlanId,
        after: u64,
        limit: usize,
    ) -> Result<Vec<NumberedEvent>, StoreError>;

    /// Ticks after each change of the plan or its events has become readable, and once more when it is deleted.
    /// Subscribe before reading, and no change is missed.
    fn changes(&self, id: PlanId) -> watch::Receiver<u64>;

    /// Counts for the queue's head-room and `Retry-After`.
    async fn stats(&self) -> Result<Stats, StoreError>;

    /// Whether the store can take a write now: it makes a small one durable.
    async fn health(&self) -> Result<(), StoreError>;

    /// Finish what is being written and let go of files. Waiting claims and later calls fail.
    async fn close(&self);
}

/// How long a deleted plan is remembered, milliseconds.
pub const TOMBSTONE_MS: i64 = 24 * 60 * 60 * 1_000;

/// Tells the time: milliseconds since 1970.
pub type Clock = Arc<dyn Fn() -> i64 + Send + Sync>;

/// The machine's clock.
#[must_use]
pub fn wall_clock() -> Clock {
    Arc::new(|| {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        i64::try_from(since.unwrap_or_default().as_millis()).unwrap_or(i64::MAX)
    })
}

/// What a store is opened with.
#[derive(Clone)]
pub struct Options {
    /// As many plans may wait; see [`StoreError::QueueFull`].
    pub queue_limit: u64,
    /// Of claims, tombstones and recovery.
    pub clock: Clock,
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

impl Ending {
    /// Change the record as this ending does; the result document is left to the store.
    ///
    /// # Errors
    /// [`Refused`] when the plan is not running.
    fn apply(&self, plan: &mut Plan, now_ms: i64) -> Result<(), Refused> {
        match self {
            Self::Result {
                status,
                stop_reason,
                feasible,
                best_cost,
                evaluations,
                iteration,
                document: _,
            } => {
                plan.end(*status, now_ms)?;
                plan.stop_reason = Some(stop_reason.clone());
                plan.feasible = Some(*feasible);
                plan.best_cost = *best_cost;
                plan.progress = 1.0;
                plan.iteration = *iteration;
                plan.evaluations = *evaluations;
                Ok(())
            }
            Self::Failed(failure) => plan.fail(failure.clone(), now_ms),
        }
    }
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
    /// When the plan at the head of the queue was accepted, milliseconds since 1970; `None` without one.
    pub oldest_queued_ms: Option<i64>,
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
