//! The keys of a service: read at its start, and again at SIGHUP; and a safeguard against serving strangers by
//! accident.

use std::path::Path;

use anyhow::{Context, bail};
use tokio::signal::unix::{Signal, SignalKind, signal};

use crate::config::Config;
use crate::http::auth::{Access, Keys, Settings};
use crate::http::{Hosts, Origins};
use crate::store::Clock;

/// The keys themselves, in the form of the file.
const VARIABLE: &str = "NOCTULE_KEYS";

/// Who may use the service.
///
/// # Errors
/// When the keys cannot be read, and when there are none although other machines can reach the service.
pub(super) fn open(config: &Config, clock: Clock) -> anyhow::Result<Access> {
    let keys = match (&config.keys_file, of_environment()?) {
        (Some(_), Some(_)) => bail!("there are keys in both keys_file and {VARIABLE}; give one"),
        (Some(path), None) => Some(read(path)?),
        (None, Some(text)) => Some(Keys::read(&text).context(VARIABLE)?),
        (None, None) => None,
    };
    match &keys {
        Some(keys) => tracing::info!(keys = keys.len(), "the service is for holders of keys"),
        None if config.listen.ip().is_loopback() => {}
        None if config.allow_anonymous => {
            tracing::warn!("the service is for everybody who reaches it: it has no keys");
        }
        None => bail!(
            "{} can be reached from other machines, and there are no keys: name some with \
             --keys-file (noctule key new makes them), or say --allow-anonymous",
            config.listen
        ),
    }
    let settings = Settings {
        streams: config.http.streams,
        streams_per_key: config.http.streams_per_key,
        ..Settings::default()
    };
    Ok(Access::new(keys, settings, clock))
}

/// The text of the keys, where the environment has it.
fn of_environment() -> anyhow::Result<Option<String>> {
    match std::env::var(VARIABLE) {
        Ok(text) => Ok(Some(text).filter(|text| !text.trim().is_empty())),
        Err(std::env::VarError::NotPresent) => Ok(None),
        Err(error) => Err(error).context(VARIABLE),
    }
}

/// What the printed settings say of keys in the environment, which are no setting.
///
/// # Errors
/// When they are no text.
pub(super) fn comment() -> anyhow::Result<Option<String>> {
    let comment = |_| format!("# The keys are set by {VARIABLE}, and not shown\n");
    Ok(of_environment()?.map(comment))
}

/// The names that the service answers to. Without keys it is for this machine alone, which excludes pages with other
/// names; with keys, or when everybody is allowed, a proxy may call it whatever it likes.
pub(super) fn hosts(config: &Config, access: &Access, cors: &Origins) -> Hosts {
    if access.is_guarded() || config.allow_anonymous {
        Hosts::any()
    } else {
        Hosts::of_this_machine(cors)
    }
}

/// From now on SIGHUP does not end the process.
pub(super) fn hangups() -> std::io::Result<Signal> {
    signal(SignalKind::hangup())
}

/// Read the file of keys again whenever SIGHUP comes. One that is wrong changes nothing.
pub(super) fn reload_on_hangup(mut hangups: Signal, config: &Config, access: Access) {
    let path = config.keys_file.clone();
    tokio::spawn(async move {
        while hangups.recv().await.is_some() {
            let Some(path) = &path else {
                tracing::info!("SIGHUP, but there is no keys_file to read again");
                continue;
            };
            match read(path) {
                Ok(keys) => {
                    tracing::info!(keys = keys.len(), "the keys have been read again");
                    access.replace(keys);
                }
                Err(error) => {
                    tracing::error!("{error:#}; the keys stay as they were");
                }
            }
        }
    });
}

fn read(path: &Path) -> anyhow::Result<Keys> {
    let place = || format!("cannot take the keys of {}", path.display());
    let text = std::fs::read_to_string(path).with_context(place)?;
    Keys::read(&text).with_context(place)
}
