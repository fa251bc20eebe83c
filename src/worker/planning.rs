//! The planning threads: each calls the engine and builds the ending.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use tokio::sync::oneshot;
use tracing::Span;

use super::reporter::{Reporter, Reports};
use super::stop::Watch;
use super::{Engine, Unplanned};
use crate::export::document::ResultDocument;
use crate::job::{FailureKind, Plan};
use crate::planner::{Outcome, Stop as _, StopReason};
use crate::store::{Ending, Lease};

/// An engine that cannot plan now is retried for this long; after that, another plan may be possible, or another worker
/// may succeed.
const PATIENCE: Duration = Duration::from_secs(5);

/// Pause between such retries, at first and at most.
const PAUSES: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(2)];

/// How much lower the priority of a planning thread is than the others', and that of the threads that it starts.
#[cfg(target_os = "linux")]
const POLITE: i32 = 5;

/// A thread that plans one plan after another, and ends when this is dropped.
pub(super) struct Thread {
    tasks: std::sync::mpsc::Sender<Task>,
}

/// A plan to be planned.
struct Task {
    plan: Plan,
    scenario: Arc<str>,
    reports: Reports,
    span: Span,
    ended: oneshot::Sender<Run>,
}

/// How a run is over.
pub(super) enum Run {
    Ended(Ending),
    /// It was stopped, and its plan goes back to the queue.
    Stopped,
    /// Its plan cannot be planned now.
    NotNow,
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

    /// Plan the plan of `lease` within the caller's span.
    pub(super) fn plan(&self, lease: &Lease, reports: Reports) -> oneshot::Receiver<Run> {
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
        let mut reporter = Reporter::new(self.reports);
        let end = catch_unwind(AssertUnwindSafe(|| {
            plan_to_its_end(engine, &self.plan, &self.scenario, &mut reporter)
        }));
        // Nobody listens when the pool was dropped.
        let _ = self
            .ended
            .send(end.unwrap_or_else(|_| Run::Ended(panicked())));
        // Whoever is woken by the end of the events finds the ending there.
        drop(reporter);
    }
}

/// Let other threads of this process go first: a plan takes long anyway, while a request waits for an answer that takes
/// a millisecond. Only on Linux: elsewhere it would lower the priority of the whole process.
fn step_back() {
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::nice(POLITE) {
        tracing::debug!(%error, "planning goes on at the priority of serving");
    }
}

fn plan_to_its_end(engine: &Engine, plan: &Plan, scenario: &str, reporter: &mut Reporter) -> Run {
    let stop = reporter.stop();
    let asked = Instant::now();
    let mut pause = PAUSES[0];
    loop {
        // The time spent waiting is not the search's.
        let watch = Watch {
            began: Instant::now(),
            stop: Arc::clone(&stop),
        };
        match engine(scenario, reporter, &watch) {
            Ok(outcome) => {
                reporter.ended(&outcome);
                return Run::Ended(ending(&outcome, plan, scenario, watch.elapsed_ms()));
            }
            Err(Unplanned::Failed(failure)) => return Run::Ended(Ending::Failed(failure)),
            Err(Unplanned::NotNow(why)) => {
                if asked.elapsed() >= PATIENCE {
                    tracing::warn!(why, "cannot be planned now; others go first");
                    return Run::NotNow;
                }
                tracing::warn!(why, "cannot be planned now; trying again");
            }
        }
        if stop.is_raised_within(pause) {
            return Run::Stopped;
        }
        pause = (2 * pause).min(PAUSES[1]);
    }
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

/// What a plan ends with whose planner panicked, which the log of panics tells of.
fn panicked() -> Ending {
    let detail = "the planner broke on this scenario; the service's log says where";
    Ending::Failed(FailureKind::PlannerPanic.because(detail))
}
