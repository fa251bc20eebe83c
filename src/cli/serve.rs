//! `noctule serve`: puts the parts together and starts them; `ending` stops them.

mod backend;
mod datasets;
mod descriptors;
mod ending;
mod parts;

use std::io::Write as _;
use std::net::SocketAddr;
use std::num::NonZero;
use std::sync::Arc;
use std::thread::available_parallelism;
use std::time::Duration;

use anyhow::Context as _;
use axum::Router;
use tokio::net::{TcpListener, TcpSocket};
use tokio::sync::watch;

use self::ending::{Running, Signals};
use self::parts::Callers;
use super::{access, config, files};
use crate::config::{Config, Flags};
use crate::http::webhook::Sender;
use crate::http::{self, Parts, Phase};
use crate::job::FailureKind;
use crate::planner;
use crate::scenario::json::{self, Rules, Unread};
use crate::telemetry::{self, Instruments};
use crate::worker::{self, Engine, Pool, Sweeper, Unplanned};

/// Callers that may wait to be accepted; the Linux limit since 5.4. With more, some may be left waiting for an answer
/// that never comes.
const BACKLOG: u32 = 4_096;

/// How long connections may take to finish their answers at the end, if the grace period is that long.
const LAST_ANSWERS: Duration = Duration::from_secs(5);

/// Serve until a signal, or print the configuration.
pub(super) fn run(flags: &Flags) -> anyhow::Result<()> {
    let loaded = config::of_environment(flags)?;
    if flags.print_config {
        let mut text = access::comment()?.unwrap_or_default().into_bytes();
        for line in config::misspelt() {
            writeln!(text, "# {line}")?;
        }
        loaded.write_toml(&mut text)?;
        return files::print(&String::from_utf8_lossy(&text));
    }
    start(&loaded.config)
}

/// Serve until a signal.
pub(super) fn start(config: &Config) -> anyhow::Result<()> {
    let instruments = Arc::new(Instruments::default());
    let log = telemetry::log::init(config, &instruments.metrics)?;
    for line in config::misspelt() {
        tracing::warn!("{line}");
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?;
    let served = runtime.block_on(serve(config, instruments));
    // Everything still running has been given back to the queue, or has hardly begun; the process does not wait for it.
    // Nor is the runtime shut down, under which a store that is still being opened would panic.
    std::mem::forget(runtime);
    log.close();
    served
}

async fn serve(config: &Config, instruments: Arc<Instruments>) -> anyhow::Result<()> {
    // Before anything that takes time: until they are awaited, signals end the process.
    let mut signals = Signals::new()?;
    let hangups = access::hangups()?;
    let max_connections = descriptors::connections(config.http.max_connections);
    let callers = Callers::read(config)?;
    let listener =
        listen(config.listen).with_context(|| format!("cannot listen on {}", config.listen))?;
    let (phase, watched) = watch::channel(Phase::Serving);
    let parts = tokio::select! {
        parts = parts::open(config, callers, instruments, watched.clone()) => parts?,
        signal = signals.next() => {
            tracing::info!(signal, "leaving before the service has begun");
            return Ok(());
        }
    };
    let store = parts.store.clone();
    let pool = pool(&parts);
    let sweeper = sweeper(&parts);
    let sender = sender(config, &parts);
    access::reload_on_hangup(hangups, config, parts.access.clone());
    announce(&listener)?;
    let settings = http::server::Settings {
        head_timeout: config.http.head_timeout,
        body_timeout: config.http.body_timeout,
        reader_patience: http::server::READER_PATIENCE,
        max_connections,
        patience: LAST_ANSWERS,
        instruments: parts.instruments.clone(),
    };
    let router = router(config, parts);
    let server = tokio::spawn(http::server::serve(listener, router, watched, settings));
    let running = Running {
        phase,
        pool,
        server,
        sweeper,
        sender,
        store,
    };
    running.end_on(signals, config.grace).await
}

fn pool(parts: &Parts) -> Pool {
    let settings = worker::Settings {
        workers: parts.capacity.workers,
        clock: parts.clock.clock(),
        instruments: parts.instruments.clone(),
    };
    let engine = engine(parts.rules.clone());
    Pool::start(parts.store.clone(), settings, engine)
}

fn sweeper(parts: &Parts) -> Sweeper {
    let catalogue = parts.terrains.catalogue.clone();
    Sweeper::start(parts.store.clone(), catalogue, parts.clock.clock())
}

/// `None` where webhooks are off, or other nodes send them.
fn sender(config: &Config, parts: &Parts) -> Option<Sender> {
    let settings = parts.webhooks.clone().filter(|_| config.role.serves());
    let instruments = parts.instruments.clone();
    settings.map(|settings| {
        Sender::start(
            parts.store.clone(),
            settings,
            parts.clock.clock(),
            instruments,
        )
    })
}

fn router(config: &Config, parts: Parts) -> Router {
    if config.role.serves() {
        http::router(parts)
    } else {
        http::upkeep_router(parts)
    }
}

/// The pool's engine: reads the accepted document again, and plans it on no more threads than there are cores.
fn engine(rules: Arc<Rules>) -> Engine {
    let cores = available_parallelism().map_or(1, NonZero::get);
    Arc::new(move |document, observer, stop| {
        let mut scenario = json::read_accepted(document, &rules).map_err(unplanned)?;
        let threads = &mut scenario.planner.threads;
        *threads = (*threads).min(cores);
        Ok(planner::plan(&scenario, observer, stop))
    })
}

/// What becomes of a plan whose document cannot be read.
fn unplanned(unread: Unread) -> Unplanned {
    let kind = match unread {
        Unread::Unreachable(error) => return Unplanned::NotNow(error),
        Unread::NoGround(_) => FailureKind::NoGround,
        Unread::Damaged(_) => FailureKind::InvalidScenario,
    };
    Unplanned::Failed(kind.because(unread.to_string()))
}

/// Plans that this node runs at a time.
fn slots(config: &Config) -> usize {
    if config.role.runs() {
        config.workers
    } else {
        0
    }
}

/// Bind the address, with the largest backlog that the system allows.
fn listen(address: SocketAddr) -> std::io::Result<TcpListener> {
    let socket = if address.is_ipv4() {
        TcpSocket::new_v4()
    } else {
        TcpSocket::new_v6()
    }?;
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// One plain line for people and scripts, with the port that was taken.
fn announce(listener: &TcpListener) -> anyhow::Result<()> {
    let address = listener.local_addr()?;
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "listening on http://{address}")?;
    stdout.flush()?;
    Ok(())
}
