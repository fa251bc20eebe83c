//! The command line: serve, plan, export, convert, bench, key, store, terrain, healthcheck.

mod access;
mod bench;
mod config;
mod convert;
mod export;
mod files;
mod ground;
mod healthcheck;
mod key;
mod plan;
mod serve;
mod store;
mod terrain;

use std::process::ExitCode;

use clap::builder::Resettable;
use clap::{Arg, CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

/// Plans 3-D routes for unmanned aircraft.
#[derive(Parser)]
#[command(name = "noctule", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run the HTTP service
    Serve(crate::config::Flags),
    /// Plan one scenario without a server
    Plan(plan::Arguments),
    /// Write a JSON result in another format
    Export(export::Arguments),
    /// Convert a GeoJSON, a KML, a QGroundControl plan or a map of airspace to a scenario
    Convert(convert::Arguments),
    /// Measure the algorithms, the planner and the service
    #[command(subcommand)]
    Bench(bench::Command),
    /// Create keys for those who may use a service
    #[command(subcommand)]
    Key(key::Command),
    /// Back up the stored plans, or check them for damage
    #[command(subcommand)]
    Store(store::Command),
    /// Inspect a file of elevations
    #[command(subcommand)]
    Terrain(terrain::Command),
    /// Check whether a running service is ready; for containers
    Healthcheck(healthcheck::Arguments),
}

/// Exit codes, the same in all commands.
mod exit {
    /// Done; `plan` found a feasible route.
    pub(super) const DONE: u8 = 0;
    /// Anything without a code of its own, a wrong command line included.
    pub(super) const FAILED: u8 = 1;
    /// A scenario, a result, a file to convert or a line of routes to price is refused.
    pub(super) const BAD_INPUT: u8 = 2;
    /// No feasible route was found, or is there to export.
    pub(super) const INFEASIBLE: u8 = 3;
}

/// Run the command line.
#[must_use]
pub fn run() -> ExitCode {
    let parsed = heeding_variables(Cli::command()).try_get_matches();
    let parsed = parsed.and_then(|matches| Cli::from_arg_matches(&matches));
    let command = match parsed {
        Ok(cli) => cli.command,
        Err(usage) => {
            // Nothing can be done about a closed terminal.
            let _ = usage.print();
            return if usage.use_stderr() {
                exit::FAILED
            } else {
                exit::DONE
            }
            .into();
        }
    };
    let done = match command {
        Command::Serve(flags) => serve::run(&flags).map(|()| exit::DONE),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Bench(command) => bench::run(&command),
        Command::Key(command) => key::run(&command).map(|()| exit::DONE),
        Command::Store(command) => store::run(command),
        Command::Terrain(command) => terrain::run(&command),
        Command::Healthcheck(arguments) => healthcheck::run(&arguments).map(|()| exit::DONE),
    };
    done.unwrap_or_else(|error| {
        eprintln!("noctule: {}", reason(&error));
        exit::FAILED
    })
    .into()
}

/// An error and its causes, without those that the text before already ends in.
fn reason(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.ends_with(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

/// An empty variable counts as unset, whichever command reads it.
fn heeding_variables(command: clap::Command) -> clap::Command {
    let is_empty = |argument: &Arg| {
        let value = argument.get_env().and_then(std::env::var_os);
        value.is_some_and(|value| value.is_empty())
    };
    command
        .mut_args(|argument| {
            if is_empty(&argument) {
                argument.env(Resettable::Reset)
            } else {
                argument
            }
        })
        .mut_subcommands(heeding_variables)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::dem::DemError;

    #[test]
    fn a_reason_is_told_once() {
        let missing = || std::io::Error::other("no such file");
        let error = anyhow::Error::new(missing()).context("the file cannot be read: no such file");
        assert_eq!(reason(&error), "the file cannot be read: no such file");
        let error = anyhow::Error::new(DemError::from(missing())).context("hills.tif");
        let expected = "hills.tif: the file cannot be read: no such file";
        assert_eq!(reason(&error), expected);
        assert_eq!(format!("{error:#}"), expected);
    }
}
