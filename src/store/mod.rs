//! Where plans are kept: the contract that every store meets, and the stores.
//!
//! A store holds the queue, the records, the documents and the events of all plans, and makes each
//! step durable before it answers. Deliberately absent: what a plan means, and who may see it.

mod changes;
mod clock;
mod end;
mod error;
pub mod jetstream;
mod lost;
pub mod measured;
mod options;
mod parts;
mod pause;
pub mod reopening;
pub mod sqlite;

pub use clock::{Clock, SteadyClock, TOLERANCE_MS, wall_clock};
pub use end::{End, Ending};
use error::expected;
pub use error::{StoreError, Trouble};
pub use options::{OnLost, Options, Retention};
use pause::pause_after;

use std::sync::Arc;

use async_trait::async_trait;
use serde::{Deserialize, Serialize};
use tokio::sync::watch;

use crate::export::document::Incumbent;
use crate::job::{Event, Idempotency, NumberedEvent, Owner, Plan, PlanId, Status, Submission};

/// The queue, the records, the documents and the events of all plans.
///
/// Every method that changes something returns after the change is durable, but for [`Store::claim_early`].
#[async_trait]
pub trait Store: Send + Sync + 'static {
    /// Put a plan at the end of the queue; its first event is its `queued` status. A submission
    /// whose idempotency key has been seen within [`IDEMPOTENCY_MS`] changes nothing and returns the plan of the first
    /// one, however full the queue is.
    ///
    /// # Errors
    /// [`StoreError::QueueFull`] when the queue holds as many plans as the store was opened for,
    /// [`StoreError::QuotaReached`] when its owner has as many active plans as the submission allows,
    /// [`StoreError::KeyReused`] when its idempotency key came with another body,
    /// [`StoreError::KeyInFlight`] when a request with the key has not been answered,
    /// [`StoreError::Gone`] when the plan of the first submission was deleted.
    async fn submit(&self, submission: Submission) -> Result<Submitted, StoreError>;

    /// What [`Store::submit`] would answer to a repeated request that can no longer be read because what it refers to
    /// has gone; `None` when the key has not been seen within [`IDEMPOTENCY_MS`].
    ///
    /// # Errors
    /// [`StoreError::KeyReused`], [`StoreError::Gone`].
    async fn repeated(
        &self,
        owner: Option<&Owner>,
        idempotency: &Idempotency,
    ) -> Result<Option<Plan>, StoreError>;

    /// Wait for the plan at the head of the queue and take it: queued -> running, at the time that the store's clock
    /// shows then. A plan whose run was cut off by the end of its process, and not given back, is handed out again;
    /// after the fifth time it fails, `worker-lost`. One whose document the store has lost fails, `scenario-lost`, and
    /// the next is taken. Dropping the future before it completes takes nothing: a plan already on its way returns to
    /// its place; until then other claimers get the plans behind it.
    ///
    /// # Errors
    /// [`StoreError::Unavailable`] when the store fails or is closed meanwhile.
    async fn claim(&self) -> Result<Lease, StoreError>;

    /// As [`Store::claim`], but the lease may come before the claim is durable or visible: a run may begin during the
    /// wait for the disk, since a forgotten run is only repeated. If the claim fails after all, the lease is lost:
    /// whatever is written under it is refused, and until a claim succeeds, failed ones return their error.
    ///
    /// # Errors
    /// As [`Store::claim`].
    async fn claim_early(&self) -> Result<Lease, StoreError> {
        self.claim().await
    }

    /// Add events of a run; convergence points also update the record's progress.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn append(&self, lease: &Lease, events: Vec<Event>) -> Result<(), StoreError>;

    /// End a run: its last events, state, result, last status and `end` event in one step.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn finish(&self, lease: &Lease, end: Arc<End>) -> Result<Plan, StoreError>;

    /// Give a plan back to its old place in the queue, which is the head: running -> queued. Its next run begins again
    /// from its seed. When its end has been requested, it is cancelled instead, without a result. Returns its new
    /// record.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn release(&self, lease: &Lease) -> Result<Plan, StoreError>;

    /// As [`Store::release`], for a plan that cannot be run now: it keeps its place, but those behind it go first for a
    /// while: ten seconds after its first run, twice as long after each further one, up to 320 s.
    ///
    /// # Errors
    /// [`StoreError::LeaseLost`] when the plan is no longer this lease's to run.
    async fn postpone(&self, lease: &Lease) -> Result<Plan, StoreError>;

    /// Request the end of a plan. A queued one ends at once, without a result; a running one's lease is notified;
    /// nothing changes for one that has ended.
    ///
    /// # Errors
    /// [`StoreError::NotFound`], [`StoreError::Gone`].
    async fn request_cancel(&self, id: PlanId, now_ms: i64) -> Result<Plan, StoreError> {
        self.request_cancel_if(id, None, now_ms).await
    }

    /// As [`Store::request_cancel`], but nothing is done unless the record has this `revision`, if one is given.
    ///
    /// # Errors
    /// As [`Store::request_cancel`], and [`StoreError::Changed`].
    async fn request_cancel_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<Plan, StoreError>;

    /// Remove a plan and all that belongs to it; a running one's lease is notified, and lost. A tombstone remains for
    /// [`TOMBSTONE_MS`]; until it expires, removing the plan again is no error.
    ///
    /// # Errors
    /// [`StoreError::NotFound`] when there is neither such a plan nor its tombstone.
    async fn delete(&self, id: PlanId, now_ms: i64) -> Result<(), StoreError> {
        self.delete_if(id, None, now_ms).await
    }

    /// As [`Store::delete`], but nothing is done unless the record has this `revision`, if one is given; then removing
    /// the plan again is an error.
    ///
    /// # Errors
    /// As [`Store::delete`], and [`StoreError::Changed`], [`StoreError::Gone`].
    async fn delete_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<(), StoreError>;

    /// The record.
    ///
    /// # Errors
    /// [`StoreError::NotFound`], or [`StoreError::Gone`] within a day of its removal.
    async fn get(&self, id: PlanId) -> Result<Plan, StoreError>;

    /// The accepted scenario document.
    ///
    /// # Errors
    /// As [`Store::get`], and [`StoreError::ScenarioLost`].
    async fn scenario(&self, id: PlanId) -> Result<String, StoreError>;

    /// The result document, byte for byte as it was finished; `None` while there is none.
    ///
    /// # Errors
    /// As [`Store::get`].
    async fn result(&self, id: PlanId) -> Result<Option<String>, StoreError>;

    /// The best route so far: the newest [`Event::Incumbent`] of the present run; `None` before the first, and once the
    /// run has ended.
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

    /// Whether the plan has an event of this number by now, on any node: another node may have stored events that are
    /// not known here yet.
    ///
    /// # Errors
    /// As [`Store::get`].
    async fn has_event(&self, id: PlanId, event: u64) -> Result<bool, StoreError>;

    /// Ticks after each change of the plan or its events has become readable, and once more when it is deleted.
    /// Subscribe before reading, and no change is missed.
    fn changes(&self, id: PlanId) -> watch::Receiver<u64>;

    /// Remove ended plans that are past their time or beyond the limits of [`Retention`], those that ended longest ago
    /// first, at most [`SWEEP`] of them; returns how many, which is fewer only when no more can be removed. Their
    /// tombstones mark them as expired for [`TOMBSTONE_MS`]. Expired tombstones and idempotency keys are removed too.
    async fn sweep(&self, now_ms: i64) -> Result<usize, StoreError>;

    /// Webhooks of ended plans that are due, at most `limit`, and of one owner at most half of it, rounded up: first the
    /// longest due of each owner, then each owner's next, so that an owner with many does not hold up the others. A
    /// submission's webhook is due as soon as its plan has ended: it is stored in the same step as the submission and
    /// made due in the same step as the end. It is removed with its plan.
    async fn due_webhooks(&self, now_ms: i64, limit: usize) -> Result<Vec<Webhook>, StoreError>;

    /// A plan's webhook has been tried; it is due again at `next_ms`, or done with. It is no error if it no longer
    /// exists.
    async fn webhook_tried(&self, id: PlanId, next_ms: Option<i64>) -> Result<(), StoreError>;

    /// The datasets that plans of any owner use, in the order of their sums.
    async fn datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError>;

    /// The same, but an error unless all plans are known: what none of them uses may be removed.
    async fn all_datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError> {
        self.datasets_in_use().await
    }

    /// Counts for the queue's head-room and `Retry-After`.
    async fn stats(&self) -> Result<Stats, StoreError>;

    /// Whether the store can take a write now: it makes a small one durable.
    async fn health(&self) -> Result<(), StoreError>;

    /// What an operator should see to, although the store works.
    fn warning(&self) -> Option<String> {
        None
    }

    /// Finish pending writes, give back what is still being run here, and release files. Waiting claims and later calls
    /// fail.
    async fn close(&self);
}

