//! A day's load for a while: whether plans wait as long as the model of `docs/OPERATIONS.md` says.
//!
//! Plans come at random, evenly spread (a Poisson process); each takes the same time; workers take the
//! oldest. The mean wait of such a queue is half that of one with exponential times (Erlang C), about.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use tokio::task::JoinSet;

use super::Arguments;
use super::work::{Nodes, submission};
use crate::cli::bench::table::{Cell, Table};
use crate::store::{ListQuery, Store as _};

/// Peak of a day over its mean.
const PEAK: f64 = 3.0;

/// Seconds of a day.
const DAY_S: f64 = 86_400.0;

pub(super) async fn measure(arguments: &Arguments) -> anyhow::Result<Table> {
    let rate = PEAK * f64::from(arguments.daily) / DAY_S;
    let arrivals = arrivals(rate, arguments.time_s.into());
    let plans = u32::try_from(arrivals.len()).unwrap_or(u32::MAX);
    let workers = arguments.workers;
    let nodes = Nodes::open(arguments.settings()?, workers, arguments.slots).await?;
    let front = nodes.front();
    let offered = tokio::spawn({
        let front = Arc::clone(&front);
        async move {
            let began = Instant::now();
            let mut posts = JoinSet::new();
            for due in arrivals {
                tokio::time::sleep(due.saturating_sub(began.elapsed())).await;
                let front = Arc::clone(&front);
                posts.spawn(async move { front.submit(submission()).await.map(drop) });
            }
            while let Some(post) = posts.join_next().await {
                post??;
            }
            anyhow::Ok(())
        }
    });
    nodes.run(plans, arguments.job()).await?;
    offered.await??;
    let all = ListQuery {
        limit: usize::MAX,
        ..ListQuery::default()
    };
    let mut waits_ms: Vec<f64> = Vec::new();
    for plan in front.list(all).await? {
        if let Some(started_ms) = plan.started_ms {
            waits_ms.push((started_ms - plan.created_ms) as f64);
        }
    }
    waits_ms.sort_by(f64::total_cmp);
    nodes.remove().await?;
    let mean = waits_ms.iter().sum::<f64>() / waits_ms.len().max(1) as f64;
    let p99 = waits_ms
        .get(waits_ms.len().saturating_sub(1) * 99 / 100)
        .copied();
    let busy = rate * arguments.job().as_secs_f64();
    let model_ms = mean_wait(workers, busy) * arguments.job().as_secs_f64() * 1e3;
    Ok(Table {
        name: "load",
        title: "Waiting".to_owned(),
        note: format!(
            "{} plans a day, at {PEAK} times their mean rate, each asleep for {} ms; the model is that of \
             docs/OPERATIONS.md.",
            arguments.daily, arguments.job_ms
        ),
        columns: vec![
            "plans/s",
            "workers",
            "used",
            "mean wait ms",
            "model ms",
            "99 % ms",
        ],
        rows: vec![vec![
            Cell::number(Some(rate), 1),
            Cell::count(workers.into()),
            Cell::Share(busy / f64::from(workers)),
            Cell::number(Some(mean), 1),
            Cell::number(Some(model_ms), 1),
            Cell::number(p99, 0),
        ]],
    })
}

/// When plans come within a time, `rate` a second; the same at each measurement.
fn arrivals(rate: f64, time_s: f64) -> Vec<Duration> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut at = 0.0;
    let times = std::iter::from_fn(|| {
        at -= libm::log(1.0 - random.random::<f64>()) / rate;
        (at < time_s).then(|| Duration::from_secs_f64(at))
    });
    times.collect()
}

/// Mean wait in units of the time that a job takes, for `workers` of which `busy` are needed on
/// average: half of Erlang's for exponential times. Infinite when more are needed than there are.
fn mean_wait(workers: u16, busy: f64) -> f64 {
    let count = f64::from(workers);
    if busy >= count {
        return f64::INFINITY;
    }
    // Erlang B by its recursion, then C.
    let blocked = (1..=workers).fold(1.0, |blocked, k| {
        busy * blocked / (f64::from(k) + busy * blocked)
    });
    let waits = blocked * count / (count - busy * (1.0 - blocked));
    0.5 * waits / (count - busy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_queue_model_matches_the_known_formula_for_one_worker() {
        // M/D/1: rho / (2 (1 - rho)).
        for busy in [0.1, 0.5, 0.9] {
            assert!((mean_wait(1, busy) - busy / (2.0 * (1.0 - busy))).abs() < 1e-12);
        }
        assert!(mean_wait(4, 4.0).is_infinite());
        assert!(mean_wait(16, 8.0) < mean_wait(8, 7.0));
    }
}
