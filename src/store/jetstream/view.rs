//! A node's knowledge of all plans: kept from the plans' stream, and from what the node writes itself, so that whoever
//! has been answered can read what they were told.

use std::sync::Arc;

use parking_lot::{Mutex, MutexGuard};
use tokio::sync::watch;

use super::known::Known;
use super::record::{Placed, Record, State};
use crate::job::PlanId;
use crate::store::changes::Changes;
use crate::store::{StoreError, TOMBSTONE_MS};

/// The module's documentation describes it.
pub(super) struct View {
    known: Mutex<Known>,
    /// Ticks whenever there may be something to claim.
    waiting: watch::Sender<u64>,
    pub(super) changes: Changes,
}

/// A plan's state, and the stream sequence it dates from.
#[derive(Debug, Clone)]
pub(super) struct Standing {
    pub(super) sequence: u64,
    pub(super) state: Arc<State>,
}

impl View {
    pub(super) fn new(events_kept: u64) -> Self {
        Self {
            known: Mutex::new(Known::new(events_kept)),
            waiting: watch::Sender::new(0),
            changes: Changes::default(),
        }
    }

    pub(super) fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock()
    }

    /// Ticks whenever there may be something to claim.
    pub(super) fn waiting(&self) -> watch::Receiver<u64> {
        self.waiting.subscribe()
    }

    /// Take in a step, whoever wrote it; false when it was already known or superseded.
    pub(super) fn learn(&self, id: PlanId, placed: &Placed) -> bool {
        let queued = {
            let mut known = self.known();
            known.histories.push(id, &placed.step);
            if !known.stand(id, placed) {
                return false;
            }
            known.is_queued(id)
        };
        if queued {
            self.waiting.send_modify(|ticks| *ticks += 1);
        }
        self.changes.tick(id);
        true
    }

    /// A plan that was expected to run here does not.
    pub(super) fn expect_no_run(&self, id: PlanId) {
        if self.known().expect_no_run(id) {
            self.waiting.send_modify(|ticks| *ticks += 1);
        }
    }

    /// A plan whose tombstone has expired.
    pub(super) fn forget(&self, id: PlanId) {
        self.known().forget(id);
    }

    /// A plan that is no longer on the servers, unless a later step than `sequence` is known by now.
    pub(super) fn forget_since(&self, id: PlanId, sequence: u64) {
        {
            let mut known = self.known();
            let standing = known.standing(id);
            if standing.is_none_or(|standing| standing.sequence > sequence) {
                return;
            }
            known.forget(id);
        }
        self.changes.tick(id);
    }

    /// Wait until the steps of a plan up to this one have come, or the plan is forgotten.
    pub(super) async fn caught_up(&self, id: PlanId, sequence: u64) {
        let mut changes = self.changes.subscribe(id);
        let is_behind = || {
            let standing = self.standing(id);
            standing.is_some_and(|standing| standing.sequence < sequence)
        };
        while is_behind() && changes.changed().await.is_ok() {}
    }

    pub(super) fn standing(&self, id: PlanId) -> Option<Standing> {
        self.known().standing(id)
    }
}

impl Standing {
    /// Whether nothing more happens to the plan, but that it may be removed.
    pub(super) fn has_ended(&self) -> bool {
        match &*self.state {
            State::Kept(record) => record.plan.status.is_final(),
            State::Buried(_) => true,
        }
    }

    /// The record of the plan, unless it has been removed.
    pub(super) fn kept(&self) -> Option<&Record> {
        match &*self.state {
            State::Kept(record) => Some(record),
            State::Buried(_) => None,
        }
    }

    /// As [`Standing::kept`]; otherwise, whether and when it was removed.
    ///
    /// # Errors
    /// [`StoreError::Gone`], [`StoreError::NotFound`].
    pub(super) fn record(&self, id: PlanId, expiry_ms: i64) -> Result<&Record, StoreError> {
        match &*self.state {
            State::Kept(record) => Ok(record),
            State::Buried(grave) if expiry_ms.saturating_sub(grave.deleted_ms) < TOMBSTONE_MS => {
                Err(StoreError::Gone(grave.tombstone(id)))
            }
            State::Buried(_) => Err(StoreError::NotFound(id)),
        }
    }
}
