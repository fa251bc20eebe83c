//! The same document and seed give the same route: with one worker, with four, and without a server.

use futures_util::future::join_all;
use serde_json::Value;

use crate::support::process::run;
use crate::support::stores::{BACKENDS, Backend, Place};

/// The shipped scenarios, reduced to test size: with two seeds without seeding and polishing, and with the
/// defaults.
fn documents() -> Vec<Value> {
    let shipped = [
        include_str!("../../scenarios/paper-1.json"),
        include_str!("../../scenarios/paper-2.json"),
        include_str!("../../scenarios/paper-3.json"),
        include_str!("../../scenarios/paper-4.json"),
        include_str!("../../scenarios/jacksboro.json"),
    ];
    let small = |text: &str, seed: u64, plain: bool| {
        let mut document: Value = serde_json::from_str(text).expect("JSON");
        let planner = &mut document["planner"];
        planner["population"] = 20.into();
        planner["iterations"] = 20.into();
        planner["seed"] = seed.into();
        if plain {
            planner["seeding"] = "random".into();
            planner["polish"] = false.into();
        }
        document
    };
    let variants = [(1, true), (2, true), (1, false)];
    shipped
        .iter()
        .flat_map(|text| variants.map(|(seed, plain)| small(text, seed, plain)))
        .collect()
}

/// The bytes of a result without its id and its times.
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

async fn by_service(backend: Backend, workers: &str, documents: &[Value]) -> Vec<String> {
    let place = Place::new(backend);
    let service = place.serve(&["--workers", workers]);
    let addresses = join_all(documents.iter().map(|document| service.submit(document))).await;
    join_all(addresses.iter().map(async |address| {
        assert_eq!(service.ended(address).await["status"], "succeeded");
        essence(&service.bytes(&format!("{address}/result")).await)
    }))
    .await
}

fn alone(document: &Value) -> String {
    essence(&run(&["plan", "-"], &document.to_string()).stdout)
}

#[tokio::test]
async fn the_result_depends_on_the_request_alone() {
    let documents = documents();
    let alone: Vec<String> = documents.iter().map(alone).collect();
    let waypoints = |essence: &str| {
        let result: Value = serde_json::from_str(essence).expect("JSON");
        result["waypoints"].clone()
    };
    assert_ne!(
        waypoints(&alone[0]),
        waypoints(&alone[1]),
        "the seed matters"
    );
    for backend in BACKENDS {
        for workers in ["1", "4"] {
            let routes = by_service(backend, workers, &documents).await;
            assert_eq!(routes, alone, "{backend:?}, {workers} workers");
        }
    }
}

#[test]
fn every_thread_count_gives_the_same_bits() {
    for mut document in documents() {
        // Large enough to give every thread a share.
        document["planner"]["population"] = 100.into();
        document["planner"]["iterations"] = 10.into();
        let mut with_threads = |threads: u64| {
            document["planner"]["parameters"]["threads"] = threads.into();
            let mut result: Value = serde_json::from_str(&alone(&document)).expect("JSON");
            // It hashes the document, which names the thread count.
            result
                .as_object_mut()
                .expect("an object")
                .remove("scenario_sha256");
            result
        };
        let one = with_threads(1);
        for threads in [2, 4, 7] {
            assert_eq!(with_threads(threads), one, "{threads} threads");
        }
    }
}
