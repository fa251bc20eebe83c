//! A lane's jobs, as the servers deliver them.

use std::time::Duration;

use async_nats::jetstream::consumer::{AckPolicy, PullConsumer, pull};
use async_nats::jetstream::{AckKind, Message};
use futures_util::StreamExt as _;

use super::JetStream;
use super::connect::PATIENCE;
use super::errors::{failed, refused};
use super::lane::Lane;
use crate::store::StoreError;

/// How long the servers keep a consumer that is not used. (That of a lane with running plans is asked every second.)
const UNASKED: Duration = Duration::from_secs(60 * 60);

/// How often a lane is asked again that nobody answers for, and the pause before that.
const MORE_TRIES: usize = 3;
const PAUSE: Duration = Duration::from_millis(200);

/// Maximum number of redelivered jobs that are sorted.
const MOST_SORTED: usize = 64;

impl JetStream {
    /// The next job of a lane, if there is one that nobody holds.
    pub(super) async fn fetch(&self, lane: &Lane) -> Result<Option<Message>, StoreError> {
        let Some(first) = self.fetch_any(lane).await? else {
            return Ok(None);
        };
        if !came_again(&first) {
            return Ok(Some(first));
        }
        // The servers redeliver jobs in the order in which they were given back.
        let mut jobs = vec![first];
        while jobs.len() < MOST_SORTED {
            let job = match self.fetch_any(lane).await {
                Ok(Some(job)) => job,
                Ok(None) => break,
                Err(error) => {
                    tracing::debug!(%error, "no more jobs are sorted");
                    break;
                }
            };
            let again = came_again(&job);
            jobs.push(job);
            if !again {
                break;
            }
        }
        jobs.sort_by_key(place);
        let next = jobs.remove(0);
        for job in jobs {
            if let Err(error) = job.double_ack_with(AckKind::Nak(None)).await {
                tracing::debug!(error = %error, "a job was not given back");
            }
        }
        Ok(Some(next))
    }

    /// After an outage of its server, a lane's stream may be there before what delivers from it: made sure of, that
    /// answers.
    async fn fetch_any(&self, lane: &Lane) -> Result<Option<Message>, StoreError> {
        for _ in 0..MORE_TRIES {
            match self.try_to_fetch(lane).await {
                Err(error) if is_unanswered(&error) => tokio::time::sleep(PAUSE).await,
                fetched => return fetched,
            }
        }
        self.try_to_fetch(lane).await
    }

    async fn try_to_fetch(&self, lane: &Lane) -> Result<Option<Message>, StoreError> {
        let what = || format!("lane {}", lane.name());
        let consumer = self.consumer(lane).await?;
        let asked = async {
            match consumer.fetch().max_messages(1).messages().await {
                Ok(mut batch) => batch
                    .next()
                    .await
                    .transpose()
                    .map_err(|error| refused(&what(), &error)),
                Err(error) => Err(failed(&what(), &error)),
            }
        };
        // A server that is lost during a request never answers.
        let fetched = tokio::time::timeout(PATIENCE, asked)
            .await
            .unwrap_or_else(|_| Err(refused(&what(), "no server answered")));
        if fetched.is_err() {
            // It may have been removed after a long time without use.
            self.consumers.lock().remove(lane);
        }
        fetched
    }

    async fn consumer(&self, lane: &Lane) -> Result<PullConsumer, StoreError> {
        if let Some(consumer) = self.consumers.lock().get(lane) {
            return Ok(consumer.clone());
        }
        let config = pull::Config {
            durable_name: Some(lane.name()),
            filter_subject: format!("{}.jobs.{}.*", self.servers.namespace, lane.subject()),
            ack_policy: AckPolicy::Explicit,
            ack_wait: self.settings.lease,
            // Lost runs are counted in the record, where giving back does not count.
            max_deliver: -1,
            max_ack_pending: 65_536,
            inactive_threshold: UNASKED,
            ..pull::Config::default()
        };
        let made = self.servers.jobs.create_consumer(config).await;
        let consumer = made.map_err(|error| failed(&format!("lane {}", lane.name()), &error))?;
        self.consumers.lock().insert(lane.clone(), consumer.clone());
        Ok(consumer)
    }
}

/// Whether the request had no responders, status 503 of NATS.
fn is_unanswered(error: &StoreError) -> bool {
    matches!(error, StoreError::Unavailable { detail, .. } if detail.contains(": 503, "))
}

fn came_again(job: &Message) -> bool {
    job.info().is_ok_and(|info| info.delivered > 1)
}

/// Its place in the queue's stream.
fn place(job: &Message) -> u64 {
    job.info().map_or(u64::MAX, |info| info.stream_sequence)
}
