//! `noctule bench serve`: the service under load, beside a handler that does nothing.

mod client;
mod planning;
mod refusals;
mod stage;
mod streams;

use std::time::Duration;

use anyhow::{Context as _, ensure};
use clap::Args;
use serde_json::{Value, json};

use self::client::{Answer, Connection, Load, Question, load};
use self::stage::{Role, Stage};
use super::Common;
use super::case::Case;
use super::progress;
use super::report::Report;
use super::summary::median;
use super::table::{Cell, Table};

#[derive(Args)]
pub(in crate::cli) struct Arguments {
    #[command(flatten)]
    pub(super) common: Common,
    /// Connections that send requests at the same time
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    connections: u16,
    /// Time of each measurement, milliseconds
    #[arg(long, default_value_t = 2_000, value_parser = clap::value_parser!(u32).range(1..=600_000))]
    time_ms: u32,
    /// Measurements of each kind, taken in turn; the median counts
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1_000))]
    rounds: u16,
    /// Plans of each scenario, to measure the rate of planning
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    plans: u16,
    /// Readers of one plan's events
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    readers: u16,
    #[command(flatten)]
    role: Role,
}

impl Arguments {
    fn time(&self) -> Duration {
        Duration::from_millis(u64::from(self.time_ms))
    }

    async fn load(&self, stage: &Stage, question: &Question) -> anyhow::Result<Load> {
        let connections = self.connections.into();
        load(stage.address, connections, self.time(), question.clone()).await
    }
}

/// Play the target's part, when this process was started for that.
pub(super) fn plays_a_role(arguments: &Arguments) -> anyhow::Result<bool> {
    arguments.role.play()
}

/// A scenario that is planned in no time.
fn tiny() -> Value {
    json!({
        "start": {"x": 0, "y": 0, "z": 50}, "target": {"x": 1000, "y": 0, "z": 50},
        "altitude": {"min": 0, "max": 100},
        "planner": {"population": 2, "iterations": 1, "waypoints": 1, "seed": 1},
    })
}

/// Measure all tables.
pub(super) fn measure(arguments: &Arguments, cases: &[Case]) -> anyhow::Result<Report> {
    tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?
        .block_on(measure_all(arguments, cases))
}

async fn measure_all(arguments: &Arguments, cases: &[Case]) -> anyhow::Result<Report> {
    let bar = progress::bar(3 + cases.len());
    let mut tables = Vec::new();
    bar.set_message("requests");
    tables.push(requests(arguments).await?);
    bar.inc(1);
    bar.set_message("a full queue");
    tables.push(refusals::measure(arguments).await?);
    bar.inc(1);
    bar.set_message("streams");
    tables.push(streams::measure(arguments).await?);
    bar.inc(1);
    bar.set_message("planning");
    tables.push(planning::measure(arguments, cases, &bar).await?);
    bar.finish_and_clear();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    Ok(Report {
        title: "The service under load".to_owned(),
        intro: format!(
            "`noctule bench serve`, version {}, {cores} cores that the service, its callers and whatever else \
             runs share. Service and bare handler are processes of their own, reached over loopback. \
             Rates depend on the machine; ratios within a run hardly do.",
            env!("CARGO_PKG_VERSION")
        ),
        tables,
        raw: Vec::new(),
        drawings: Vec::new(),
    })
}

/// Reading and accepting, each against a handler that does nothing.
async fn requests(arguments: &Arguments) -> anyhow::Result<Table> {
    let bare = Stage::bare()?;
    let service = Stage::service(0, 100_000_000)?;
    let scenario = tiny().to_string();
    let submission = Question::post("/plans", scenario.clone());
    let mut connection = Connection::open(service.address).await?;
    let queued = location(&connection.ask(&submission).await?)?;
    let ended = location(&connection.ask(&submission).await?)?;
    let cancelled = connection
        .ask(&Question::post(format!("{ended}/cancel"), ""))
        .await?;
    ensure!(
        cancelled.status == 200,
        "a waiting plan is cancelled at once"
    );

    let pairs = [
        (
            "GET, an ended plan",
            0.5,
            Question::get("/"),
            Question::get(ended),
            200,
        ),
        (
            "GET, a waiting plan",
            0.5,
            Question::get("/"),
            Question::get(queued),
            200,
        ),
        (
            "POST, made durable",
            0.3,
            Question::post("/", scenario),
            submission,
            202,
        ),
    ];
    let mut rows = Vec::new();
    for (name, bar, nothing, asked, status) in pairs {
        let mut rounds = Vec::new();
        for _ in 0..arguments.rounds {
            rounds.push((
                arguments.load(&bare, &nothing).await?.all(200)?,
                arguments.load(&service, &asked).await?.all(status)?,
            ));
        }
        let of = |figure: &dyn Fn(&(Load, Load)) -> f64, digits| {
            Cell::number(median(rounds.iter().map(figure).collect()), digits)
        };
        rows.push(vec![
            Cell::text(name),
            of(&|(bare, _)| bare.rate, 0),
            of(&|(_, service)| service.rate, 0),
            of(&|(bare, service)| service.rate / bare.rate, 2),
            Cell::Number(bar, 2),
            of(&|(bare, _)| bare.within_ms(0.5), 2),
            of(&|(_, service)| service.within_ms(0.5), 2),
            of(&|(bare, _)| bare.within_ms(0.99), 2),
            of(&|(_, service)| service.within_ms(0.99), 2),
        ]);
    }
    Ok(Table {
        name: "requests",
        title: "Requests".to_owned(),
        note: format!(
            "{} connections, each asking as soon as it has its answer; medians of {} rounds of {} ms, in turn. \
             The bare handler answers 15 bytes, after reading the body if there is one.",
            arguments.connections, arguments.rounds, arguments.time_ms
        ),
        columns: vec![
            "request",
            "bare 1/s",
            "service 1/s",
            "ratio",
            "bar",
            "bare p50 ms",
            "service p50 ms",
            "bare p99 ms",
            "service p99 ms",
        ],
        rows,
    })
}

/// The address of an accepted plan.
fn location(answer: &Answer) -> anyhow::Result<String> {
    ensure!(
        answer.status == 202,
        "a plan should be accepted, not {}",
        answer.status
    );
    let location = answer.headers.get("location").context("it has a place")?;
    Ok(location.to_str()?.to_owned())
}
