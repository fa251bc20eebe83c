//! The messages in the plans' stream: steps of plans' lives.
//!
//! Each message is one step: the plan's new state, and the events that go with it. So a state and its events are one
//! write, which happens entirely or not at all.

use std::sync::Arc;

use async_nats::jetstream::message::StreamMessage;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::lane::Lane;
use super::steps::Change;
use crate::job::{Event, NumberedEvent, Owner, Plan, PlanId, Status, Submission};
use crate::store::{Ending, LastEvent, Retention, StoreError, Tombstone};

/// A step, as it is written.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Step {
    /// Lets a writer whose acknowledgement was lost recognise its own step.
    pub(super) mark: Uuid,
    /// The state after the step.
    #[serde(with = "shared")]
    pub(super) state: Arc<State>,
    /// Events before that of the new state.
    pub(super) events: Vec<Event>,
    /// Whether the new state is an event too, and the end when the plan has ended: both can be derived from the state,
    /// so they are not written twice.
    #[serde(rename = "told")]
    pub(super) announced: bool,
}

/// The state of a plan.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum State {
    /// The plan exists.
    Kept(Box<Record>),
    /// The plan was removed.
    Buried(Grave),
}

/// A plan with the data that only the store knows.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Record {
    pub(super) plan: Plan,
    pub(super) lane: Lane,
    /// Its job's place in the queue's stream: the order of acceptance.
    pub(super) place: u64,
    /// Runs begun.
    pub(super) attempt: u64,
    /// Runs that were lost with their worker.
    pub(super) lost: u32,
    /// Steps appended by the present run.
    pub(super) appended: u64,
    /// Id of the newest event.
    pub(super) last_event: u64,
    /// Bytes of its documents.
    pub(super) bytes: u64,
    /// Bytes of its events that are kept.
    #[serde(default)]
    pub(super) event_bytes: u64,
    pub(super) scenario: Document,
    pub(super) result: Option<Document>,
    pub(super) dataset: Option<String>,
    pub(super) webhook: Option<Hook>,
}

/// A plan's position in the queue.
#[derive(Debug, Clone, Copy)]
pub(super) struct Queued {
    /// See [`Record::place`].
    pub(super) place: u64,
    /// 1 for the next to run.
    pub(super) position: u64,
}

/// Where a document is stored.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Document {
    pub(super) key: String,
    /// Whether it is in the object store, being too long for a message.
    pub(super) large: bool,
}

/// Where to send word of the end.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Hook {
    pub(super) url: String,
    pub(super) tries: u32,
    /// `None` before the end.
    pub(super) due_ms: Option<i64>,
}

/// What remains of a plan.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Grave {
    pub(super) owner: Option<Owner>,
    pub(super) expired: bool,
    pub(super) deleted_ms: i64,
    /// See [`Record::objects`].
    #[serde(default)]
    pub(super) objects: Vec<String>,
    /// See [`Tombstone::end`].
    #[serde(default)]
    pub(super) end: Option<LastEvent>,
}

impl Record {
    /// The record of a plan that has just been accepted.
    pub(super) fn accepted(submission: &Submission, queued: Queued, scenario: Document) -> Self {
        Self {
            plan: Plan::accepted(submission, queued.position),
            lane: Lane::of(submission),
            place: queued.place,
            attempt: 0,
            lost: 0,
            appended: 0,
            last_event: 0,
            bytes: submission.scenario.len() as u64,
            event_bytes: 0,
            scenario,
            result: None,
            dataset: submission.dataset.clone(),
            webhook: submission.webhook.as_ref().map(|url| Hook {
                url: url.clone(),
                tries: 0,
                due_ms: None,
            }),
        }
    }

    /// A record for tests, of a plan that waits.
    #[cfg(test)]
    pub(super) fn example() -> Self {
        let queued = Queued {
            place: 1,
            position: 1,
        };
        let scenario = Document::scenario(uuid::Uuid::nil(), "{}");
        Self::accepted(&Submission::example(), queued, scenario)
    }

    pub(super) fn id(&self) -> PlanId {
        self.plan.id
    }

    /// Keys of its documents that are, or may be, in the object store: what a superseded run, or one that ended without
    /// a result, wrote is recorded nowhere.
    pub(super) fn objects(&self) -> Vec<String> {
        let scenario = Some(&self.scenario).filter(|scenario| scenario.large);
        let small = self.result.as_ref().filter(|result| !result.large);
        let results = (1..=self.attempt).map(|attempt| Document::result_key(self.id(), attempt));
        let results = results.filter(|key| small.is_none_or(|small| small.key != *key));
        let scenario = scenario.map(|scenario| scenario.key.clone());
        scenario.into_iter().chain(results).collect()
    }

    /// Approximate bytes it takes up on the servers: documents and events.
    pub(super) fn size(&self) -> u64 {
        self.bytes + self.event_bytes
    }

    /// Its current status as an event.
    pub(super) fn status(&self) -> Event {
        Event::Status(Box::new(self.plan.clone()))
    }

    /// The plan has ended: its retention time starts, and its webhook is due.
    pub(super) fn ended(&mut self, retention: Retention) {
        self.plan.expires_ms = retention.expires_ms(&self.plan);
        if let Some(hook) = &mut self.webhook {
            hook.due_ms = self.plan.finished_ms;
        }
    }

