//! Jobs without a record: either the plan is about to be accepted, or it never was.

use std::collections::HashMap;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::time::Instant;

use crate::job::PlanId;

/// A job whose record this node has not found for this long is abandoned: a submission writes the job first, and would
/// have given up on the record long before.
const NOBODYS: Duration = Duration::from_secs(60);

/// Shortest and longest delay before such a job is delivered again.
const SOONEST: Duration = Duration::from_millis(250);
const LATEST: Duration = Duration::from_secs(15);

/// After this long, another node has discarded the job.
const FORGOTTEN: Duration = Duration::from_secs(10 * 60);

/// Since when each job's record has been missing. Measured on this node: clocks of nodes may differ, and the number of
/// deliveries says little, since a job that is only being sorted is redelivered at once.
#[derive(Default)]
pub(super) struct Orphans {
    missed: Mutex<HashMap<PlanId, Instant>>,
}

/// What to do with a job without a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Orphan {
    /// It is delivered again after this delay, which equals the time its record has been missing, so that many such
    /// jobs, as the loss of a server may leave, soon cost the plans behind them little.
    Waits(Duration),
    /// It is discarded.
    Nobodys,
}

impl Orphans {
    /// The record of this job is missing.
    pub(super) fn miss(&self, id: PlanId) -> Orphan {
        let now = Instant::now();
        let mut missed = self.missed.lock();
        missed.retain(|_, since| now.duration_since(*since) < FORGOTTEN);
        let since = *missed.entry(id).or_insert(now);
        let age = now.duration_since(since);
        if age < NOBODYS {
            return Orphan::Waits(age.clamp(SOONEST, LATEST));
        }
        missed.remove(&id);
        Orphan::Nobodys
    }

    /// Whether this job has come without a record before.
    pub(super) fn is_known(&self, id: PlanId) -> bool {
        self.missed.lock().contains_key(&id)
    }

    /// The record of this job is found.
    pub(super) fn found(&self, id: PlanId) {
        self.missed.lock().remove(&id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::new_id;

    #[tokio::test(start_paused = true)]
    async fn a_job_without_a_record_is_retried_ever_later_and_given_up_after_a_minute() {
        let (orphans, id) = (Orphans::default(), new_id(0));
        let mut came = 0;
        assert!(!orphans.is_known(id));
        let begun = Instant::now();
        while let Orphan::Waits(pause) = orphans.miss(id) {
            assert!(orphans.is_known(id));
            tokio::time::sleep(pause).await;
            came += 1;
        }
        assert!((60..90).contains(&begun.elapsed().as_secs()));
        assert!(came < 15, "{came}");
        assert!(!orphans.is_known(id));
    }

    #[tokio::test(start_paused = true)]
    async fn a_job_whose_record_arrived_is_not_an_orphan() {
        let (orphans, id, other) = (Orphans::default(), new_id(0), new_id(0));
        assert_eq!(orphans.miss(id), Orphan::Waits(SOONEST));
        orphans.miss(other);
        tokio::time::sleep(NOBODYS).await;
        orphans.found(id);
        assert_eq!(orphans.miss(id), Orphan::Waits(SOONEST));
        assert_eq!(orphans.miss(other), Orphan::Nobodys);
        // Jobs that other nodes discarded are eventually forgotten.
        tokio::time::sleep(FORGOTTEN).await;
        orphans.miss(other);
        assert!(!orphans.is_known(id));
    }
}
