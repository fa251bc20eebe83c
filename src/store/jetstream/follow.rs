//! Keeps the view current: reads the plans' stream as it grows, and resumes after an interruption.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use async_nats::jetstream::Message;
use async_nats::jetstream::consumer::{DeliverPolicy, push};
use async_nats::jetstream::stream::Stream;
use futures_util::StreamExt as _;
use tokio::runtime::Handle;
use tokio::sync::watch;
use tokio::time::{sleep, timeout};

use super::JetStream;
use super::connect::{PATIENCE, plan_of};
use super::errors::{failed, refused};
use super::history::History;
use super::record::{Placed, State, Step};
use crate::job::PlanId;
use crate::store::StoreError;

/// While what was there at the start is being read, progress is reported once in so many steps.
const SAID_EVERY: u64 = 1_000;

/// Pause between attempts to resume.
const PAUSE: Duration = Duration::from_millis(250);

/// While no step comes, it is looked in these intervals whether the servers have one.
const LOOK: Duration = Duration::from_millis(500);

/// How far the reading has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reading {
    /// What was there at the start is still being read; so far up to this sequence, roughly.
    Catching { read: u64 },
    /// Every new step is known at once.
    Current,
    /// Reading was interrupted and is being resumed.
    Broken,
}

impl JetStream {
    /// Read until the stream vanishes; report the state of reading to `reading`.
    pub(super) async fn follow(self: Arc<Self>, reading: watch::Sender<Reading>) {
        let mut read = 0;
        loop {
            let ended = self.read_on(&mut read, &reading).await;
            let broken = reading.send_if_modified(|reading| {
                let was_current = *reading == Reading::Current;
                if was_current {
                    *reading = Reading::Broken;
                }
                was_current
            });
            if let Err(error) = ended {
                if self.heed_vanished(&error) {
                    return;
                }
                // Once for each interruption.
                if broken {
                    tracing::warn!(%error, "plans are no longer followed; trying again");
                } else {
                    tracing::debug!(%error, "plans are not followed yet; trying again");
                }
            }
            sleep(PAUSE).await;
        }
    }

    /// Read on after `read`, the last sequence read; ends when the connection is lost for good.
    async fn read_on(
        &self,
        read: &mut u64,
        reading: &watch::Sender<Reading>,
    ) -> Result<(), StoreError> {
        let what = "the plans' stream";
        let begin = if *read == 0 {
            DeliverPolicy::LastPerSubject
        } else {
            DeliverPolicy::ByStartSequence {
                start_sequence: *read + 1,
            }
        };
        let all = format!("{}.plans.*", self.servers.namespace);
        let connects = self.connects();
        // It may have been removed since, and never come.
        let newest = self.newest_sequence().await?;
        let mut steps = self.read_steps(what, all, begin).await?;
        if steps.are_none {
            *read = newest.max(*read);
            reading.send_replace(Reading::Current);
        }
        loop {
            let message = tokio::select! {
                biased;
                message = steps.messages.next() => message,
                why = self.left_behind(*read, connects) => return Err(refused(what, why)),
            };
            let Some(message) = message else { break };
            let message = message.map_err(|error| refused(what, &error))?;
            let (sequence, pending) = {
                let info = message.info().map_err(|error| refused(what, &*error))?;
                (info.stream_sequence, info.pending)
            };
            self.take_in(&message, sequence);
            *read = sequence.max(*read);
            if pending % SAID_EVERY == 0 {
                reading.send_if_modified(|reading| {
                    let is_catching = matches!(reading, Reading::Catching { .. });
                    if is_catching {
                        *reading = Reading::Catching { read: sequence };
                    }
                    is_catching
                });
            }
            if pending == 0 {
                *read = newest.max(*read);
                reading.send_if_modified(|reading| {
                    let news = *reading != Reading::Current;
                    *reading = Reading::Current;
                    news
                });
            }
        }
        Ok(())
    }

