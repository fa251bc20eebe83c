//! `noctule store`: what an operator does with the embedded store.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, Subcommand};

use super::exit;
use crate::config::Config;
use crate::store::sqlite::upkeep;

/// Keep or look after the plans of this machine.
#[derive(Subcommand)]
pub(super) enum Command {
    /// Write a compact copy to a new file, also while the service runs; it is restored by putting it
    /// into an empty data directory as noctule.db
    Backup {
        #[command(flatten)]
        place: Place,
        /// The new file
        file: PathBuf,
    },
    /// Look for damage and contradictions, also while the service runs; exits 1 when there are any
    Check {
        #[command(flatten)]
        place: Place,
    },
}

#[derive(Args)]
pub(super) struct Place {
    /// Directory of the plans [default: noctule in the user's data home]
    #[arg(long, env = "NOCTULE_DATA_DIR", value_name = "DIR")]
    data_dir: Option<PathBuf>,
}

impl Place {
    fn data_dir(self) -> anyhow::Result<PathBuf> {
        self.data_dir
            .or(Config::default().data_dir)
            .context("the user has no home; name a directory with --data-dir")
    }
}

pub(super) fn run(command: Command) -> anyhow::Result<u8> {
    match command {
        Command::Backup { place, file } => {
            upkeep::backup(&place.data_dir()?, &file)?;
            println!("written to {}", file.display());
            Ok(exit::DONE)
        }
        Command::Check { place } => {
            let findings = upkeep::check(&place.data_dir()?)?;
            for fault in &findings.faults {
                println!("{fault}");
            }
            let (plans, faults) = (findings.plans, findings.faults.len());
            println!("{plans} plans, {faults} faults");
            Ok(if faults == 0 {
                exit::DONE
            } else {
                exit::FAILED
            })
        }
    }
}
