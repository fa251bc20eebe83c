//! How a plan is claimed to be run.

use std::sync::Arc;
use std::time::Duration;

use async_nats::jetstream::{AckKind, Message};
use tokio::runtime::Handle;
use tokio::sync::{oneshot, watch};
use tokio::time::Instant;
use tracing::field::display;

use super::JetStream;
use super::connect::plan_of;
use super::errors::lacks_consumers;
use super::lane::{Lane, Version};
use super::leases::Job;
use super::orphans::Orphan;
use super::record::{Document, Record, State};
use super::steps::Change;
use super::view::Standing;
use crate::job::{Plan, PlanId, Status};
use crate::store::{Ending, Lease, StoreError, lost};

/// A job may be seen before its record; a claim waits this long for the record.
const RECORD_PATIENCE: Duration = Duration::from_millis(100);

/// Attempts on lanes whose jobs others claim first.
const TRIES: usize = 4;

/// Maximum number of lanes that are asked in turn.
const LANES: usize = 64;

/// Pause between two attempts.
const BREATH: Duration = Duration::from_millis(5);

impl JetStream {
    /// See [`Store::claim`](crate::store::Store::claim). Claiming is a task of its own, so that a caller who goes away
    /// in the middle of it leaves no plan behind.
    pub(super) async fn claim(self: &Arc<Self>) -> Result<Lease, StoreError> {
        let (give, take) = oneshot::channel();
        let store = Arc::clone(self);
        tokio::spawn(async move { store.take_for(give).await });
        let mut caller = Caller {
            store: Arc::clone(self),
            take,
        };
        (&mut caller.take)
            .await
            .unwrap_or_else(|_| Err(StoreError::closed()))
    }

    async fn take_for(&self, mut give: oneshot::Sender<Result<Lease, StoreError>>) {
        let mut waiting = self.view.waiting();
        let mut end = self.end.subscribe();
        loop {
            // One slot at a time: two would ask the same lanes, and get their jobs out of order.
            let turn = self.turn.lock().await;
            waiting.mark_unchanged();
            if give.is_closed() {
                return;
            }
            let job = if *end.borrow() {
                Err(StoreError::closed())
            } else {
                self.next_job().await
            };
            drop(turn);
            let taken = match job {
                Ok(Some(job)) => match self.begin(job).await {
                    Ok(None) => {
                        self.patrol_again();
                        continue;
                    }
                    lease => lease.transpose(),
                },
                Ok(None) => None,
                Err(error) => Some(Err(error)),
            };
            if let Some(taken) = taken {
                if let Err(Ok(lease)) = give.send(taken) {
                    self.take_back(&lease).await;
                }
                return;
            }
            tokio::select! {
                () = give.closed() => return,
                _ = end.changed() => {}
                _ = waiting.changed() => {}
                () = tokio::time::sleep(self.patrol()) => {}
            }
        }
    }

    /// The caller is gone. The job is put back in its place too, not only the record, so that the next claim finds it.
    async fn take_back(&self, lease: &Lease) {
        let _turn = self.turn.lock().await;
        if let Err(error) = self.put_back(lease.plan.id, lease.attempt).await {
            let plan_id = lease.plan.id;
            tracing::warn!(%plan_id, %error, "a plan that nobody waits for goes back when its lease ends");
        }
    }

    /// How often lanes are checked for jobs whose workers were lost.
    fn patrol(&self) -> Duration {
        (self.settings.lease / 4).min(Duration::from_secs(1))
    }

    /// The next job, from the lane whose turn it is or from a lane with lost workers.
    async fn next_job(&self) -> Result<Option<Message>, StoreError> {
        // A lane whose only jobs are held, by a claimer that was lost, must not keep the turn from the others.
        let mut passed = Vec::new();
        let mut unserved = None;
        let mut tries = 0;
        while tries < LANES {
            let Some(lane) = self.next_lane(&passed) else {
                if passed.is_empty() || tries >= TRIES {
                    break;
                }
                passed.clear();
                continue;
            };
            tries += 1;
            if let Some(job) = self.fetch_if_served(&lane, &mut unserved).await? {
                // The next slot need not ask for it again.
                if let Some(id) = plan_of(&job.subject) {
                    self.view.known().expect_run(id);
                }
                return Ok(Some(job));
            }
            passed.push(lane);
            tokio::time::sleep(BREATH).await;
        }
        if self.is_patrol_due() {
            let lanes = self.view.known().running_lanes(Version::own());
            for lane in lanes {
                if let Some(job) = self.fetch_if_served(&lane, &mut unserved).await? {
                    return Ok(Some(job));
                }
            }
        }
        unserved.map_or(Ok(None), Err)
    }

