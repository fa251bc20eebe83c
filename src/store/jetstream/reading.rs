//! What a node answers about a plan: from what it knows, and from the servers where that is not enough.

use std::sync::Arc;

use async_nats::jetstream::consumer::DeliverPolicy;
use futures_util::StreamExt as _;
use tokio::time::timeout;

use super::JetStream;
use super::connect::PATIENCE;
use super::delivery::Delivery;
use super::errors::refused;
use super::history::History;
use super::record::{Document, Step};
use super::together::Together;
use super::view::Standing;
use crate::export::document::Incumbent;
use crate::job::{Plan, PlanId};
use crate::store::{EventPage, StoreError};

/// Plans whose histories are read from the servers at the same time: each may be megabytes.
const HISTORIES: usize = 4;

/// Plans whose states are asked for at the same time.
const STATES: usize = 1024;

/// What the servers are being asked.
pub(super) struct Asking {
    /// Histories that are not in memory.
    histories: Together<Arc<History>>,
    /// States that another node may have changed.
    states: Together<Standing>,
}

impl Default for Asking {
    fn default() -> Self {
        Self {
            histories: Together::new(HISTORIES),
            states: Together::new(STATES),
        }
    }
}

impl JetStream {
    pub(super) async fn get(&self, id: PlanId) -> Result<Plan, StoreError> {
        let standing = self.present(id).await?;
        let record = standing.record(id, self.expiry_ms())?;
        Ok(self.view.known().shown(record))
    }

    pub(super) async fn scenario(&self, id: PlanId) -> Result<String, StoreError> {
        let standing = self.plans().standing(id).await?;
        let record = standing.record(id, self.expiry_ms())?;
        let scenario = self.read_document(id, &record.scenario).await?;
        scenario.ok_or(StoreError::ScenarioLost(id))
    }

    pub(super) async fn result(&self, id: PlanId) -> Result<Option<String>, StoreError> {
        let standing = self.present(id).await?;
        match &standing.record(id, self.expiry_ms())?.result {
            Some(result) => match self.read_document(id, result).await? {
                Some(text) => Ok(Some(text)),
                None => Err(result.missing()),
            },
            None => Ok(None),
        }
    }

    pub(super) async fn incumbent(&self, id: PlanId) -> Result<Option<Incumbent>, StoreError> {
        let standing = self.plans().standing(id).await?;
        let record = standing.record(id, self.expiry_ms())?;
        if !record.is_run_under(record.attempt) {
            return Ok(None);
        }
        if let Some(history) = self.view.known().histories.whole(id) {
            return Ok(history.incumbent(record.attempt));
        }
        Ok(self.recall(id).await?.incumbent(record.attempt))
    }

    pub(super) async fn events(
        &self,
        id: PlanId,
        after: u64,
        limit: usize,
    ) -> Result<EventPage, StoreError> {
        let standing = self.plans().standing(id).await?;
        standing.record(id, self.expiry_ms())?;
        if let Some(page) = self.view.known().histories.page(id, after, limit) {
            return Ok(page);
        }
        Ok(self.recall(id).await?.page(after, limit))
    }

    /// Where it is not known here, the servers decide: who is told wrongly that there is no such event reads all again.
    pub(super) async fn has_event(&self, id: PlanId, event: u64) -> Result<bool, StoreError> {
        let has_come_so_far = |standing: &Standing| -> Result<bool, StoreError> {
            let record = standing.record(id, self.expiry_ms())?;
            Ok(event <= record.last_event)
        };
        let plans = self.plans();
        if has_come_so_far(&plans.standing(id).await?)? {
            return Ok(true);
        }
        has_come_so_far(&plans.look_up(id).await?)
    }

    /// A history that is not in memory; it is from now on, as far as there is room.
    async fn recall(&self, id: PlanId) -> Result<Arc<History>, StoreError> {
        let read = async {
            let history = self.read_history(id).await?;
            self.view.known().keep_history(id, history.clone());
            Ok(Arc::new(history))
        };
        Box::pin(self.asking.histories.ask(id, read)).await
    }

    /// All events of a plan that the stream still keeps.
    async fn read_history(&self, id: PlanId) -> Result<History, StoreError> {
        let what = format!("events of plan {id}");
        let subject = self.servers.subject_of(id);
        let mut history = History::whole();
        let mut delivery = Delivery::of(&self.servers, &what, subject, DeliverPolicy::All).await?;
        if delivery.is_empty {
            return Ok(history);
        }
        loop {
            // Steps that are removed just now never come.
            let Ok(next) = timeout(PATIENCE, delivery.steps.next()).await else {
                let standing = self.plans().look_up(id).await?;
                standing.record(id, self.expiry_ms())?;
                return Err(refused(&what, "none came for a while"));
            };
            let Some(message) = next else { break };
            let message = message.map_err(|error| refused(&what, &error))?;
            let pending = message
                .info()
                .map_err(|error| refused(&what, &*error))?
                .pending;
            history.push(&Step::read(&message.payload)?, self.options.events_kept);
            if pending == 0 {
                break;
            }
        }
        Ok(history)
    }

    /// A plan's state, no older than what any node has told of it: of a plan that has not ended, another may know more
    /// for some milliseconds, so the servers are asked.
    async fn present(&self, id: PlanId) -> Result<Standing, StoreError> {
        let known = self.plans().standing(id).await?;
        if known.has_ended() || !self.servers.is_connected() {
            return Ok(known);
        }
        let plans = self.plans();
        let renewed = async { Ok(plans.renewed(id, known).await) };
        self.asking.states.ask(id, renewed).await
    }

    /// A document that a plan's record names; `None` when the servers have lost it, but not the plan.
    async fn read_document(
        &self,
        id: PlanId,
        document: &Document,
    ) -> Result<Option<String>, StoreError> {
        if let Some(text) = self.servers.read(document).await? {
            return Ok(Some(text));
        }
        // It goes with its plan, which may have been removed meanwhile.
        let standing = self.plans().look_up(id).await?;
        standing.record(id, self.expiry_ms())?;
        Ok(None)
    }
}
