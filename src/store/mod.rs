//! Where plans are kept: the contract that every store meets, and the table of stores.
//!
//! A store holds the queue, the records, the documents and the events of all plans, and makes each
//! step durable before it answers. Deliberately absent: what a plan means, and who may see it.

mod changes;
pub mod jetstream;
pub mod measured;
pub mod reopening;
pub mod sqlite;

use std::sync::Arc;

use async_trait::async_trait;
use tokio::sync::watch;

use crate::export::document::Incumbent;
use crate::job::state::Refused;
use crate::job::{Event, Failure, NumberedEvent, Owner, Plan, PlanId, Status, Submission};

/// The queue, the records, the documents and the events of all plans.
///
/// Every method that changes something returns after the change is durable, but for [`Store::claim_early`].
#[async_trait]
pub trait Store: Send + Sync + 'static {
    /// Put a plan at the end of the queue; its first event is its `queued` status. A submission
    /// whose idempotency key has been seen within [`IDEMPOTENCY_MS`] changes nothing and gets the
    /// plan of the first one, however full the queue is.
    ///
    /// # Errors
    /// [`StoreError::QueueFull`] when as many plans are queued as the store was opened for,
    /// [`StoreError::QuotaReached`] when its owner has as many active plans as the submission allows,
    /// [`StoreError::KeyReused`] when its idempotency key came with another body,
    /// [`StoreError::Gone`] when the plan of the first one was deleted.
    async fn submit(&self, submission: Submission) -> Result<Submitted, StoreError>;

    /// Wait for the plan at the head of the queue and take it: queued -> running, at the time that
    /// the store's clock shows then. Dropping the future before it is done takes nothing; what was on its way
    /// goes back, and meanwhile others are given what stands behind it.
    ///
    /// # Errors
    /// [`StoreError::Unavailable`] when the store fails or is closed meanwhile.
    async fn claim(&self) -> Result<Lease, StoreError>;

    /// As [`Store::claim`], but the lease may come before the claim is durable, or seen by anybody: a run
    /// may begin while the disk is being waited for, since one that is forgotten is only run again. If
    /// the claim fails after all, the lease is lost: whatever is written under it, is refused.
    ///
    /// # Errors
    /// As [`Store::claim`].
    async fn claim_early(&self) -> Result<Lease, StoreError> {
        self.claim().await
    }

    /// Add what a run tells; convergence points also move the record's progress.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn append(&self, lease: &Lease, events: Vec<Event>) -> Result<(), StoreError>;

    /// End a run: what it told last, state, result, last status and `end` event in one step.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn finish(&self, lease: &Lease, end: End) -> Result<Plan, StoreError>;

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

    /// The best route so far: the newest [`Event::Incumbent`] of the present run; `None` before the
    /// first, and after an end without a result.
    ///
    /// # Errors
    /// As [`Store::get`].
    async fn incumbent(&self, id: PlanId) -> Result<Option<Incumbent>, StoreError>;

    /// Newest first: by id, from the greatest down.
    async fn list(&self, query: ListQuery) -> Result<Vec<Plan>, StoreError>;

    /// At most `limit` events after the one numbered `after`, in order; none when there are none yet.
    /// Of a plan's events the store keeps the newest, at least as many as it was opened for.
    ///
    /// # Errors
    /// As [`Store::get`].
    async fn events(&self, id: PlanId, after: u64, limit: usize) -> Result<EventPage, StoreError>;

    /// Ticks after each change of the plan or its events has become readable, and once more when it is deleted.
    /// Subscribe before reading, and no change is missed.
    fn changes(&self, id: PlanId) -> watch::Receiver<u64>;

    /// Remove ended plans that are past their time or beyond the limits of [`Retention`], the longest
    /// ended first, at most [`SWEEP`] of them; returns how many. Their tombstones say so for
    /// [`TOMBSTONE_MS`]. What has expired of tombstones and idempotency keys goes too.
    async fn sweep(&self, now_ms: i64) -> Result<usize, StoreError>;

    /// Webhooks of ended plans that are due, the longest due first, at most `limit`. A submission's
    /// webhook is due as soon as its plan has ended: it is kept in the same step as the submission
    /// and made due in the same step as the end. It goes with its plan.
    async fn due_webhooks(&self, now_ms: i64, limit: usize) -> Result<Vec<Webhook>, StoreError>;

    /// A plan's webhook has been tried; it is due again at `next_ms`, or done with. One that is no
    /// longer there is no error.
    async fn webhook_tried(&self, id: PlanId, next_ms: Option<i64>) -> Result<(), StoreError>;

    /// The datasets that plans are planned over, whoever's the plans are, in the order of their sums.
    async fn datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError>;

    /// Counts for the queue's head-room and `Retry-After`.
    async fn stats(&self) -> Result<Stats, StoreError>;

    /// Whether the store can take a write now: it makes a small one durable.
    async fn health(&self) -> Result<(), StoreError>;

    /// Finish what is being written and let go of files. Waiting claims and later calls fail.
    async fn close(&self);
}

/// How long a deleted plan is remembered, milliseconds.
pub const TOMBSTONE_MS: i64 = 24 * 60 * 60 * 1_000;

