//! How a plan is accepted.
//!
//! Its document and its job are written first, its record last: a submission that was interrupted before that was never
//! accepted, and its job, which has no record, is discarded by whichever node receives it, or finds it in the
//! queue once more after some minutes.

use std::error::Error;
use std::time::Duration;

use async_nats::jetstream::context::PublishErrorKind;
use async_nats::jetstream::kv::{CreateErrorKind, Entry, Operation};
use async_nats::jetstream::message::PublishMessage;
use bytes::Bytes;
use serde::{Deserialize, Serialize};
use tokio::time::{Instant, timeout};

use super::JetStream;
use super::errors::{failed, is_outrun, lacks_room};
use super::lane::Lane;
use super::record::{Document, Queued, Record};
use super::steps::Change;
use crate::digest::sha256_hex;
use crate::job::{Idempotency, Owner, Plan, PlanId, Submission};
use crate::store::{IDEMPOTENCY_MS, StoreError, Submitted};

/// How long a request waits for an earlier one with the same idempotency key.
const PATIENCE: Duration = Duration::from_secs(10);

/// How long the writes of a submission may take; after that, it begins no other.
const LONGEST: Duration = Duration::from_secs(30);

/// A request older than this whose plan does not exist was interrupted. Taking the key outlasts an election, and the writes
/// that follow take [`LONGEST`]; the rest is for the clocks of two nodes, which may differ.
const BROKEN_OFF_MS: i64 = 60_000;

/// Which submission came first with a key.
#[derive(Debug, Serialize, Deserialize)]
struct First {
    plan: PlanId,
    body_sha256: String,
    seen_ms: i64,
}

impl First {
    /// The first submission, unless it was too long ago.
    fn read(
        entry: &Entry,
        idempotency: &Idempotency,
        expiry_ms: i64,
    ) -> Result<Option<Self>, StoreError> {
        let first: Self = serde_json::from_slice(&entry.value).map_err(|error| unread(&error))?;
        if first.seen_ms <= expiry_ms.saturating_sub(IDEMPOTENCY_MS) {
            return Ok(None);
        }
        if first.body_sha256 != idempotency.body_sha256 {
            return Err(StoreError::KeyReused);
        }
        Ok(Some(first))
    }
}

