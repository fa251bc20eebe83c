//! The planning threads: each calls the engine, passes on its events, and builds the ending.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::{mpsc, oneshot, watch};
use tracing::Span;

use super::run::BATCH;
use super::{Engine, Unplanned};
use crate::export::document::ResultDocument;
use crate::job::{Event, FailureKind, Plan};
use crate::planner::{ConvergencePoint, Incumbent, Observer, Outcome, Stop, StopReason};
use crate::store::{Ending, Lease};
use crate::telemetry::Instruments;

/// An engine that cannot plan now is retried for this long; after that, another worker may succeed.
const PATIENCE: Duration = Duration::from_secs(30);

/// Pause between such retries, at first and at most.
const PAUSES: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(2)];

/// How much lower the priority of a planning thread is than the others', and that of the threads that it starts.
#[cfg(target_os = "linux")]
const POLITE: i32 = 5;

/// How often a waiting thread checks whether it must stop.
const LOOK: Duration = Duration::from_millis(50);

/// Why a run must stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Reason {
    /// Somebody requested the end of the plan, and wants the best route so far.
    Cancelled = 1,
    /// Nobody wants its outcome: the plan will be run again, or is no longer this worker's.
    Abandoned = 2,
}

/// Shared by a run's thread and the code that may stop it.
#[derive(Debug, Default)]
pub(super) struct StopFlag(AtomicU8);

impl StopFlag {
    /// The first reason wins.
    pub(super) fn raise(&self, reason: Reason) {
        let _ = self
            .0
            .compare_exchange(0, reason as u8, Ordering::Relaxed, Ordering::Relaxed);
    }

    pub(super) fn is_abandoned(&self) -> bool {
        self.0.load(Ordering::Relaxed) == Reason::Abandoned as u8
    }

    fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed) != 0
    }
}

/// Where a run's thread reports its events, and learns that it must stop.
pub(super) struct Reports {
    /// Events to be stored.
    pub(super) events: mpsc::Sender<Event>,
    /// Ticks after each [`BATCH`] of them; dropped when no more will come.
    pub(super) telling: watch::Sender<()>,
    /// Shared with the code that may stop the run.
    pub(super) stop: Arc<StopFlag>,
    /// Metrics for the operator.
    pub(super) instruments: Arc<Instruments>,
}

/// A thread that plans one plan after another, and ends when this is dropped.
pub(super) struct Thread {
    tasks: std::sync::mpsc::Sender<Task>,
}

/// Let other threads of this process go first: a plan takes long anyway, while a request waits for an answer that takes
/// a millisecond. Only on Linux: elsewhere it would lower the priority of the whole process.
fn step_back() {
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::nice(POLITE) {
        tracing::debug!(%error, "planning goes on at the priority of serving");
    }
}

/// A plan to be planned.
struct Task {
    plan: Plan,
    scenario: Arc<str>,
    reports: Reports,
    span: Span,
    ended: oneshot::Sender<Option<Ending>>,
}

impl Thread {
    /// # Errors
    /// When the machine has no thread left.
    pub(super) fn start(name: String, engine: Engine) -> std::io::Result<Self> {
        let (tasks, inbox) = std::sync::mpsc::channel::<Task>();
        thread::Builder::new().name(name).spawn(move || {
            step_back();
            for task in inbox {
                task.run(&engine);
            }
        })?;
        Ok(Self { tasks })
    }

    /// Plan the plan of `lease` within the caller's span. An ending of `None` means that it must go back to the queue.
    pub(super) fn plan(
        &self,
        lease: &Lease,
        reports: Reports,
    ) -> oneshot::Receiver<Option<Ending>> {
        let (ended, ending) = oneshot::channel();
        let task = Task {
            plan: lease.plan.clone(),
            scenario: Arc::clone(&lease.scenario),
            reports,
            span: Span::current(),
            ended,
        };
        let taken = self.tasks.send(task);
        taken.expect("the thread outlives panics of the engine");
        ending
    }
}

impl Task {
    fn run(self, engine: &Engine) {
        let _within = self.span.enter();
        let mut teller = Teller {
            reports: self.reports,
            told: 0,
            iterations: 0,
            evaluations: 0,
        };
        let end = catch_unwind(AssertUnwindSafe(|| {
            plan_to_its_end(engine, &self.plan, &self.scenario, &mut teller)
        }));
        // Nobody listens when the pool was dropped.
        let _ = self
            .ended
            .send(end.unwrap_or_else(|payload| Some(panicked(&*payload))));
        // Whoever is woken by the end of the events finds the ending there.
        drop(teller);
    }
}

