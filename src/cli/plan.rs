//! `noctule plan`: the service's engine on one scenario, without the service.

use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::files::{self, Choice};
use super::ground::Ground;
use super::{exit, export};
use crate::digest::sha256_hex;
use crate::export::document::{Origin, ResultDocument, Timing};
use crate::export::{ExportError, ResultInput};
use crate::job::draw_seed;
use crate::planner::{self, ConvergencePoint, Incumbent, Observer, Outcome, Stop};
use crate::scenario::json::{self, Fault, Refusal};
use crate::scenario::limits::Limits;
use crate::scenario::{Scenario, WarmStart};

#[derive(Args)]
pub(super) struct Arguments {
    /// Scenario document, or - for standard input
    file: PathBuf,
    /// File for the result, in the format of its extension; may be given several times, to write the
    /// one plan in several formats [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Vec<PathBuf>,
    #[command(flatten)]
    choice: Choice,
    #[command(flatten)]
    ground: Ground,
}

/// Plan and write the result; the exit code tells how it went.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<u8> {
    let outs: Vec<&Path> = arguments.out.iter().map(PathBuf::as_path).collect();
    let chosen = arguments.choice.of(&outs)?;
    let text = files::read(&arguments.file)?;
    let rules = arguments.ground.rules(Limits::default())?;
    let scenario = match json::read(&text, &rules, draw_seed()).and_then(without_a_store) {
        Ok(scenario) => scenario,
        Err(refusal) => {
            report(&arguments.file, &refusal);
            return Ok(exit::BAD_INPUT);
        }
    };

    // Reported before the search, not after it.
    let degrees = chosen.iter().find(|chosen| chosen.format.geodetic);
    if let (Some(chosen), None) = (degrees, scenario.frame.wgs84()) {
        let format = chosen.format.name;
        eprintln!(
            "{}: {}",
            arguments.file.display(),
            ExportError::NoGeodeticFrame { format }
        );
        return Ok(exit::BAD_INPUT);
    }

    let stop = Interrupt::watch()?;
    let mut progress = Progress::new(scenario.planner.iterations);
    let outcome = planner::plan(&scenario, &mut progress, &stop);
    progress.finish(&outcome);

    let accepted = json::write(&scenario);
    let result = document(&scenario, &accepted, &outcome, stop.elapsed_ms());
    let input = ResultInput {
        result: &result,
        scenario: &accepted,
        rules: &rules,
    };
    let mut code = if outcome.feasible {
        exit::DONE
    } else {
        exit::INFEASIBLE
    };
    for (position, chosen) in chosen.iter().enumerate() {
        match chosen.format.write(&input, &chosen.options) {
            Ok(document) => files::write(outs.get(position).copied(), &document)?,
            Err(error) => {
                let unwritten = outs.get(position).copied().unwrap_or(&arguments.file);
                eprintln!("{}: {error}", unwritten.display());
                code = export::code(&error);
            }
        }
    }
    Ok(code)
}

/// There is no store here from which a route could be taken.
fn without_a_store(scenario: Scenario) -> Result<Scenario, Refusal> {
    match &scenario.planner.warm_start {
        Some(WarmStart::Plan(id)) => {
            let why = "only the service keeps plans: give waypoints in its place";
            Err(Refusal::Invalid(vec![Fault::unknown_plan(id, why)]))
        }
        _ => Ok(scenario),
    }
}

fn document(scenario: &Scenario, accepted: &str, outcome: &Outcome, run_ms: f64) -> String {
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
    ResultDocument::new(outcome, origin).to_json()
}

/// Print the faults with which the service would answer, one line each.
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
