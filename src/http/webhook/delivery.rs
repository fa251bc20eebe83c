//! One webhook: it is sent once, and the outcome recorded.

use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::time::Duration;

use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use futures_util::FutureExt as _;
use serde::Serialize;

use super::address::Target;
use super::client::Client;
use super::{Settings, retry};
use crate::http::status::StatusDocument;
use crate::http::time::Time;
use crate::job::PlanId;
use crate::store::{Clock, Store, StoreError, Webhook};
use crate::telemetry::{Instruments, WebhookTry};

const WEBHOOK_ID: HeaderName = HeaderName::from_static("webhook-id");
const WEBHOOK_TIMESTAMP: HeaderName = HeaderName::from_static("webhook-timestamp");
const WEBHOOK_SIGNATURE: HeaderName = HeaderName::from_static("webhook-signature");

/// Pauses between attempts to record the outcome: the first, and the longest.
const WRITING_PAUSES: [Duration; 2] = [Duration::from_millis(250), Duration::from_secs(60)];

/// What sends a webhook.
pub(super) struct Delivery {
    pub(super) store: Arc<dyn Store>,
    pub(super) settings: Settings,
    pub(super) client: Client,
    /// Decides when to try, and dates what is sent.
    pub(super) clock: Clock,
    pub(super) instruments: Arc<Instruments>,
}

impl Delivery {
    /// Try once, and record the outcome.
    pub(super) async fn deliver(&self, webhook: Webhook) {
        let (id, tries) = (webhook.plan.id, webhook.tries + 1);
        // A panic counts as a try, or it would happen again at the next look.
        let trying = AssertUnwindSafe(self.try_once(webhook)).catch_unwind();
        let broke = |_| Err(std::io::Error::other("sending it broke"));
        let (tried, pause_ms) = match trying.await.unwrap_or_else(broke) {
            Ok(status) if status.is_success() => {
                tracing::info!(plan_id = %id, tries, "the webhook got through");
                (WebhookTry::Delivered, None)
            }
            Ok(StatusCode::GONE) => {
                tracing::info!(plan_id = %id, tries, "the webhook's receiver is gone");
                (WebhookTry::Gone, None)
            }
            Ok(status) => again(id, tries, &format!("the answer is {status}")),
            Err(error) => again(id, tries, &error.to_string()),
        };
        self.instruments.metrics.webhook_tried(tried);
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

/// What came of a try, and the milliseconds until the next. The address stays out of the log: it may contain the receiver's own secret.
fn again(id: PlanId, tries: u32, why: &str) -> (WebhookTry, Option<i64>) {
    let jitter = f64::from(getrandom::u32().unwrap_or(u32::MAX / 2)) / f64::from(u32::MAX);
    if let Some(pause_ms) = retry::pause_ms(tries, jitter) {
        let pause_s = pause_ms / 1000;
        tracing::warn!(plan_id = %id, tries, pause_s, why, "a webhook did not get through");
        (WebhookTry::Failed, Some(pause_ms))
    } else {
        tracing::error!(plan_id = %id, tries, why, "a webhook did not get through and is given up");
        (WebhookTry::GivenUp, None)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_try_is_given_up() {
        let id = PlanId::nil();
        let (tried, pause_ms) = again(id, 8, "no answer");
        assert!(tried == WebhookTry::Failed && pause_ms > Some(0));
        assert_eq!(again(id, 9, "no answer"), (WebhookTry::GivenUp, None));
    }
}
