//! The same document and seed give the same route: on one worker, on four, and without a server.

use futures_util::future::join_all;
use serde_json::Value;

use crate::support::process::{Service, run};

/// The shipped scenarios with two seeds each, small enough for a test.
fn documents() -> Vec<Value> {
    let shipped = [
        include_str!("../../scenarios/paper-1.json"),
        include_str!("../../scenarios/paper-2.json"),
        include_str!("../../scenarios/paper-3.json"),
        include_str!("../../scenarios/paper-4.json"),
        include_str!("../../scenarios/jacksboro.json"),
    ];
    let small = |text: &str, seed: u64| {
        let mut document: Value = serde_json::from_str(text).expect("JSON");
        document["planner"]["population"] = 20.into();
        document["planner"]["iterations"] = 20.into();
        document["planner"]["seed"] = seed.into();
        document
    };
    shipped
        .iter()
        .flat_map(|text| [1, 2].map(|seed| small(text, seed)))
        .collect()
}

/// The bytes of a result but for its id and its times.
fn essence(result: &[u8]) -> String {
    let mut result: Value = serde_json::from_slice(result).expect("JSON");
    let members = result.as_object_mut().expect("an object");
    members.remove("plan_id");
    members.remove("timing");
    for point in result["convergence"].as_array_mut().expect("a curve") {
        point.as_object_mut().expect("a point").remove("elapsed_ms");
    }
    result.to_string()
}

async fn by_service(workers: &str, documents: &[Value]) -> Vec<String> {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--workers", workers]);
    let addresses = join_all(documents.iter().map(|document| service.submit(document))).await;
    join_all(addresses.iter().map(async |address| {
        assert_eq!(service.ended(address).await["status"], "succeeded");
        essence(&service.bytes(&format!("{address}/result")).await)
    }))
    .await
}

#[tokio::test]
async fn the_route_depends_on_the_request_alone() {
    let documents = documents();
    let alone: Vec<String> = documents
        .iter()
        .map(|document| essence(&run(&["plan", "-"], &document.to_string()).stdout))
        .collect();
    assert_ne!(alone[0], alone[1], "the seed matters");
    assert_eq!(by_service("1", &documents).await, alone);
    assert_eq!(by_service("4", &documents).await, alone);
}
