//! `noctule bench cluster`: the throughput of a NATS system, compared with a client that makes only the same calls, and
//! how many workers it keeps busy. Jobs sleep for a fixed time, so that a small machine can play many workers.

mod load;
mod raw;
mod work;

use std::time::Duration;

use anyhow::{Context as _, bail};
use clap::Args;
use uuid::Uuid;

use self::work::{CALLERS, Nodes, WORKERS};
use super::report::Report;
use super::summary::median;
use super::table::{Cell, Table};
use super::{Output, progress};
use crate::config::Address;
use crate::store::jetstream::Settings;

#[derive(Args)]
pub(in crate::cli) struct Arguments {
    /// Address of the servers; everything is written under its own namespace, which is removed at the end
    #[arg(long, value_name = "ADDRESS", default_value = "nats://127.0.0.1:4222")]
    store: String,
    /// Copies that the servers keep
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=5))]
    replicas: u8,
    /// Plans in each measurement of a rate
    #[arg(long, default_value_t = 1_000, value_parser = clap::value_parser!(u32).range(10..=1_000_000))]
    plans: u32,
    /// Measurements of each rate, alternating with those of the bare client; the median counts
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=100))]
    rounds: u16,
    /// Time that a job takes, milliseconds
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=60_000))]
    job_ms: u32,
    /// Workers in the last step; the steps before it have 1, 2, 4, ... workers
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..=256))]
    workers: u16,
    /// Workers on each node
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=256))]
    slots: u16,
    /// Plans a day, offered for a while at their peak rate, to compare the waiting time with the model
    #[arg(long, default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    daily: u32,
    /// How long they are offered, seconds
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    time_s: u32,
    #[command(flatten)]
    pub(super) output: Output,
}

impl Arguments {
    fn job(&self) -> Duration {
        Duration::from_millis(self.job_ms.into())
    }

    /// Settings for one measurement.
    fn settings(&self) -> anyhow::Result<Settings> {
        let Some(address) = Address::read(&self.store) else {
            bail!("--store {}: allowed is {}", self.store, Address::ALLOWED);
        };
        Ok(Settings {
            address: Address {
                namespace: format!("bench-{}", &Uuid::new_v4().simple().to_string()[..12]),
                ..address
            },
            credentials: None,
            replicas: self.replicas.into(),
            lease: Duration::from_secs(30),
            slots: self.slots.into(),
        })
    }
}

/// Measure all tables.
pub(super) fn measure(arguments: &Arguments) -> anyhow::Result<Report> {
    tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?
        .block_on(measure_all(arguments))
}

async fn measure_all(arguments: &Arguments) -> anyhow::Result<Report> {
    let steps = worker_counts(arguments.workers);
    let bar = progress::bar(2 * usize::from(arguments.rounds) + steps.len() + 1);
    let mut tables = Vec::new();
    let mut rates = Rates::default();
    for _ in 0..arguments.rounds {
        bar.set_message("the bare client");
        rates
            .bare
            .push(raw::measure(arguments.settings()?, arguments.plans).await?);
        bar.inc(1);
        bar.set_message("the store");
        rates
            .store
            .push(work::rates(arguments.settings()?, arguments.plans).await?);
        bar.inc(1);
    }
    tables.push(rates.table());
    let mut scaling = Vec::new();
    for workers in steps {
        bar.set_message(format!("{workers} workers"));
        scaling.push(scale(arguments, workers).await?);
        bar.inc(1);
    }
    tables.push(scaling_table(&scaling, arguments.job()));
    bar.set_message("a day's load");
    tables.push(load::measure(arguments).await?);
    bar.finish_and_clear();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    Ok(Report {
        title: "A NATS system under load".to_owned(),
        intro: format!(
            "`noctule bench cluster`, version {}, {} replica(s), {cores} cores that servers, nodes and bare client \
             share. Rates depend on the machine and its disk; ratios within a run hardly do.",
            env!("CARGO_PKG_VERSION"),
            arguments.replicas,
        ),
        tables,
        raw: Vec::new(),
        drawings: Vec::new(),
    })
}

/// 1, 2, 4, ... up to the most.
fn worker_counts(most: u16) -> Vec<u16> {
    let doubled = std::iter::successors(Some(1_u16), |count| count.checked_mul(2));
    let mut counts: Vec<_> = doubled.take_while(|count| *count < most).collect();
    counts.push(most);
    counts
}

/// How long all plans took to be accepted, and how long to be run.
#[derive(Debug, Clone, Copy)]
struct Took {
    accepting: Duration,
    running: Duration,
    plans: u32,
}

impl Took {
    fn accepted_per_s(self) -> f64 {
        f64::from(self.plans) / self.accepting.as_secs_f64()
    }

    fn end_to_end_per_s(self) -> f64 {
        f64::from(self.plans) / (self.accepting + self.running).as_secs_f64()
    }
}

#[derive(Default)]
struct Rates {
    bare: Vec<Took>,
    store: Vec<Took>,
}

impl Rates {
    fn table(&self) -> Table {
        let row = |what: &str, rate: fn(Took) -> f64| {
            let of = |all: &[Took]| median(all.iter().copied().map(rate).collect());
            let (bare, store) = (of(&self.bare), of(&self.store));
            vec![
                Cell::text(what),
                Cell::number(bare, 0),
                Cell::number(store, 0),
                Cell::number(store.zip(bare).map(|(store, bare)| store / bare), 2),
            ]
        };
        Table {
            name: "rates",
            title: "Plans a second".to_owned(),
            note: format!(
                "Beside a bare client that does the same calls. Callers: {CALLERS}; workers: {WORKERS}."
            ),
            columns: vec!["", "bare client", "store", "ratio"],
            rows: vec![
                row("accepted", Took::accepted_per_s),
                row("end to end", Took::end_to_end_per_s),
            ],
        }
    }
}

struct Scaled {
    workers: u16,
    plans_per_s: f64,
}

/// One step of the scale: `workers` workers, each job a sleep.
async fn scale(arguments: &Arguments, workers: u16) -> anyhow::Result<Scaled> {
    let settings = arguments.settings()?;
    let nodes = Nodes::open(settings, workers, arguments.slots).await?;
    // About six seconds of work, so that its beginning and end count little.
    let plans = (6_000 / arguments.job_ms).max(8) * u32::from(workers);
    nodes.accept(plans).await.context("accepting")?;
    let took = nodes.run(plans, arguments.job()).await.context("running")?;
    nodes.remove().await?;
    Ok(Scaled {
        workers,
        plans_per_s: f64::from(plans) / took.as_secs_f64(),
    })
}

fn scaling_table(scaling: &[Scaled], job: Duration) -> Table {
    let row = |scaled: &Scaled| {
        let most = f64::from(scaled.workers) / job.as_secs_f64();
        vec![
            Cell::count(scaled.workers.into()),
            Cell::number(Some(scaled.plans_per_s), 1),
            Cell::number(Some(most), 1),
            Cell::number(Some(scaled.plans_per_s / most), 3),
        ]
    };
    Table {
        name: "scaling",
        title: "Plans a second by workers".to_owned(),
        note: format!("Each job sleeps for {} ms.", job.as_millis()),
        columns: vec!["workers", "plans/s", "at most", "of linear"],
        rows: scaling.iter().map(row).collect(),
    }
}
