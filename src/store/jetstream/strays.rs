//! Jobs of submissions that broke off, in lanes that nobody asks for: no node would ever receive them.

use std::collections::BTreeMap;

use futures_util::TryStreamExt as _;

use super::JetStream;
use super::connect::plan_of;
use super::errors::{failed, found};
use super::record::Document;
use crate::job::PlanId;
use crate::store::StoreError;

/// A node looks through the queue this often. A submission is over long before the next time.
const PERIOD_MS: i64 = 300_000;

/// Maximum number of jobs discarded each time.
const AT_ONCE: usize = 256;

/// Jobs by the plans that this node does not know, with their subjects.
type Jobs = BTreeMap<PlanId, String>;

/// What a node found when it last looked.
#[derive(Debug, Default)]
pub(super) struct Strays {
    /// `None` before the first time.
    looked_ms: Option<i64>,
    found: Jobs,
}

impl Strays {
    fn is_due(&self, now_ms: i64) -> bool {
        let passed = |before| now_ms.saturating_sub(before) >= PERIOD_MS;
        self.looked_ms.is_none_or(passed)
    }

    /// Those that were found the last time too.
    fn found_again(&mut self, now_ms: i64, found: Jobs) -> Jobs {
        self.looked_ms = Some(now_ms);
        let mut before = std::mem::replace(&mut self.found, found);
        before.retain(|id, _| self.found.contains_key(id));
        before
    }
}

impl JetStream {
    /// Discard jobs that have long had no record, with the documents that were written for them.
    pub(super) async fn discard_strays(&self, now_ms: i64) -> Result<(), StoreError> {
        if !self.strays.lock().is_due(now_ms) {
            return Ok(());
        }
        let found = self.jobs_of_unknown_plans().await?;
        let again = self.strays.lock().found_again(now_ms, found);
        for (id, subject) in again.into_iter().take(AT_ONCE) {
            self.discard_stray(id, &subject).await?;
        }
        Ok(())
    }

    async fn jobs_of_unknown_plans(&self) -> Result<Jobs, StoreError> {
        let what = "jobs in the queue";
        let all = format!("{}.jobs.>", self.servers.namespace);
        let jobs = self.servers.jobs.info_with_subjects(all).await;
        let jobs = jobs.map_err(|error| failed(what, &error))?;
        let unknown = jobs.try_filter_map(async |(subject, _)| {
            let id = plan_of(&subject).filter(|id| self.view.standing(*id).is_none());
            Ok(id.map(|id| (id, subject)))
        });
        let unknown = unknown.try_collect().await;
        unknown.map_err(|error| failed(what, &error))
    }

    async fn discard_stray(&self, id: PlanId, subject: &str) -> Result<(), StoreError> {
        match self.plans().look_up(id).await {
            Err(StoreError::NotFound(_)) => {}
            found => return found.map(drop),
        }
        tracing::info!(plan_id = %id, "a job that was never accepted is thrown away");
        // Before the job, by which they are found.
        let scenario = Document::scenario_key(id);
        self.servers.remove_documents(id, &[scenario]).await?;
        let jobs = &self.servers.jobs;
        let job = jobs.get_last_raw_message_by_subject(subject).await;
        if let Some(job) = found(job, || format!("job of plan {id}"))? {
            self.withdraw(id, job.sequence).await;
        }
        Ok(())
    }
}
