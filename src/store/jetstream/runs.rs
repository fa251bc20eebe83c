//! What a plan's worker reports of its run, and how the run ends.

use std::time::Duration;

use async_nats::jetstream::AckKind;

use super::JetStream;
use super::claim::answer;
use super::record::{Document, Record, State, length};
use super::run_steps::{Appended, RunSteps};
use super::steps::Change;
use super::view::Standing;
use crate::job::{Event, Plan, PlanId, Status};
use crate::store::parts::parts;
use crate::store::{End, Ending, StoreError, expected, pause_after};

impl JetStream {
    pub(super) async fn append(
        &self,
        id: PlanId,
        attempt: u64,
        events: &[Event],
    ) -> Result<(), StoreError> {
        let appended = self.try_to_append(id, attempt, events).await;
        self.let_go_when_lost(id, attempt, appended)
    }

    pub(super) async fn finish(
        &self,
        id: PlanId,
        attempt: u64,
        end: &End,
    ) -> Result<Plan, StoreError> {
        let finished = match self.try_to_finish(id, attempt, end).await {
            Err(StoreError::LeaseLost(_)) => self.finished_before(id, attempt, end),
            finished => finished,
        };
        if finished.is_ok()
            && let Some(job) = self.leases.let_go(id, attempt)
        {
            answer(id, &job, AckKind::Ack).await;
        }
        self.let_go_when_lost(id, attempt, finished)
    }

    pub(super) async fn release(&self, id: PlanId, attempt: u64) -> Result<Plan, StoreError> {
        let released = self.try_to_release(id, attempt, None).await;
        self.let_go_when_lost(id, attempt, released)
    }

    pub(super) async fn postpone(&self, id: PlanId, attempt: u64) -> Result<Plan, StoreError> {
        let pause = Some(pause_after(attempt));
        let postponed = self.try_to_release(id, attempt, pause).await;
        self.let_go_when_lost(id, attempt, postponed)
    }

    /// Nothing is held any more of a run that turns out to be no longer this node's.
    fn let_go_when_lost<T>(
        &self,
        id: PlanId,
        attempt: u64,
        done: Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        if matches!(done, Err(StoreError::LeaseLost(_))) {
            self.leases.let_go(id, attempt);
        }
        done
    }

    async fn try_to_append(
        &self,
        id: PlanId,
        attempt: u64,
        events: &[Event],
    ) -> Result<(), StoreError> {
        if events.is_empty() {
            return self.still_own(id, attempt).await;
        }
        let appended = self.append_all(id, attempt, &parts(events)).await?;
        self.leases.appended(id, attempt, appended);
        Ok(())
    }

    async fn still_own(&self, id: PlanId, attempt: u64) -> Result<(), StoreError> {
        let standing = self.plans().standing(id).await;
        let standing = standing.map_err(|error| lost(error, id))?;
        own(&standing, id, attempt).map(drop)
    }

    /// Append a step for each part; returns the number of the last. Until that is recorded, a retry writes only what
    /// was not written before.
    async fn append_all(
        &self,
        id: PlanId,
        attempt: u64,
        parts: &[&[Event]],
    ) -> Result<u64, StoreError> {
        let appended = self
            .leases
            .appended_last(id, attempt)
            .ok_or(StoreError::LeaseLost(id))?;
        let mut number = appended;
        for part in parts {
            number += 1;
            self.append_part(id, attempt, number, part).await?;
            self.forget_old_events(id, attempt).await;
        }
        Ok(number)
    }

    /// Delete the oldest events of a run that tells many. A failure is retried at the next step.
    async fn forget_old_events(&self, id: PlanId, attempt: u64) {
        let kept = self.options.events_kept;
        let excess = |steps: &mut RunSteps| steps.excess(kept);
        let Some(Some(first)) = self.leases.steps(id, attempt, excess) else {
            return;
        };
        match self.servers.purge_steps(id).sequence(first).await {
            Ok(_) => {
                let forget = |steps: &mut RunSteps| steps.forget_before(first);
                self.leases.steps(id, attempt, forget);
            }
            Err(error) => tracing::debug!(%error, plan_id = %id, "old events are kept for now"),
        }
    }

    async fn append_part(
        &self,
        id: PlanId,
        attempt: u64,
        number: u64,
        events: &[Event],
    ) -> Result<(), StoreError> {
        let bytes = length(events);
        let left = self.leases.steps(id, attempt, |steps| steps.bytes_left());
        let left = left.flatten();
        let appended = self
            .plans()
            .change(id, |standing| {
                let record = own(standing, id, attempt)?;
                if record.appended >= number {
                    // It was written earlier, but the answer was lost.
                    return Ok(None);
                }
                let mut record = Box::new(record.clone());
                record.appended = number;
                record.event_bytes = left.unwrap_or(record.event_bytes) + bytes;
                record.plan.advance(events);
                Ok(Some(Change {
                    events: events.to_vec(),
                    ..Change::silent(State::Kept(record))
                }))
            })
            .await;
        let standing = appended.map_err(|error| lost(error, id))?;
        let step = Appended {
            number,
            sequence: standing.sequence,
            events: events.len() as u64,
            bytes,
        };
        self.leases.steps(id, attempt, |steps| steps.push(step));
        Ok(())
    }

