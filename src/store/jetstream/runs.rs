//! What the worker of a plan tells of its run, and how the run ends.

use async_nats::jetstream::AckKind;

use super::JetStream;
use super::claim::answer;
use super::record::{Document, Record, State};
use super::steps::Change;
use super::view::Standing;
use crate::job::{Event, Plan, PlanId, Status};
use crate::store::{Ending, StoreError};

/// Events of one step; a message must not grow too long.
const EVENTS: usize = 256;

impl JetStream {
    pub(super) async fn append(
        &self,
        id: PlanId,
        attempt: u64,
        events: &[Event],
    ) -> Result<(), StoreError> {
        if events.is_empty() {
            let standing = self.plans().standing(id).await?;
            return own(&standing, id, attempt).map(drop);
        }
        for part in events.chunks(EVENTS) {
            self.append_part(id, attempt, part).await?;
        }
        Ok(())
    }

    async fn append_part(
        &self,
        id: PlanId,
        attempt: u64,
        events: &[Event],
    ) -> Result<(), StoreError> {
        let number = self
            .leases
            .next_append(id, attempt)
            .ok_or(StoreError::LeaseLost(id))?;
        let point = events.iter().rev().find_map(|event| match event {
            Event::Convergence(point) => Some(point),
            _ => None,
        });
        let appended = self
            .plans()
            .change(id, |standing| {
                let record = own(standing, id, attempt)?;
                if record.appended >= number {
                    // Written before, when no answer came.
                    return Ok(None);
                }
                let mut record = Box::new(record.clone());
                record.appended = number;
                if let Some(point) = point {
                    record.plan.advance(point);
                }
                Ok(Some(Change {
                    state: State::Kept(record),
                    events: events.to_vec(),
                }))
            })
            .await;
        match appended {
            Ok(_) => {
                self.leases.appended(id, attempt, number);
                Ok(())
            }
            Err(error) => Err(lost(error, id)),
        }
    }

    pub(super) async fn finish(
        &self,
        id: PlanId,
        attempt: u64,
        ending: &Ending,
        now_ms: i64,
    ) -> Result<Plan, StoreError> {
        let result = match ending {
            Ending::Result { document, .. } => {
                own(
                    &self
                        .plans()
                        .standing(id)
                        .await
                        .map_err(|error| lost(error, id))?,
                    id,
                    attempt,
                )?;
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
                ending.apply(&mut record.plan, now_ms)?;
                if let Some((result, bytes)) = &result {
                    record.bytes += bytes;
                    record.result = Some(result.clone());
                }
                let events = record.told_end(self.options.retention.age_ms);
                Ok(Some(Change {
                    state: State::Kept(record),
                    events,
                }))
            })
            .await;
        let standing = finished.map_err(|error| lost(error, id))?;
        if let Some(job) = self.leases.let_go(id, attempt) {
            answer(&job, AckKind::Ack).await;
        }
        let record = standing.record(id, now_ms)?;
        Ok(record.plan.clone())
    }

    pub(super) async fn release(&self, id: PlanId, attempt: u64) -> Result<(), StoreError> {
        let now_ms = (self.options.clock)();
        let mut back = AckKind::Nak(None);
        let released = self
            .plans()
            .change(id, |standing| {
                let mut record = Box::new(own(standing, id, attempt)?.clone());
                let events = if record.plan.cancel_requested {
                    record.plan.cancel(now_ms)?;
                    back = AckKind::Ack;
                    record.told_end(self.options.retention.age_ms)
                } else {
                    record.plan.requeue()?;
                    record.plan.queue_position = Some(self.view.known().position(record.place));
                    record.told()
                };
                Ok(Some(Change {
                    state: State::Kept(record),
                    events,
                }))
            })
            .await;
        released.map_err(|error| lost(error, id))?;
        if let Some(job) = self.leases.let_go(id, attempt) {
            answer(&job, back).await;
        }
        Ok(())
    }

    pub(super) async fn request_cancel(&self, id: PlanId, now_ms: i64) -> Result<Plan, StoreError> {
        let clock_ms = (self.options.clock)();
        let mut waited = None;
        let standing = self
            .plans()
            .change(id, |standing| {
                waited = None;
                let mut record = Box::new(standing.record(id, clock_ms)?.clone());
                let events = match record.plan.status {
                    Status::Queued => {
                        record.plan.cancel(now_ms)?;
                        waited = Some(record.place);
                        record.told_end(self.options.retention.age_ms)
                    }
                    Status::Running if !record.plan.cancel_requested => {
                        record.plan.request_cancel();
                        record.told()
                    }
                    Status::Running | Status::Succeeded | Status::Failed | Status::Cancelled => {
                        return Ok(None);
                    }
                };
                Ok(Some(Change {
                    state: State::Kept(record),
                    events,
                }))
            })
            .await?;
        if let Some(place) = waited {
            self.withdraw(id, place).await;
        }
        Ok(standing.record(id, clock_ms)?.plan.clone())
    }
}

/// The record of a plan that is run under that attempt.
fn own(standing: &Standing, id: PlanId, attempt: u64) -> Result<&Record, StoreError> {
    match &*standing.state {
        State::Kept(record) if record.is_run_under(attempt) => Ok(record),
        _ => Err(StoreError::LeaseLost(id)),
    }
}

/// A plan that is nowhere is nobody's to run.
fn lost(error: StoreError, id: PlanId) -> StoreError {
    match error {
        StoreError::NotFound(_) | StoreError::Gone(_) => StoreError::LeaseLost(id),
        other => other,
    }
}
