//! A cache of recently read records, so that asking for a plan's status again costs no query.
//!
//! It returns what a query would: while a commit is under way, nothing that the commit may change is returned, and
//! nothing read before a commit is kept after it. So whoever got an answer about a change also sees that change.

use std::collections::HashMap;

use parking_lot::Mutex;

use crate::job::{Plan, PlanId};
use crate::store::Stats;

/// Maximum number of records; on reaching it, all are dropped.
const CAPACITY: usize = 4_096;

/// What was read, and as of which commit.
#[derive(Default)]
pub(super) struct Records(Mutex<Kept>);

/// Counts the beginnings and ends of commits; odd while one is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Version(u64);

#[derive(Default)]
struct Kept {
    version: u64,
    plans: HashMap<PlanId, (u64, Plan)>,
    stats: Option<(u64, Stats)>,
}

impl Records {
    /// Take this before reading what is to be kept.
    pub(super) fn version(&self) -> Version {
        Version(self.0.lock().version)
    }

    /// The record, if it is known to be current: nothing has been committed since it was read, or it had ended and was
    /// not touched.
    pub(super) fn plan(&self, id: PlanId) -> Option<Plan> {
        let kept = self.0.lock();
        let (version, plan) = kept.plans.get(&id)?;
        (*version == kept.version || plan.status.is_final()).then(|| plan.clone())
    }

    /// The counts, if nothing has been committed since they were read.
    pub(super) fn stats(&self) -> Option<Stats> {
        let kept = self.0.lock();
        let (version, stats) = kept.stats?;
        (version == kept.version).then_some(stats)
    }

    /// Keep a record that was read after `version` was taken.
    pub(super) fn keep_plan(&self, version: Version, plan: &Plan) {
        let mut kept = self.0.lock();
        if kept.still(version) {
            if kept.plans.len() >= CAPACITY {
                kept.plans.clear();
            }
            kept.plans.insert(plan.id, (version.0, plan.clone()));
        }
    }

    /// Keep counts that were read after `version` was taken.
    pub(super) fn keep_stats(&self, version: Version, stats: Stats) {
        let mut kept = self.0.lock();
        if kept.still(version) {
            kept.stats = Some((version.0, stats));
        }
    }

    /// A commit begins that changes or removes these plans, and may change the queue positions and counts of all.
    pub(super) fn begin(&self, changed: impl Iterator<Item = PlanId>) {
        let mut kept = self.0.lock();
        kept.version += 1;
        for id in changed {
            kept.plans.remove(&id);
        }
    }

    /// The commit is done, or has failed.
    pub(super) fn end(&self) {
        self.0.lock().version += 1;
    }

    /// Drop everything and cache nothing from now on.
    pub(super) fn close(&self) {
        let mut kept = self.0.lock();
        *kept = Kept {
            version: kept.version | 1,
            ..Kept::default()
        };
    }
}

impl Kept {
    fn still(&self, version: Version) -> bool {
        version.0 == self.version && self.version.is_multiple_of(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{self, Status};

    fn plan(id: u128, status: Status) -> Plan {
        let submission = job::Submission {
            id: PlanId::from_u128(id),
            name: None,
            algorithm: "tms-sba".to_owned(),
            seed: 7,
            iterations: 10,
            work: 2_000,
            scenario: String::new(),
            created_ms: 0,
            owner: None,
            quota: None,
            idempotency: None,
            dataset: None,
            webhook: None,
        };
        Plan {
            status,
            ..Plan::accepted(&submission, 1)
        }
    }

    #[test]
    fn a_commit_invalidates_what_it_may_have_changed() {
        let records = Records::default();
        let [active, ended, touched] = [
            (1, Status::Queued),
            (2, Status::Failed),
            (3, Status::Failed),
        ]
        .map(|(id, status)| plan(id, status));
        for plan in [&active, &ended, &touched] {
            records.keep_plan(records.version(), plan);
            assert_eq!(records.plan(plan.id).as_ref(), Some(plan));
        }
        let before = records.version();
        records.begin(std::iter::once(touched.id));
        for during in [true, false] {
            assert_eq!(records.plan(active.id), None);
            assert_eq!(records.plan(touched.id), None);
            assert_eq!(records.plan(ended.id).as_ref(), Some(&ended));
            if during {
                // It cannot be known whether this was read before or after the commit.
                records.keep_plan(records.version(), &touched);
                records.keep_plan(before, &touched);
                records.end();
            }
        }
        records.keep_plan(before, &touched);
        assert_eq!(records.plan(touched.id), None, "read before the commit");
        records.keep_plan(records.version(), &active);
        assert_eq!(records.plan(active.id), Some(active));
    }

    #[test]
    fn the_cache_does_not_grow_without_bound() {
        let records = Records::default();
        for id in 0..3 * CAPACITY as u128 {
            records.keep_plan(records.version(), &plan(id, Status::Failed));
        }
        assert!(records.0.lock().plans.len() <= CAPACITY);
    }
}
