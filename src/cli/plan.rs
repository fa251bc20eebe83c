//! `noctule plan`: the service's engine on one scenario, without the service.

use std::fs;
use std::io::{self, IsTerminal, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use clap::builder::PossibleValuesParser;
use indicatif::{ProgressBar, ProgressStyle};

use super::exit;
use crate::catalogue::Mounted;
use crate::export::document::{Origin, ResultDocument, Timing};
use crate::export::sha256_hex;
use crate::export::{self, Format, ResultInput};
use crate::job::draw_seed;
use crate::planner::{self, ConvergencePoint, Incumbent, Observer, Outcome, Stop};
use crate::scenario::json::{self, Fault, Refusal};
use crate::scenario::limits::Limits;
use crate::scenario::{Scenario, WarmStart};

#[derive(Args)]
pub(super) struct Arguments {
    /// Scenario document; - reads standard input
    file: PathBuf,
    /// Where the result goes [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Directory of the datasets that the scenario may name
    #[arg(long, env = "NOCTULE_TERRAIN_DIR", value_name = "DIR")]
    terrain_dir: Option<PathBuf>,
    /// What the result is written as [default: by the extension of --out, else json]
    #[arg(long, value_parser = PossibleValuesParser::new(export::ALL.iter().map(|format| format.name)))]
    format: Option<String>,
}

impl Arguments {
    fn format(&self) -> &'static Format {
        let extension = || self.out.as_deref()?.extension()?.to_str();
        let name = self.format.as_deref().or_else(extension);
        let named = export::ALL
            .iter()
            .find(|format| name.is_some_and(|name| format.name.eq_ignore_ascii_case(name)));
        named.unwrap_or(&export::ALL[0])
    }
}

/// Plan, write the result, and say by the exit code how it went.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<u8> {
    let text = read(&arguments.file)
        .with_context(|| format!("cannot read {}", arguments.file.display()))?;
    let rules = planner::rules(Limits::default());
    let rules = match &arguments.terrain_dir {
        Some(directory) => rules.with_datasets(Arc::new(Mounted::open(directory)?)),
        None => rules,
    };
    let scenario = match json::read(&text, &rules, draw_seed()).and_then(without_a_store) {
        Ok(scenario) => scenario,
        Err(refusal) => {
            report(&arguments.file, &refusal);
            return Ok(exit::BAD_INPUT);
        }
    };

    let stop = Interrupt::watch()?;
    let mut progress = Progress::new(scenario.planner.iterations);
    let outcome = planner::plan(&scenario, &mut progress, &stop);
    progress.finish(&outcome);

    let document = document(&scenario, &outcome, stop.elapsed_ms(), arguments.format());
    write(arguments.out.as_deref(), &document).context("cannot write the result")?;
    Ok(if outcome.feasible {
        exit::DONE
    } else {
        exit::INFEASIBLE
    })
}

/// No plans are kept here that a route could be taken from.
fn without_a_store(scenario: Scenario) -> Result<Scenario, Refusal> {
    match &scenario.planner.warm_start {
        Some(WarmStart::Plan(id)) => {
            let why = "only the service keeps plans: give waypoints in its place";
            Err(Refusal::Invalid(vec![Fault::unknown_plan(id, why)]))
        }
        _ => Ok(scenario),
    }
}

fn read(file: &Path) -> io::Result<Vec<u8>> {
    if file == Path::new("-") {
        let mut text = Vec::new();
        io::stdin().lock().read_to_end(&mut text)?;
        return Ok(text);
    }
    fs::read(file)
}

fn write(out: Option<&Path>, document: &str) -> io::Result<()> {
    match out {
        Some(file) => fs::write(file, format!("{document}\n")),
        None => writeln!(io::stdout().lock(), "{document}"),
    }
}

fn document(scenario: &Scenario, outcome: &Outcome, run_ms: f64, format: &Format) -> String {
    let accepted = json::write(scenario);
    let origin = Origin {
        plan_id: None,
        algorithm: scenario.planner.algorithm.clone(),
        seed: scenario.planner.seed,
        scenario_sha256: sha256_hex(accepted.as_bytes()),
        timing: Timing {
            queued_ms: 0.0,
            run_ms,
        },
    };
    let result = ResultDocument::new(outcome, origin).to_json();
    match format.write {
        None => result,
        Some(write) => write(&ResultInput {
            result: &result,
            scenario: &accepted,
        }),
    }
}

/// The faults that the service would answer with, a line each.
pub(super) fn report(file: &Path, refusal: &Refusal) {
    let file = file.display();
    match refusal {
        Refusal::Syntax { .. } => eprintln!("{file} is not JSON: {refusal}"),
        Refusal::Invalid(_) => eprintln!("{file} cannot be planned:\n{refusal}"),
    }
}

/// Ctrl-C ends the search with the best route so far; a second one ends the process.
struct Interrupt {
    requested: Arc<AtomicBool>,
    begun: Instant,
}

impl Interrupt {
    fn watch() -> anyhow::Result<Self> {
        let requested = Arc::new(AtomicBool::new(false));
        let flag = requested.clone();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .build()?;
        std::thread::Builder::new()
            .name("interrupt".to_owned())
            .spawn(move || {
                runtime.block_on(async {
                    if tokio::signal::ctrl_c().await.is_err() {
                        return;
                    }
                    flag.store(true, Ordering::Relaxed);
                    if tokio::signal::ctrl_c().await.is_ok() {
                        std::process::exit(exit::FAILED.into());
                    }
                });
            })?;
        Ok(Self {
            requested,
            begun: Instant::now(),
        })
    }
}

impl Stop for Interrupt {
    fn requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }

    fn elapsed_ms(&self) -> f64 {
        self.begun.elapsed().as_secs_f64() * 1e3
    }
}

/// A bar on a terminal, nothing elsewhere.
struct Progress {
    bar: ProgressBar,
}

impl Progress {
    fn new(iterations: usize) -> Self {
        if !io::stderr().is_terminal() {
            return Self {
                bar: ProgressBar::hidden(),
            };
        }
        let style = ProgressStyle::with_template("{bar:40} {pos}/{len} iterations, {msg}")
            .expect("the template is well-formed");
        let bar = ProgressBar::new(iterations as u64).with_style(style);
        Self {
            bar: bar.with_message("no feasible route yet"),
        }
    }

    fn finish(&self, outcome: &Outcome) {
        self.bar.finish_and_clear();
        if io::stderr().is_terminal() {
            eprintln!("{}", summary(outcome));
        }
    }
}

impl Observer for Progress {
    fn iteration(&mut self, point: &ConvergencePoint) {
        self.bar.set_position(point.iteration as u64);
    }

    fn incumbent(&mut self, incumbent: &Incumbent) {
        if incumbent.feasible {
            self.bar.set_message(format!("cost {:.4}", incumbent.cost));
        }
    }
}

fn summary(outcome: &Outcome) -> String {
    if outcome.feasible {
        let legs = outcome.legs.len();
        format!(
            "a feasible route of {legs} legs, cost {:.4}",
            outcome.cost.total
        )
    } else {
        let violations = outcome.violations.len();
        format!("no feasible route; the least violating one breaks {violations} constraints")
    }
}
