//! `noctule bench random`: the planner's default settings on scenarios that it was not tuned for.

mod family;
mod scene;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use clap::builder::PossibleValuesParser;
use serde_json::{Value, json};

use super::case::Case;
use super::report::Report;
use super::summary::{mean, median};
use super::table::{Cell, Table};
use super::trial::{self, Trial};
use super::{Output, progress};
use family::{FAMILIES, Family};

/// A run that is farther from its reference than this is a miss.
const MISS: f64 = 0.01;

/// A proven gap of at most this is small.
const PROVEN: f64 = 0.02;

#[derive(Args)]
pub(in crate::cli) struct Arguments {
    #[command(flatten)]
    pub(super) output: Output,
    /// Families of scenarios [default: all]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = PossibleValuesParser::new(FAMILIES.map(|family| family.name)))]
    family: Vec<String>,
    /// Scenarios of each family
    #[arg(long, value_name = "COUNT", default_value_t = 40, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    scenarios: u64,
    /// Seed of the first scenario of each family; the others follow
    #[arg(long, value_name = "SEED", default_value_t = 1, value_parser = clap::value_parser!(u64).range(0..=1_000_000_000))]
    first: u64,
    /// Runs of each scenario, with the seeds 1, 2, ...
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    seeds: u64,
    /// Longer runs of each scenario, to find a good route to compare with
    #[arg(long, value_name = "COUNT", default_value_t = 4, value_parser = clap::value_parser!(u8).range(0..=4))]
    longer: u8,
    /// Directory in which to keep the scenario documents
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
}

/// The longer runs, as the planner's settings.
fn longer() -> [Value; 4] {
    [
        json!({"population": 400, "iterations": 400, "seed": 101}),
        json!({"population": 400, "iterations": 400, "seed": 102, "seeding": "random"}),
        json!({"population": 1000, "iterations": 100, "seed": 103}),
        json!({"population": 400, "iterations": 400, "seed": 104}),
    ]
}

/// The runs of one scenario.
struct Runs {
    family: &'static str,
    case: Case,
    waypoints: usize,
    trials: Vec<Trial>,
    /// Cost of the best feasible route of all runs, longer ones included.
    reference: Option<f64>,
}

