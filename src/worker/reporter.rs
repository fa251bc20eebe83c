//! What a run's thread reports while it plans: events to be stored, and figures for the operator.

use std::sync::Arc;

use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::{mpsc, watch};

use super::run::BATCH;
use super::stop::{Reason, StopFlag};
use crate::job::Event;
use crate::planner::{ConvergencePoint, Incumbent, Observer, Outcome};
use crate::telemetry::Instruments;

/// Where a run's thread reports its events, and learns that it must stop.
pub(super) struct Reports {
    /// Events to be stored.
    pub(super) events: mpsc::Sender<Event>,
    /// Ticks after each [`BATCH`] of them; dropped when no more will come.
    pub(super) full_batches: watch::Sender<()>,
    /// Shared with the code that may stop the run.
    pub(super) stop: Arc<StopFlag>,
    /// Metrics for the operator.
    pub(super) instruments: Arc<Instruments>,
}

/// Passes events on; waits when they come faster than they can be stored.
pub(super) struct Reporter {
    reports: Reports,
    /// Events so far.
    reported: usize,
    /// Iterations counted so far.
    iterations: u64,
    evaluations: u64,
}

impl Reporter {
    pub(super) fn new(reports: Reports) -> Self {
        Self {
            reports,
            reported: 0,
            iterations: 0,
            evaluations: 0,
        }
    }

    pub(super) fn stop(&self) -> Arc<StopFlag> {
        Arc::clone(&self.reports.stop)
    }

    fn report(&mut self, event: Event) {
        // Setting up a wait has a cost, and there is room unless a search outruns the disk.
        let sent = match self.reports.events.try_send(event) {
            Err(TrySendError::Full(event)) => self.reports.events.blocking_send(event).is_ok(),
            sent => sent.is_ok(),
        };
        if !sent {
            self.reports.stop.raise(Reason::Abandoned);
        }
        self.reported += 1;
        if self.reported.is_multiple_of(BATCH) {
            self.reports.full_batches.send_replace(());
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

    /// The engine has planned.
    pub(super) fn ended(&mut self, outcome: &Outcome) {
        self.count(self.iterations, outcome.evaluations);
        if let Some(gap) = outcome.bound.gap {
            self.reports.instruments.metrics.gap(gap);
        }
    }
}

impl Observer for Reporter {
    fn iteration(&mut self, point: &ConvergencePoint) {
        self.count(point.iteration as u64, point.evaluations);
        self.report(Event::Convergence(point.into()));
    }

    fn incumbent(&mut self, incumbent: &Incumbent) {
        self.report(Event::Incumbent(incumbent.into()));
    }
}
