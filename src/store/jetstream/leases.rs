//! The runs of this node: each keeps its job by telling the servers again and again that it is in progress.

use std::collections::HashMap;
use std::time::Duration;

use async_nats::jetstream::AckKind;
use async_nats::jetstream::message::Acker;
use parking_lot::Mutex;
use tokio::sync::watch;
use tokio::task::JoinHandle;

use super::record::State;
use super::run_steps::RunSteps;
use crate::job::PlanId;

/// Renewals within the time after which the job would be given to another node.
const RENEWALS: u32 = 4;

/// The runs of this node.
#[derive(Default)]
pub(super) struct Leases(Mutex<HashMap<PlanId, Held>>);

/// One of them.
struct Held {
    attempt: u64,
    cancel: watch::Sender<bool>,
    job: watch::Sender<Job>,
    renewing: JoinHandle<()>,
    /// Steps that have been appended, as far as the worker knows.
    appended: u64,
    steps: RunSteps,
}

/// The delivery by which the job is held.
pub(super) type Job = std::sync::Arc<Acker>;

impl Leases {
    /// Hold a job from now on; returns what tells its run to stop.
    pub(super) fn hold(
        &self,
        id: PlanId,
        attempt: u64,
        job: Job,
        ack_wait: Duration,
    ) -> watch::Receiver<bool> {
        let (cancel, cancelled) = watch::channel(false);
        let (job, jobs) = watch::channel(job);
        let held = Held {
            attempt,
            cancel,
            job,
            renewing: tokio::spawn(renew(id, jobs, ack_wait / RENEWALS)),
            appended: 0,
            steps: RunSteps::default(),
        };
        if let Some(before) = self.0.lock().insert(id, held) {
            before.renewing.abort();
        }
        cancelled
    }

    /// A job was delivered again while it is being done here: the servers missed a renewal. True when so.
    pub(super) fn again(&self, id: PlanId, attempt: u64, job: &Job) -> bool {
        self.0
            .lock()
            .get(&id)
            .filter(|held| held.attempt == attempt)
            .map(|held| held.job.send_replace(job.clone()))
            .is_some()
    }

    /// A plan has changed; its run here is stopped when that was requested, or when it is no longer ours. States may
    /// come late, when newer ones have been heeded already.
    pub(super) fn heed(&self, id: PlanId, state: &State) {
        let all = self.0.lock();
        let Some(held) = all.get(&id) else { return };
        let order = Order::to_run(held.attempt, state);
        if order != Order::GoOn {
            held.cancel.send_replace(true);
        }
        if order == Order::LetGo {
            // Its worker is told so at its next step, which lets go.
            held.renewing.abort();
        }
    }

    /// Whether this run is held here.
    pub(super) fn holds(&self, id: PlanId, attempt: u64) -> bool {
        self.appended_last(id, attempt).is_some()
    }

    /// Number of the step that a run appended last.
    pub(super) fn appended_last(&self, id: PlanId, attempt: u64) -> Option<u64> {
        let all = self.0.lock();
        let held = all.get(&id).filter(|held| held.attempt == attempt)?;
        Some(held.appended)
    }

    pub(super) fn appended(&self, id: PlanId, attempt: u64, number: u64) {
        if let Some(held) = self
            .0
            .lock()
            .get_mut(&id)
            .filter(|held| held.attempt == attempt)
        {
            held.appended = number;
        }
    }

    /// Read or update the steps of a run; `None` when it is not held here.
    pub(super) fn steps<T>(
        &self,
        id: PlanId,
        attempt: u64,
        look: impl FnOnce(&mut RunSteps) -> T,
    ) -> Option<T> {
        let mut all = self.0.lock();
        let held = all.get_mut(&id).filter(|held| held.attempt == attempt)?;
        Some(look(&mut held.steps))
    }

    /// Let go of a run; returns its job, if it was held.
    pub(super) fn let_go(&self, id: PlanId, attempt: u64) -> Option<Job> {
        let mut all = self.0.lock();
        if all.get(&id).is_none_or(|held| held.attempt != attempt) {
            return None;
        }
        let held = all.remove(&id)?;
        held.renewing.abort();
        Some(held.job.borrow().clone())
    }

    /// The runs that are held, with their attempts.
    pub(super) fn all(&self) -> Vec<(PlanId, u64)> {
        self.0
            .lock()
            .iter()
            .map(|(id, held)| (*id, held.attempt))
            .collect()
    }
}

/// What the state of a plan means to its run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    GoOn,
    /// Somebody requested the end of the plan.
    Stop,
    /// The plan is another run's, or nobody's.
    LetGo,
}

impl Order {
    fn to_run(attempt: u64, state: &State) -> Self {
        match state {
            // From before this run.
            State::Kept(record) if record.attempt < attempt => Self::GoOn,
            State::Kept(record) if !record.is_run_under(attempt) => Self::LetGo,
            State::Kept(record) if record.plan.cancel_requested => Self::Stop,
            State::Kept(_) => Self::GoOn,
            State::Buried(_) => Self::LetGo,
        }
    }
}

impl Drop for Leases {
    fn drop(&mut self) {
        for held in self.0.lock().values() {
            held.renewing.abort();
        }
    }
}

async fn renew(id: PlanId, jobs: watch::Receiver<Job>, period: Duration) {
    loop {
        tokio::time::sleep(period).await;
        let job = jobs.borrow().clone();
        if let Err(error) = job.ack_with(AckKind::Progress).await {
            tracing::warn!(plan_id = %id, error = %error, "a lease was not renewed; trying again");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::record::Record;
    use super::*;

    /// A thread that takes in a step may be held up until the run that follows it is held here.
    #[test]
    fn only_a_request_or_a_later_state_ends_a_run() {
        let order = |change: &dyn Fn(&mut Record)| {
            let mut record = Record::example();
            record.plan.start(1_000).expect("it is queued");
            record.attempt = 2;
            change(&mut record);
            Order::to_run(2, &State::Kept(Box::new(record)))
        };
        let requeue = |record: &mut Record| record.plan.requeue().expect("it is running");
        assert_eq!(order(&|_| {}), Order::GoOn);
        assert_eq!(order(&|record| record.plan.request_cancel()), Order::Stop);
        assert_eq!(order(&requeue), Order::LetGo);
        assert_eq!(order(&|record| record.attempt = 3), Order::LetGo);
        let earlier = |record: &mut Record| record.attempt = 1;
        assert_eq!(order(&earlier), Order::GoOn);
        let waited = |record: &mut Record| {
            requeue(record);
            earlier(record);
        };
        assert_eq!(order(&waited), Order::GoOn);
    }
}
