//! One plan's run, from its lease to its end in the store.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{mpsc, watch};
use tracing::{Instrument as _, Span};

use super::planning::{Run, Thread};
use super::reporter::Reports;
use super::stop::{Reason, StopFlag};
use super::{Pause, Phase, Slot, reached};
use crate::job::{Event, Plan};
use crate::store::{Ending, Lease, StoreError};
use crate::telemetry::metrics::Ended;

/// Events in the channel from the planning thread; when it is full, the thread waits.
const ON_THE_WAY: usize = 1024;

/// Events are stored as soon as there are this many.
pub(super) const BATCH: usize = 512;

/// Longest delay before fewer events are stored: waking up for each costs more than storing it.
const DELAY: Duration = Duration::from_millis(50);

/// Why something was not stored.
enum Unstored {
    /// The plan is no longer ours.
    Lost,
    /// The pool must end.
    GivenUp,
}

/// A run that is over, but not yet in the store.
pub(super) struct Over {
    lease: Lease,
    /// Its last events; stored with its end.
    events: Vec<Event>,
    run: Run,
    span: Span,
}

impl Slot {
    /// Run the plan on `thread`, which is started if there is none yet, and store its events; the caller concludes it.
    pub(super) async fn run(&self, lease: Lease, thread: &mut Option<Thread>) -> Option<Over> {
        tracing::info!(
            worker = self.number,
            attempt = lease.attempt,
            "plan started"
        );
        if let Some(started_ms) = lease.plan.started_ms {
            let waited_ms = started_ms - lease.plan.created_ms;
            self.instruments.metrics.started(waited_ms);
        }
        let stop = Arc::new(StopFlag::default());
        let (events, reported) = mpsc::channel(ON_THE_WAY);
        let (full_batches, full) = watch::channel(());
        let reports = Reports {
            events,
            full_batches,
            stop: Arc::clone(&stop),
            instruments: Arc::clone(&self.instruments),
        };
        let run = match self.planning(thread) {
            Ok(thread) => thread.plan(&lease, reports),
            Err(error) => {
                tracing::error!(%error, "no thread to plan on; the plan goes back to the queue");
                self.give_back(&lease, false).await;
                // A thread may become available soon.
                Pause::default().wait().await;
                return None;
            }
        };
        let rest = tokio::select! {
            rest = self.keep_events(&lease, reported, full) => rest,
            never = stop_when_asked(&lease, self.phase.clone(), &stop) => match never {},
        };
        if rest.is_err() {
            stop.raise(Reason::Abandoned);
        }
        let run = run
            .await
            .expect("the planning thread answers even when it panics");
        let rest = match rest {
            Ok(rest) => rest,
            Err(Unstored::GivenUp) => Vec::new(),
            // Nothing is left to conclude.
            Err(Unstored::Lost) => return None,
        };
        let run = match run {
            Run::Ended(Ending::Result { .. }) if stop.is_abandoned() => Run::Stopped,
            run => run,
        };
        Some(Over {
            lease,
            events: rest,
            run,
            span: Span::current(),
        })
    }

