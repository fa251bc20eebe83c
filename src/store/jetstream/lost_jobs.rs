//! Jobs that are missing from the queue while their plans need them: they are put back, at its end.
//!
//! A record is written after its job, and a job leaves the queue only after its plan has ended. But an operator may
//! purge the queue's stream or restore it from another moment than the plans', and the record of a submission that was
//! given up may arrive after its job, which nobody seemed to want, has been discarded.
//!
//! A run goes on without its job, but nobody learns when its worker is lost. One that tells nothing for long and has no
//! job is taken for lost; if it is alive after all, it is fenced off.

use std::collections::HashMap;
use std::time::Duration;

use tokio::time::Instant;

use super::JetStream;
use super::errors::found;
use super::lane::Lane;
use super::record::{Record, State};
use super::steps::Change;
use crate::job::PlanId;
use crate::store::StoreError;

/// Only plans that have waited longer than this are looked at: most never wait as long, and a submission that has not
/// been answered by then has been given up. Also how long a run must have told nothing.
const WAITED_MS: i64 = 120_000;

/// A node looks for missing jobs this often, at this many plans.
const PERIOD: Duration = Duration::from_secs(60);
const AT_ONCE: usize = 16;

/// How far a node has looked through the queue.
#[derive(Debug, Default)]
pub(super) struct Round {
    /// When it looked last; `None` before the first time.
    last: Option<Instant>,
    /// Place of the last waiting plan that it looked at.
    place: u64,
    /// The runs of other nodes: the last step of each, and when it was first seen.
    runs: HashMap<PlanId, (u64, i64)>,
}

impl Round {
    /// Those of these runs, each with its last step, that have told nothing for long. They are looked at again only
    /// after as long.
    fn silent(&mut self, runs: Vec<(PlanId, u64)>, now_ms: i64) -> Vec<PlanId> {
        let before = std::mem::take(&mut self.runs);
        let mut silent = Vec::new();
        for (id, step) in runs {
            let known = before.get(&id).filter(|(last, _)| *last == step);
            let mut since_ms = known.map_or(now_ms, |(_, since_ms)| *since_ms);
            if now_ms.saturating_sub(since_ms) >= WAITED_MS {
                silent.push(id);
                since_ms = now_ms;
            }
            self.runs.insert(id, (step, since_ms));
        }
        silent
    }
}

impl JetStream {
    /// Look at some of the plans that have long been waiting, in turn, and at silent runs, and put back the jobs that are
    /// missing.
    pub(super) async fn restore_jobs(&self, now_ms: i64) -> Result<(), StoreError> {
        let mut failed = None;
        for id in self.silent_runs(now_ms) {
            let restored = self.restore_job(id).await;
            failed = failed.or(restored.err());
        }
        let waiting = self.next_waiting(now_ms);
        let mut missing = 0;
        for id in &waiting {
            match self.restore_job(*id).await {
                Ok(was_missing) => missing += usize::from(was_missing),
                Err(error) => failed = failed.or(Some(error)),
            }
        }
        if missing > 0 && missing == waiting.len() {
            // Where all were missing there may be more: the whole queue was lost.
            self.round.lock().last = None;
        }
        failed.map_or(Ok(()), Err)
    }

    fn silent_runs(&self, now_ms: i64) -> Vec<PlanId> {
        let own = self.leases.all();
        let mut runs = self.view.known().runs();
        runs.retain(|(id, _)| own.iter().all(|(held, _)| held != id));
        self.round.lock().silent(runs, now_ms)
    }

    /// The waiting plans whose turn it is to be looked at.
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
        let Some(unended) = self.unended_on_servers(id).await? else {
            return Ok(false);
        };
        if self.has_job(id, &unended.lane).await? {
            return Ok(false);
        }
        let missing = unended.place;
        // Nodes that find this at the same time put back one job: the servers identify it by the one that is missing.
        let place = self
            .enqueue(id, &unended.lane, &format!("{id}.{missing}"))
            .await?;
        let plans = self.plans();
        let moved = plans.change(id, |standing| {
            let State::Kept(record) = &*standing.state else {
                return Ok(None);
            };
            if record.plan.status.is_final() || record.place != missing {
                return Ok(None);
            }
            let mut record = record.clone();
            record.place = place;
            Ok(Some(Change::silent(State::Kept(record))))
        });
        moved.await?;
        tracing::warn!(plan_id = %id, "the job of a plan was missing from the queue; it is back, at the end");
        Ok(true)
    }

    /// The record of a plan that has not ended, as the servers have it.
    async fn unended_on_servers(&self, id: PlanId) -> Result<Option<Record>, StoreError> {
        let standing = match self.plans().look_up(id).await {
            Ok(standing) => standing,
            Err(StoreError::NotFound(_)) => return Ok(None),
            Err(error) => return Err(error),
        };
        Ok(match &*standing.state {
            State::Kept(record) if !record.plan.status.is_final() => Some((**record).clone()),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_silent_once_it_has_told_nothing_for_long() {
        let id = PlanId::now_v7();
        let mut round = Round::default();
        let mut silent = |step, now_ms| !round.silent(vec![(id, step)], now_ms).is_empty();
        assert!(!silent(1, 0));
        assert!(!silent(1, WAITED_MS - 1));
        assert!(!silent(2, WAITED_MS), "it has told something");
        assert!(!silent(2, 2 * WAITED_MS - 1));
        assert!(silent(2, 2 * WAITED_MS));
        assert!(!silent(2, 2 * WAITED_MS + 1), "it has just been looked at");
        assert!(silent(2, 3 * WAITED_MS));
    }
}
