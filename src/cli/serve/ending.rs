//! The end of a service: the signals that request it, the order in which parts are stopped, and how the time is
//! divided.

use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::{Instant, timeout, timeout_at};

use crate::cli::exit;
use crate::http::Phase;
use crate::http::webhook::Sender;
use crate::store::Store;
use crate::telemetry;
use crate::worker::{Pool, Sweeper};

/// Time for the store to close even where the grace period leaves none: runs that are not given back count as lost.
const LEAST_CLOSE: Duration = Duration::from_secs(1);

/// The running parts of the service.
pub(super) struct Running {
    pub(super) phase: watch::Sender<Phase>,
    pub(super) pool: Pool,
    pub(super) server: JoinHandle<()>,
    pub(super) sweeper: Sweeper,
    pub(super) sender: Option<Sender>,
    pub(super) store: Arc<dyn Store>,
}

impl Running {
    /// Stop them in the right order once a signal requests it, within `grace`; the store has a second at least.
    pub(super) async fn end_on(self, mut signals: Signals, grace: Duration) -> anyhow::Result<()> {
        let name = signals.next().await;
        let signalled = Instant::now();
        tracing::info!(
            signal = name,
            grace_s = grace.as_secs_f64(),
            "shutting down"
        );
        leave_on_another(signals);
        let times = Times::within(grace);
        self.phase.send_replace(Phase::Draining);
        drain(self.pool, &times).await;
        self.phase.send_replace(Phase::Stopping);
        if let Ok(ended) = timeout_at(signalled + times.answers, self.server).await {
            ended.context("the server broke")?;
        }
        drop((self.sweeper, self.sender));
        let until = (signalled + grace).max(Instant::now() + LEAST_CLOSE);
        if timeout_at(until, self.store.close()).await.is_err() {
            tracing::warn!(
                "the store did not close in time; what it had yet to give back is found as after a crash"
            );
        }
        tracing::info!(
            duration_ms = signalled.elapsed().as_secs_f64() * 1e3,
            "shut down"
        );
        Ok(())
    }
}

/// A second signal means that the user does not want to wait.
fn leave_on_another(mut signals: Signals) {
    tokio::spawn(async move {
        signals.next().await;
        tracing::warn!("a second signal, leaving at once");
        telemetry::log::flush();
        std::process::exit(exit::FAILED.into());
    });
}

/// Let runs finish, then give them back; runs that do not stop in time are left for the next process to find, as after
/// a crash.
async fn drain(pool: Pool, times: &Times) {
    if timeout(times.runs + times.giving_back, pool.drain(times.runs))
        .await
        .is_err()
    {
        tracing::warn!("some runs did not stop in time; the next process runs them again");
    }
}

/// How the grace period is spent.
struct Times {
    /// How long runs may take to finish.
    runs: Duration,
    /// How long stopping them and giving them back may take after that.
    giving_back: Duration,
    /// Until when, counted from the signal, connections may finish their answers; the rest is for the store.
    answers: Duration,
}

impl Times {
    /// The last quarter, at most two seconds, is for giving back, for connections, and for the store.
    fn within(grace: Duration) -> Self {
        let reserve = (grace / 4).min(Duration::from_secs(2));
        Self {
            runs: grace.saturating_sub(reserve),
            giving_back: reserve / 4,
            answers: grace.saturating_sub(reserve / 4),
        }
    }
}

/// The signals that ask for an end.
pub(super) struct Signals {
    terminate: Signal,
    interrupt: Signal,
}

impl Signals {
    pub(super) fn new() -> std::io::Result<Self> {
        Ok(Self {
            terminate: signal(SignalKind::terminate())?,
            interrupt: signal(SignalKind::interrupt())?,
        })
    }

    pub(super) async fn next(&mut self) -> &'static str {
        tokio::select! {
            _ = self.terminate.recv() => "SIGTERM",
            _ = self.interrupt.recv() => "SIGINT",
        }
    }
}