fn unread(error: &(impl Error + 'static)) -> StoreError {
    failed("idempotency key", error)
}

impl JetStream {
    /// See [`Store::repeated`](crate::store::Store::repeated).
    pub(super) async fn repeated(
        &self,
        owner: Option<&Owner>,
        idempotency: &Idempotency,
    ) -> Result<Option<Plan>, StoreError> {
        let key = key_of(owner, idempotency);
        let asked = self.servers.outlast(async || {
            let entry = self.servers.keys.entry(key.as_str()).await;
            entry.map_err(|error| unread(&error))
        });
        let entry = asked.await?;
        let Some(entry) = entry.filter(|entry| entry.operation == Operation::Put) else {
            return Ok(None);
        };
        let Some(first) = First::read(&entry, idempotency, self.expiry_ms())? else {
            return Ok(None);
        };
        match self.get(first.plan).await {
            // It was never accepted, or is not yet.
            Err(StoreError::NotFound(_)) => Ok(None),
            found => found.map(Some),
        }
    }

    pub(super) async fn submit(&self, submission: &Submission) -> Result<Submitted, StoreError> {
        let Some(idempotency) = &submission.idempotency else {
            let accepted = self.accept(submission).await;
            return accepted.map(newly).map_err(|not| not.error);
        };
        let key = key_of(submission.owner.as_ref(), idempotency);
        let revision = match self.be_first(&key, submission, idempotency).await? {
            Turn::First { revision } => revision,
            Turn::Later(plan) => {
                return Ok(Submitted {
                    plan: *plan,
                    replayed: true,
                });
            }
        };
        match self.accept(submission).await {
            Ok(plan) => Ok(newly(plan)),
            Err(NotAccepted { error, is_certain }) => {
                // While that is uncertain the key must be kept.
                if is_certain {
                    let undone = self
                        .servers
                        .keys
                        .delete_expect_revision(&key, Some(revision))
                        .await;
                    if let Err(error) = undone {
                        tracing::debug!(%error, "an idempotency key is left without a plan");
                    }
                }
                Err(error)
            }
        }
    }

    async fn accept(&self, submission: &Submission) -> Result<Plan, NotAccepted> {
        let lane = Lane::of(submission);
        let limit = self.options.queue_limit;
        let room = self.view.known().expect(limit, submission.quota, &lane);
        let position = room.map_err(NotAccepted::certainly)?;
        let accepted = timeout(LONGEST, self.write_all(submission, &lane, position)).await;
        self.view.known().arrived(&lane);
        accepted.unwrap_or_else(|_| {
            Err(NotAccepted {
                error: StoreError::unavailable("the servers were too slow to accept a plan"),
                is_certain: false,
            })
        })
    }

    async fn write_all(
        &self,
        submission: &Submission,
        lane: &Lane,
        position: u64,
    ) -> Result<Plan, NotAccepted> {
        let id = submission.id;
        let scenario = Document::scenario(id, &submission.scenario);
        let mark = id.to_string();
        let (document, job) = tokio::join!(
            self.servers.write(&scenario, &submission.scenario),
            self.enqueue(id, lane, &mark)
        );
        let objects = [scenario.key.clone()];
        let enqueued = job.as_ref().ok().copied();
        let place = match document.and(job) {
            Ok(place) => place,
            Err(error) => {
                self.undo(id, &objects, enqueued).await;
                return Err(NotAccepted::certainly(error));
            }
        };
        let record = Record::accepted(submission, Queued { place, position }, scenario);
        let plan = record.plan.clone();
        let change = Change::announced(Box::new(record));
        match self.plans().begin(id, change).await {
            Ok(()) => Ok(plan),
            Err(error) if lacks_room(&error) => {
                self.undo(id, &objects, Some(place)).await;
                Err(NotAccepted::certainly(error))
            }
            Err(error) => Err(NotAccepted {
                is_certain: !matches!(error, StoreError::Unavailable { .. }),
                error,
            }),
        }
    }

    /// Remove what was written of a plan that is refused: it must not take up the room that smaller plans and the ends of
    /// runs need. The job goes last, since what is left is found by it.
    async fn undo(&self, id: PlanId, objects: &[String], place: Option<u64>) {
        let removed = self.servers.remove_documents(id, objects).await;
        if let (Ok(()), Some(place)) = (removed, place) {
            self.withdraw(id, place).await;
        }
    }

    /// Write a job; returns its place in the queue's stream. A job written twice because the answer was lost is there
    /// once: the servers identify it by its `mark`.
    pub(super) async fn enqueue(
        &self,
        id: PlanId,
        lane: &Lane,
        mark: &str,
    ) -> Result<u64, StoreError> {
        self.servers
            .outlast(|| self.try_to_enqueue(id, lane, mark))
            .await
    }

    async fn try_to_enqueue(&self, id: PlanId, lane: &Lane, mark: &str) -> Result<u64, StoreError> {
        let job = PublishMessage::build().message_id(mark);
        let subject = self.job_subject(id, lane);
        let error = match self.servers.publish(subject, job).await {
            Ok(ack) => return Ok(ack.sequence),
            Err(error) => error,
        };
        let refusal = failed(&format!("job of plan {id}"), &error);
        let is_full = error.kind() == PublishErrorKind::Other
            && refusal.to_string().contains("maximum messages exceeded");
        Err(if is_full {
            StoreError::QueueFull {
                queued: self.view.known().stats().queued,
            }
        } else {
            refusal
        })
    }

    pub(super) fn job_subject(&self, id: PlanId, lane: &Lane) -> String {
        format!("{}.jobs.{}.{id}", self.servers.namespace, lane.subject())
    }

    /// Claim a key, or find the plan of the submission that holds it.
    async fn be_first(
        &self,
        key: &str,
        submission: &Submission,
        idempotency: &Idempotency,
    ) -> Result<Turn, StoreError> {
        self.servers
            .outlast(|| self.try_to_be_first(key, submission, idempotency))
            .await
    }

    async fn try_to_be_first(
        &self,
        key: &str,
        submission: &Submission,
        idempotency: &Idempotency,
    ) -> Result<Turn, StoreError> {
        let keys = &self.servers.keys;
        let until = Instant::now() + PATIENCE;
        loop {
            let now_ms = (self.options.clock)();
            let own = First {
                plan: submission.id,
                body_sha256: idempotency.body_sha256.clone(),
                seen_ms: now_ms,
            };
            let own: Bytes = serde_json::to_vec(&own)
                .map_err(|error| unread(&error))?
                .into();
            match keys.create(key, own.clone()).await {
                Ok(revision) => return Ok(Turn::First { revision }),
                Err(error) if error.kind() == CreateErrorKind::AlreadyExists => {}
                Err(error) if is_outrun(&error) => {}
                Err(error) => return Err(unread(&error)),
            }
            let entry = keys.entry(key).await.map_err(|error| unread(&error))?;
            let Some(entry) = entry.filter(|entry| entry.operation == Operation::Put) else {
                continue;
            };
            if let Some(first) = First::read(&entry, idempotency, self.expiry_ms())? {
                if first.plan == submission.id {
                    // It was claimed earlier, but the answer was lost.
                    let revision = entry.revision;
                    return Ok(Turn::First { revision });
                }
                match self.get(first.plan).await {
                    Ok(plan) => return Ok(Turn::Later(Box::new(plan))),
                    Err(StoreError::NotFound(_)) if Instant::now() < until => {
                        tokio::time::sleep(Duration::from_millis(10)).await;
                        continue;
                    }
                    Err(StoreError::NotFound(_)) if now_ms - first.seen_ms < BROKEN_OFF_MS => {
                        return Err(StoreError::KeyInFlight);
                    }
                    Err(StoreError::NotFound(_)) => {}
                    Err(error) => return Err(error),
                }
            }
            match keys.update(key, own, entry.revision).await {
                Ok(revision) => return Ok(Turn::First { revision }),
                Err(error) if is_outrun(&error) => {}
                Err(error) => return Err(unread(&error)),
            }
        }
    }
}

/// Why a plan was not accepted, as far as is known.
struct NotAccepted {
    error: StoreError,
    /// False when it may have been, and only the answer was lost.
    is_certain: bool,
}

impl NotAccepted {
    fn certainly(error: StoreError) -> Self {
        Self {
            error,
            is_certain: true,
        }
    }
}

enum Turn {
    First {
        /// Revision of the key.
        revision: u64,
    },
    Later(Box<Plan>),
}

fn newly(plan: Plan) -> Submitted {
    Submitted {
        plan,
        replayed: false,
    }
}

/// Callers choose keys freely; a bucket does not allow all characters.
fn key_of(owner: Option<&Owner>, idempotency: &Idempotency) -> String {
    let owner = owner.map_or("", String::as_str);
    sha256_hex(format!("{owner}\n{}", idempotency.key).as_bytes())
}