/// Run every scenario with every seed, and the longer searches.
pub(super) fn measure(arguments: &Arguments) -> anyhow::Result<Report> {
    let asked = |family: &&Family| {
        let mut names = arguments.family.iter();
        arguments.family.is_empty() || names.any(|name| name == family.name)
    };
    let families: Vec<&Family> = FAMILIES.iter().filter(asked).collect();
    let seeds = arguments.first..arguments.first + arguments.scenarios;
    let count = usize::try_from(arguments.scenarios).expect("the range of the argument fits");
    let bar = progress::bar(families.len() * count);
    let mut all = Vec::new();
    for family in &families {
        for seed in seeds.clone() {
            bar.set_message(format!("{}-{seed}", family.name));
            let document = family.scenario(seed);
            if let Some(directory) = &arguments.keep {
                keep(directory, &document)?;
            }
            all.push(runs(family.name, document, arguments)?);
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    let last = seeds.end - 1;
    Ok(Report {
        title: "Quality on random scenarios".to_owned(),
        intro: format!(
            "Scenarios {} to {last} of each family, the planner's defaults with the seeds 1 to {}. A gap is what a feasible run costs beyond the \
             best route that these and {} longer runs found, in per cent: a way that none of them finds is not seen by it. The proven gap, \
             against the result's own lower bound, holds whatever nobody found. A scenario for which no run has a feasible route may have none. CPU is the processor's time of a whole \
             plan, in milliseconds.",
            arguments.first, arguments.seeds, arguments.longer
        ),
        tables: vec![table(&families, &all), misses(&all)],
        raw: vec![raw(&all)],
        drawings: Vec::new(),
    })
}

fn keep(directory: &Path, document: &Value) -> anyhow::Result<()> {
    let name = document["name"].as_str().expect("a drawn one has a name");
    let file = directory.join(format!("{name}.json"));
    fs::create_dir_all(directory)
        .and_then(|()| fs::write(&file, format!("{document:#}\n")))
        .with_context(|| format!("cannot write {}", file.display()))
}

fn runs(family: &'static str, document: Value, arguments: &Arguments) -> anyhow::Result<Runs> {
    let waypoints = document["planner"]["waypoints"].clone();
    let case = Case::drawn(document);
    let run = |mut planner: Value| -> anyhow::Result<Trial> {
        planner["waypoints"] = waypoints.clone();
        Ok(trial::run(&case.with(&planner)?))
    };
    let trials = (1..=arguments.seeds)
        .map(|seed| run(json!({"seed": seed})))
        .collect::<Result<Vec<_>, _>>()?;
    let longer = longer()
        .into_iter()
        .take(arguments.longer.into())
        .map(run)
        .collect::<Result<Vec<_>, _>>()?;
    let costs = trials.iter().chain(&longer).filter_map(Trial::cost);
    Ok(Runs {
        family,
        waypoints: case.as_it_is()?.planner.waypoints,
        reference: costs.reduce(f64::min),
        trials,
        case,
    })
}

impl Runs {
    /// What a feasible run costs beyond the reference.
    fn gap(&self, trial: &Trial) -> Option<f64> {
        Some(trial.cost()? / self.reference? - 1.0)
    }
}

fn table(families: &[&Family], all: &[Runs]) -> Table {
    let row = |family: &&Family| {
        let own = || all.iter().filter(|runs| runs.family == family.name);
        let solved = || own().filter(|runs| runs.reference.is_some());
        let trials =
            || solved().flat_map(|runs| runs.trials.iter().map(move |trial| (runs, trial)));
        let gaps: Vec<f64> = trials()
            .filter_map(|(runs, trial)| runs.gap(trial))
            .collect();
        let proven: Vec<f64> = trials().filter_map(|(_, trial)| trial.gap).collect();
        let times: Vec<f64> = trials().map(|(_, trial)| trial.cpu_ms).collect();
        let count =
            |values: &[f64], limit: f64| values.iter().filter(|&&value| value > limit).count();
        let percent =
            |share: Option<f64>, digits| Cell::number(share.map(|share| share * 100.0), digits);
        let share = |part: usize, whole: usize| {
            Cell::number((whole > 0).then(|| 100.0 * part as f64 / whole as f64), 1)
        };
        vec![
            Cell::text(format!("{}: {}", family.name, family.about)),
            Cell::count(own().count()),
            Cell::count(solved().count()),
            share(gaps.len(), times.len()),
            percent(mean(&gaps), 3),
            percent(gaps.iter().copied().reduce(f64::max), 2),
            share(count(&gaps, MISS), gaps.len()),
            percent(median(proven.clone()), 2),
            share(proven.len() - count(&proven, PROVEN), proven.len()),
            Cell::number(median(times.clone()), 1),
            Cell::number(times.iter().copied().reduce(f64::max), 0),
        ]
    };
    Table {
        name: "families",
        title: "Families".to_owned(),
        note: "Shares, gaps and times are of the runs of solved scenarios: those for which any run has a feasible route.".to_owned(),
        columns: vec![
            "family",
            "scenarios",
            "solved",
            "feasible %",
            "mean gap %",
            "worst gap %",
            "over 1 %, %",
            "proven gap %, median",
            "proven to 2 %, %",
            "CPU ms, median",
            "CPU ms, most",
        ],
        rows: families.iter().map(row).collect(),
    }
}

/// Results that are not as good as they should be, each by its name.
fn misses(all: &[Runs]) -> Table {
    let off = |runs: &&Runs| {
        let is_off = |trial: &Trial| runs.gap(trial).is_none_or(|gap| gap > MISS);
        runs.trials.iter().any(is_off)
    };
    let row = |runs: &Runs| {
        let gaps = runs.trials.iter().map(|trial| match runs.gap(trial) {
            Some(gap) => format!("{:.2}", gap * 100.0),
            None => "infeasible".to_owned(),
        });
        vec![
            Cell::text(&runs.case.name),
            Cell::count(runs.waypoints),
            Cell::number(runs.reference, 4),
            Cell::text(gaps.collect::<Vec<_>>().join(", ")),
        ]
    };
    Table {
        name: "misses",
        title: "Misses".to_owned(),
        note: "Scenarios with a run over 1 % or without a feasible route.".to_owned(),
        columns: vec!["scenario", "N", "reference", "gaps %, by seed"],
        rows: all.iter().filter(off).map(row).collect(),
    }
}

fn raw(all: &[Runs]) -> Table {
    let rows = all.iter().flat_map(|runs| {
        runs.trials.iter().map(|trial| {
            let mut row = vec![Cell::text(&runs.case.name), Cell::count(runs.waypoints)];
            row.extend(trial.cells());
            row.push(Cell::number(runs.reference, 4));
            row
        })
    });
    Table {
        name: "runs",
        title: "Runs".to_owned(),
        note: "Every run with default settings.".to_owned(),
        columns: [&["scenario", "N"], &Trial::COLUMNS[..], &["reference"]].concat(),
        rows: rows.collect(),
    }
}
