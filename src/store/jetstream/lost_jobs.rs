//! Jobs that are missing from the queue while their plans wait for them: they are put back, at its end.
//!
//! A record is written after its job, and a job leaves the queue only after its plan has ended. But an operator may
//! purge the queue's stream, and the record of a submission that was given up may arrive after its job, which nobody
//! seemed to want, has been discarded.

use std::time::Duration;

use tokio::time::Instant;

use super::JetStream;
use super::errors::found;
use super::lane::Lane;
use super::record::{Record, State};
use super::steps::Change;
use crate::job::{PlanId, Status};
use crate::store::StoreError;

/// Only plans that have waited longer than this are looked at: most never wait as long, and a submission that has not
/// been answered by then has been given up.
const WAITED_MS: i64 = 120_000;

/// A node looks for missing jobs this often, at this many plans.
const PERIOD: Duration = Duration::from_secs(60);
const AT_ONCE: usize = 16;

/// How far a node has looked through the queue.
#[derive(Debug, Default)]
pub(super) struct Round {
    /// When it looked last; `None` before the first time.
    last: Option<Instant>,
    /// Place of the last plan that it looked at.
    place: u64,
}

impl JetStream {
    /// Look at some of the plans that have long been waiting, in turn, and put back the jobs that are missing.
    pub(super) async fn restore_jobs(&self, now_ms: i64) -> Result<(), StoreError> {
        let waiting = self.next_waiting(now_ms);
        let mut missing = 0;
        for id in &waiting {
            missing += usize::from(self.restore_job(*id).await?);
        }
        if missing > 0 && missing == waiting.len() {
            // Where all were missing there may be more: the whole queue was lost.
            self.round.lock().last = None;
        }
        Ok(())
    }

    /// The plans whose turn it is to be looked at.
    fn next_waiting(&self, now_ms: i64) -> Vec<PlanId> {
        let mut round = self.round.lock();
        if round.last.is_some_and(|last| last.elapsed() < PERIOD) {
            return Vec::new();
        }
        round.last = Some(Instant::now());
        let accepted_before = now_ms.saturating_sub(WAITED_MS);
        let waiting = self
            .view
            .known()
            .waiting(round.place, accepted_before, AT_ONCE);
        // After the last of them, the first again.
        round.place = waiting.last().map_or(0, |(place, _)| *place);
        waiting.into_iter().map(|(_, id)| id).collect()
    }

    /// True when the job was missing.
    async fn restore_job(&self, id: PlanId) -> Result<bool, StoreError> {
        let Some(waiting) = self.waiting_on_servers(id).await? else {
            return Ok(false);
        };
        if self.has_job(id, &waiting.lane).await? {
            return Ok(false);
        }
        let missing = waiting.place;
        // Nodes that find this at the same time put back one job: the servers identify it by the one that is missing.
        let place = self
            .enqueue(id, &waiting.lane, &format!("{id}.{missing}"))
            .await?;
        let plans = self.plans();
        let moved = plans.change(id, |standing| {
            let State::Kept(record) = &*standing.state else {
                return Ok(None);
            };
            if !is_waiting_at(record, missing) {
                return Ok(None);
            }
            let mut record = record.clone();
            record.place = place;
            Ok(Some(Change::silent(State::Kept(record))))
        });
        moved.await?;
        tracing::warn!(plan_id = %id, "the job of a waiting plan was missing from the queue; it is back, at the end");
        Ok(true)
    }

    /// The record of a plan that waits, as the servers have it.
    async fn waiting_on_servers(&self, id: PlanId) -> Result<Option<Record>, StoreError> {
        let standing = match self.plans().look_up(id).await {
            Ok(standing) => standing,
            Err(StoreError::NotFound(_)) => return Ok(None),
            Err(error) => return Err(error),
        };
        Ok(match &*standing.state {
            State::Kept(record) if record.plan.status == Status::Queued => Some((**record).clone()),
            _ => None,
        })
    }

    async fn has_job(&self, id: PlanId, lane: &Lane) -> Result<bool, StoreError> {
        let subject = self.job_subject(id, lane);
        let jobs = &self.servers.jobs;
        let job = jobs.get_last_raw_message_by_subject(&subject).await;
        Ok(found(job, || format!("job of plan {id}"))?.is_some())
    }
}

fn is_waiting_at(record: &Record, place: u64) -> bool {
    record.plan.status == Status::Queued && record.place == place
}
