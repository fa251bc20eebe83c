//! `noctule serve`: put the parts together, and take them apart in the right order.

use std::io::Write as _;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use tokio::net::TcpListener;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::watch;
use tokio::time::Instant;

use super::exit;
use crate::config::Serve;
use crate::http::{self, AppState, Capacity, Phase};
use crate::scenario::json::Rules;
use crate::scenario::limits::Limits;
use crate::store::sqlite::SqliteStore;
use crate::store::{self, Store};
use crate::worker::Pool;
use crate::{planner, telemetry};

/// Serve until a signal.
pub(super) fn run(config: &Serve) -> anyhow::Result<()> {
    telemetry::init(config.log_format);
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    runtime.block_on(serve(config))?;
    // Whatever still runs has been given back to the queue; the process does not wait for it.
    runtime.shutdown_background();
    Ok(())
}

async fn serve(config: &Serve) -> anyhow::Result<()> {
    let mut signals = Signals::new()?;
    let listener = TcpListener::bind(config.listen)
        .await
        .with_context(|| format!("cannot listen on {}", config.listen))?;
    let store = open_store(config)?;
    let workers = config.workers();
    let pool = Pool::start(store.clone(), workers);
    let (phase, watched) = watch::channel(Phase::Serving);
    let router = http::router(AppState {
        store: store.clone(),
        rules: Arc::new(Rules {
            limits: Limits::default(),
            algorithms: planner::algorithms(),
        }),
        capacity: Capacity {
            workers: workers.get(),
            queue: config.queue.get() as usize,
        },
        phase: watched.clone(),
    });
    announce(&listener)?;
    let times = Times::within(Duration::from_secs(config.grace));
    let server = tokio::spawn(http::server::serve(listener, router, watched, times.connections));

    let name = signals.next().await;
    let signalled = Instant::now();
    tracing::info!(signal = name, grace_s = config.grace, "shutting down");
    tokio::spawn(async move {
        signals.next().await;
        tracing::warn!("a second signal, leaving at once");
        std::process::exit(exit::FAILED.into());
    });
    phase.send_replace(Phase::Draining);
    pool.drain(signalled + times.runs).await;
    phase.send_replace(Phase::Stopping);
    server.await.context("the server broke")?;
    store.close().await;
    tracing::info!(duration_ms = signalled.elapsed().as_secs_f64() * 1e3, "shut down");
    Ok(())
}

fn open_store(config: &Serve) -> anyhow::Result<Arc<dyn Store>> {
    let data_dir = config.data_dir().context("the user has no home; name a directory with --data-dir")?;
    let options = store::Options {
        queue_limit: config.queue.get().into(),
        clock: store::wall_clock(),
    };
    let store = SqliteStore::open(&data_dir, options)
        .with_context(|| format!("cannot open the store in {}", data_dir.display()))?;
    tracing::info!(data_dir = %data_dir.display(), "the store is open");
    Ok(Arc::new(store))
}

/// One plain line for people and scripts, with the port that was taken.
fn announce(listener: &TcpListener) -> anyhow::Result<()> {
    let address = listener.local_addr()?;
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "listening on http://{address}")?;
    stdout.flush()?;
    Ok(())
}

/// How the grace period is spent.
struct Times {
    /// Runs may finish until then.
    runs: Duration,
    /// Connections may finish their answers for so long, after the streams were told to end.
    connections: Duration,
}

impl Times {
    /// Of the last fifth, at most two seconds, half goes to connections, half remains for giving
    /// plans back and closing the store.
    fn within(grace: Duration) -> Self {
        let reserve = (grace / 5).min(Duration::from_secs(2));
        Self {
            runs: grace - reserve,
            connections: reserve / 2,
        }
    }
}

/// The signals that ask for an end.
struct Signals {
    terminate: Signal,
    interrupt: Signal,
}

impl Signals {
    fn new() -> std::io::Result<Self> {
        Ok(Self {
            terminate: signal(SignalKind::terminate())?,
            interrupt: signal(SignalKind::interrupt())?,
        })
    }

    async fn next(&mut self) -> &'static str {
        tokio::select! {
            _ = self.terminate.recv() => "SIGTERM",
            _ = self.interrupt.recv() => "SIGINT",
        }
    }
}
