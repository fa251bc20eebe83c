//! Keeps the view current: reads the plans' stream as it grows, and resumes after an interruption.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use async_nats::jetstream::Message;
use async_nats::jetstream::consumer::DeliverPolicy;
use futures_util::StreamExt as _;
use tokio::sync::watch;
use tokio::time::sleep;

use super::JetStream;
use super::connect::plan_of;
use super::delivery::Delivery;
use super::errors::{failed, refused};
use super::record::{Placed, Step};
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
            let broken = report(&reading, Reading::Broken, |before| {
                before == Reading::Current
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
        let mut delivery = Delivery::of(&self.servers, what, all, begin).await?;
        if delivery.is_empty {
            *read = newest.max(*read);
            report(reading, Reading::Current, |_| true);
        }
        loop {
            let message = tokio::select! {
                biased;
                message = delivery.steps.next() => message,
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
                let progress = Reading::Catching { read: sequence };
                report(reading, progress, |before| {
                    matches!(before, Reading::Catching { .. })
                });
            }
            if pending == 0 {
                *read = newest.max(*read);
                report(reading, Reading::Current, |_| true);
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
}

/// Say so if it is news after what was said `before`; true when it is.
fn report(
    reading: &watch::Sender<Reading>,
    now: Reading,
    follows: impl Fn(Reading) -> bool,
) -> bool {
    reading.send_if_modified(|before| {
        let is_news = *before != now && follows(*before);
        if is_news {
            *before = now;
        }
        is_news
    })
}