    /// The thread that this slot plans on.
    fn planning<'t>(&self, thread: &'t mut Option<Thread>) -> std::io::Result<&'t Thread> {
        let started = match thread.take() {
            Some(started) => started,
            None => Thread::start(format!("planner-{}", self.number), Arc::clone(&self.engine))?,
        };
        Ok(thread.insert(started))
    }

    /// End a plan whose run is over, or give it back.
    pub(super) async fn conclude(&self, over: Over) {
        let Over {
            lease,
            events,
            run,
            span,
        } = over;
        let conclusion = async {
            match run {
                Run::Ended(ending) => self.finish(&lease, events, ending).await,
                Run::Stopped => self.give_back(&lease, false).await,
                Run::NotNow => self.give_back(&lease, true).await,
            }
        };
        conclusion.instrument(span).await;
    }

    /// Store events until there are no more; returns the last of them, which are stored with the end. `full` ticks when
    /// there are many, and loses its sender after the last.
    async fn keep_events(
        &self,
        lease: &Lease,
        mut reported: mpsc::Receiver<Event>,
        mut full: watch::Receiver<()>,
    ) -> Result<Vec<Event>, Unstored> {
        let mut batch = Vec::new();
        loop {
            tokio::select! {
                _ = full.changed() => {}
                () = tokio::time::sleep(DELAY) => {}
            }
            let was_last = reported.is_closed();
            while let Ok(event) = reported.try_recv() {
                batch.push(event);
            }
            if was_last {
                return Ok(batch);
            }
            if batch.is_empty() {
                // A quiet search wakes nobody, and neither does the first event of a short one.
                reported.recv_many(&mut batch, 1).await;
                continue;
            }
            let events = std::mem::take(&mut batch);
            let append = || self.store.append(lease, events.clone());
            self.persist("events", append).await?;
        }
    }

    async fn finish(&self, lease: &Lease, events: Vec<Event>, ending: Ending) {
        let end = ending.after(events, (self.clock)());
        let finish = || self.store.finish(lease, Arc::clone(&end));
        if let Ok(plan) = self.persist("ending", finish).await {
            self.report_end(&plan);
        }
    }

    /// Back to the queue; with `others_first`, behind the others there for a while.
    async fn give_back(&self, lease: &Lease, others_first: bool) {
        let release = || {
            if others_first {
                self.store.postpone(lease)
            } else {
                self.store.release(lease)
            }
        };
        match self.persist("release", release).await {
            // Its end had been requested, and it has no ending of its own to wait for.
            Ok(plan) if plan.status.is_final() => self.report_end(&plan),
            Ok(_) => tracing::info!("plan given back to the queue"),
            Err(Unstored::Lost | Unstored::GivenUp) => {}
        }
    }

    fn report_end(&self, plan: &Plan) {
        let run_ms = plan
            .finished_ms
            .zip(plan.started_ms)
            .map(|(end, start)| end - start);
        tracing::info!(status = plan.status.name(), run_ms, "plan ended");
        self.instruments.origins.forget(plan.id);
        self.instruments.metrics.ended(Ended {
            status: plan.status.name(),
            run_ms,
        });
    }

    /// Do a store operation, and retry while the store fails.
    async fn persist<T, F>(&self, what: &str, step: impl Fn() -> F) -> Result<T, Unstored>
    where
        F: Future<Output = Result<T, StoreError>>,
    {
        let mut pause = Pause::default();
        loop {
            let last_try = *self.phase.borrow() == Phase::Stopping;
            match step().await {
                Ok(done) => return Ok(done),
                Err(StoreError::LeaseLost(plan)) => {
                    self.instruments.origins.forget(plan);
                    self.instruments.metrics.lost();
                    tracing::info!("the plan was taken from its worker");
                    return Err(Unstored::Lost);
                }
                Err(error) if last_try => {
                    tracing::error!(%error, what, "not stored; the next process runs the plan again");
                    return Err(Unstored::GivenUp);
                }
                Err(error) => tracing::warn!(%error, what, "not stored yet; trying again"),
            }
            tokio::select! {
                () = reached(self.phase.clone(), Phase::Stopping) => {}
                () = pause.wait() => {}
            }
        }
    }
}

/// Pass a request to stop on to the planning thread.
async fn stop_when_asked(
    lease: &Lease,
    phase: watch::Receiver<Phase>,
    stop: &StopFlag,
) -> Infallible {
    let mut cancel = lease.cancel.clone();
    tokio::select! {
        // A cancelled plan keeps its best route, even at the end of the service.
        biased;
        Ok(_) = cancel.wait_for(|cancelled| *cancelled) => stop.raise(Reason::Cancelled),
        () = reached(phase, Phase::Stopping) => stop.raise(Reason::Abandoned),
    }
    std::future::pending().await
}
