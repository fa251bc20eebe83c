//! A store that fails at every other step of a run or a webhook, or in which something happens while a plan is read,
//! and that works otherwise.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use async_trait::async_trait;
use noctule::export::document::Incumbent;
use noctule::job::{Event, Idempotency, Owner, Plan, PlanId, Status, Submission};
use noctule::store::{
    DatasetUse, End, EventPage, Lease, ListQuery, Stats, Store, StoreError, Submitted, Webhook,
    wall_clock,
};
use tokio::sync::watch;

use super::run;

pub(crate) struct FaultyStore {
    sound: Arc<dyn Store>,
    steps: AtomicU64,
    trouble: Trouble,
}

enum Trouble {
    Fails,
    Panics,
    /// A plan is deleted before its result is read.
    Deleted,
    /// The run ends before its route so far is read.
    Ended(Box<Lease>),
}

impl FaultyStore {
    pub(crate) fn new(sound: Arc<dyn Store>) -> Self {
        Self::with(sound, Trouble::Fails)
    }

    fn with(sound: Arc<dyn Store>, trouble: Trouble) -> Self {
        Self {
            sound,
            steps: AtomicU64::new(0),
            trouble,
        }
    }

    /// Panics where the other one fails.
    pub(crate) fn that_panics(sound: Arc<dyn Store>) -> Self {
        Self::with(sound, Trouble::Panics)
    }

    /// Plans are deleted before their results are read.
    pub(crate) fn that_deletes(sound: Arc<dyn Store>) -> Self {
        Self::with(sound, Trouble::Deleted)
    }

    /// The run of `lease` succeeds before its route so far is read.
    pub(crate) fn that_ends(sound: Arc<dyn Store>, lease: Lease) -> Self {
        Self::with(sound, Trouble::Ended(Box::new(lease)))
    }

    /// Fails for the first, third, fifth, ... caller.
    fn stumble(&self) -> Result<(), StoreError> {
        match self.steps.fetch_add(1, Ordering::SeqCst) % 2 {
            0 if matches!(self.trouble, Trouble::Panics) => panic!("as it shall"),
            0 => Err(StoreError::unavailable("disk full")),
            _ => Ok(()),
        }
    }
}

#[async_trait]
impl Store for FaultyStore {
    async fn submit(&self, submission: Submission) -> Result<Submitted, StoreError> {
        self.sound.submit(submission).await
    }

    async fn repeated(
        &self,
        owner: Option<&Owner>,
        idempotency: &Idempotency,
    ) -> Result<Option<Plan>, StoreError> {
        self.sound.repeated(owner, idempotency).await
    }

    async fn claim(&self) -> Result<Lease, StoreError> {
        self.stumble()?;
        self.sound.claim().await
    }

    async fn claim_early(&self) -> Result<Lease, StoreError> {
        self.stumble()?;
        self.sound.claim_early().await
    }

    async fn append(&self, lease: &Lease, events: Vec<Event>) -> Result<(), StoreError> {
        self.stumble()?;
        self.sound.append(lease, events).await
    }

    async fn finish(&self, lease: &Lease, end: Arc<End>) -> Result<Plan, StoreError> {
        self.stumble()?;
        self.sound.finish(lease, end).await
    }

    async fn release(&self, lease: &Lease) -> Result<Plan, StoreError> {
        self.stumble()?;
        self.sound.release(lease).await
    }

    async fn postpone(&self, lease: &Lease) -> Result<Plan, StoreError> {
        self.stumble()?;
        self.sound.postpone(lease).await
    }

    async fn request_cancel_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<Plan, StoreError> {
        self.sound.request_cancel_if(id, revision, now_ms).await
    }

    async fn delete_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<(), StoreError> {
        self.sound.delete_if(id, revision, now_ms).await
    }

    async fn get(&self, id: PlanId) -> Result<Plan, StoreError> {
        self.sound.get(id).await
    }

    async fn scenario(&self, id: PlanId) -> Result<String, StoreError> {
        self.sound.scenario(id).await
    }

    async fn result(&self, id: PlanId) -> Result<Option<String>, StoreError> {
        if matches!(self.trouble, Trouble::Deleted) {
            self.sound.delete(id, wall_clock()()).await?;
        }
        self.sound.result(id).await
    }

    async fn incumbent(&self, id: PlanId) -> Result<Option<Incumbent>, StoreError> {
        if let Trouble::Ended(lease) = &self.trouble {
            run::finish(&*self.sound, lease, Status::Succeeded).await;
        }
        self.sound.incumbent(id).await
    }

    async fn list(&self, query: ListQuery) -> Result<Vec<Plan>, StoreError> {
        self.sound.list(query).await
    }

    async fn events(&self, id: PlanId, after: u64, limit: usize) -> Result<EventPage, StoreError> {
        self.sound.events(id, after, limit).await
    }

    async fn has_event(&self, id: PlanId, event: u64) -> Result<bool, StoreError> {
        self.sound.has_event(id, event).await
    }

    fn changes(&self, id: PlanId) -> watch::Receiver<u64> {
        self.sound.changes(id)
    }

    async fn sweep(&self, now_ms: i64) -> Result<usize, StoreError> {
        self.sound.sweep(now_ms).await
    }

    async fn due_webhooks(&self, now_ms: i64, limit: usize) -> Result<Vec<Webhook>, StoreError> {
        self.sound.due_webhooks(now_ms, limit).await
    }

    async fn webhook_tried(&self, id: PlanId, next_ms: Option<i64>) -> Result<(), StoreError> {
        self.stumble()?;
        self.sound.webhook_tried(id, next_ms).await
    }

    async fn datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError> {
        self.sound.datasets_in_use().await
    }

    async fn stats(&self) -> Result<Stats, StoreError> {
        self.sound.stats().await
    }

    async fn health(&self) -> Result<(), StoreError> {
        self.sound.health().await
    }

    fn warning(&self) -> Option<String> {
        self.sound.warning()
    }

    async fn close(&self) {
        self.sound.close().await;
    }
}