/// How long a deleted plan is remembered, milliseconds.
pub const TOMBSTONE_MS: i64 = 24 * 60 * 60 * 1_000;

/// How long an idempotency key is remembered, milliseconds.
pub const IDEMPOTENCY_MS: i64 = 24 * 60 * 60 * 1_000;

/// Maximum number of plans removed by one [`Store::sweep`], so that nobody waits long behind it.
pub const SWEEP: usize = 256;

/// The answer to a submission.
#[derive(Debug, Clone, PartialEq)]
pub struct Submitted {
    /// The plan's present record.
    pub plan: Plan,
    /// Whether it was made by an earlier submission with the same idempotency key.
    pub replayed: bool,
}

/// A page of a plan's events.
#[derive(Debug, Clone, PartialEq)]
pub struct EventPage {
    /// Events up to this id are no longer kept; 0 when all are.
    pub forgotten: u64,
    /// The events, in order.
    pub events: Vec<NumberedEvent>,
}

/// A notification of a plan's end.
#[derive(Debug, Clone, PartialEq)]
pub struct Webhook {
    /// The plan as it ended.
    pub plan: Plan,
    /// Where to send it.
    pub url: String,
    /// How often sending has been tried.
    pub tries: u32,
}

/// How many plans use a dataset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DatasetUse {
    /// As in [`Submission::dataset`].
    pub sha256: String,
    /// Plans that are queued or running.
    pub active: u64,
    /// All plans in the store.
    pub plans: u64,
}