    pub(super) fn is_run_under(&self, attempt: u64) -> bool {
        self.plan.status == Status::Running && self.attempt == attempt
    }

    /// Whether the run of this attempt has ended it so. Others may end it too, when its worker seems lost.
    pub(super) fn is_ended_by(&self, attempt: u64, ending: &Ending) -> bool {
        self.attempt == attempt
            && match ending {
                // Only a run leaves one.
                Ending::Result { .. } => self.result.is_some(),
                Ending::Failed(failure) => self.plan.error.as_ref() == Some(failure),
            }
    }
}

impl Grave {
    pub(super) fn tombstone(&self, id: PlanId) -> Tombstone {
        Tombstone {
            id,
            owner: self.owner.clone(),
            expired: self.expired,
            end: self.end,
        }
    }
}

impl Step {
    /// The step for `change`, with the events counted.
    pub(super) fn of(change: Change) -> Self {
        let Change {
            mut state,
            events,
            announced,
        } = change;
        if let State::Kept(record) = &mut state {
            record.last_event += count(events.len(), announced, &record.plan);
        }
        Self {
            mark: Uuid::new_v4(),
            state: Arc::new(state),
            events,
            announced,
        }
    }

    /// Id of its first event; of the next one, when it has none.
    pub(super) fn first_event(&self, record: &Record) -> u64 {
        record.last_event + 1 - count(self.events.len(), self.announced, &record.plan)
    }

    /// All its events, with their ids.
    pub(super) fn numbered(&self) -> Vec<NumberedEvent> {
        let State::Kept(record) = &*self.state else {
            return Vec::new();
        };
        let status = record.plan.status;
        let now = [
            Some(record.status()),
            status.is_final().then_some(Event::End(status)),
        ];
        let now = now.into_iter().flatten().filter(|_| self.announced);
        (self.first_event(record)..)
            .zip(self.events.iter().cloned().chain(now))
            .map(|(id, event)| NumberedEvent { id, event })
            .collect()
    }

    pub(super) fn write(&self) -> Result<bytes::Bytes, StoreError> {
        serde_json::to_vec(self)
            .map(bytes::Bytes::from)
            .map_err(|error| StoreError::unavailable(format!("a step of a plan: {error}")))
    }

    pub(super) fn read(payload: &[u8]) -> Result<Self, StoreError> {
        serde_json::from_slice(payload)
            .map_err(|error| StoreError::unavailable(format!("a step of a plan: {error}")))
    }
}

/// Number of events of a step with `before` explicit ones, and that of the new state when `announced`.
fn count(before: usize, announced: bool, plan: &Plan) -> u64 {
    before as u64 + u64::from(announced) + u64::from(announced && plan.status.is_final())
}

/// Bytes of events as stored in a step.
pub(super) fn length(events: &[Event]) -> u64 {
    struct Count(u64);
    impl std::io::Write for Count {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0 += bytes.len() as u64;
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let mut count = Count(0);
    // Events that cannot be serialised cannot be written as a step either; the error is reported there.
    let _ = serde_json::to_writer(&mut count, events);
    count.0
}

/// Serialises a state as if it were not shared.
mod shared {
    use std::sync::Arc;

    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer};

    use super::State;

    pub(super) fn serialize<S: Serializer>(state: &Arc<State>, to: S) -> Result<S::Ok, S::Error> {
        state.as_ref().serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Arc<State>, D::Error> {
        State::deserialize(from).map(Arc::new)
    }
}

/// A step with its sequence in the stream.
#[derive(Debug, Clone)]
pub(super) struct Placed {
    pub(super) sequence: u64,
    pub(super) step: Step,
}

impl TryFrom<StreamMessage> for Placed {
    type Error = StoreError;

    fn try_from(message: StreamMessage) -> Result<Self, StoreError> {
        Ok(Self {
            sequence: message.sequence,
            step: Step::read(&message.payload)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::FailureKind;

    #[test]
    fn an_end_is_that_run_s_which_left_its_result_or_its_failure() {
        let result = Ending::Result {
            cancelled: false,
            stop_reason: "iterations".to_owned(),
            feasible: false,
            best_cost: None,
            evaluations: 0,
            iteration: 0,
            document: "{}".to_owned(),
        };
        let failure = |kind: FailureKind| kind.because("said");
        let failed = Ending::Failed(failure(FailureKind::PlannerPanic));
        let mut record = Record::example();
        record.plan.start(1).expect("it waits");
        record.attempt = 2;
        assert!(!record.is_ended_by(2, &result) && !record.is_ended_by(2, &failed));

        let mut lost = record.clone();
        let by_others = failure(FailureKind::WorkerLost);
        lost.plan.fail(by_others, 2).expect("it runs");
        assert!(!lost.is_ended_by(2, &result) && !lost.is_ended_by(2, &failed));

        let mut own = record.clone();
        let panic = failure(FailureKind::PlannerPanic);
        own.plan.fail(panic, 2).expect("it runs");
        assert!(own.is_ended_by(2, &failed) && !own.is_ended_by(1, &failed));

        record.plan.end(Status::Succeeded, 2).expect("it runs");
        record.result = Some(Document::result(Uuid::nil(), 2, "{}"));
        assert!(record.is_ended_by(2, &result) && !record.is_ended_by(1, &result));
    }
}
