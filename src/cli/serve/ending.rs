//! The end of a service: the signals that ask for it, and how its time is spent.

use std::time::Duration;

use tokio::signal::unix::{Signal, SignalKind, signal};

use crate::worker::Pool;

/// Let runs finish, then give them back; without those that do not heed their stop in time, which
/// the next process finds as after a crash.
pub(super) async fn drain(pool: Pool, times: &Times) {
    if tokio::time::timeout(times.runs + times.giving_back, pool.drain(times.runs))
        .await
        .is_err()
    {
        tracing::warn!("some runs did not stop in time; the next process runs them again");
    }
}

/// How the grace period is spent.
pub(super) struct Times {
    /// Runs may finish until then.
    pub(super) runs: Duration,
    /// Then they are stopped and given back.
    pub(super) giving_back: Duration,
    /// Connections may finish their answers until then; what remains is for the store.
    pub(super) answers: Duration,
}

impl Times {
    /// The last quarter, at most two seconds, is for giving back, for connections, and for the store.
    pub(super) fn within(grace: Duration) -> Self {
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
