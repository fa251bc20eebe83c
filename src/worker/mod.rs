//! The pool: takes plans off the queue, runs a bounded number of them at a time, stores their events and how they end.
//!
//! Planning has threads of its own, one per slot, so that it never blocks the threads that serve requests.
//! Deliberately absent: what planning is, and how anybody learns of its progress.

mod planning;
mod reporter;
mod run;
mod stop;
mod sweeper;

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::task::JoinSet;
use tracing::Instrument as _;

pub use sweeper::{Sweeper, sweep_datasets};

use self::planning::Thread;
use self::run::Over;

use crate::job::Failure;
use crate::planner::{Observer, Outcome, Stop};
use crate::store::{Clock, Lease, Store, StoreError};
use crate::telemetry::{Instruments, spans};

/// Plans an accepted scenario document, calling back as it goes. If it panics, only its plan fails.
pub type Engine =
    Arc<dyn Fn(&str, &mut dyn Observer, &dyn Stop) -> Result<Outcome, Unplanned> + Send + Sync>;

/// Why an engine did not plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unplanned {
    /// It never will: the plan fails.
    Failed(Failure),
    /// Something it needs is unavailable for now: it is retried for a while, then the plan goes back to the queue.
    NotNow(String),
}

/// What a pool is started with.
#[derive(Clone)]
pub struct Settings {
    /// Plans run at the same time; with 0, none are run.
    pub workers: usize,
    /// The clock for times of ending.
    pub clock: Clock,
    /// Where runs are counted.
    pub instruments: Arc<Instruments>,
}

/// The running pool.
///
/// [`Pool::drain`] it at the end. Dropping it leaves its plans to the next process, as a crash would.
pub struct Pool {
    phase: watch::Sender<Phase>,
    slots: JoinSet<()>,
}

/// The stages of the pool's shutdown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Phase {
    /// Plans are claimed and run.
    Open,
    /// No plan is claimed any more.
    Draining,
    /// Plans that still run go back to the queue.
    Stopping,
}

impl Pool {
    /// Start claiming.
    ///
    /// # Panics
    /// Outside a tokio runtime.
    #[must_use]
    pub fn start(store: Arc<dyn Store>, settings: Settings, engine: Engine) -> Self {
        let phase = watch::Sender::new(Phase::Open);
        let slot = Slot {
            number: 0,
            store,
            clock: settings.clock,
            instruments: settings.instruments,
            engine,
            phase: phase.subscribe(),
        };
        let mut slots = JoinSet::new();
        for number in 0..settings.workers {
            let slot = Slot {
                number,
                ..slot.clone()
            };
            slots.spawn(slot.serve());
        }
        Self { phase, slots }
    }

    /// Claim nothing from now on, let running plans continue for `grace`, then stop them and give them back to the
    /// queue. Returns when all is quiet, which an engine that ignores its stop delays.
    pub async fn drain(mut self, grace: Duration) {
        self.phase.send_replace(Phase::Draining);
        if tokio::time::timeout(grace, self.quiet()).await.is_err() {
            self.phase.send_replace(Phase::Stopping);
            self.quiet().await;
        }
    }

    async fn quiet(&mut self) {
        while let Some(slot) = self.slots.join_next().await {
            if let Err(error) = slot {
                tracing::error!(%error, "a worker broke");
            }
        }
    }
}

/// Runs one plan after another.
#[derive(Clone)]
struct Slot {
    number: usize,
    store: Arc<dyn Store>,
    clock: Clock,
    instruments: Arc<Instruments>,
    engine: Engine,
    phase: watch::Receiver<Phase>,
}

impl Slot {
    async fn serve(self) {
        let mut pause = Pause::default();
        let mut thread = None;
        let mut over = None;
        loop {
            // The next run does not wait until the end of the previous one, or its own beginning, is on the disk. Its
            // claim is sent first, and the end right behind it, so that the store can take both in one step.
            let conclusion = async {
                if let Some(over) = over.take() {
                    self.conclude(over).await;
                }
            };
            let (next, ()) = tokio::join!(biased; self.run_next(&mut thread), conclusion);
            match next {
                None => return,
                Some(Ok(next)) => {
                    pause = Pause::default();
                    over = next;
                }
                Some(Err(error)) => {
                    tracing::warn!(%error, worker = self.number, "no plan could be claimed; trying again");
                    tokio::select! {
                        () = reached(self.phase.clone(), Phase::Draining) => return,
                        () = pause.wait() => {}
                    }
                }
            }
        }
    }

    /// Claim a plan and run it; `None` when no more should be run.
    async fn run_next(
        &self,
        thread: &mut Option<Thread>,
    ) -> Option<Result<Option<Over>, StoreError>> {
        let lease = match self.claim().await? {
            Ok(lease) => lease,
            Err(error) => return Some(Err(error)),
        };
        let plan = lease.plan.id;
        let span = spans::of_run(plan, self.instruments.origins.of(plan).as_ref());
        Some(Ok(self.run(lease, thread).instrument(span).await))
    }

    /// The next plan to run; `None` when no more should be run.
    async fn claim(&self) -> Option<Result<Lease, StoreError>> {
        tokio::select! {
            biased;
            () = reached(self.phase.clone(), Phase::Draining) => None,
            claim = self.store.claim_early() => Some(claim),
        }
    }
}

/// Returns once the pool has reached this stage of its shutdown.
async fn reached(mut phase: watch::Receiver<Phase>, wanted: Phase) {
    // Without its sender the pool is gone, which is beyond any phase.
    let _ = phase.wait_for(|phase| *phase >= wanted).await;
}

/// Increasing waits between retries.
#[derive(Debug)]
struct Pause(Duration);

impl Pause {
    const LONGEST: Duration = Duration::from_secs(5);

    async fn wait(&mut self) {
        tokio::time::sleep(self.0).await;
        self.0 = (self.0 * 2).min(Self::LONGEST);
    }
}

impl Default for Pause {
    fn default() -> Self {
        Self(Duration::from_millis(20))
    }
}
