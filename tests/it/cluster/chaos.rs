//! The leader of three servers and one of three workers are killed repeatedly while plans are submitted.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use futures_util::stream::{self, StreamExt as _};
use serde_json::Value;

use super::{Node, is_whole};
use crate::support::lives::a_plan;
use crate::support::nats::Cluster;
use crate::support::process::{Service, address_of};
use crate::support::size::size;
use crate::support::sse::{Stream, events};

/// Between two kills.
const PERIOD: Duration = Duration::from_secs(5);

/// Submits until accepted: a store without a leader refuses.
async fn submit(api: &Service, nth: usize) -> String {
    let document = a_plan(30, 60, nth);
    loop {
        let request = api
            .request(reqwest::Method::POST, "/plans")
            .header("idempotency-key", format!("plan-{nth}"))
            .json(&document);
        let answer = request.send().await.unwrap();
        let status = answer.status().as_u16();
        if status == 202 {
            return address_of(&answer);
        }
        assert!(status == 503 || status == 409, "{status}");
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

/// Follows a plan to its end, resuming each broken connection where it ended.
async fn follow(api: &Service, address: &str) -> Vec<(u64, String)> {
    let mut told: Vec<(u64, String)> = Vec::new();
    loop {
        let last = told.last().map_or(0, |(id, _)| *id);
        let request = api.get(&format!("{address}/events?rate=0&last_event_id={last}"));
        let probe = api.get(address).send().await.unwrap();
        if probe.status() == 503 {
            tokio::time::sleep(Duration::from_millis(200)).await;
            continue;
        }
        told.extend(events(&Stream::open(request).await.rest().await));
        if told.last().is_some_and(|(_, name)| name == "end") {
            return told;
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_plan_ends_once_while_leaders_and_workers_are_killed() {
    let (n_plans, n_kills) = size((60, 2), (2_000, usize::MAX));
    let mut cluster = Cluster::start().await;
    let address = cluster.address();
    let api = Arc::new(Node::api(&address, &["--store-replicas", "3"]));
    let teller = Arc::new(Node::api(&address, &["--store-replicas", "3"]));
    let start = || Node::worker(&address, &["--store-replicas", "3"]);
    let mut workers = [start(), start(), start()];

    let done = Arc::new(AtomicBool::new(false));
    let pace =
        PERIOD * u32::try_from(n_kills.min(1_000)).unwrap() / u32::try_from(n_plans).unwrap();
    let load = tokio::spawn({
        let (api, teller, done) = (api.clone(), teller.clone(), done.clone());
        async move {
            // In CI the plans are spread over all kills; at full size each follows as soon as one is done.
            let pace = size(pace, Duration::ZERO);
            let followed = stream::iter(0..n_plans)
                .then(|nth| async move {
                    tokio::time::sleep(pace).await;
                    nth
                })
                .map(async |nth| {
                    let address = submit(&api, nth).await;
                    let told = follow(&teller, &address).await;
                    (address, told)
                })
                .buffer_unordered(32)
                .collect::<Vec<_>>()
                .await;
            done.store(true, Ordering::SeqCst);
            followed
        }
    });
    let mut kills = 0;
    while kills < n_kills && !done.load(Ordering::SeqCst) {
        tokio::time::sleep(PERIOD).await;
        let leader = cluster.leader(&address).await;
        cluster.servers[leader].kill();
        workers[kills % 3].kill();
        tokio::time::sleep(PERIOD / 2).await;
        cluster.servers[leader].restart();
        workers[kills % 3].restart();
        kills += 1;
    }
    let begun = Instant::now();
    let followed = load.await.unwrap();
    println!(
        "{n_plans} plans, {kills} kills, {:.1?} after the last",
        begun.elapsed()
    );
    assert_eq!(followed.len(), n_plans);
    for (address, told) in &followed {
        is_whole(told, address);
        assert_eq!(api.ended(address).await["status"], "succeeded", "{address}");
    }
    let listed: Value = serde_json::from_slice(&api.bytes("/plans?limit=1000").await).unwrap();
    assert_eq!(
        listed["plans"].as_array().unwrap().len(),
        n_plans.min(1_000)
    );
}
