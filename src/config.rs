//! What the operator sets, by flag or environment, as plain structs.

use std::net::SocketAddr;
use std::num::{NonZeroU32, NonZeroUsize};
use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// How the service runs.
#[derive(Debug, Clone, Args)]
pub struct Serve {
    /// Address and port to listen on; port 0 takes a free one
    #[arg(
        long,
        env = "NOCTULE_LISTEN",
        default_value = "127.0.0.1:8080",
        value_name = "ADDRESS"
    )]
    pub listen: SocketAddr,

    /// Directory for the plans, created if need be [default: noctule in the user's data home]
    #[arg(long, env = "NOCTULE_DATA_DIR", value_name = "DIR")]
    pub data_dir: Option<PathBuf>,

    /// Plans run at the same time [default: the number of cores]
    #[arg(long, env = "NOCTULE_WORKERS", value_name = "N")]
    pub workers: Option<NonZeroUsize>,

    /// Plans that may wait; more are refused with 503 queue-full
    #[arg(long, env = "NOCTULE_QUEUE", default_value = "1000", value_name = "N")]
    pub queue: NonZeroU32,

    /// Time from a signal to the exit: what runs may finish in it, the rest goes back to the queue
    #[arg(long, env = "NOCTULE_GRACE", default_value = "10", value_name = "SECONDS",
          value_parser = clap::value_parser!(u64).range(0..=3600))]
    pub grace: u64,

    /// How log lines are written to stderr
    #[arg(
        long,
        env = "NOCTULE_LOG_FORMAT",
        default_value = "text",
        value_name = "FORMAT"
    )]
    pub log_format: LogFormat,
}

/// How log lines are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// For people
    Text,
    /// One object a line
    Json,
}

impl Serve {
    /// Plans run at the same time.
    #[must_use]
    pub fn workers(&self) -> NonZeroUsize {
        let cores = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        self.workers.unwrap_or_else(cores)
    }

    /// Directory for the plans; `None` when none is named and the user has no home.
    #[must_use]
    pub fn data_dir(&self) -> Option<PathBuf> {
        let of_user = || {
            let directories = directories::ProjectDirs::from("", "", "noctule")?;
            Some(directories.data_dir().to_owned())
        };
        self.data_dir.clone().or_else(of_user)
    }
}
