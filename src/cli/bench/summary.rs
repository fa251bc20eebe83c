//! Summarises many runs.

use super::trial::Trial;

/// Figures of the runs of one setting. Costs are those of the feasible runs; none without any.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Summary {
    pub(super) mean: Option<f64>,
    /// Sample deviation; none for a single run.
    pub(super) deviation: Option<f64>,
    pub(super) best: Option<f64>,
    pub(super) worst: Option<f64>,
    /// Share of the runs that ended with a feasible route.
    pub(super) feasible: f64,
    /// Mean of all runs, milliseconds.
    pub(super) cpu_ms: f64,
}

impl Summary {
    pub(super) fn of(trials: &[Trial]) -> Self {
        let costs: Vec<f64> = trials.iter().filter_map(Trial::cost).collect();
        let mean = mean(&costs);
        Self {
            mean,
            deviation: mean
                .filter(|_| costs.len() > 1)
                .map(|mean| deviation(&costs, mean)),
            best: costs.iter().copied().reduce(f64::min),
            worst: costs.iter().copied().reduce(f64::max),
            feasible: costs.len() as f64 / trials.len() as f64,
            cpu_ms: trials.iter().map(|trial| trial.cpu_ms).sum::<f64>() / trials.len() as f64,
        }
    }
}

/// `None` for an empty list.
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn deviation(values: &[f64], mean: f64) -> f64 {
    let squares: f64 = values
        .iter()
        .map(|value| (value - mean) * (value - mean))
        .sum();
    (squares / (values.len() - 1) as f64).sqrt()
}

/// The middle value, the lower one of two; infinities take part.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len().checked_sub(1)? / 2;
    Some(values[middle])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimizer::Fitness;

    fn trial(cost: f64, violation: f64) -> Trial {
        Trial {
            seed: 1,
            feasible: violation <= 0.0,
            fitness: Fitness { violation, cost },
            gap: None,
            evaluations: 1,
            cpu_ms: cost,
            curve: Vec::new(),
        }
    }

    #[test]
    fn costs_are_summarised_over_feasible_runs_only() {
        let runs = [(2.0, 0.0), (4.0, 0.0), (1.0, 3.0), (9.0, 0.0)];
        let runs = runs.map(|(cost, violation)| trial(cost, violation));
        let summary = Summary::of(&runs);
        assert_eq!(summary.mean, Some(5.0));
        // ((2-5)^2 + (4-5)^2 + (9-5)^2) / 2 = 13.
        assert_eq!(summary.deviation, Some(13.0_f64.sqrt()));
        assert_eq!((summary.best, summary.worst), (Some(2.0), Some(9.0)));
        assert!((summary.feasible - 0.75).abs() < 1e-12);
        assert!((summary.cpu_ms - 4.0).abs() < 1e-12);

        let none = Summary::of(&runs[2..3]);
        assert_eq!((none.mean, none.deviation, none.best), (None, None, None));
    }

    #[test]
    fn a_median_is_one_of_the_values() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![f64::INFINITY, 4.0]), Some(4.0));
        assert_eq!(median(Vec::new()), None);
    }
}
