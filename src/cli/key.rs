//! `noctule key new`: a new key, shown once, and the entry that the service needs for it.

use std::io::Write as _;

use anyhow::{anyhow, ensure};
use clap::{Args, Subcommand};
use jiff::Timestamp;

use crate::digest::sha256_hex;
use crate::http::auth::{Keys, Scope, fresh_key};

#[derive(Subcommand)]
pub(super) enum Command {
    /// Print a new key to stderr, the only time it is shown, and its entry for the file of keys to stdout
    New(Arguments),
}

#[derive(Args)]
pub(super) struct Arguments {
    /// Name of the key, for people; also the owner of its plans unless another is given
    #[arg(long)]
    name: String,

    /// What it may do: read (look at own plans), plan (also submit, cancel and delete plans, and upload datasets), metrics, admin (everything)
    #[arg(long, value_delimiter = ',', default_value = "plan", value_parser = scope)]
    scopes: Vec<Scope>,

    /// Owner of its plans; keys that replace each other have the same owner
    #[arg(long)]
    owner: Option<String>,

    /// When it expires, such as 2027-01-31T00:00:00Z [default: never]
    #[arg(long, value_name = "TIME")]
    expires: Option<Timestamp>,

    /// Most plans that may be queued and running at once [default: any number]
    #[arg(long, value_name = "N")]
    active_plans: Option<u64>,

    /// Most requests a second [default: any number]
    #[arg(long, value_name = "RATE")]
    requests_per_second: Option<f64>,

    /// Most requests at once, if there is a rate [default: those of a second]
    #[arg(long, value_name = "N")]
    burst: Option<u32>,
}

fn scope(name: &str) -> Result<Scope, String> {
    let names = || Scope::ALL.map(Scope::name).join(", ");
    Scope::from_name(name).ok_or_else(|| format!("must be some of {}", names()))
}

pub(super) fn run(command: &Command) -> anyhow::Result<()> {
    let Command::New(arguments) = command;
    if let Some(time) = arguments.expires {
        ensure!(
            time > Timestamp::now(),
            "--expires {time} is past, must be a time to come"
        );
    }
    let key = fresh_key()?;
    let entry = entry(arguments, &key);
    Keys::read(&entry).map_err(|error| anyhow!("there can be no such key: {error}"))?;
    // On separate streams, so that `>> keys.toml` takes the entry and the key stays out.
    eprintln!(
        "the key, for its holder alone; it is kept nowhere and cannot be shown again:\n{key}"
    );
    std::io::stdout().write_all(entry.as_bytes())?;
    Ok(())
}

fn entry(arguments: &Arguments, key: &str) -> String {
    let text = |text: &str| toml::Value::from(text);
    let scopes: Vec<toml::Value> = arguments
        .scopes
        .iter()
        .map(|scope| text(scope.name()))
        .collect();
    let fields = [
        ("name", Some(text(&arguments.name))),
        ("sha256", Some(text(&sha256_hex(key.as_bytes())))),
        ("scopes", Some(scopes.into())),
        ("owner", arguments.owner.as_deref().map(text)),
        (
            "expires",
            arguments.expires.map(|time| text(&time.to_string())),
        ),
        ("active_plans", arguments.active_plans.map(whole)),
        (
            "requests_per_second",
            arguments.requests_per_second.map(Into::into),
        ),
        ("burst", arguments.burst.map(Into::into)),
    ];
    let lines = fields
        .into_iter()
        .filter_map(|(name, value)| Some(format!("{name} = {}\n", value?)));
    format!("[[key]]\n{}", lines.collect::<String>())
}

/// TOML has no whole numbers above 63 bits.
fn whole(number: u64) -> toml::Value {
    i64::try_from(number).unwrap_or(i64::MAX).into()
}
