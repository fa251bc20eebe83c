//! A store that measures the one it wraps, so that stores themselves measure nothing.

use std::sync::Arc;
use std::time::Instant;

use async_trait::async_trait;
use tokio::sync::watch;

use super::{
    DatasetUse, End, EventPage, Lease, ListQuery, Stats, Store, StoreError, Submitted, Webhook,
};
use crate::export::document::Incumbent;
use crate::job::{Event, Idempotency, Owner, Plan, PlanId, Submission};
use crate::telemetry::Instruments;

/// Does what the wrapped store does, and reports how long it took.
pub struct MeasuredStore {
    store: Arc<dyn Store>,
    instruments: Arc<Instruments>,
}

impl MeasuredStore {
    /// Measure `store`.
    #[must_use]
    pub fn new(store: Arc<dyn Store>, instruments: Arc<Instruments>) -> Self {
        Self { store, instruments }
    }

    async fn measured<T>(
        &self,
        operation: &'static str,
        step: impl Future<Output = Result<T, StoreError>>,
    ) -> Result<T, StoreError> {
        let begun = Instant::now();
        let done = step.await;
        self.instruments.metrics.stored(operation, begun.elapsed());
        self.counted(operation, done)
    }

    /// A caller's mistake is not a failure of the store, and neither is what a single plan has lost.
    fn counted<T>(
        &self,
        operation: &'static str,
        done: Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        if let Err(StoreError::Unavailable { .. } | StoreError::InUse(_)) = done {
            self.instruments.metrics.store_failed(operation);
        }
        done
    }
}

#[async_trait]
impl Store for MeasuredStore {
    async fn submit(&self, submission: Submission) -> Result<Submitted, StoreError> {
        self.measured("submit", self.store.submit(submission)).await
    }

    async fn repeated(
        &self,
        owner: Option<&Owner>,
        idempotency: &Idempotency,
    ) -> Result<Option<Plan>, StoreError> {
        let repeated = self.store.repeated(owner, idempotency);
        self.measured("repeated", repeated).await
    }

    /// Not timed: it waits for a plan.
    async fn claim(&self) -> Result<Lease, StoreError> {
        self.counted("claim", self.store.claim().await)
    }

    /// Not timed either.
    async fn claim_early(&self) -> Result<Lease, StoreError> {
        self.counted("claim", self.store.claim_early().await)
    }

    async fn append(&self, lease: &Lease, events: Vec<Event>) -> Result<(), StoreError> {
        self.measured("append", self.store.append(lease, events))
            .await
    }

    async fn finish(&self, lease: &Lease, end: Arc<End>) -> Result<Plan, StoreError> {
        self.measured("finish", self.store.finish(lease, end)).await
    }

    async fn release(&self, lease: &Lease) -> Result<Plan, StoreError> {
        self.measured("release", self.store.release(lease)).await
    }

    async fn postpone(&self, lease: &Lease) -> Result<Plan, StoreError> {
        self.measured("release", self.store.postpone(lease)).await
    }

    async fn request_cancel_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<Plan, StoreError> {
        self.measured(
            "request_cancel",
            self.store.request_cancel_if(id, revision, now_ms),
        )
        .await
    }

    async fn delete_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<(), StoreError> {
        self.measured("delete", self.store.delete_if(id, revision, now_ms))
            .await
    }

    async fn get(&self, id: PlanId) -> Result<Plan, StoreError> {
        self.measured("get", self.store.get(id)).await
    }

    async fn scenario(&self, id: PlanId) -> Result<String, StoreError> {
        self.measured("scenario", self.store.scenario(id)).await
    }

    async fn result(&self, id: PlanId) -> Result<Option<String>, StoreError> {
        self.measured("result", self.store.result(id)).await
    }

    async fn list(&self, query: ListQuery) -> Result<Vec<Plan>, StoreError> {
        self.measured("list", self.store.list(query)).await
    }

    async fn events(&self, id: PlanId, after: u64, limit: usize) -> Result<EventPage, StoreError> {
        let step = self.store.events(id, after, limit);
        self.measured("events", step).await
    }

    async fn has_event(&self, id: PlanId, event: u64) -> Result<bool, StoreError> {
        self.measured("has_event", self.store.has_event(id, event))
            .await
    }

    async fn incumbent(&self, id: PlanId) -> Result<Option<Incumbent>, StoreError> {
        self.measured("incumbent", self.store.incumbent(id)).await
    }

    async fn sweep(&self, now_ms: i64) -> Result<usize, StoreError> {
        self.measured("sweep", self.store.sweep(now_ms)).await
    }

    async fn due_webhooks(&self, now_ms: i64, limit: usize) -> Result<Vec<Webhook>, StoreError> {
        let due = self.store.due_webhooks(now_ms, limit);
        self.measured("due_webhooks", due).await
    }

    async fn webhook_tried(&self, id: PlanId, next_ms: Option<i64>) -> Result<(), StoreError> {
        let tried = self.store.webhook_tried(id, next_ms);
        self.measured("webhook_tried", tried).await
    }

    fn changes(&self, id: PlanId) -> watch::Receiver<u64> {
        self.store.changes(id)
    }

    async fn datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError> {
        let uses = self.store.datasets_in_use();
        self.measured("datasets_in_use", uses).await
    }

    async fn all_datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError> {
        let uses = self.store.all_datasets_in_use();
        self.measured("datasets_in_use", uses).await
    }

    async fn stats(&self) -> Result<Stats, StoreError> {
        self.measured("stats", self.store.stats()).await
    }

    async fn health(&self) -> Result<(), StoreError> {
        self.measured("health", self.store.health()).await
    }

    fn warning(&self) -> Option<String> {
        self.store.warning()
    }

    async fn close(&self) {
        self.store.close().await;
    }
}
