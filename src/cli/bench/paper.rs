//! `noctule bench paper`: every algorithm from a random start, as the paper compares them.

use clap::Args;
use indicatif::ProgressBar;
use serde_json::{Value, json};

use super::Common;
use super::case::Case;
use super::chart::{self, Curve};
use super::progress;
use super::rank_sum::rank_sum;
use super::report::{Drawing, Report};
use super::summary::{Summary, median};
use super::table::{Cell, Table};
use super::trial::{self, Trial};
use crate::optimizer;

#[derive(Args)]
pub(in crate::cli) struct Arguments {
    #[command(flatten)]
    pub(super) common: Common,
    /// Runs of each setting, with the seeds 1, 2, ...
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    seeds: u64,
    /// Members of a population; one table also has a quarter, half and twice as many
    #[arg(long, default_value_t = 200)]
    population: usize,
    /// Iterations; one table also has a quarter, half and twice as many
    #[arg(long, default_value_t = 200)]
    iterations: usize,
    /// Free waypoints N; one table also has half, twice and three times as many
    #[arg(long, default_value_t = 10)]
    waypoints: usize,
}

/// The algorithm that all others are compared with.
const REFERENCE: &str = "tms-sba";

/// Its variants in the ablation table: a constant, and its value.
const ABLATIONS: [(&str, f64); 4] = [
    ("truncation", 0.0),
    ("truncation", 0.8),
    ("expansion", 1.0),
    ("expansion", 10.0),
];

/// How to plan, except for the seed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Setting {
    algorithm: &'static str,
    /// A constant of the algorithm that differs from its default.
    constant: Option<(&'static str, f64)>,
    waypoints: usize,
    population: usize,
    iterations: usize,
}

impl Setting {
    fn label(&self) -> String {
        match self.constant {
            None => self.algorithm.to_owned(),
            Some((name, value)) => format!("{}, {name} {value}", self.algorithm),
        }
    }

    fn planner(&self, seed: u64) -> Value {
        let mut planner = json!({
            "algorithm": self.algorithm,
            "waypoints": self.waypoints,
            "population": self.population,
            "iterations": self.iterations,
            "seed": seed,
            "seeding": "random",
            "polish": false,
        });
        if let Some((name, value)) = self.constant {
            planner["parameters"] = json!({name: value});
        }
        planner
    }
}

/// A table: groups of settings, each compared with the first of its group.
struct Experiment {
    name: &'static str,
    title: &'static str,
    note: &'static str,
    /// The column that distinguishes the groups.
    axis: Option<&'static str>,
    groups: Vec<(usize, Vec<Setting>)>,
}

/// Every setting that was run, and for each case its trials by seed.
struct Runs {
    settings: Vec<Setting>,
    trials: Vec<Vec<Vec<Trial>>>,
}

impl Runs {
    fn of(&self, case_idx: usize, setting: &Setting) -> &[Trial] {
        let idx = self.settings.iter().position(|known| known == setting);
        &self.trials[idx.expect("every setting of an experiment was run")][case_idx]
    }
}

/// Run everything that the tables need, each setting once.
pub(super) fn measure(arguments: &Arguments, cases: &[Case]) -> anyhow::Result<Report> {
    let base = Setting {
        algorithm: REFERENCE,
        constant: None,
        waypoints: arguments.waypoints,
        population: arguments.population,
        iterations: arguments.iterations,
    };
    let experiments = experiments(&base);
    let mut settings: Vec<Setting> = Vec::new();
    for (_, group) in experiments.iter().flat_map(|experiment| &experiment.groups) {
        for setting in group {
            if !settings.contains(setting) {
                settings.push(*setting);
            }
        }
    }
    let seeds = usize::try_from(arguments.seeds).expect("the range of the argument fits");
    let bar = progress::bar(settings.len() * cases.len() * seeds);
    let mut trials = Vec::new();
    for setting in &settings {
        bar.set_message(setting.label());
        let of_case = |case| run_seeds(case, setting, arguments.seeds, &bar);
        trials.push(cases.iter().map(of_case).collect::<anyhow::Result<_>>()?);
    }
    bar.finish_and_clear();
    let runs = Runs { settings, trials };
    let tables = experiments
        .iter()
        .map(|experiment| table(experiment, cases, &runs));
    Ok(Report {
        title: "The algorithms compared".to_owned(),
        intro: format!(
            "Population {}, {} iterations, N = {} where no table says otherwise; seeds 1 to {}. Every run starts at random and is not \
             polished. Costs are the exact integral along the route and those of feasible runs only; std is their sample \
             deviation. CPU is the processor's time of a whole plan, smoothing and certificate included, in milliseconds. p is the \
             two-sided Wilcoxon rank-sum test against {REFERENCE} of the same setting, over all runs ranked by violation, then cost; \
             wins is the share of pairs of runs in which the one in this row ranks before {REFERENCE}'s.",
            base.population, base.iterations, base.waypoints, arguments.seeds
        ),
        tables: tables.collect(),
        raw: vec![raw(cases, &runs)],
        drawings: drawings(cases, &runs, &base),
    })
}