    /// As [`JetStream::fetch`], but where the servers allow the lane no consumer, others may have theirs: the error is
    /// `unserved`.
    async fn fetch_if_served(
        &self,
        lane: &Lane,
        unserved: &mut Option<StoreError>,
    ) -> Result<Option<Message>, StoreError> {
        match self.fetch(lane).await {
            Err(error) if lacks_consumers(&error) => {
                *unserved = Some(error);
                Ok(None)
            }
            fetched => fetched,
        }
    }

    /// The lane whose turn it is, of those that are not `passed` over.
    fn next_lane(&self, passed: &[Lane]) -> Option<Lane> {
        let known = self.view.known();
        known.next_lane(Version::own(), self.slots(), passed)
    }

    /// One slot of the node checks for all.
    fn is_patrol_due(&self) -> bool {
        let mut last = self.last_patrol.lock();
        let due = last.is_none_or(|last| last.elapsed() >= self.patrol());
        if due {
            *last = Some(Instant::now());
        }
        due
    }

    /// Where one lost job was found there may be more.
    fn patrol_again(&self) {
        *self.last_patrol.lock() = None;
    }

    /// Begin to run the plan of a job; `None` when there is nothing to run.
    async fn begin(&self, job: Message) -> Result<Option<Lease>, StoreError> {
        let id = plan_of(&job.subject);
        let begun = self.try_to_begin(job).await;
        if let (Some(id), Ok(None) | Err(_)) = (id, &begun) {
            self.view.expect_no_run(id);
        }
        begun
    }

    async fn try_to_begin(&self, job: Message) -> Result<Option<Lease>, StoreError> {
        let (message, acker) = job.split();
        let job = Job::new(acker);
        let Some(id) = plan_of(&message.subject) else {
            tracing::warn!(
                subject = message.subject.as_str(),
                "a job of no plan is thrown away"
            );
            answer(None, &job, AckKind::Ack).await;
            return Ok(None);
        };
        let Some(document) = self.document_of_job(id, &job).await? else {
            return Ok(None);
        };
        let (found, scenario) = tokio::join!(self.start(id, &job), self.servers.read(&document));
        let found = match found {
            Ok(found) => found,
            Err(error) => {
                answer(id, &job, AckKind::Nak(None)).await;
                return Err(error);
            }
        };
        match found {
            Found::Over => answer(id, &job, AckKind::Ack).await,
            Found::Lost(plan) => {
                (self.options.on_lost)(&plan);
                answer(id, &job, AckKind::Ack).await;
            }
            Found::Ours => {}
            Found::Run(record, cancel) => return self.lease(*record, cancel, scenario).await,
        }
        Ok(None)
    }

    /// The document to plan from; `None` when nobody wants it any more, or when the job comes again
    /// later.
    async fn document_of_job(&self, id: PlanId, job: &Job) -> Result<Option<Document>, StoreError> {
        match self.record_of_job(id).await {
            Ok(standing) => match &*standing.state {
                State::Kept(record) => return Ok(Some(record.scenario.clone())),
                State::Buried(_) => answer(id, job, AckKind::Ack).await,
            },
            Err(StoreError::NotFound(_)) => match self.orphans.miss(id) {
                Orphan::Waits(pause) => answer(id, job, AckKind::Nak(Some(pause))).await,
                Orphan::Nobodys => {
                    tracing::info!(plan_id = %id, "a job that was never accepted is thrown away");
                    let scenario = Document::scenario_key(id);
                    let removed = self.servers.remove_documents(id, &[scenario]).await;
                    let kind = removed
                        .as_ref()
                        .map_or(AckKind::Nak(None), |()| AckKind::Ack);
                    answer(id, job, kind).await;
                    removed?;
                }
            },
            Err(error) => {
                answer(id, job, AckKind::Nak(None)).await;
                return Err(error);
            }
        }
        Ok(None)
    }

    /// Jobs are written before records; a record that was waited for once is not waited for again.
    async fn record_of_job(&self, id: PlanId) -> Result<Standing, StoreError> {
        let is_late = self.orphans.is_known(id);
        let until = Instant::now() + RECORD_PATIENCE;
        loop {
            match self.plans().standing(id).await {
                Err(StoreError::NotFound(_)) if !is_late && Instant::now() < until => {
                    tokio::time::sleep(BREATH).await;
                }
                answer => {
                    if is_late && answer.is_ok() {
                        self.orphans.found(id);
                    }
                    return answer;
                }
            }
        }
    }

