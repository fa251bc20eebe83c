//! `noctule bench`: what the planner and the algorithms behind it do, measured.
//!
//! Everything but times depends on the scenarios, the sizes and the seeds 1, 2, ... alone.

mod case;
mod chart;
mod clock;
mod paper;
mod progress;
mod quality;
mod rank_sum;
mod report;
mod speed;
mod summary;
mod table;
mod trial;

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, Subcommand};

use super::exit;
use case::Refused;
use report::Report;

#[derive(Subcommand)]
pub(super) enum Command {
    /// All algorithms from a random start, as in the tables of the TMS-SBA paper
    Paper(paper::Arguments),
    /// The planner with its default settings: distance to the best known routes and to the proven bound
    Quality(quality::Arguments),
    /// Routes priced in a second, by waypoints, threats and population
    Speed(speed::Arguments),
}

/// What all measurements are asked.
#[derive(Args)]
struct Common {
    /// Directory for Markdown, CSV and SVG files [default: Markdown to standard output]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Scenario documents, or names of shipped ones [default: paper-1 paper-2 paper-3 paper-4]
    #[arg(long, value_name = "FILE", num_args = 1..)]
    scenario: Vec<PathBuf>,
}

/// Measure, and write what came of it.
pub(super) fn run(command: &Command) -> anyhow::Result<u8> {
    let (common, name) = match command {
        Command::Paper(arguments) => (&arguments.common, "paper"),
        Command::Quality(arguments) => (&arguments.common, "quality"),
        Command::Speed(arguments) => (&arguments.common, "speed"),
    };
    let done = case::cases(&common.scenario).and_then(|cases| match command {
        Command::Paper(arguments) => paper::measure(arguments, &cases),
        Command::Quality(arguments) => quality::measure(arguments, &cases),
        Command::Speed(arguments) => speed::measure(arguments, &cases),
    });
    match done {
        Ok(report) => {
            write(&report, common, name).context("cannot write the report")?;
            Ok(exit::DONE)
        }
        Err(error) => match error.downcast::<Refused>() {
            Ok(refused) => {
                super::plan::report(&refused.file, &refused.refusal);
                Ok(exit::BAD_INPUT)
            }
            Err(error) => Err(error),
        },
    }
}

fn write(report: &Report, common: &Common, name: &str) -> std::io::Result<()> {
    match &common.out {
        Some(directory) => report.save(directory, name),
        None => report.print(),
    }
}