fn run_seeds(
    case: &Case,
    setting: &Setting,
    seeds: u64,
    bar: &ProgressBar,
) -> anyhow::Result<Vec<Trial>> {
    let run = |seed| {
        let trial = trial::run(&case.with(&setting.planner(seed))?);
        bar.inc(1);
        Ok(trial)
    };
    (1..=seeds).map(run).collect()
}

/// The setting under every algorithm, [`REFERENCE`] first.
fn by_algorithm(base: &Setting) -> Vec<Setting> {
    let others = optimizer::ALL
        .iter()
        .map(|algorithm| algorithm.name)
        .filter(|name| *name != REFERENCE);
    std::iter::once(REFERENCE)
        .chain(others)
        .map(|algorithm| Setting { algorithm, ..*base })
        .collect()
}

fn experiments(base: &Setting) -> Vec<Experiment> {
    let groups = |sizes: Vec<usize>, set: fn(&mut Setting, usize)| {
        let group = |size: usize| {
            let mut setting = *base;
            set(&mut setting, size);
            (size, by_algorithm(&setting))
        };
        sizes.into_iter().map(group).collect::<Vec<_>>()
    };
    let ablations = ABLATIONS.map(|constant| Setting {
        constant: Some(constant),
        ..*base
    });
    let sba = Setting {
        algorithm: "sba",
        ..*base
    };
    vec![
        Experiment {
            name: "algorithms",
            title: "Algorithms",
            note: "All algorithms under the same setting.",
            axis: None,
            groups: groups(vec![base.waypoints], |_, _| ()),
        },
        Experiment {
            name: "iterations",
            title: "By iterations",
            note: "Each row is a search of its own that knows how long it will be, not the beginning of a longer one.",
            axis: Some("iterations"),
            groups: groups(scaled(base.iterations, 1), |setting, size| {
                setting.iterations = size;
            }),
        },
        Experiment {
            name: "population",
            title: "By population",
            note: "The iterations stay the same, so that the evaluations grow with the population.",
            axis: Some("population"),
            groups: groups(scaled(base.population, 2), |setting, size| {
                setting.population = size;
            }),
        },
        Experiment {
            name: "waypoints",
            title: "By waypoints",
            note: "The altitude cost is a sum over waypoints, so costs of different N are not of the same route.",
            axis: Some("N"),
            groups: groups(
                distinct([
                    base.waypoints / 2,
                    base.waypoints,
                    2 * base.waypoints,
                    3 * base.waypoints,
                ]),
                |setting, size| setting.waypoints = size,
            ),
        },
        Experiment {
            name: "ablation",
            title: "What the truncated mean adds",
            note: "sba is tms-sba without the truncated mean and the re-initialisation; truncation is the share of bats left out of the \
                   mean (0.4), expansion the widening of a stagnant swarm (1.5; 1 is none).",
            axis: None,
            groups: vec![(
                base.waypoints,
                [*base, sba].into_iter().chain(ablations).collect(),
            )],
        },
    ]
}

/// A quarter, a half, once and twice of `size`, at least `least`.
fn scaled(size: usize, least: usize) -> Vec<usize> {
    distinct([(size / 4).max(least), (size / 2).max(least), size, 2 * size])
}

fn distinct<const COUNT: usize>(sizes: [usize; COUNT]) -> Vec<usize> {
    let mut sizes: Vec<usize> = sizes.into_iter().filter(|size| *size > 0).collect();
    sizes.dedup();
    sizes
}