/// How long an idempotency key is remembered, milliseconds.
pub const IDEMPOTENCY_MS: i64 = 24 * 60 * 60 * 1_000;

/// Plans that one [`Store::sweep`] removes at most, so that nobody waits long behind it.
pub const SWEEP: usize = 256;

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
    /// How long plans are kept.
    pub retention: Retention,
    /// Events kept of each plan; of a longer history the oldest are forgotten.
    pub events_kept: u64,
}

impl Options {
    /// For `queue_limit` waiting plans, with no other limit, on the machine's clock.
    #[must_use]
    pub fn new(queue_limit: u64) -> Self {
        Self {
            queue_limit,
            clock: wall_clock(),
            retention: Retention::default(),
            events_kept: u64::MAX,
        }
    }
}

/// How long ended plans are kept: until the first of these limits; `None` is no limit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Retention {
    /// From the end of a plan, milliseconds. It becomes the plan's `expires_ms` when it ends, and
    /// that stands whatever is set later.
    pub age_ms: Option<i64>,
    /// Ended plans kept.
    pub plans: Option<u64>,
    /// Bytes of their documents and events.
    pub bytes: Option<u64>,
}

/// The answer to a submission.
#[derive(Debug, Clone, PartialEq)]
pub struct Submitted {
    /// As it now stands.
    pub plan: Plan,
    /// Whether an earlier submission with the same idempotency key had made it.
    pub replayed: bool,
}

/// A page of a plan's events.
#[derive(Debug, Clone, PartialEq)]
pub struct EventPage {
    /// Events up to this id are no longer kept; 0 when all are.
    pub forgotten: u64,
    /// In order.
    pub events: Vec<NumberedEvent>,
}

/// The end of a plan, to be told.
#[derive(Debug, Clone, PartialEq)]
pub struct Webhook {
    /// As it ended.
    pub plan: Plan,
    /// Where to.
    pub url: String,
    /// How often that has been tried.
    pub tries: u32,
}

/// How many plans are planned over a dataset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DatasetUse {
    /// As in [`Submission::dataset`].
    pub sha256: String,
    /// Plans that are queued or running.
    pub active: u64,
    /// All that are kept.
    pub plans: u64,
}

/// What remains of a removed plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tombstone {
    /// Which plan it was.
    pub id: PlanId,
    /// Whose.
    pub owner: Option<Owner>,
    /// Whether its time had come; otherwise somebody deleted it.
    pub expired: bool,
}

/// The right to run one plan, from [`Store::claim`] or [`Store::claim_early`] to [`Store::finish`] or [`Store::release`].
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
    /// With a result.
    Result {
        /// Whether it was asked to stop; such a plan is `cancelled`, any other `succeeded`.
        cancelled: bool,
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
    /// At that time, with nothing told since the last [`Store::append`].
    #[must_use]
    pub fn at(self, at_ms: i64) -> End {
        End {
            told: Vec::new(),
            ending: self,
            at_ms,
        }
    }
}

/// The end of a run.
#[derive(Debug, Clone)]
pub struct End {
    /// What the run told since the last [`Store::append`].
    pub told: Vec<Event>,
    /// How it ended.
    pub ending: Ending,
    /// When, milliseconds since 1970.
    pub at_ms: i64,
}

impl End {
    /// Change the record as this end does; the result document is left to the store.
    ///
    /// # Errors
    /// [`Refused`] when the plan is not running.
    fn apply(&self, plan: &mut Plan) -> Result<(), Refused> {
        plan.advance(&self.told);
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

/// What [`Store::list`] returns.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ListQuery {
    /// Only these, or all.
    pub status: Option<Status>,
    /// Only this owner's, or everybody's.
    pub owner: Option<Owner>,
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
    /// Plans that all nodes of the store together run at the same time; `None` when one process alone uses it.
    pub slots: Option<usize>,
}

/// Why a store did not do what it was asked.
#[derive(Debug, Clone, thiserror::Error)]
pub enum StoreError {
    /// There never was such a plan, or its tombstone has expired.
    #[error("no plan {0}")]
    NotFound(PlanId),
    /// It was removed, less than a day ago.
    #[error("plan {} is gone", .0.id)]
    Gone(Tombstone),
    /// As many plans are queued as the store was opened for.
    #[error("the queue holds {queued} plans, its limit")]
    QueueFull {
        /// How many.
        queued: u64,
    },
    /// The owner has as many active plans as the submission allows.
    #[error("the owner has {active} active plans, the quota")]
    QuotaReached {
        /// How many.
        active: u64,
    },
    /// The idempotency key came with another body before.
    #[error("the idempotency key was used with another body")]
    KeyReused,
    /// The plan ended, was deleted or was claimed by another worker.
    #[error("plan {0} is no longer this worker's to run")]
    LeaseLost(PlanId),
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
    /// For no reason that has a name.
    pub fn unavailable(detail: impl Into<String>) -> Self {
        Self::Unavailable {
            trouble: Trouble::Other,
            detail: detail.into(),
        }
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
    /// What is in the file is not what was written.
    Damaged,
    /// The file was written by a newer version of the program.
    Newer,
    /// See the log.
    Other,
}