    async fn try_to_finish(&self, id: PlanId, attempt: u64, end: &End) -> Result<Plan, StoreError> {
        let mut parts = parts(&end.events);
        let last = parts.pop().unwrap_or_default();
        self.still_own(id, attempt).await?;
        self.append_all(id, attempt, &parts).await?;
        let result = match &end.ending {
            Ending::Result { document, .. } => {
                let result = Document::result(id, attempt, document);
                self.servers.write(&result, document).await?;
                Some((result, document.len() as u64))
            }
            Ending::Failed(_) => None,
        };
        let finished = self
            .plans()
            .change(id, |standing| {
                let mut record = Box::new(own(standing, id, attempt)?.clone());
                end.apply(&mut record.plan)?;
                if let Some((result, bytes)) = &result {
                    record.bytes += bytes;
                    record.result = Some(result.clone());
                }
                record.ended(self.options.retention);
                record.event_bytes += length(last);
                Ok(Some(Change {
                    events: last.to_vec(),
                    ..Change::announced(record)
                }))
            })
            .await;
        let standing = finished.map_err(|error| lost(error, id))?;
        let record = standing.record(id, end.at_ms)?;
        Ok(record.plan.clone())
    }

    /// The plan as an earlier call has ended it whose answer was lost: until it is answered, the run holds its job.
    fn finished_before(&self, id: PlanId, attempt: u64, end: &End) -> Result<Plan, StoreError> {
        let standing = self.view.standing(id);
        let record = standing.as_ref().and_then(|standing| standing.kept());
        record
            .filter(|record| record.is_ended_by(attempt, &end.ending))
            .filter(|_| self.leases.holds(id, attempt))
            .map(|record| record.plan.clone())
            .ok_or(StoreError::LeaseLost(id))
    }

    /// The job comes again after `pause`.
    async fn try_to_release(
        &self,
        id: PlanId,
        attempt: u64,
        pause: Option<Duration>,
    ) -> Result<Plan, StoreError> {
        let now_ms = (self.options.clock)();
        let mut back = AckKind::Nak(pause);
        let released = self
            .plans()
            .change(id, |standing| {
                let mut record = Box::new(own(standing, id, attempt)?.clone());
                if record.plan.cancel_requested {
                    record.plan.cancel(now_ms)?;
                    back = AckKind::Ack;
                    record.ended(self.options.retention);
                } else {
                    record.plan.requeue()?;
                    record.plan.queue_position = Some(self.view.known().position(record.place));
                }
                Ok(Some(Change::announced(record)))
            })
            .await;
        let standing = released.map_err(|error| lost(error, id))?;
        if let Some(job) = self.leases.let_go(id, attempt) {
            answer(id, &job, back).await;
        }
        let record = standing.record(id, now_ms)?;
        Ok(record.plan.clone())
    }

    pub(super) async fn request_cancel(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<Plan, StoreError> {
        let expiry_ms = self.expiry_ms();
        let mut waited = None;
        let standing = self
            .plans()
            .change(id, |standing| {
                waited = None;
                let mut record = Box::new(standing.record(id, expiry_ms)?.clone());
                expected(&record.plan, revision)?;
                match record.plan.status {
                    Status::Queued => {
                        record.plan.cancel(now_ms)?;
                        waited = Some(record.place);
                        record.ended(self.options.retention);
                    }
                    Status::Running if !record.plan.cancel_requested => {
                        record.plan.request_cancel();
                    }
                    Status::Running | Status::Succeeded | Status::Failed | Status::Cancelled => {
                        return Ok(None);
                    }
                }
                Ok(Some(Change::announced(record)))
            })
            .await?;
        if let Some(place) = waited {
            self.withdraw(id, place).await;
        }
        Ok(standing.record(id, expiry_ms)?.plan.clone())
    }
}

/// The record of a plan that is being run under this attempt.
fn own(standing: &Standing, id: PlanId, attempt: u64) -> Result<&Record, StoreError> {
    let record = standing.kept();
    record
        .filter(|record| record.is_run_under(attempt))
        .ok_or(StoreError::LeaseLost(id))
}

/// A plan that does not exist cannot be run under any lease.
fn lost(error: StoreError, id: PlanId) -> StoreError {
    match error {
        StoreError::NotFound(_) | StoreError::Gone(_) => StoreError::LeaseLost(id),
        other => other,
    }
}
