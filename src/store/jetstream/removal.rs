//! Plans that are removed, and what remains of them.

use futures_util::{StreamExt as _, stream};

use super::JetStream;
use super::connect::plan_of;
use super::errors::{failed, lacks_room};
use super::record::{Grave, State};
use super::steps::Change;
use super::view::Standing;
use crate::job::PlanId;
use crate::store::{LastEvent, SWEEP, StoreError, expected};

/// Number of expired plans that are removed at the same time.
const AT_ONCE: usize = 16;

impl JetStream {
    pub(super) async fn delete(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<(), StoreError> {
        let burial = Burial {
            revision,
            expired: false,
            now_ms,
        };
        match self.bury(id, burial).await {
            Err(StoreError::Gone(_)) if revision.is_none() => Ok(()),
            buried => buried,
        }
    }

    /// Remove a plan and all that belongs to it, except its tombstone.
    async fn bury(&self, id: PlanId, burial: Burial) -> Result<(), StoreError> {
        let is_refused =
            |buried: &Result<_, StoreError>| matches!(buried, Err(error) if lacks_room(error));
        let mut buried = self.write_grave(id, burial).await;
        // Full servers take nothing, not even a plan's removal, but they do remove. Old events go first: they may be
        // enough, and a plan that stays after all can do without them.
        if is_refused(&buried) {
            self.remove_old_steps(id).await?;
            buried = self.write_grave(id, burial).await;
        }
        if is_refused(&buried) {
            self.give_up_documents(id).await?;
            buried = self.write_grave(id, burial).await;
        }
        let (standing, Remains { place, objects }) = buried?;
        if let Some(place) = place {
            self.withdraw(id, place).await;
        }
        self.servers.remove_documents(id, &objects).await?;
        // Last: while steps remain, documents may remain too.
        let steps = self.servers.purge_steps(id);
        let purged = steps.sequence(standing.sequence).await;
        purged.map_err(|error| failed(&format!("steps of plan {id}"), &error))?;
        Ok(())
    }

    /// Mark a plan as removed; returns its state from then on, and what is left of it.
    async fn write_grave(
        &self,
        id: PlanId,
        burial: Burial,
    ) -> Result<(Standing, Remains), StoreError> {
        let Burial {
            revision,
            expired,
            now_ms,
        } = burial;
        let mut remains = Remains::default();
        let standing = self
            .plans()
            .change(id, |standing| {
                let record = standing.record(id, self.expiry_ms_at(now_ms))?;
                expected(&record.plan, revision)?;
                let objects = record.objects();
                remains = Remains {
                    place: (!record.plan.status.is_final()).then_some(record.place),
                    objects: objects.clone(),
                };
                let grave = Grave {
                    owner: record.plan.owner.clone(),
                    expired,
                    deleted_ms: now_ms,
                    objects,
                    end: Some(LastEvent::of(record.plan.status, record.last_event)),
                };
                Ok(Some(Change::silent(State::Buried(grave))))
            })
            .await?;
        Ok((standing, remains))
    }

    /// Remove all steps of a plan but the newest, by which other writers and nodes know it.
    async fn remove_old_steps(&self, id: PlanId) -> Result<(), StoreError> {
        let purged = self.servers.purge_steps(id).keep(1).await;
        purged.map_err(|error| failed(&format!("steps of plan {id}"), &error))?;
        Ok(())
    }

    async fn give_up_documents(&self, id: PlanId) -> Result<(), StoreError> {
        let standing = self.plans().standing(id).await?;
        let State::Kept(record) = &*standing.state else {
            return Ok(());
        };
        self.servers.remove_documents(id, &record.objects()).await
    }

    /// Remove a tombstone, and what an interrupted removal has left.
    async fn forget_tombstone(&self, id: PlanId) -> Result<(), StoreError> {
        // Its documents first: afterwards nothing names them.
        if let Some(standing) = self.view.standing(id)
            && let State::Buried(grave) = &*standing.state
        {
            self.servers.remove_documents(id, &grave.objects).await?;
        }
        let purged = self.servers.purge_steps(id).await;
        purged.map_err(|error| failed(&format!("tombstone of plan {id}"), &error))?;
        self.view.forget(id);
        Ok(())
    }

    /// Take a job out of the queue, by its place. One that stays is discarded by whichever node receives it.
    ///
    /// (To purge its subject would also make the servers forget which jobs were given back.)
    pub(super) async fn withdraw(&self, id: PlanId, place: u64) {
        let jobs = &self.servers.jobs;
        // In a queue that was made again, the place may be another plan's.
        let there = jobs.get_raw_message(place).await;
        if !there.is_ok_and(|job| plan_of(&job.subject) == Some(id)) {
            return;
        }
        if let Err(error) = jobs.delete_message(place).await {
            tracing::debug!(%error, plan_id = %id, "a job is left in the queue");
        }
    }

    pub(super) async fn sweep(&self, now_ms: i64) -> Result<usize, StoreError> {
        // A wrong clock would remove what all nodes have; what is beyond the limits may go whatever the time.
        let expiry_ms = self.expiry_ms_at(now_ms);
        let expired = self.view.known().expired_tombstones(expiry_ms, SWEEP);
        let mut forgotten = Ok(());
        for id in expired {
            // One that cannot be forgotten does not keep the others.
            forgotten = forgotten.and(self.forget_tombstone(id).await);
        }
        let removed = self.remove_expired(expiry_ms, now_ms).await?;
        if let Err(error) = self.restore_jobs(now_ms).await {
            tracing::debug!(%error, "missing jobs were not looked for; trying again");
        }
        if let Err(error) = self.discard_strays(now_ms).await {
            tracing::debug!(%error, "jobs without plans were not looked for; trying again");
        }
        forgotten.map(|()| removed)
    }

    /// Remove plans that nobody has removed yet, as many as a sweep may. Other nodes remove the same plans meanwhile;
    /// those do not count, or a crowd of nodes would remove no more than one.
    async fn remove_expired(&self, expiry_ms: i64, now_ms: i64) -> Result<usize, StoreError> {
        let mut removed = 0;
        loop {
            let round = self.remove_some(expiry_ms, now_ms, SWEEP - removed).await?;
            removed += round.removed;
            if removed >= SWEEP || round.outrun == 0 {
                return Ok(removed);
            }
        }
    }

    /// Those that have expired at `expiry_ms` and those beyond the limits, removed at `now_ms`.
    async fn remove_some(
        &self,
        expiry_ms: i64,
        now_ms: i64,
        at_most: usize,
    ) -> Result<Round, StoreError> {
        let retention = self.options.retention;
        let plans = retention.plans.unwrap_or(u64::MAX);
        let bytes = retention.bytes.unwrap_or(u64::MAX);
        let mut going = self
            .view
            .known()
            .removable(expiry_ms, plans, bytes, at_most);
        // Each node in an order of its own, so that they seldom meet.
        going.sort_by_key(|id| id.as_u128() ^ self.node.as_u128());
        let mut round = Round::default();
        let mut refused = None;
        let burial = Burial {
            revision: None,
            expired: true,
            now_ms,
        };
        let buried = going.into_iter().map(|id| self.bury(id, burial));
        let mut buried = stream::iter(buried).buffer_unordered(AT_ONCE);
        while let Some(buried) = buried.next().await {
            match buried {
                Ok(()) => round.removed += 1,
                Err(StoreError::Gone(_) | StoreError::NotFound(_)) => round.outrun += 1,
                // This one freed too little; with the next one it may be enough.
                Err(error) if lacks_room(&error) => refused = Some(error),
                Err(error) => return Err(error),
            }
        }
        match refused {
            Some(error) if round.removed == 0 => Err(error),
            _ => Ok(round),
        }
    }
}

/// How a plan is removed.
#[derive(Debug, Clone, Copy)]
struct Burial {
    /// Only at this revision, if at one.
    revision: Option<u64>,
    /// Whether nobody has asked for it.
    expired: bool,
    now_ms: i64,
}

/// Plans that a sweep has tried to remove.
#[derive(Debug, Default)]
struct Round {
    removed: usize,
    /// Other nodes were faster. None of these is tried again.
    outrun: usize,
}

/// What is left of a plan that has been marked as removed.
#[derive(Debug, Default)]
struct Remains {
    /// Its job's place in the queue's stream, unless it had ended.
    place: Option<u64>,
    /// Keys of its documents that may be in the object store.
    objects: Vec<String>,
}
