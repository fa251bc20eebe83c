//! Steps as the servers deliver them: in their order, each once, without acknowledgement.

use async_nats::jetstream::consumer::{DeliverPolicy, push};
use async_nats::jetstream::stream::Stream;
use tokio::runtime::Handle;

use super::connect::Servers;
use super::errors::failed;
use crate::store::StoreError;

/// The steps of a subject.
pub(super) struct Delivery {
    /// Whether there were none at the beginning.
    pub(super) is_empty: bool,
    /// Those, and the ones that are written later.
    pub(super) steps: push::Ordered,
    /// The consumer that delivers them.
    consumer: String,
    stream: Stream,
}

impl Delivery {
    /// The steps of this subject, from where `begin` says.
    pub(super) async fn of(
        servers: &Servers,
        what: &str,
        subject: String,
        begin: DeliverPolicy,
    ) -> Result<Self, StoreError> {
        let config = push::OrderedConfig {
            deliver_subject: servers.client.new_inbox(),
            filter_subject: subject,
            deliver_policy: begin,
            ..push::OrderedConfig::default()
        };
        let made = servers.plans.create_consumer(config).await;
        let mut consumer = made.map_err(|error| failed(what, &error))?;
        let info = consumer
            .info()
            .await
            .map_err(|error| failed(what, &error))?;
        // Nothing is delivered before somebody listens. (The delivered count does not tell: for a consumer that starts
        // at a sequence number it is the number before.)
        let (is_empty, name) = (info.num_pending == 0, info.name.clone());
        let steps = consumer.messages().await;
        Ok(Self {
            is_empty,
            steps: steps.map_err(|error| failed(what, &error))?,
            consumer: name,
            stream: servers.plans.clone(),
        })
    }
}

impl Drop for Delivery {
    /// The servers would keep the consumer for half a minute, and allow only so many.
    fn drop(&mut self) {
        let (stream, consumer) = (self.stream.clone(), std::mem::take(&mut self.consumer));
        if let Ok(runtime) = Handle::try_current() {
            runtime.spawn(async move {
                if let Err(error) = stream.delete_consumer(&consumer).await {
                    tracing::debug!(%error, "a consumer is left to the servers");
                }
            });
        }
    }
}
