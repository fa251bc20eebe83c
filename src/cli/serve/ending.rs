//! The end of a service: the signals that request it, the order in which parts are stopped, and how the time is
//! divided.

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context as _, bail};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::watch;
use tokio::task::{JoinError, JoinHandle};
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

/// Why the service ends.
enum Cause {
    /// A signal of this name.
    Signal(&'static str),
    /// The server has ended by itself, so nobody is answered any more.
    Server(Result<(), JoinError>),
}

impl Running {
    /// Stop them in the right order once a signal requests it or the server has ended, within `grace`; the store has a
    /// second at least.
    ///
    /// # Errors
    /// When the server ended by itself. The store is closed all the same: runs that are not given back count as lost.
    pub(super) async fn end_on(
        mut self,
        mut signals: Signals,
        grace: Duration,
    ) -> anyhow::Result<()> {
        let cause = tokio::select! {
            name = signals.next() => Cause::Signal(name),
            ended = &mut self.server => Cause::Server(ended),
        };
        let begun = Instant::now();
        cause.log(grace);
        leave_on_another(signals);
        let times = Times::within(grace);
        self.phase.send_replace(Phase::Draining);
        drain(self.pool, &times).await;
        self.phase.send_replace(Phase::Stopping);
        // Side by side: neither takes the other's time.
        let last = begun + times.answers;
        let (served, ()) = tokio::join!(
            last_answers(cause, self.server, last),
            last_webhooks(self.sender, last),
        );
        drop(self.sweeper);
        let until = (begun + grace).max(Instant::now() + LEAST_CLOSE);
        if timeout_at(until, self.store.close()).await.is_err() {
            tracing::warn!(
                "the store did not close in time; what it had yet to give back is found as after a crash"
            );
        }
        tracing::info!(
            duration_ms = begun.elapsed().as_secs_f64() * 1e3,
            "shut down"
        );
        served
    }
}

impl Cause {
    fn log(&self, grace: Duration) {
        let grace_s = grace.as_secs_f64();
        match self {
            Self::Signal(signal) => tracing::info!(signal, grace_s, "shutting down"),
            Self::Server(_) => tracing::error!(grace_s, "the server has ended, shutting down"),
        }
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

/// Let connections finish their answers.
///
/// # Errors
/// When the server broke, or had ended by itself.
async fn last_answers(cause: Cause, server: JoinHandle<()>, until: Instant) -> anyhow::Result<()> {
    match cause {
        Cause::Signal(_) => timeout_at(until, server)
            .await
            .unwrap_or(Ok(()))
            .context("the server broke"),
        Cause::Server(ended) => ended
            .context("the server broke")
            .and_then(|()| bail!("the server ended unasked")),
    }
}

/// Let webhooks on their way arrive.
async fn last_webhooks(sender: Option<Sender>, until: Instant) {
    if let Some(sender) = sender
        && timeout_at(until, sender.finish()).await.is_err()
    {
        tracing::warn!("some webhooks did not arrive in time; the next process sends them again");
    }
}

/// How the grace period is spent.
struct Times {
    /// How long runs may take to finish.
    runs: Duration,
    /// How long stopping them and giving them back may take after that.
    giving_back: Duration,
    /// Until when, counted from the signal, connections may finish their answers and webhooks may arrive; the rest is for
    /// the store.
    answers: Duration,
}

impl Times {
    /// The last quarter, at most two seconds, is for giving back, for connections and webhooks, and for the store.
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::catalogue::Directories;
    use crate::store::sqlite::SqliteStore;
    use crate::store::{Options, wall_clock};
    use crate::worker::{self, Unplanned};

    fn running(data_dir: &Path, server: JoinHandle<()>) -> Running {
        let options = Options::new(1);
        let store: Arc<dyn Store> =
            Arc::new(SqliteStore::open(data_dir, options).expect("nobody else has it open"));
        let settings = worker::Settings {
            workers: 1,
            clock: wall_clock(),
            instruments: Arc::default(),
        };
        let engine: worker::Engine =
            Arc::new(|_, _, _| Err(Unplanned::NotNow("no plan is submitted".to_owned())));
        let catalogue = Directories::new(data_dir.join("terrains"), None);
        Running {
            phase: watch::Sender::new(Phase::Serving),
            pool: Pool::start(store.clone(), settings, engine),
            server,
            sweeper: Sweeper::start(store.clone(), Arc::new(catalogue), wall_clock()),
            sender: None,
            store,
        }
    }

    /// Whoever starts it again finds the store closed, and the error in the log.
    #[tokio::test]
    async fn a_server_that_ends_by_itself_ends_the_service() {
        let data_dir = tempfile::tempdir().expect("a directory");
        let panics = || tokio::spawn(async { panic!("as this test wants") });
        let returns = || tokio::spawn(async {});
        for (server, expected) in [
            (panics(), "the server broke"),
            (returns(), "the server ended unasked"),
        ] {
            let running = running(data_dir.path(), server);
            let phase = running.phase.subscribe();
            let signals = Signals::new().expect("signals");
            let ended = running.end_on(signals, Duration::from_secs(5)).await;
            let error = ended.expect_err("it was not asked to");
            assert_eq!(error.to_string(), expected);
            assert_eq!(*phase.borrow(), Phase::Stopping);
            drop(SqliteStore::open(data_dir.path(), Options::new(1)).expect("it is closed"));
        }
    }
}
