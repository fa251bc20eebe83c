//! Webhooks: reports a plan's end to an address that its caller named.
//!
//! The store keeps each webhook from the plan's acceptance until it has been delivered, so a restart forgets nothing; a
//! receiver may be told of an end twice and recognises it by its id.

mod address;
mod client;
mod delivery;
mod retry;
mod secret;

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use axum::http::{HeaderMap, HeaderName};
use tokio::sync::watch;
use tokio::task::{self, JoinHandle, JoinSet};
use tokio::time::MissedTickBehavior;

pub use secret::Secrets;

use super::params;
use super::problem::Problem;
use crate::job::{Owner, PlanId};
use crate::store::{Clock, Store};
use crate::telemetry::Instruments;
use address::Target;
use client::Client;
use delivery::Delivery;

const NOCTULE_WEBHOOK: HeaderName = HeaderName::from_static("noctule-webhook");

/// How often the store is asked for due webhooks.
const LOOK: Duration = Duration::from_millis(500);

/// Webhooks in flight at once. An owner has at most as many as there are places left, 64 if nobody else has any, so
/// that receivers who do not answer hold up their owner and not the others.
const AT_ONCE: usize = 128;

/// How webhooks are sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The secrets shared with receivers.
    pub secrets: Secrets,
    /// Whether receivers may be outside the public internet, and without TLS.
    pub allow_private: bool,
}

/// Where the caller wants to be told of the plan's end.
///
/// # Errors
/// An invalid parameter when webhooks may not go to the address, or when webhooks are disabled.
pub(super) fn asked(
    settings: Option<&Settings>,
    headers: &HeaderMap,
) -> Result<Option<String>, Problem> {
    let mut values = headers.get_all(NOCTULE_WEBHOOK).iter();
    let Some(value) = values.next() else {
        return Ok(None);
    };
    let text = String::from_utf8_lossy(value.as_bytes()).into_owned();
    let refused = |allowed| params::refused(NOCTULE_WEBHOOK.as_str(), &text, allowed);
    let Some(settings) = settings else {
        return Err(refused("left out: this service sends no webhooks"));
    };
    let private = settings.allow_private;
    if values.next().is_some() {
        return Err(params::repeated(NOCTULE_WEBHOOK.as_str()));
    }
    if Target::read(&text, private).is_none() {
        return Err(refused(Target::allowed(private)));
    }
    Ok(Some(text))
}

/// Sends due webhooks, until dropped.
pub struct Sender {
    sending: JoinHandle<()>,
    /// Becomes true when no more are to be sent.
    end: watch::Sender<bool>,
}

impl Sender {
    /// Send the webhooks in `store`, and count the tries.
    #[must_use]
    pub fn start(
        store: Arc<dyn Store>,
        settings: Settings,
        clock: Clock,
        instruments: Arc<Instruments>,
    ) -> Self {
        let client = Client::new(settings.allow_private);
        let delivery = Arc::new(Delivery {
            store,
            settings,
            client,
            clock,
            instruments,
        });
        let end = watch::Sender::new(false);
        let sending = tokio::spawn(deliver_all(delivery, end.subscribe()));
        Self { sending, end }
    }

    /// Send no more; returns when those on their way have arrived, or failed to.
    pub async fn finish(mut self) {
        self.end.send_replace(true);
        // If it panicked, none is on its way.
        let _ = (&mut self.sending).await;
    }
}

impl Drop for Sender {
    fn drop(&mut self) {
        self.sending.abort();
    }
}

async fn deliver_all(delivery: Arc<Delivery>, mut end: watch::Receiver<bool>) {
    let mut looks = tokio::time::interval(LOOK);
    looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut on_their_way: HashMap<task::Id, (PlanId, Option<Owner>)> = HashMap::new();
    let mut tasks = JoinSet::new();
    loop {
        tokio::select! {
            _ = looks.tick() => {}
            _ = end.wait_for(|end| *end) => break,
            Some(ended) = tasks.join_next_with_id() => {
                // A webhook whose task panicked is no longer in flight either.
                let task = ended.map_or_else(|broken| broken.id(), |(task, ())| task);
                on_their_way.remove(&task);
                continue;
            }
        }
        // Asking which are due takes the longer the more there are, and none could be sent.
        if tasks.len() >= AT_ONCE {
            continue;
        }
        let now_ms = (delivery.clock)();
        let due = match delivery.store.due_webhooks(now_ms, AT_ONCE).await {
            Ok(due) => due,
            Err(error) => {
                tracing::debug!(%error, "the store does not say which webhooks are due");
                continue;
            }
        };
        for webhook in due {
            let (id, owner) = (webhook.plan.id, webhook.plan.owner.clone());
            let is_on_its_way = on_their_way.values().any(|(other, _)| *other == id);
            let of_owner = on_their_way.values().filter(|(_, other)| *other == owner);
            if !is_on_its_way && of_owner.count() < AT_ONCE - tasks.len() {
                let delivery = delivery.clone();
                let task = tasks.spawn(async move { delivery.deliver(webhook).await });
                on_their_way.insert(task.id(), (id, owner));
            }
        }
    }
    while tasks.join_next().await.is_some() {}
}
