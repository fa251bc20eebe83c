//! Processes that are killed, paused and replaced.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use futures_util::future::join_all;
use reqwest::Client;
use serde_json::Value;
use tokio::sync::watch;

use super::{Node, ends_once};
use crate::support::lives::{self, a_run_of, await_run, life, running};
use crate::support::nats;
use crate::support::patience::in_time;
use crate::support::process::{Service, address_of};
use crate::support::scenario;
use crate::support::sse::events;

/// A plan that runs for some hundred milliseconds.
fn a_plan(seed: usize) -> Value {
    lives::a_plan(50, 100, seed)
}

/// How many times the plan started to run.
async fn runs(service: &Service, address: &str) -> usize {
    let life = life(service, address).await;
    life.iter().filter(|status| *status == "running").count()
}

#[tokio::test(flavor = "multi_thread")]
async fn plans_of_a_killed_worker_are_finished_once_by_the_others() {
    let address = nats::address();
    let api = Node::api(&address, &[]);
    let mut killed = Node::worker(&address, &[]);
    let long = api.submit(&a_run_of(5_000)).await;
    running(&api, &long).await;
    let plans = join_all((0..20).map(async |seed| api.submit(&a_plan(seed)).await)).await;
    let _other = Node::worker(&address, &[]);
    // It runs the long plan, since there was no other when that began.
    killed.kill();
    for plan in plans.iter().chain([&long]) {
        ends_once(&api, plan).await;
    }
    assert_eq!(runs(&api, &long).await, 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_paused_past_its_lease_ends_no_plan() {
    let address = nats::address();
    let api = Node::api(&address, &[]);
    let paused = Node::worker(&address, &[]);
    let plan = api.submit(&a_run_of(4_000)).await;
    let stream = running(&api, &plan).await;
    paused.signal("STOP");
    let other = Node::worker(&address, &[]);
    // The plan's reader sees the other worker take it, and one end.
    let rest = tokio::spawn(stream.rest());
    let mut again = running(&api, &plan).await;
    await_run(&mut again).await;
    paused.signal("CONT");
    ends_once(&api, &plan).await;
    assert_eq!(runs(&api, &plan).await, 2);
    drop(again);
    let told = events(&rest.await.unwrap());
    assert_eq!(told.iter().filter(|(_, name)| name == "end").count(), 1);
    // The late worker goes on with other plans.
    drop(other);
    let next = api.submit(&a_plan(1)).await;
    ends_once(&api, &next).await;
}

/// A caller with two addresses: each retry goes to the other one, with the same idempotency key.
async fn persist(client: &Client, urls: &Mutex<[Option<String>; 2]>, nth: usize) -> String {
    let body = a_plan(nth);
    for attempt in nth.. {
        let Some(url) = urls.lock().unwrap()[attempt % 2].clone() else {
            continue;
        };
        let request = client
            .post(format!("{url}/plans"))
            .header("idempotency-key", format!("plan {nth}").replace(' ', "-"))
            .json(&body);
        // A broken connection is no response.
        let Ok(answer) = request.send().await else {
            continue;
        };
        let status = answer.status().as_u16();
        if status == 202 {
            return address_of(&answer);
        }
        let problem: Value = answer.json().await.unwrap();
        let leaving = status == 503 && problem["type"] == "/problems/draining";
        let same = status == 409 && problem["type"] == "/problems/idempotency-in-flight";
        assert!(leaving || same, "{problem}");
    }
    unreachable!("it tries for ever")
}

/// Waits until `plans` more plans have been accepted.
async fn more(accepted: &mut watch::Receiver<usize>, plans: usize) {
    let enough = *accepted.borrow() + plans;
    let counted = in_time(accepted.wait_for(|accepted| *accepted >= enough)).await;
    counted.expect("the load goes on");
}

#[tokio::test(flavor = "multi_thread")]
async fn no_request_fails_while_nodes_are_replaced_under_load() {
    const PLANS: usize = 120;
    /// Plans accepted before each replacement and after the last.
    const BETWEEN: usize = 8;
    let address = nats::address();
    let mut replaced = Node::api(&address, &[]);
    let other = Arc::new(Node::api(&address, &[]));
    let _worker = Node::worker(&address, &[]);
    let urls = Arc::new(Mutex::new([Some(replaced.url("")), Some(other.url(""))]));
    let client = Client::builder().no_proxy().build().unwrap();
    let (accepted, mut told) = watch::channel(0);
    let over = Arc::new(AtomicBool::new(false));
    let load = tokio::spawn({
        let (urls, over, other) = (urls.clone(), over.clone(), other.clone());
        async move {
            let mut plans = Vec::new();
            while plans.len() < PLANS || !over.load(Ordering::Relaxed) {
                let first = plans.len();
                let four = (first..first + 4).map(|nth| persist(&client, &urls, nth));
                plans.extend(join_all(four).await);
                accepted.send_replace(plans.len());
                // No faster than the worker takes them.
                other.ended(&plans[first]).await;
            }
            plans
        }
    });
    more(&mut told, BETWEEN).await;
    // Replaced once gracefully and once by a kill.
    replaced.leave().await;
    replaced.restart();
    urls.lock().unwrap()[0] = Some(replaced.url(""));
    more(&mut told, BETWEEN).await;
    replaced.kill();
    replaced.restart();
    urls.lock().unwrap()[0] = Some(replaced.url(""));
    more(&mut told, BETWEEN).await;
    over.store(true, Ordering::Relaxed);
    let plans = in_time(load).await.unwrap();
    for plan in &plans {
        ends_once(&replaced, plan).await;
    }
    let listed: Value = serde_json::from_slice(&other.bytes("/plans?limit=1000").await).unwrap();
    assert_eq!(listed["plans"].as_array().unwrap().len(), plans.len());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_queue_is_full_at_every_node() {
    let address = nats::address();
    let nodes = [
        Node::api(&address, &["--queue", "5"]),
        Node::api(&address, &["--queue", "5"]),
    ];
    for _ in 0..5 {
        nodes[0].submit(&scenario()).await;
    }
    for node in &nodes {
        let refused = in_time(async {
            loop {
                let answer = node.post(&scenario()).await;
                // The other node learns of it a moment later.
                if answer.status() != 202 {
                    return answer;
                }
            }
        })
        .await;
        assert_eq!(refused.status(), 503);
        assert!(refused.headers().contains_key("retry-after"));
        let problem: Value = refused.json().await.unwrap();
        assert_eq!(problem["type"], "/problems/queue-full");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_without_servers_is_not_ready_until_they_come() {
    let mut server = nats::NatsServer::start();
    let address = server.address();
    server.kill();
    let node = Node::start(&address, "all", &[]);
    node.bytes("/livez").await;
    let detail = node.until_ready(503).await;
    assert!(!detail.is_empty());
    server.restart();
    node.until_ready(200).await;
    let plan = node.submit(&scenario()).await;
    ends_once(&node, &plan).await;
    // The same again beneath an open store.
    server.kill();
    node.until_ready(503).await;
    server.restart();
    node.until_ready(200).await;
    let plan = node.submit(&scenario()).await;
    ends_once(&node, &plan).await;
}
