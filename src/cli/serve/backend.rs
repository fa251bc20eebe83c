//! Opens the store that the configuration names, and where its nodes share datasets: one arm each.

use std::path::PathBuf;
use std::sync::Arc;

use tokio::runtime::Handle;

use super::slots;
use crate::catalogue::Shelf;
use crate::cli::config::data_dir;
use crate::config::{self, Address, Backend, Config};
use crate::store::jetstream::{JetStreamShelf, JetStreamStore, Settings};
use crate::store::reopening::{Open, Reopening};
use crate::store::sqlite::SqliteStore;
use crate::store::{OnLost, Options, Retention, SteadyClock, Store, TOLERANCE_MS};
use crate::telemetry::Instruments;
use crate::telemetry::metrics::Ended;

/// The store, as soon as it can be opened.
///
/// # Errors
/// When the configuration names none.
pub(super) async fn open(
    config: &Config,
    clock: &Arc<SteadyClock>,
    instruments: &Arc<Instruments>,
) -> anyhow::Result<Arc<dyn Store>> {
    let options = options(config, clock, instruments);
    let open = match &config.store {
        Backend::Sqlite => sqlite(data_dir(config)?, options),
        Backend::Nats(address) => jetstream(settings(config, address), options),
    };
    Ok(Arc::new(Reopening::start(open).await))
}

fn sqlite(data_dir: PathBuf, options: Options) -> Open {
    Arc::new(move |suspicious| {
        let open = if suspicious {
            SqliteStore::open_suspicious
        } else {
            SqliteStore::open
        };
        let store = open(&data_dir, options.clone())?;
        tracing::info!(data_dir = %data_dir.display(), "the store is open");
        Ok(Arc::new(store))
    })
}

/// Opens it on a thread that may block.
fn jetstream(settings: Settings, options: Options) -> Open {
    let runtime = Handle::current();
    Arc::new(move |_| {
        let opening = JetStreamStore::open(settings.clone(), options.clone());
        let store = runtime.block_on(opening)?;
        let Address { servers, namespace } = &settings.address;
        tracing::info!(servers = %servers.join(","), namespace, "the store is open");
        Ok(Arc::new(store))
    })
}

/// Where nodes share their datasets; `None` where there is one node.
pub(super) fn shelf(config: &Config) -> Option<Arc<dyn Shelf>> {
    match &config.store {
        Backend::Sqlite => None,
        Backend::Nats(address) => Some(Arc::new(JetStreamShelf::new(settings(config, address)))),
    }
}

fn settings(config: &Config, address: &Address) -> Settings {
    Settings {
        address: address.clone(),
        credentials: config.store_credentials.clone(),
        replicas: config.store_replicas.count(),
        lease: config.store_lease,
        slots: slots(config),
    }
}

fn options(config: &Config, clock: &Arc<SteadyClock>, instruments: &Arc<Instruments>) -> Options {
    Options {
        most_apart_ms: Some(TOLERANCE_MS),
        on_lost: counted(instruments),
        retention: retention(config.retention),
        events_kept: config.retention.events,
        ..Options::new(config.queue as u64).by(clock)
    }
}

/// Counts a plan as ended; the duration of its last run is unknown.
fn counted(instruments: &Arc<Instruments>) -> OnLost {
    let instruments = Arc::clone(instruments);
    Arc::new(move |plan| {
        instruments.origins.forget(plan.id);
        instruments.metrics.ended(Ended {
            status: plan.status.name(),
            run_ms: None,
        });
    })
}

/// In the settings, 0 means no limit. A fraction of a millisecond is a limit.
fn retention(settings: config::Retention) -> Retention {
    let limit = |setting: u64| (setting > 0).then_some(setting);
    let age_ms = settings.age.as_nanos().div_ceil(1_000_000);
    let age_ms = i64::try_from(age_ms).unwrap_or(i64::MAX);
    Retention {
        age_ms: (age_ms > 0).then_some(age_ms),
        plans: limit(settings.plans),
        bytes: limit(settings.bytes),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn only_an_age_of_zero_means_for_ever() {
        for (age, expected_ms) in [
            (Duration::ZERO, None),
            (Duration::from_nanos(1), Some(1)),
            (Duration::from_micros(400), Some(1)),
            (Duration::from_millis(1), Some(1)),
            (Duration::from_micros(1_400), Some(2)),
            (Duration::from_secs(604_800), Some(604_800_000)),
            (Duration::MAX, Some(i64::MAX)),
        ] {
            let settings = config::Retention {
                age,
                ..config::Retention::default()
            };
            assert_eq!(retention(settings).age_ms, expected_ms, "{age:?}");
        }
    }
}
