//! `noctule serve`: put the parts together, and take them apart in the right order.

mod backend;
mod datasets;
mod descriptors;
mod ending;

use std::io::Write as _;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, anyhow};
use tokio::net::{TcpListener, TcpSocket};
use tokio::sync::watch;
use tokio::time::Instant;

use self::ending::{Signals, Times};
use super::{access, exit, files};
use crate::config::{self, Config, Flags};
use crate::http::webhook::{self, Secret, Sender};
use crate::http::{self, Capacity, InFlight, Origins, Parts, Phase, Terrains};
use crate::job::{Failure, FailureKind};
use crate::planner;
use crate::scenario::json::{self, Refusal, Rules};
use crate::store::measured::MeasuredStore;
use crate::store::{self, SteadyClock, Store};
use crate::telemetry::{self, Instruments};
use crate::worker::{self, Engine, Pool, Sweeper, Unplanned};

/// Callers that may wait to be let in; Linux allows as many since 5.4. Who comes when there are more
/// may be left waiting for an answer that never comes.
const BACKLOG: u32 = 4_096;

/// Connections may finish their answers for so long at the end, if the grace period lasts so long.
const LAST_ANSWERS: Duration = Duration::from_secs(5);

/// Serve until a signal, or print the configuration.
pub(super) fn run(flags: &Flags) -> anyhow::Result<()> {
    let loaded = config::load(flags, |name| std::env::var_os(name))
        .map_err(|faults| anyhow!("wrong configuration\n  {}", faults.join("\n  ")))?;
    if flags.print_config {
        let mut text = Vec::new();
        loaded.write_toml(&mut text)?;
        return files::print(&String::from_utf8_lossy(&text));
    }
    start(&loaded.config)
}

/// Serve until a signal.
pub(super) fn start(config: &Config) -> anyhow::Result<()> {
    let log = telemetry::log::init(config);
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?;
    runtime.block_on(serve(config))?;
    // Whatever still runs has been given back to the queue; the process does not wait for it.
    runtime.shutdown_background();
    log.close();
    Ok(())
}

async fn serve(config: &Config) -> anyhow::Result<()> {
    let mut signals = Signals::new()?;
    let max_connections = descriptors::connections(config.http.max_connections);
    let access = access::open(config)?;
    let cors =
        Origins::read(&config.cors_origins).map_err(|fault| anyhow!("cors_origins: {fault}"))?;
    let hosts = access::hosts(config, &access, &cors);
    let webhooks = webhooks(&config.webhook)?;
    let listener =
        listen(config.listen).with_context(|| format!("cannot listen on {}", config.listen))?;
    let instruments = Arc::new(Instruments::default());
    let clock = SteadyClock::following(store::wall_clock());
    let store = backend::open(config, clock.clock()).await?;
    let store: Arc<dyn Store> = Arc::new(MeasuredStore::new(store, instruments.clone()));
    let catalogue = datasets::open(config, &instruments).await?;
    let rules = planner::rules(config.limits).with_datasets(catalogue.clone());
    let rules = Arc::new(rules);
    let settings = worker::Settings {
        workers: slots(config),
        clock: clock.clock(),
        instruments: instruments.clone(),
    };
    let pool = Pool::start(store.clone(), settings, engine(rules.clone()));
    let sweeper = Sweeper::start(store.clone(), catalogue.clone(), clock.clock());
    let sender = webhooks
        .clone()
        .filter(|_| config.role.serves())
        .map(|settings| Sender::start(store.clone(), settings, clock.clock()));
    let (phase, watched) = watch::channel(Phase::Serving);
    let parts = Parts {
        store: store.clone(),
        rules,
        terrains: Terrains::new(catalogue),
        capacity: Capacity {
            workers: slots(config),
            queue: config.queue,
        },
        in_flight: InFlight::default(),
        clock,
        body_timeout: config.http.body_timeout,
        access: access.clone(),
        webhooks: webhooks.clone(),
        cors,
        hosts,
        phase: watched.clone(),
        instruments: instruments.clone(),
    };
    let router = if config.role.serves() {
        http::router(parts)
    } else {
        http::upkeep_router(parts)
    };
    access::reload_on_hangup(config, access)?;
    announce(&listener)?;
    let times = Times::within(config.grace);
    let settings = http::server::Settings {
        head_timeout: config.http.head_timeout,
        body_timeout: config.http.body_timeout,
        max_connections,
        patience: LAST_ANSWERS,
        instruments,
    };
    let server = tokio::spawn(http::server::serve(listener, router, watched, settings));

    let name = signals.next().await;
    let signalled = Instant::now();
    tracing::info!(
        signal = name,
        grace_s = config.grace.as_secs_f64(),
        "shutting down"
    );
    tokio::spawn(async move {
        signals.next().await;
        tracing::warn!("a second signal, leaving at once");
        std::process::exit(exit::FAILED.into());
    });
    phase.send_replace(Phase::Draining);
    ending::drain(pool, &times).await;
    phase.send_replace(Phase::Stopping);
    if let Ok(ended) = tokio::time::timeout_at(signalled + times.answers, server).await {
        ended.context("the server broke")?;
    }
    drop((sweeper, sender));
    store.close().await;
    tracing::info!(
        duration_ms = signalled.elapsed().as_secs_f64() * 1e3,
        "shut down"
    );
    Ok(())
}

/// What the pool runs: the accepted document, read again, and planned.
fn engine(rules: Arc<Rules>) -> Engine {
    Arc::new(move |document, observer, stop| {
        let scenario = json::read_accepted(document, &rules).map_err(|refusal| {
            match refusal.unreachable_ground() {
                Some(fault) => Unplanned::NotNow(fault.detail.clone()),
                None => Unplanned::Failed(unread(&refusal)),
            }
        })?;
        Ok(planner::plan(&scenario, observer, stop))
    })
}

/// Why a document is not read that was once.
fn unread(refusal: &Refusal) -> Failure {
    match refusal.lost_ground() {
        Some(fault) => FailureKind::NoGround.because(format!(
            "the ground that it was accepted over is gone: {}",
            fault.detail
        )),
        None => FailureKind::InvalidScenario.because(format!(
            "this version of the service cannot read the accepted document: {refusal}"
        )),
    }
}

/// Plans that this node runs at a time.
fn slots(config: &Config) -> usize {
    if config.role.runs() {
        config.workers
    } else {
        0
    }
}

fn data_dir(config: &Config) -> anyhow::Result<PathBuf> {
    let data_dir = config.data_dir.clone();
    data_dir.context("the user has no home; name a directory with --data-dir")
}

/// How ends of plans are told; `None` when nobody is.
fn webhooks(config: &config::Webhook) -> anyhow::Result<Option<webhook::Settings>> {
    let Some(path) = &config.secret_file else {
        return Ok(None);
    };
    let place = || format!("the webhook secret of {}", path.display());
    let text = std::fs::read_to_string(path).with_context(place)?;
    let secret = Secret::read(&text).map_err(|allowed| anyhow!("{} {allowed}", place()))?;
    Ok(Some(webhook::Settings {
        secret,
        allow_private: config.allow_private,
    }))
}

/// Take the address, for as many callers at once as the system lets wait.
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