/// What remains of a removed plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tombstone {
    /// Which plan it was.
    pub id: PlanId,
    /// Its owner.
    pub owner: Option<Owner>,
    /// Whether it had expired; otherwise somebody deleted it.
    pub expired: bool,
    /// The last of its events; `None` of one that an earlier version of this program removed.
    pub end: Option<LastEvent>,
}

/// The `end` of a removed plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct LastEvent {
    /// Its number.
    pub id: u64,
    /// How the plan ended.
    pub status: Status,
}

impl LastEvent {
    /// Of a plan that is removed in this state, with `newest` the number of its newest event: its end, or else the removal
    /// cancels it.
    pub(crate) fn of(status: Status, newest: u64) -> Self {
        if status.is_final() {
            Self { id: newest, status }
        } else {
            Self {
                id: newest + 1,
                status: Status::Cancelled,
            }
        }
    }
}

/// The right to run one plan, from [`Store::claim`] or [`Store::claim_early`] to [`Store::finish`] or [`Store::release`].
#[derive(Debug, Clone)]
pub struct Lease {
    /// The record at the time of the claim.
    pub plan: Plan,
    /// The accepted scenario document.
    pub scenario: Arc<str>,
    /// Distinguishes this run from earlier runs of the same plan.
    pub attempt: u64,
    /// Becomes true when somebody requests the end of the plan or deletes it.
    pub cancel: watch::Receiver<bool>,
}

/// What [`Store::list`] returns.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ListQuery {
    /// Only plans with this status, or all.
    pub status: Option<Status>,
    /// Only this owner's, or everybody's.
    pub owner: Option<Owner>,
    /// Only plans older than this one.
    pub before: Option<PlanId>,
    /// Maximum number returned.
    pub limit: usize,
}

/// Number of runs in [`Stats::mean_run_ms`].
const RUNS_IN_MEAN: u32 = 20;

/// Counts of a store.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stats {
    /// Plans waiting.
    pub queued: u64,
    /// When the plan at the head of the queue was accepted, milliseconds since 1970; `None` without one.
    pub oldest_queued_ms: Option<i64>,
    /// Plans being run.
    pub running: u64,
    /// Mean run time of the last 20 plans that ended with a result, milliseconds; `None` before the first.
    pub mean_run_ms: Option<f64>,
    /// Plans that all nodes of the store together run at the same time; `None` when one process alone uses it.
    pub slots: Option<usize>,
}