fn plan_to_its_end(
    engine: &Engine,
    plan: &Plan,
    scenario: &str,
    teller: &mut Teller,
) -> Option<Ending> {
    let stop = Arc::clone(&teller.reports.stop);
    let asked = Instant::now();
    let mut pause = PAUSES[0];
    loop {
        // The time spent waiting is not the search's.
        let watch = Watch {
            began: Instant::now(),
            stop: Arc::clone(&stop),
        };
        match engine(scenario, teller, &watch) {
            Ok(outcome) => {
                teller.ended(&outcome);
                return Some(ending(&outcome, plan, scenario, watch.elapsed_ms()));
            }
            Err(Unplanned::Failed(failure)) => return Some(Ending::Failed(failure)),
            Err(Unplanned::NotNow(why)) => {
                if asked.elapsed() >= PATIENCE {
                    tracing::warn!(why, "cannot be planned here now");
                    return None;
                }
                tracing::warn!(why, "cannot be planned now; trying again");
            }
        }
        if stopped_within(pause, &stop) {
            return None;
        }
        pause = (2 * pause).min(PAUSES[1]);
    }
}

/// Wait, but only until a stop.
fn stopped_within(pause: Duration, stop: &StopFlag) -> bool {
    let began = Instant::now();
    while !stop.is_raised() {
        let left = pause.saturating_sub(began.elapsed());
        if left.is_zero() {
            return false;
        }
        thread::sleep(left.min(LOOK));
    }
    true
}

fn ending(outcome: &Outcome, plan: &Plan, scenario: &str, run_ms: f64) -> Ending {
    Ending::Result {
        cancelled: outcome.stop_reason == StopReason::Cancelled,
        stop_reason: outcome.stop_reason.name().to_owned(),
        feasible: outcome.feasible,
        best_cost: outcome.feasible.then_some(outcome.cost.total),
        evaluations: outcome.evaluations,
        iteration: outcome
            .convergence
            .last()
            .map_or(0, |last| last.iteration as u64),
        document: ResultDocument::new(outcome, plan.origin(scenario, run_ms)).to_json(),
    }
}

fn panicked(payload: &(dyn Any + Send)) -> Ending {
    let message = payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message");
    tracing::error!(
        panic = message,
        "the planner panicked; its plan fails, the others go on"
    );
    let detail = "the planner broke on this scenario; the service's log says where";
    Ending::Failed(FailureKind::PlannerPanic.because(detail))
}

/// Passes events on; waits when they come faster than they can be stored.
struct Teller {
    reports: Reports,
    /// Events so far.
    told: usize,
    /// Iterations counted so far.
    iterations: u64,
    evaluations: u64,
}

impl Teller {
    fn tell(&mut self, event: Event) {
        // Setting up a wait has a cost, and there is room unless a search outruns the disk.
        let sent = match self.reports.events.try_send(event) {
            Err(TrySendError::Full(event)) => self.reports.events.blocking_send(event).is_ok(),
            sent => sent.is_ok(),
        };
        if !sent {
            self.reports.stop.raise(Reason::Abandoned);
        }
        self.told += 1;
        if self.told.is_multiple_of(BATCH) {
            self.reports.telling.send_replace(());
        }
    }

    /// Count what has been added since the last time.
    fn count(&mut self, iterations: u64, evaluations: u64) {
        self.reports.instruments.metrics.searched(
            iterations.saturating_sub(self.iterations),
            evaluations.saturating_sub(self.evaluations),
        );
        (self.iterations, self.evaluations) = (iterations, evaluations);
    }

    fn ended(&mut self, outcome: &Outcome) {
        self.count(self.iterations, outcome.evaluations);
        if let Some(gap) = outcome.bound.gap {
            self.reports.instruments.metrics.gap(gap);
        }
    }
}

impl Observer for Teller {
    fn iteration(&mut self, point: &ConvergencePoint) {
        self.count(point.iteration as u64, point.evaluations);
        self.tell(Event::Convergence(point.into()));
    }

    fn incumbent(&mut self, incumbent: &Incumbent) {
        self.tell(Event::Incumbent(incumbent.into()));
    }
}

struct Watch {
    began: Instant,
    stop: Arc<StopFlag>,
}

impl Stop for Watch {
    fn requested(&self) -> bool {
        self.stop.is_raised()
    }

    fn elapsed_ms(&self) -> f64 {
        self.began.elapsed().as_secs_f64() * 1_000.0
    }
}
