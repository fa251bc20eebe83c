//! `noctule bench`: measures the planner and the algorithms behind it.
//!
//! Everything but times depends only on the scenarios, the sizes and the seeds 1, 2, ...

mod case;
mod chart;
mod clock;
mod cluster;
mod paper;
mod price;
mod progress;
mod quality;
mod random;
mod rank_sum;
mod report;
mod serve;
mod speed;
mod summary;
mod table;
mod trial;

use std::fs;
use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, Subcommand};

use super::exit;
use case::{Case, Refused};
use price::BadLine;
use report::Report;

#[derive(Subcommand)]
pub(super) enum Command {
    /// Compare all algorithms from a random start, as in the tables of the TMS-SBA paper
    Paper(paper::Arguments),
    /// Measure how far the default settings are from the best known routes and the proven bound
    Quality(quality::Arguments),
    /// Measure on random scenarios how far the default settings are from the best of many runs and the proven bound
    Random(random::Arguments),
    /// Measure how many routes are priced a second, by waypoints, threats and population
    Speed(speed::Arguments),
    /// Measure the service under load: requests, refusals, streams and plans a second, compared with a bare handler
    Serve(serve::Arguments),
    /// Measure a NATS system under load: rates compared with a bare client, workers that sleep, a day's load
    Cluster(cluster::Arguments),
    /// Print the violation and cost of routes from standard input, for searches outside of this program: each line is a JSON
    /// array of routes, a route an array of its free waypoints [x, y, z]
    Price(price::Arguments),
}

/// What all measurements are asked.
#[derive(Args)]
struct Common {
    #[command(flatten)]
    output: Output,
    /// Scenario documents, or names of shipped ones [default: paper-1 paper-2 paper-3 paper-4]
    #[arg(long, value_name = "FILE", num_args = 1..)]
    scenario: Vec<PathBuf>,
}

/// Where a report goes.
#[derive(Args)]
struct Output {
    /// Directory for Markdown, CSV and SVG files [default: Markdown to standard output]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Do what is asked; the exit code tells how it went.
pub(super) fn run(command: &Command) -> anyhow::Result<u8> {
    let done = match command {
        Command::Paper(arguments) => report(&arguments.common, "paper", |cases| {
            paper::measure(arguments, cases)
        }),
        Command::Quality(arguments) => report(&arguments.common, "quality", |cases| {
            quality::measure(arguments, cases)
        }),
        Command::Speed(arguments) => report(&arguments.common, "speed", |cases| {
            speed::measure(arguments, cases)
        }),
        Command::Serve(arguments) => serve::plays_a_role(arguments).and_then(|played| {
            if played {
                return Ok(());
            }
            report(&arguments.common, "serve", |cases| {
                serve::measure(arguments, cases)
            })
        }),
        Command::Random(arguments) => {
            kept(&arguments.output, "random", || random::measure(arguments))
        }
        Command::Cluster(arguments) => {
            kept(&arguments.output, "cluster", || cluster::measure(arguments))
        }
        Command::Price(arguments) => price::run(arguments),
    };
    let Err(error) = done else {
        return Ok(exit::DONE);
    };
    if let Some(refused) = error.downcast_ref::<Refused>() {
        super::plan::report(&refused.file, &refused.refusal);
    } else if let Some(line) = error.downcast_ref::<BadLine>() {
        eprintln!("{line}");
    } else {
        return Err(error);
    }
    Ok(exit::BAD_INPUT)
}

/// Measure all cases, and write the results.
fn report(
    common: &Common,
    name: &str,
    measure: impl FnOnce(&[Case]) -> anyhow::Result<Report>,
) -> anyhow::Result<()> {
    kept(&common.output, name, || {
        measure(&case::cases(&common.scenario)?)
    })
}

/// Measure, and write the results where they are wanted, which is made ready before.
fn kept(
    output: &Output,
    name: &str,
    measure: impl FnOnce() -> anyhow::Result<Report>,
) -> anyhow::Result<()> {
    output.make_ready()?;
    write(&measure()?, output, name)
}

impl Output {
    /// Make the directory, so that one that cannot be is known before the measurement.
    fn make_ready(&self) -> anyhow::Result<()> {
        let Some(directory) = &self.out else {
            return Ok(());
        };
        fs::create_dir_all(directory)
            .with_context(|| format!("cannot make the directory {}", directory.display()))
    }
}

fn write(report: &Report, output: &Output, name: &str) -> anyhow::Result<()> {
    let written = match &output.out {
        Some(directory) => report.save(directory, name).map_err(Into::into),
        None => report.print(),
    };
    written.context("cannot write the report")
}
