//! `noctule store`: what an operator does with the embedded store.

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::{Args, Subcommand};

use super::{exit, files};
use crate::config::Config;
use crate::store::sqlite::upkeep;

/// Keep or look after the plans of this machine.
#[derive(Subcommand)]
pub(super) enum Command {
    /// Write a compact copy to a new file, even while the service runs; to restore it, put it into an
    /// empty data directory as noctule.db
    Backup {
        #[command(flatten)]
        place: Location,
        /// The new file
        file: PathBuf,
    },
    /// Check for damage and contradictions, even while the service runs; exits with 1 if there are any
    Check {
        #[command(flatten)]
        place: Location,
    },
}

#[derive(Args)]
pub(super) struct Location {
    /// Directory of the plans [default: noctule in the user's data home]
    #[arg(long, env = "NOCTULE_DATA_DIR", value_name = "DIR")]
    data_dir: Option<PathBuf>,
    /// Same as for serve; NATS servers have their own commands for this
    #[arg(
        long,
        env = "NOCTULE_STORE",
        value_name = "PLACE",
        hide_env_values = true
    )]
    store: Option<String>,
}

impl Location {
    fn data_dir(self, instead: &str) -> anyhow::Result<PathBuf> {
        // A store that is not a file has its own tools.
        if self
            .store
            .is_some_and(|store| !["", "sqlite"].contains(&store.as_str()))
        {
            bail!(
                "the plans are on NATS servers, and this looks after a file of one machine: {instead}"
            );
        }
        self.data_dir
            .or(Config::default().data_dir)
            .context("the user has no home; name a directory with --data-dir")
    }
}

pub(super) fn run(command: Command) -> anyhow::Result<u8> {
    match command {
        Command::Backup { place, file } => {
            let instead = "nats stream backup, or nats account backup, copies what they keep (docs/OPERATIONS.md)";
            upkeep::backup(&place.data_dir(instead)?, &file)?;
            files::print(&format!("written to {}\n", file.display()))?;
            Ok(exit::DONE)
        }
        Command::Check { place } => {
            let instead = "nats server check jetstream, and nats stream report, say how they are (docs/OPERATIONS.md)";
            let findings = upkeep::check(&place.data_dir(instead)?)?;
            let (plans, faults) = (findings.plans, findings.faults.len());
            let mut lines = findings.faults;
            lines.push(format!("{plans} plans, {faults} faults\n"));
            files::print(&lines.join("\n"))?;
            Ok(if faults == 0 {
                exit::DONE
            } else {
                exit::FAILED
            })
        }
    }
}
