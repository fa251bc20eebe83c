//! Plans in the real program, followed from submission to end as a caller would.

use serde_json::Value;

use super::process::Service;
use super::scenario;
use super::sse::{Block, Stream, events};

/// A plan that runs for `ms` on any machine: its iterations alone would take minutes.
pub(crate) fn a_run_of(ms: u64) -> Value {
    let mut scenario = a_plan(4_000, 100_000, 7);
    scenario["planner"]["time_limit_ms"] = ms.into();
    scenario
}

/// A plan with the given population and number of iterations.
pub(crate) fn a_plan(population: u64, iterations: u64, seed: usize) -> Value {
    let mut scenario = scenario();
    scenario["planner"]["population"] = population.into();
    scenario["planner"]["iterations"] = iterations.into();
    scenario["planner"]["seed"] = seed.into();
    scenario
}

/// A plan that waits behind a long one when there is one worker; its address.
pub(crate) async fn waiting(service: &Service) -> String {
    service.submit(&a_plan(10_000, 30_000, 7)).await;
    service.submit(&scenario()).await
}

/// Reads until the plan's run has reported something. Its status tells of the run a moment before the worker has it: a
/// service that ends in that moment puts the plan back into the queue.
pub(crate) async fn running(service: &Service, address: &str) -> Stream {
    let mut stream = running_at(service, address, 10.0).await;
    let is_report = |block: &Block| matches!(block, Block::Event { name, .. } if name != "status");
    while !is_report(&stream.next().await.expect("it has not ended")) {}
    stream
}

/// Reads until the plan is running, with at most `rate_hz` points a second.
pub(crate) async fn running_at(service: &Service, address: &str, rate_hz: f64) -> Stream {
    let mut stream = Stream::open(service.get(&format!("{address}/events?rate={rate_hz}"))).await;
    await_run(&mut stream).await;
    stream
}

/// Reads until the plan's next run starts.
pub(crate) async fn await_run(stream: &mut Stream) {
    loop {
        match stream.next().await.expect("it has not ended").status() {
            Some(status) if status == "running" => return,
            _ => {}
        }
    }
}

/// The statuses of a plan, which must have ended exactly once.
pub(crate) async fn life(service: &Service, address: &str) -> Vec<String> {
    let stream = Stream::open(service.get(&format!("{address}/events?rate=1"))).await;
    let blocks = stream.rest().await;
    let ends = events(&blocks)
        .into_iter()
        .filter(|(_, name)| name == "end");
    assert_eq!(ends.count(), 1);
    blocks.iter().filter_map(Block::status).collect()
}
