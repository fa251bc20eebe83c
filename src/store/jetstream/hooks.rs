//! Webhooks for ends of plans: each sent by one node at a time.

use async_nats::jetstream::kv::CreateErrorKind;
use tokio::time::Instant;

use super::JetStream;
use super::connect::TELLING;
use super::errors::{failed, is_outrun};
use super::record::{Hook, State};
use super::steps::Change;
use super::view::Standing;
use crate::job::PlanId;
use crate::store::{StoreError, Webhook};

/// As many times the webhooks that are wanted are looked at.
const LOOKED_AT: usize = 16;

impl JetStream {
    pub(super) async fn due_webhooks(
        &self,
        now_ms: i64,
        limit: usize,
    ) -> Result<Vec<Webhook>, StoreError> {
        self.telling
            .lock()
            .retain(|_, taken| taken.elapsed() < TELLING);
        // Other nodes may be sending those that have been due longest.
        let due = self.view.known().due(now_ms, LOOKED_AT * limit);
        let mut taken: Vec<Webhook> = Vec::new();
        for id in due {
            if taken.len() == limit {
                break;
            }
            let known = self.plans().standing(id).await?;
            let Some(webhook) = due_of(&known, now_ms) else {
                continue;
            };
            let owner = &webhook.plan.owner;
            let of_owner = taken.iter().filter(|other| other.plan.owner == *owner);
            if of_owner.count() == limit.div_ceil(2) {
                continue;
            }
            if self.is_telling(id) {
                taken.push(webhook);
            } else {
                taken.extend(self.take(id, now_ms).await?);
            }
        }
        Ok(taken)
    }

    /// A webhook that from now on no other node sends; `None` where one has the right to, or has sent it just before.
    async fn take(&self, id: PlanId, now_ms: i64) -> Result<Option<Webhook>, StoreError> {
        if !self.may_tell(id).await? {
            return Ok(None);
        }
        let due = match self.plans().look_up(id).await {
            Err(StoreError::NotFound(_)) => Ok(None),
            newest => newest.map(|newest| due_of(&newest, now_ms)),
        };
        if !matches!(due, Ok(Some(_))) {
            self.let_tell(id).await;
        }
        due
    }

    /// Take the right to send this webhook, unless another node has it; for two minutes no other gets it.
    async fn may_tell(&self, id: PlanId) -> Result<bool, StoreError> {
        let own = self.node.to_string();
        match self
            .servers
            .tellers
            .create(id.to_string(), own.into())
            .await
        {
            Ok(_) => {
                self.telling.lock().insert(id, Instant::now());
                Ok(true)
            }
            Err(error) if error.kind() == CreateErrorKind::AlreadyExists => {
                self.may_go_on_telling(id).await
            }
            Err(error) => Err(failed(&format!("webhook of plan {id}"), &error)),
        }
    }

    /// Take the right to send this webhook anew if it is this node's: that it was taken may not have been acknowledged, or
    /// may be long ago.
    async fn may_go_on_telling(&self, id: PlanId) -> Result<bool, StoreError> {
        let what = || format!("webhook of plan {id}");
        let (tellers, own) = (&self.servers.tellers, self.node.to_string());
        let entry = tellers.entry(id.to_string()).await;
        let entry = entry.map_err(|error| failed(&what(), &error))?;
        let Some(entry) = entry.filter(|entry| entry.value == own.as_bytes()) else {
            return Ok(false);
        };
        let renewed = tellers.update(id.to_string(), own.into(), entry.revision);
        match renewed.await {
            Ok(_) => {
                self.telling.lock().insert(id, Instant::now());
                Ok(true)
            }
            Err(error) if is_outrun(&error) => Ok(false),
            Err(error) => Err(failed(&what(), &error)),
        }
    }

    /// Whether this node has the right to send this webhook for some time yet.
    fn is_telling(&self, id: PlanId) -> bool {
        let telling = self.telling.lock();
        telling
            .get(&id)
            .is_some_and(|taken| taken.elapsed() < TELLING / 2)
    }

    pub(super) async fn webhook_tried(
        &self,
        id: PlanId,
        next_ms: Option<i64>,
    ) -> Result<(), StoreError> {
        let tried = self
            .plans()
            .change(id, |standing| {
                let State::Kept(record) = &*standing.state else {
                    return Ok(None);
                };
                let mut record = record.clone();
                let Some(hook) = record.webhook.take() else {
                    return Ok(None);
                };
                record.webhook = next_ms.map(|due_ms| Hook {
                    tries: hook.tries + 1,
                    due_ms: Some(due_ms),
                    ..hook
                });
                Ok(Some(Change::silent(State::Kept(record))))
            })
            .await;
        // Until the outcome is recorded, no other node may send it again.
        if !matches!(tried, Err(StoreError::Unavailable { .. })) {
            self.let_tell(id).await;
        }
        match tried {
            Ok(_) | Err(StoreError::NotFound(_)) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Leave this webhook to whichever node is first.
    async fn let_tell(&self, id: PlanId) {
        if self.telling.lock().remove(&id).is_some()
            && let Err(error) = self.servers.tellers.purge(id.to_string()).await
        {
            tracing::debug!(%error, plan_id = %id, "a webhook is left to others two minutes later");
        }
    }

    /// Leave all of them to other nodes.
    pub(super) async fn let_tell_all(&self) {
        let all: Vec<_> = self.telling.lock().keys().copied().collect();
        for id in all {
            self.let_tell(id).await;
        }
    }
}

/// A plan's webhook, if it is due.
fn due_of(standing: &Standing, now_ms: i64) -> Option<Webhook> {
    let State::Kept(record) = &*standing.state else {
        return None;
    };
    let hook = record.webhook.as_ref()?;
    hook.due_ms.filter(|due_ms| *due_ms <= now_ms)?;
    Some(Webhook {
        plan: record.plan.clone(),
        url: hook.url.clone(),
        tries: hook.tries,
    })
}
