//! Plans a second: through the service, and by the engine alone on as many threads.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use indicatif::ProgressBar;
use serde_json::{Value, json};

use super::super::case::Case;
use super::super::summary::median;
use super::super::table::{Cell, Table};
use super::client::{Connection, Question};
use super::stage::Stage;
use super::{Arguments, location};
use crate::planner::{self, Nobody};
use crate::scenario::Scenario;
use crate::scenario::json;

/// Measure all cases.
pub(super) async fn measure(
    arguments: &Arguments,
    cases: &[Case],
    bar: &ProgressBar,
) -> anyhow::Result<Table> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let service = Stage::service(cores, arguments.plans.into())?;
    let mut rows = Vec::new();
    for case in cases {
        let scenarios: Vec<Scenario> = (1..=arguments.plans)
            .map(|seed| case.with(&json!({ "seed": seed })))
            .collect::<Result<_, _>>()?;
        let mut rates = Vec::new();
        for _ in 0..arguments.rounds {
            let bare =
                scenarios.len() as f64 / tokio::task::block_in_place(|| bare_s(&scenarios, cores));
            let served = scenarios.len() as f64 / served_s(&service, &scenarios).await?;
            rates.push((bare, served));
        }
        let of = |figure: fn(&(f64, f64)) -> f64, digits| {
            Cell::number(median(rates.iter().map(figure).collect()), digits)
        };
        rows.push(vec![
            Cell::text(&case.name),
            of(|(bare, _)| *bare, 2),
            of(|(_, served)| *served, 2),
            of(|(bare, served)| served / bare, 3),
            Cell::Number(0.95, 2),
        ]);
        bar.inc(1);
    }
    Ok(Table {
        name: "planning",
        title: "Planning".to_owned(),
        note: format!(
            "{} plans of each scenario with default settings and seeds from 1 on, on {cores} cores; medians of {} \
             rounds, in turn. Through the service, from the first post to the last end, everything kept.",
            arguments.plans, arguments.rounds
        ),
        columns: vec!["scenario", "engine 1/s", "service 1/s", "ratio", "bar"],
        rows,
    })
}

/// Seconds that the engine alone takes on `cores` threads.
fn bare_s(scenarios: &[Scenario], cores: usize) -> f64 {
    let next = AtomicUsize::new(0);
    let begun = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                while let Some(scenario) = scenarios.get(next.fetch_add(1, Ordering::Relaxed)) {
                    std::hint::black_box(planner::plan(scenario, &mut Nobody, &Nobody));
                }
            });
        }
    });
    begun.elapsed().as_secs_f64()
}

/// Seconds from the first post to the last end.
async fn served_s(service: &Stage, scenarios: &[Scenario]) -> anyhow::Result<f64> {
    let questions: Vec<_> = scenarios
        .iter()
        .map(|scenario| Question::post("/plans", json::write(scenario)))
        .collect();
    let mut connection = Connection::open(service.address).await?;
    let begun = Instant::now();
    let mut places = Vec::new();
    for question in &questions {
        places.push(location(&connection.ask(question).await?)?);
    }
    // The plans that begin last end last, but in no particular order.
    for place in places.into_iter().rev() {
        let question = Question::get(place).patient();
        loop {
            let status: Value = serde_json::from_slice(&connection.ask(&question).await?.body)?;
            match status["status"].as_str() {
                Some("succeeded") => break,
                Some("queued" | "running") => {}
                other => anyhow::bail!("a plan should succeed, not be {other:?}"),
            }
        }
    }
    Ok(begun.elapsed().as_secs_f64())
}
