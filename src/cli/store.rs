//! `noctule store`: what an operator does with the embedded store.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow, bail};
use clap::{Args, Subcommand};

use super::{config, exit, files};
use crate::config::{Backend, Flags};
use crate::store::sqlite::upkeep;

/// Keep or look after the plans of this machine.
#[derive(Subcommand)]
pub(super) enum Command {
    /// Write a compact copy to a new file, even while the service runs; to restore it, put it into an
    /// empty data directory as noctule.db, beside a copy of terrains/content and terrains/names
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
    /// Same as for serve: read where the plans are from a TOML file
    #[arg(long, env = "NOCTULE_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
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
    /// The directory of the service with the same flags, variables and file.
    fn data_dir(self, instead: &str) -> anyhow::Result<PathBuf> {
        let config = config::of_environment(&Flags::with_file(self.config))?.config;
        // `--store ""` counts as none.
        let given = self.store.filter(|store| !store.is_empty());
        let store: Backend = match given {
            Some(store) => store
                .parse()
                .map_err(|refused| anyhow!("--store {refused}"))?,
            None => config.store.clone(),
        };
        // A store that is not a file has its own tools.
        if store.is_shared() {
            bail!(
                "the plans are on NATS servers, and this looks after a file of one machine: {instead}"
            );
        }
        self.data_dir.map_or_else(|| config::data_dir(&config), Ok)
    }
}

pub(super) fn run(command: Command) -> anyhow::Result<u8> {
    match command {
        Command::Backup { place, file } => {
            let instead = "nats stream backup, or nats account backup, copies what they keep (docs/OPERATIONS.md)";
            let data_dir = place.data_dir(instead)?;
            upkeep::backup(&data_dir, &file).with_context(|| plans_of(&data_dir))?;
            files::print(&format!(
                "the plans of {} are written to {}\n",
                data_dir.display(),
                file.display()
            ))?;
            Ok(exit::DONE)
        }
        Command::Check { place } => {
            let instead = "nats server check jetstream, and nats stream report, say how they are (docs/OPERATIONS.md)";
            let data_dir = place.data_dir(instead)?;
            let findings = upkeep::check(&data_dir).with_context(|| plans_of(&data_dir))?;
            let (plans, faults) = (findings.plans, findings.faults.len());
            let mut lines = findings.faults;
            lines.push(format!(
                "{plans} plans, {faults} faults in {}\n",
                data_dir.display()
            ));
            files::print(&lines.join("\n"))?;
            Ok(if faults == 0 {
                exit::DONE
            } else {
                exit::FAILED
            })
        }
    }
}

/// Where a failure is: flags, variables and file together say which directory is looked at.
fn plans_of(data_dir: &Path) -> String {
    format!("the plans of {}", data_dir.display())
}
