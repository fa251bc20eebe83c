//! `noctule bench quality`: how near the planner's default settings come to the best known routes.

use clap::Args;
use serde_json::{Value, json};

use super::Common;
use super::case::{BEST_KNOWN_WAYPOINTS, Case};
use super::progress;
use super::report::Report;
use super::summary::mean;
use super::table::{Cell, Table};
use super::trial::{self, Trial};

#[derive(Args)]
pub(in crate::cli) struct Arguments {
    #[command(flatten)]
    pub(super) common: Common,
    /// Runs of each scenario and N, with the seeds 1, 2, ...
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    seeds: u64,
    /// Numbers N of free waypoints
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = [3, 5, 10, 20, 40, 60])]
    waypoints: Vec<usize>,
    /// Members of the population [default: the planner's]
    #[arg(long)]
    population: Option<usize>,
    /// Iterations [default: the planner's]
    #[arg(long)]
    iterations: Option<usize>,
}

impl Arguments {
    /// Only what the caller specifies: the rest is the planner's own default.
    fn planner(&self, waypoints: usize, seed: u64) -> Value {
        let mut planner = json!({"waypoints": waypoints, "seed": seed});
        if let Some(population) = self.population {
            planner["population"] = population.into();
        }
        if let Some(iterations) = self.iterations {
            planner["iterations"] = iterations.into();
        }
        planner
    }
}

/// The runs of one scenario and N.
struct Runs<'c> {
    case: &'c Case,
    waypoints: usize,
    trials: Vec<Trial>,
}

/// Run every scenario with every N and seed.
pub(super) fn measure(arguments: &Arguments, cases: &[Case]) -> anyhow::Result<Report> {
    let seeds = usize::try_from(arguments.seeds).expect("the range of the argument fits");
    let bar = progress::bar(cases.len() * arguments.waypoints.len() * seeds);
    let mut all = Vec::new();
    for case in cases {
        for &waypoints in &arguments.waypoints {
            bar.set_message(format!("{}, N = {waypoints}", case.name));
            let run = |seed| -> anyhow::Result<Trial> {
                let trial = trial::run(&case.with(&arguments.planner(waypoints, seed))?);
                bar.inc(1);
                Ok(trial)
            };
            all.push(Runs {
                case,
                waypoints,
                trials: (1..=arguments.seeds).map(run).collect::<Result<_, _>>()?,
            });
        }
    }
    bar.finish_and_clear();
    Ok(Report {
        title: "Quality with default settings".to_owned(),
        intro: format!(
            "Seeds 1 to {}, and the planner's defaults{}. A gap is what a feasible run costs beyond the reference, in per cent. \
             With N = {BEST_KNOWN_WAYPOINTS} the reference of a shipped scenario is the best route known; for other N, whose altitude cost \
             is a sum over other waypoints, and for other scenarios it is the best of all runs in the row (marked *), so those gaps tell \
             how much runs differ rather than how far off they all are. The proven gap is against the result's own lower bound \
             and holds for any N. CPU is the processor's time of a whole plan, in milliseconds.",
            arguments.seeds,
            changed(arguments)
        ),
        tables: vec![table(&all)],
        raw: vec![raw(&all)],
        drawings: Vec::new(),
    })
}

fn changed(arguments: &Arguments) -> String {
    let population = arguments
        .population
        .map(|size| format!(", but for a population of {size}"));
    let iterations = arguments
        .iterations
        .map(|size| format!(", but for {size} iterations"));
    population.unwrap_or_default() + &iterations.unwrap_or_default()
}

impl Runs<'_> {
    fn best(&self) -> Option<f64> {
        self.trials.iter().filter_map(Trial::cost).reduce(f64::min)
    }

    fn best_known(&self) -> Option<f64> {
        self.case
            .best_known
            .filter(|_| self.waypoints == BEST_KNOWN_WAYPOINTS)
    }

    /// The cost from which the gaps are measured.
    fn reference(&self) -> Option<f64> {
        let known = self.best_known().into_iter();
        known.chain(self.best()).reduce(f64::min)
    }

    /// The gaps of feasible runs.
    fn gaps(&self) -> Vec<f64> {
        let costs = self.trials.iter().filter_map(Trial::cost);
        let Some(reference) = self.reference() else {
            return Vec::new();
        };
        costs.map(|cost| cost / reference - 1.0).collect()
    }
}

fn table(all: &[Runs]) -> Table {
    let rows = all.iter().map(|runs| {
        let gaps = runs.gaps();
        let proven: Vec<f64> = runs.trials.iter().filter_map(|trial| trial.gap).collect();
        let times: Vec<f64> = runs.trials.iter().map(|trial| trial.cpu_ms).collect();
        let percent = |share: Option<f64>| Cell::number(share.map(|share| share * 100.0), 3);
        let mark = if runs.best_known().is_some() { "" } else { "*" };
        vec![
            Cell::text(&runs.case.name),
            Cell::count(runs.waypoints),
            Cell::Share(gaps.len() as f64 / runs.trials.len() as f64),
            Cell::number(runs.reference(), 4),
            Cell::text(mark),
            Cell::number(runs.best(), 4),
            percent(mean(&gaps)),
            percent(gaps.iter().copied().reduce(f64::max)),
            percent(mean(&proven)),
            percent(proven.iter().copied().reduce(f64::max)),
            Cell::number(mean(&times), 1),
            Cell::number(times.iter().copied().reduce(f64::max), 1),
        ]
    });
    Table {
        name: "gaps",
        title: "Gaps".to_owned(),
        note: "* the reference is the best run of the row itself.".to_owned(),
        columns: vec![
            "scenario",
            "N",
            "feasible",
            "reference",
            "*",
            "best",
            "mean gap %",
            "worst gap %",
            "proven gap %, mean",
            "proven gap %, worst",
            "CPU ms, mean",
            "CPU ms, most",
        ],
        rows: rows.collect(),
    }
}

fn raw(all: &[Runs]) -> Table {
    let rows = all.iter().flat_map(|runs| {
        runs.trials.iter().map(|trial| {
            let mut row = vec![Cell::text(&runs.case.name), Cell::count(runs.waypoints)];
            row.extend(trial.cells());
            row
        })
    });
    Table {
        name: "runs",
        title: "Runs".to_owned(),
        note: "Every run.".to_owned(),
        columns: [&["scenario", "N"], &Trial::COLUMNS[..]].concat(),
        rows: rows.collect(),
    }
}
