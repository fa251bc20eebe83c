//! One run of the planner, and the figures kept of it.

use std::cmp::Ordering;

use super::clock::Stopwatch;
use super::table::Cell;
use crate::optimizer::Fitness;
use crate::planner::{self, Nobody};
use crate::scenario::Scenario;

/// The figures kept of a run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trial {
    pub(super) seed: u64,
    pub(super) feasible: bool,
    /// Total violation and cost, for ranking.
    pub(super) fitness: Fitness,
    /// The proven gap; none without a feasible route.
    pub(super) gap: Option<f64>,
    pub(super) evaluations: u64,
    /// Processor time, milliseconds; smoothing and certificate included.
    pub(super) cpu_ms: f64,
    /// Cost of the best feasible route after each iteration, the first evaluation included.
    pub(super) curve: Vec<Option<f64>>,
}

impl Trial {
    /// Headings of [`Trial::cells`].
    pub(super) const COLUMNS: [&str; 7] = [
        "seed",
        "is_feasible",
        "cost",
        "violation",
        "proven_gap",
        "evaluations",
        "CPU ms",
    ];

    /// A row of a table of runs.
    pub(super) fn cells(&self) -> [Cell; 7] {
        [
            Cell::Number(self.seed as f64, 0),
            Cell::text(self.feasible.to_string()),
            Cell::Number(self.fitness.cost, 4),
            Cell::Number(self.fitness.violation, 4),
            Cell::number(self.gap, 6),
            Cell::Number(self.evaluations as f64, 0),
            Cell::Number(self.cpu_ms, 3),
        ]
    }

    /// Its cost; none without a feasible route.
    pub(super) fn cost(&self) -> Option<f64> {
        self.feasible.then_some(self.fitness.cost)
    }

    /// Deb's rule; better is less.
    pub(super) fn rank(&self, other: &Self) -> Ordering {
        self.fitness.rank(&other.fitness)
    }
}

/// Plan `scenario`.
pub(super) fn run(scenario: &Scenario) -> Trial {
    let watch = Stopwatch::start();
    let outcome = planner::plan(scenario, &mut Nobody, &Nobody);
    let cpu_ms = watch.seconds() * 1e3;
    let violation = outcome
        .violations
        .iter()
        .map(|violation| violation.amount)
        // From 0, since a sum of nothing is -0.
        .fold(0.0, |sum, amount| sum + amount);
    Trial {
        seed: scenario.planner.seed,
        feasible: outcome.feasible,
        fitness: Fitness {
            violation,
            cost: outcome.cost.total,
        },
        gap: outcome.bound.gap,
        evaluations: outcome.evaluations,
        cpu_ms,
        curve: outcome
            .convergence
            .iter()
            .map(|point| point.best_cost)
            .collect(),
    }
}
