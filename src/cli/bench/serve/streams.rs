//! Many readers of one plan's events.

use std::time::Instant;

use anyhow::{Context as _, ensure};
use http_body_util::BodyExt as _;

use super::super::table::{Cell, Table};
use super::client::{Connection, Question};
use super::stage::Stage;
use super::{Arguments, location, tiny};

/// What one reader received.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    events: usize,
    gaps: usize,
    ends: usize,
}

/// Measure one plan that runs throughout the measurement.
pub(super) async fn measure(arguments: &Arguments) -> anyhow::Result<Table> {
    let mut rows = Vec::new();
    for readers in [1, arguments.readers] {
        rows.push(follow(arguments, readers.into()).await?);
    }
    Ok(Table {
        name: "streams",
        title: "Event streams".to_owned(),
        note: format!(
            "Readers of every event (`rate=0`) of one plan that runs for {} ms at full speed and competes with them \
             for the cores; until the last has read its `end`. A reader who is too slow for what is kept gets gaps.",
            arguments.time_ms
        ),
        columns: vec!["readers", "events each", "gaps", "events 1/s", "seconds"],
        rows,
    })
}

async fn follow(arguments: &Arguments, readers: usize) -> anyhow::Result<Vec<Cell>> {
    let service = Stage::service(1, 1)?;
    let mut scenario = tiny();
    scenario["planner"]["population"] = 500.into();
    scenario["planner"]["waypoints"] = 10.into();
    scenario["planner"]["iterations"] = 100_000.into();
    scenario["planner"]["time_limit_ms"] = arguments.time_ms.into();
    let mut connection = Connection::open(service.address).await?;
    let submission = Question::post("/plans", scenario.to_string());
    let place = location(&connection.ask(&submission).await?)?;
    let question = Question::get(format!("{place}/events?rate=0"));
    let begun = Instant::now();
    let reading: Vec<_> = (0..readers)
        .map(|_| tokio::spawn(read(service.address, question.clone())))
        .collect();
    let mut all = Vec::new();
    for reading in reading {
        all.push(reading.await.context("reading broke")??);
    }
    let took_s = begun.elapsed().as_secs_f64();
    ensure!(
        all.iter().all(|seen| seen.ends == 1),
        "every reader should see one end"
    );
    let events: usize = all.iter().map(|seen| seen.events).sum();
    Ok(vec![
        Cell::count(readers),
        Cell::count(events / readers),
        Cell::count(all.iter().map(|seen| seen.gaps).sum()),
        Cell::Number(events as f64 / took_s, 0),
        Cell::Number(took_s, 1),
    ])
}

async fn read(address: std::net::SocketAddr, question: Question) -> anyhow::Result<Seen> {
    let mut connection = Connection::open(address).await?;
    let mut body = connection.begin(&question).await?.into_body();
    let mut seen = Seen::default();
    let mut text = Vec::new();
    while let Some(frame) = body.frame().await {
        let Ok(data) = frame?.into_data() else {
            continue;
        };
        text.extend_from_slice(&data);
        let whole = text
            .iter()
            .rposition(|byte| *byte == b'\n')
            .map_or(0, |end| end + 1);
        for line in text[..whole].split(|byte| *byte == b'\n') {
            match line.strip_prefix(b"event: ") {
                Some(b"gap") => seen.gaps += 1,
                Some(b"end") => seen.ends += 1,
                _ => {}
            }
            seen.events += usize::from(line.starts_with(b"id: "));
        }
        text.drain(..whole);
    }
    Ok(seen)
}