    /// Returns when steps may have been missed: the connection was cut, or the servers have had one after `read` for a
    /// while. What delivers them may be gone with its server, which the client notices only after ten seconds.
    async fn left_behind(&self, read: u64, connects: u64) -> &'static str {
        let mut is_late = false;
        loop {
            sleep(LOOK).await;
            if self.connects() != connects || !self.servers.is_connected() {
                return "the connection was cut";
            }
            // Who does not answer may not have anything to deliver either.
            let has_more = matches!(self.newest_sequence().await, Ok(newest) if newest > read);
            if has_more && is_late {
                return "steps do not come";
            }
            is_late = has_more;
        }
    }

    /// How often the client has connected.
    fn connects(&self) -> u64 {
        self.servers
            .client
            .statistics()
            .connects
            .load(Ordering::Relaxed)
    }

    /// The sequence of the newest step on the servers.
    async fn newest_sequence(&self) -> Result<u64, StoreError> {
        let info = self.servers.plans.get_info().await;
        let info = info.map_err(|error| failed("the plans' stream", &error))?;
        Ok(info.state.last_sequence)
    }

    fn take_in(&self, message: &Message, sequence: u64) {
        let Some(id) = plan_of(&message.subject) else {
            return;
        };
        // This node's own writes are already known.
        if self
            .view
            .standing(id)
            .is_some_and(|known| known.sequence >= sequence)
        {
            return;
        }
        match Step::read(&message.payload) {
            Ok(step) => self.plans().learn(id, &Placed { sequence, step }),
            Err(error) => {
                tracing::error!(%error, plan_id = %id, sequence, "a step cannot be read; it is left out");
            }
        }
    }

    /// The steps of a subject from a sequence number on, as they come.
    async fn read_steps(
        &self,
        what: &str,
        filter_subject: String,
        deliver_policy: DeliverPolicy,
    ) -> Result<Steps, StoreError> {
        let config = push::OrderedConfig {
            deliver_subject: self.servers.client.new_inbox(),
            filter_subject,
            deliver_policy,
            ..push::OrderedConfig::default()
        };
        let made = self.servers.plans.create_consumer(config).await;
        let mut consumer = made.map_err(|error| failed(what, &error))?;
        let info = consumer
            .info()
            .await
            .map_err(|error| failed(what, &error))?;
        // Nothing is delivered before somebody listens. (The delivered count does not tell: for a consumer that starts
        // at a sequence number it is the number before.)
        let (are_none, name) = (info.num_pending == 0, info.name.clone());
        let messages = consumer.messages().await;
        Ok(Steps {
            are_none,
            messages: messages.map_err(|error| failed(what, &error))?,
            consumer: name,
            stream: self.servers.plans.clone(),
        })
    }

    /// All events of a plan that the stream still keeps.
    pub(super) async fn read_history(&self, id: PlanId) -> Result<History, StoreError> {
        let what = format!("events of plan {id}");
        let subject = self.servers.subject_of(id);
        let mut history = History::whole();
        let mut steps = self.read_steps(&what, subject, DeliverPolicy::All).await?;
        if steps.are_none {
            return Ok(history);
        }
        loop {
            // Steps that are removed just now never come.
            let Ok(next) = timeout(PATIENCE, steps.messages.next()).await else {
                let standing = self.plans().look_up(id).await?;
                standing.record(id, self.expiry_ms())?;
                return Err(refused(&what, "none came for a while"));
            };
            let Some(message) = next else { break };
            let message = message.map_err(|error| refused(&what, &error))?;
            let pending = message
                .info()
                .map_err(|error| refused(&what, &*error))?
                .pending;
            let step = Step::read(&message.payload)?;
            if matches!(*step.state, State::Kept(_)) {
                history.push(&step, self.options.events_kept);
            }
            if pending == 0 {
                break;
            }
        }
        Ok(history)
    }
}

/// Steps of a subject, as they come.
struct Steps {
    /// Whether there were none at the beginning.
    are_none: bool,
    messages: push::Ordered,
    /// What delivers them.
    consumer: String,
    stream: Stream,
}

impl Drop for Steps {
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
