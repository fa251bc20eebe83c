//! The parts of the service, put together from the configuration.

use std::sync::Arc;

use anyhow::{Context as _, anyhow};
use tokio::sync::watch;

use super::{backend, datasets, slots};
use crate::cli::access;
use crate::config::{self, Config};
use crate::http::auth::Access;
use crate::http::webhook::{self, Secrets};
use crate::http::{
    Answers, Bodies, Bounds, Capacity, Hosts, InFlight, Origins, Parts, Phase, Readiness, Terrains,
};
use crate::planner;
use crate::store::measured::MeasuredStore;
use crate::store::{self, SteadyClock};
use crate::telemetry::Instruments;

/// Who may call, by which clock, and who is notified: the fallible parts of the configuration, read before anything is
/// locked or opened.
pub(super) struct Callers {
    clock: Arc<SteadyClock>,
    access: Access,
    cors: Origins,
    hosts: Hosts,
    webhooks: Option<webhook::Settings>,
}

impl Callers {
    pub(super) fn read(config: &Config) -> anyhow::Result<Self> {
        let clock = SteadyClock::following(store::wall_clock());
        let access = access::open(config, clock.clock())?;
        let cors = Origins::new(&config.cors_origins);
        Ok(Self {
            hosts: access::hosts(config, &access, &cors),
            clock,
            access,
            cors,
            webhooks: webhooks(&config.webhook)?,
        })
    }
}

/// Open the store and the datasets, and put everything together.
pub(super) async fn open(
    config: &Config,
    callers: Callers,
    instruments: Arc<Instruments>,
    phase: watch::Receiver<Phase>,
) -> anyhow::Result<Parts> {
    let Callers {
        clock,
        access,
        cors,
        hosts,
        webhooks,
    } = callers;
    instruments.metrics.began(clock.now_ms());
    // Side by side, for servers that do not answer are waited for twice otherwise.
    let (store, catalogue) = tokio::try_join!(
        backend::open(config, &clock, &instruments),
        datasets::open(config, &instruments),
    )?;
    let rules = planner::rules(config.limits).with_datasets(catalogue.clone());
    Ok(Parts {
        store: Arc::new(MeasuredStore::new(store, instruments.clone())),
        rules: Arc::new(rules),
        terrains: Terrains::new(catalogue),
        capacity: Capacity {
            workers: slots(config),
            queue: config.queue,
        },
        in_flight: InFlight::default(),
        bounds: Bounds::default(),
        readiness: Readiness::default(),
        clock,
        body_timeout: config.http.body_timeout,
        bodies: Bodies::new(config.http.bodies_bytes, config.limits.body_bytes),
        answers: Answers::new(
            config.http.answers_bytes,
            config.http.head_timeout + config.http.body_timeout,
        ),
        access,
        webhooks,
        cors,
        hosts,
        phase,
        instruments,
    })
}

/// How ends of plans are reported; `None` when they are not.
fn webhooks(config: &config::Webhook) -> anyhow::Result<Option<webhook::Settings>> {
    let Some(path) = &config.secret_file else {
        return Ok(None);
    };
    let place = || format!("the webhook secret of {}", path.display());
    let text = std::fs::read_to_string(path).with_context(place)?;
    let secrets = Secrets::read(&text).map_err(|allowed| anyhow!("{} {allowed}", place()))?;
    Ok(Some(webhook::Settings {
        secrets,
        allow_private: config.allow_private,
    }))
}
