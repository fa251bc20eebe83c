//! Webhooks: reports a plan's end to an address that its caller named.
//!
//! The store keeps each webhook from the plan's acceptance until it has been delivered, so a restart forgets nothing; a
//! receiver may be told of an end twice and recognises it by its id.

mod address;
mod client;
mod retry;
mod secret;

use std::collections::HashMap;
use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::time::Duration;

use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use futures_util::FutureExt as _;
use serde::Serialize;
use tokio::sync::watch;
use tokio::task::{self, JoinHandle, JoinSet};
use tokio::time::MissedTickBehavior;

pub use secret::Secrets;

use super::params;
use super::problem::Problem;
use super::status::StatusDocument;
use super::time::Time;
use crate::job::{Owner, PlanId};
use crate::store::{Clock, Store, StoreError, Webhook};
use address::Target;
use client::Client;

const NOCTULE_WEBHOOK: HeaderName = HeaderName::from_static("noctule-webhook");
const WEBHOOK_ID: HeaderName = HeaderName::from_static("webhook-id");
const WEBHOOK_TIMESTAMP: HeaderName = HeaderName::from_static("webhook-timestamp");
const WEBHOOK_SIGNATURE: HeaderName = HeaderName::from_static("webhook-signature");

/// How often the store is asked for due webhooks.
const LOOK: Duration = Duration::from_millis(500);

/// Webhooks in flight at once. An owner has at most as many as there are places left, 64 if nobody else has any, so
/// that receivers who do not answer hold up their owner and not the others.
const AT_ONCE: usize = 128;

/// Pauses between attempts to record the outcome: the first, and the longest.
const WRITING_PAUSES: [Duration; 2] = [Duration::from_millis(250), Duration::from_secs(60)];

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
    if values.next().is_some() || Target::read(&text, settings.allow_private).is_none() {
        return Err(refused(Target::ALLOWED));
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
    /// Send the webhooks in `store`.
    #[must_use]
    pub fn start(store: Arc<dyn Store>, settings: Settings, clock: Clock) -> Self {
        let client = Client::new(settings.allow_private);
        let delivery = Arc::new(Delivery {
            store,
            settings,
            client,
            clock,
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

struct Delivery {
    store: Arc<dyn Store>,
    settings: Settings,
    client: Client,
    /// Decides when to try, and dates what is sent.
    clock: Clock,
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

impl Delivery {
    /// Try once, and record the outcome.
    async fn deliver(&self, webhook: Webhook) {
        let (id, tries) = (webhook.plan.id, webhook.tries + 1);
        // A panic counts as a try, or it would happen again at the next look.
        let trying = AssertUnwindSafe(self.try_once(webhook)).catch_unwind();
        let broke = |_| Err(std::io::Error::other("sending it broke"));
        let pause_ms = match trying.await.unwrap_or_else(broke) {
            Ok(status) if status.is_success() => {
                tracing::info!(plan_id = %id, tries, "the webhook got through");
                None
            }
            Ok(StatusCode::GONE) => {
                tracing::info!(plan_id = %id, tries, "the webhook's receiver is gone");
                None
            }
            Ok(status) => again(id, tries, &format!("the answer is {status}")),
            Err(error) => again(id, tries, &error.to_string()),
        };
        let next_ms = pause_ms.map(|pause_ms| (self.clock)() + pause_ms);
        self.write_down(id, next_ms).await;
    }

    /// Retries while the store fails: a webhook whose outcome is not recorded is still due, and the next look would
    /// send it once more.
    async fn write_down(&self, id: PlanId, next_ms: Option<i64>) {
        let [mut pause, longest] = WRITING_PAUSES;
        while let Err(error) = self.store.webhook_tried(id, next_ms).await {
            // The plan has been deleted meanwhile, so there is nothing to record.
            if matches!(error, StoreError::NotFound(_) | StoreError::Gone(_)) {
                return;
            }
            tracing::warn!(plan_id = %id, %error, "a webhook's try is not written down yet; trying again");
            tokio::time::sleep(pause).await;
            pause = longest.min(2 * pause);
        }
    }

    async fn try_once(&self, webhook: Webhook) -> std::io::Result<StatusCode> {
        let target = Target::read(&webhook.url, self.settings.allow_private)
            .ok_or_else(|| std::io::Error::other("the address is no longer allowed"))?;
        let id = webhook.plan.id.to_string();
        let body = Message::of(webhook).to_json();
        let timestamp_s = (self.clock)() / 1_000;
        let signature = self.settings.secrets.sign(&id, timestamp_s, &body);
        let mut headers = HeaderMap::new();
        headers.insert(
            header::CONTENT_TYPE,
            HeaderValue::from_static("application/json"),
        );
        for (name, value) in [
            (WEBHOOK_ID, id),
            (WEBHOOK_TIMESTAMP, timestamp_s.to_string()),
            (WEBHOOK_SIGNATURE, signature),
        ] {
            let value = HeaderValue::from_str(&value).expect("visible ASCII");
            headers.insert(name, value);
        }
        self.client.post(&target, headers, body).await
    }
}

/// Milliseconds until the next try. The address stays out of the log: it may contain the receiver's own secret.
fn again(id: PlanId, tries: u32, why: &str) -> Option<i64> {
    let jitter = f64::from(getrandom::u32().unwrap_or(u32::MAX / 2)) / f64::from(u32::MAX);
    if let Some(pause_ms) = retry::pause_ms(tries, jitter) {
        let pause_s = pause_ms / 1000;
        tracing::warn!(plan_id = %id, tries, pause_s, why, "a webhook did not get through");
        Some(pause_ms)
    } else {
        tracing::error!(plan_id = %id, tries, why, "a webhook did not get through and is given up");
        None
    }
}

/// The body of a webhook.
#[derive(Serialize)]
struct Message {
    r#type: &'static str,
    /// Time of the end.
    timestamp: Time,
    data: StatusDocument,
}

impl Message {
    fn of(webhook: Webhook) -> Self {
        Self {
            r#type: "plan.ended",
            timestamp: Time(webhook.plan.finished_ms.unwrap_or_default()),
            data: webhook.plan.into(),
        }
    }

    fn to_json(&self) -> String {
        serde_json::to_string(self).expect("every map key is a string")
    }
}
