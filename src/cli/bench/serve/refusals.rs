//! How soon callers are refused who find the queue full while every worker is busy.

use anyhow::ensure;
use serde_json::{Value, json};

use super::client::{Connection, Question, load};
use super::stage::Stage;
use super::{Arguments, location, tiny};
use crate::cli::bench::table::{Cell, Table};

/// Plans that wait.
const QUEUE: usize = 100;

/// A scenario whose planning outlasts the measurement: with the maximum of work allowed.
fn endless() -> Value {
    let mut scenario = tiny();
    scenario["planner"] =
        json!({"population": 10_000, "iterations": 20_000, "waypoints": 20, "seed": 1});
    scenario
}

/// Measure one caller, and many.
pub(super) async fn measure(arguments: &Arguments) -> anyhow::Result<Table> {
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    let service = Stage::service(workers, QUEUE)?;
    let mut connection = Connection::open(service.address).await?;
    let mut running = Vec::new();
    for _ in 0..workers {
        let plan = Question::post("/plans", endless().to_string());
        running.push(Question::get(location(&connection.ask(&plan).await?)?));
    }
    for plan in &running {
        while status(&mut connection, plan).await? == "queued" {}
    }
    let submission = Question::post("/plans", tiny().to_string());
    for _ in 0..QUEUE {
        location(&connection.ask(&submission).await?)?;
    }
    let mut rows = Vec::new();
    for connections in [1, arguments.connections] {
        let refused = load(
            service.address,
            connections.into(),
            arguments.time(),
            submission.clone(),
        );
        let refused = refused.await?.all(503)?;
        rows.push(vec![
            Cell::count(connections.into()),
            Cell::Number(refused.rate, 0),
            Cell::Number(refused.within_ms(0.5), 2),
            Cell::Number(refused.within_ms(0.99), 2),
            Cell::Number(20.0, 0),
        ]);
    }
    for plan in &running {
        let status = status(&mut connection, plan).await?;
        ensure!(
            status == "running",
            "a long plan should run on, not be {status}"
        );
    }
    Ok(Table {
        name: "full-queue",
        title: "Refusals when the queue is full".to_owned(),
        note: format!(
            "{workers} plans run, one on each core, and {QUEUE} wait; every answer is 503 `queue-full`."
        ),
        columns: vec!["connections", "refusals 1/s", "p50 ms", "p99 ms", "bar"],
        rows,
    })
}

/// The status of a plan.
async fn status(connection: &mut Connection, plan: &Question) -> anyhow::Result<String> {
    let document: Value = serde_json::from_slice(&connection.ask(plan).await?.body)?;
    Ok(document["status"].as_str().unwrap_or_default().to_owned())
}