fn table(experiment: &Experiment, cases: &[Case], runs: &Runs) -> Table {
    let mut columns = vec!["scenario"];
    columns.extend(experiment.axis);
    columns.extend([
        "algorithm",
        "mean",
        "std",
        "worst",
        "best",
        "feasible",
        "CPU ms",
        "p",
        "wins",
    ]);
    let mut rows = Vec::new();
    for (case_idx, case) in cases.iter().enumerate() {
        for (size, group) in &experiment.groups {
            let reference = runs.of(case_idx, &group[0]);
            for (idx, setting) in group.iter().enumerate() {
                let trials = runs.of(case_idx, setting);
                let mut row = vec![Cell::text(&case.name)];
                row.extend(experiment.axis.map(|_| Cell::count(*size)));
                row.push(Cell::text(setting.label()));
                row.extend(figures(trials, (idx > 0).then_some(reference)));
                rows.push(row);
            }
        }
    }
    Table {
        name: experiment.name,
        title: experiment.title.to_owned(),
        note: experiment.note.to_owned(),
        columns,
        rows,
    }
}

fn figures(trials: &[Trial], reference: Option<&[Trial]>) -> Vec<Cell> {
    let summary = Summary::of(trials);
    let test = reference.map(|reference| rank_sum(trials, reference, Trial::rank));
    vec![
        Cell::number(summary.mean, 2),
        Cell::number(summary.deviation, 2),
        Cell::number(summary.worst, 2),
        Cell::number(summary.best, 2),
        Cell::Share(summary.feasible),
        Cell::Number(summary.cpu_ms, 1),
        test.map_or(Cell::Missing, |test| Cell::Probability(test.p)),
        test.map_or(Cell::Missing, |test| Cell::Share(test.wins)),
    ]
}

/// Every run.
fn raw(cases: &[Case], runs: &Runs) -> Table {
    let mut rows = Vec::new();
    for (case_idx, case) in cases.iter().enumerate() {
        for setting in &runs.settings {
            for trial in runs.of(case_idx, setting) {
                rows.push(vec![
                    Cell::text(&case.name),
                    Cell::text(setting.label()),
                    Cell::count(setting.waypoints),
                    Cell::count(setting.population),
                    Cell::count(setting.iterations),
                    Cell::Number(trial.seed as f64, 0),
                    Cell::text(trial.feasible.to_string()),
                    Cell::Number(trial.fitness.cost, 4),
                    Cell::Number(trial.fitness.violation, 4),
                    Cell::Number(trial.evaluations as f64, 0),
                    Cell::Number(trial.cpu_ms, 3),
                ]);
            }
        }
    }
    Table {
        name: "runs",
        title: "Runs".to_owned(),
        note: "Every run.".to_owned(),
        columns: vec![
            "scenario",
            "algorithm",
            "N",
            "population",
            "iterations",
            "seed",
            "is_feasible",
            "cost",
            "violation",
            "evaluations",
            "CPU ms",
        ],
        rows,
    }
}

fn drawings(cases: &[Case], runs: &Runs, base: &Setting) -> Vec<Drawing> {
    let drawing = |(case_idx, case): (usize, &Case)| {
        let curves: Vec<Curve> = by_algorithm(base)
            .iter()
            .map(|setting| Curve {
                name: setting.label(),
                values: middle_curve(runs.of(case_idx, setting)),
            })
            .collect();
        let caption = format!(
            "{}: cost of the best feasible route, median of the runs",
            case.name
        );
        Drawing {
            name: case.name.clone(),
            svg: chart::draw(&caption, &curves),
            caption,
        }
    };
    cases.iter().enumerate().map(drawing).collect()
}

/// The median of the runs after each iteration; none while half of them are infeasible.
fn middle_curve(trials: &[Trial]) -> Vec<Option<f64>> {
    let length = trials.iter().map(|trial| trial.curve.len()).max();
    (0..length.unwrap_or(0))
        .map(|iteration| {
            let costs = trials
                .iter()
                .map(|trial| trial.curve.get(iteration).copied().flatten())
                .map(|cost| cost.unwrap_or(f64::INFINITY));
            median(costs.collect()).filter(|cost| cost.is_finite())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_distinct_and_valid() {
        assert_eq!(scaled(200, 2), [50, 100, 200, 400]);
        assert_eq!(scaled(2, 2), [2, 4]);
        assert_eq!(distinct([0, 1, 2, 3]), [1, 2, 3]);
    }

    #[test]
    fn every_group_starts_with_its_reference() {
        let base = Setting {
            algorithm: REFERENCE,
            constant: None,
            waypoints: 10,
            population: 20,
            iterations: 30,
        };
        for experiment in experiments(&base) {
            for (_, group) in &experiment.groups {
                assert_eq!(group[0].algorithm, REFERENCE, "{}", experiment.name);
                assert_eq!(group[0].constant, None, "{}", experiment.name);
                assert!(group.len() >= 6, "{}", experiment.name);
            }
        }
    }
}