    /// Start a plan, and hold its job from then on: its document may take long to arrive.
    async fn start(&self, id: PlanId, job: &Job) -> Result<Found, StoreError> {
        let (mut started, mut found) = (None, Found::Over);
        let now_ms = (self.options.clock)();
        self.plans()
            .change(id, |standing| {
                (started, found) = (None, Found::Over);
                let State::Kept(record) = &*standing.state else {
                    return Ok(None);
                };
                let mut record = record.clone();
                let mut events = Vec::new();
                match record.plan.status {
                    Status::Queued => {}
                    Status::Running if self.leases.again(id, record.attempt, job) => {
                        found = Found::Ours;
                        return Ok(None);
                    }
                    Status::Running => {
                        record.lost += 1;
                        if lost::end(&mut record.plan, record.lost.into(), now_ms)? {
                            record.ended(self.options.retention);
                            found = Found::Lost(Box::new(record.plan.clone()));
                            return Ok(Some(Change::announced(record)));
                        }
                        record.plan.requeue()?;
                        record.plan.queue_position = Some(self.view.known().position(record.place));
                        events.push(record.status());
                    }
                    Status::Succeeded | Status::Failed | Status::Cancelled => return Ok(None),
                }
                record.plan.start(now_ms)?;
                record.attempt += 1;
                record.appended = 0;
                started = Some(record.clone());
                Ok(Some(Change {
                    events,
                    ..Change::announced(record)
                }))
            })
            .await?;
        let Some(record) = started else {
            return Ok(found);
        };
        let lease = self.settings.lease;
        let cancel = self.leases.hold(id, record.attempt, job.clone(), lease);
        // Take in requests that came between the step and the hold.
        if let Some(standing) = self.view.standing(id) {
            self.leases.heed(id, &standing.state);
        }
        Ok(Found::Run(record, cancel))
    }

    async fn lease(
        &self,
        record: Record,
        cancel: watch::Receiver<bool>,
        scenario: Result<Option<String>, StoreError>,
    ) -> Result<Option<Lease>, StoreError> {
        let (id, attempt) = (record.id(), record.attempt);
        match scenario {
            Ok(Some(scenario)) => Ok(Some(Lease {
                plan: record.plan,
                scenario: scenario.into(),
                attempt,
                cancel,
            })),
            Ok(None) => {
                let missing = record.scenario.missing();
                self.fail_without_scenario(id, attempt, &missing).await?;
                Ok(None)
            }
            Err(error) => {
                self.put_back(id, attempt).await?;
                Err(error)
            }
        }
    }

    /// A run that nobody will do. If the servers cannot be told so, its job is no longer held, and comes again.
    async fn put_back(&self, id: PlanId, attempt: u64) -> Result<(), StoreError> {
        let released = self.release(id, attempt).await;
        if released.is_err() {
            self.leases.let_go(id, attempt);
        }
        released.map(drop)
    }

    /// End a plan that can never be run, so that those behind it are.
    async fn fail_without_scenario(
        &self,
        id: PlanId,
        attempt: u64,
        missing: &StoreError,
    ) -> Result<(), StoreError> {
        let lost = lost::scenario(id, missing);
        let end = Ending::Failed(lost).at((self.options.clock)());
        match self.finish(id, attempt, &end).await {
            Ok(plan) => {
                (self.options.on_lost)(&plan);
                Ok(())
            }
            // It was deleted, or ended, meanwhile.
            Err(StoreError::LeaseLost(_)) => Ok(()),
            Err(error) => {
                self.put_back(id, attempt).await?;
                Err(error)
            }
        }
    }
}

/// A caller waiting for a plan. A plan that was handed over but not picked up goes back.
struct Caller {
    store: Arc<JetStream>,
    take: oneshot::Receiver<Result<Lease, StoreError>>,
}

impl Drop for Caller {
    fn drop(&mut self) {
        self.take.close();
        if let Ok(Ok(lease)) = self.take.try_recv()
            && let Ok(runtime) = Handle::try_current()
        {
            let store = Arc::clone(&self.store);
            runtime.spawn(async move { store.take_back(&lease).await });
        }
    }
}

/// What a job turned out to be.
enum Found {
    /// To be run, and held, with what tells its run to stop.
    Run(Box<Record>, watch::Receiver<bool>),
    /// It is already run here, under a lease that was not renewed in time.
    Ours,
    /// Ended, or removed.
    Over,
    /// Ended by this node, because its workers were lost.
    Lost(Box<Plan>),
}

/// Answer a delivery. If the answer is lost, the next delivery makes up for it, so nobody waits for confirmation,
/// except where a job is given back: that must arrive before the next fetch.
pub(super) async fn answer(plan: impl Into<Option<PlanId>>, job: &Job, answer: AckKind) {
    let answered = match answer {
        AckKind::Nak(_) => job.double_ack_with(answer).await,
        other => job.ack_with(other).await,
    };
    if let Err(error) = answered {
        let plan_id = plan.into().map(display);
        tracing::debug!(plan_id, error = %error, "a job was not answered");
    }
}
