//! Plans that are removed, and what remains of them.

use super::JetStream;
use super::record::{Document, Grave, State};
use super::steps::Change;
use super::trouble::failed;
use crate::job::PlanId;
use crate::store::{SWEEP, StoreError};

impl JetStream {
    pub(super) async fn delete(&self, id: PlanId, now_ms: i64) -> Result<(), StoreError> {
        match self.bury(id, now_ms, false).await {
            Ok(()) | Err(StoreError::Gone(_)) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Remove a plan and all that belongs to it, except its tombstone.
    async fn bury(&self, id: PlanId, now_ms: i64, expired: bool) -> Result<(), StoreError> {
        let mut remains: Option<(u64, Vec<Document>)> = None;
        let standing = self
            .plans()
            .change(id, |standing| {
                let record = standing.record(id, now_ms)?;
                let documents = [Some(&record.scenario), record.result.as_ref()];
                remains = Some((
                    record.place,
                    documents.into_iter().flatten().cloned().collect(),
                ));
                let grave = Grave {
                    owner: record.plan.owner.clone(),
                    expired,
                    deleted_ms: now_ms,
                };
                Ok(Some(Change::silent(State::Buried(grave))))
            })
            .await?;
        if let Some((place, documents)) = remains {
            self.withdraw(id, place).await;
            self.servers
                .remove_documents(id, &documents.iter().collect::<Vec<_>>())
                .await?;
        }
        let earlier = self
            .servers
            .plans
            .purge()
            .filter(self.servers.subject_of(id));
        let purged = earlier.sequence(standing.sequence).await;
        purged.map_err(|error| failed(&format!("steps of plan {id}"), &error))?;
        Ok(())
    }

    /// Take a job out of the queue, by its place. One that stays is thrown away by whoever is given it.
    ///
    /// (To purge its subject would also make the servers forget which jobs were given back.)
    pub(super) async fn withdraw(&self, id: PlanId, place: u64) {
        if let Err(error) = self.servers.jobs.delete_message(place).await {
            tracing::debug!(%error, plan_id = %id, "a job is left in the queue");
        }
    }

    pub(super) async fn sweep(&self, now_ms: i64) -> Result<usize, StoreError> {
        let retention = self.options.retention;
        let (mouldered, going) = {
            let known = self.view.known();
            let plans = retention.plans.unwrap_or(u64::MAX);
            let bytes = retention.bytes.unwrap_or(u64::MAX);
            (
                known.mouldered(now_ms, SWEEP),
                known.removable(now_ms, plans, bytes, SWEEP),
            )
        };
        for id in mouldered {
            let steps = self
                .servers
                .plans
                .purge()
                .filter(self.servers.subject_of(id));
            steps
                .await
                .map_err(|error| failed(&format!("tombstone of plan {id}"), &error))?;
            self.view.forget(id);
        }
        let mut removed = 0;
        for id in going {
            match self.bury(id, now_ms, true).await {
                Ok(()) => removed += 1,
                // Another node was faster.
                Err(StoreError::Gone(_) | StoreError::NotFound(_)) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(removed)
    }
}
