//! Nodes that share a store: some answer requests, some run plans.

use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::patience::eventually;
use crate::support::process::{Service, run_with};
use crate::support::{nats, scenario};

/// A node on a shared store.
fn node(directory: &Path, address: &str, arguments: &[&str]) -> Service {
    let arguments = [&["--store", address], arguments].concat();
    Service::start(directory, &arguments)
}

fn directory() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

#[tokio::test]
async fn one_node_accepts_plans_and_another_runs_them() {
    let address = nats::address();
    let (of_api, of_worker) = (directory(), directory());
    let api = node(of_api.path(), &address, &["--role", "api"]);
    api.until_ready(200).await;
    let plan = api.submit(&scenario()).await;
    let waiting: Value = serde_json::from_slice(&api.bytes(&plan).await).expect("JSON");
    assert_eq!(waiting["status"], "queued", "nobody runs plans yet");
    let levels = api.bytes("/metrics").await;
    let levels = String::from_utf8_lossy(&levels);
    assert!(levels.contains("noctule_workers 0.0\n"), "{levels}");

    let worker = node(
        of_worker.path(),
        &address,
        &["--role", "worker", "--workers", "3"],
    );
    assert_eq!(api.ended(&plan).await["status"], "succeeded");
    let levels = worker.bytes("/metrics").await;
    let levels = String::from_utf8_lossy(&levels);
    assert!(levels.contains("noctule_workers 3.0\n"), "{levels}");
    worker.signal("TERM");
    assert!(worker.exit().await.success());
    api.signal("TERM");
    assert!(api.exit().await.success());
}

#[tokio::test]
async fn a_worker_serves_only_operational_routes() {
    let directory = directory();
    let worker = node(directory.path(), &nats::address(), &["--role", "worker"]);
    worker.until_ready(200).await;
    for path in ["/livez", "/readyz", "/metrics", "/version"] {
        let answer = worker.get(path).send().await.expect("an answer");
        assert_eq!(answer.status(), 200, "{path}");
    }
    for path in ["/plans", "/", "/limits", "/openapi.yaml", "/terrains"] {
        let answer = worker.get(path).send().await.expect("an answer");
        assert_eq!(answer.status(), 404, "{path}");
        let problem: Value = answer.json().await.expect("JSON");
        assert_eq!(problem["type"], "/problems/not-found");
        let detail = format!(
            "this node runs plans and serves none, so nothing is at {path}; nodes of the role api or all serve them"
        );
        assert_eq!(problem["detail"], detail);
    }
    assert_eq!(worker.post(&scenario()).await.status(), 404);
}

#[tokio::test]
async fn limits_count_the_workers_of_all_nodes() {
    let address = nats::address();
    let (first, second) = (directory(), directory());
    let worker = node(
        first.path(),
        &address,
        &["--role", "worker", "--workers", "5"],
    );
    worker.until_ready(200).await;
    // It counts the workers of other nodes at its start.
    let api = node(second.path(), &address, &["--role", "api"]);
    api.until_ready(200).await;
    eventually(async || {
        let limits: Value = serde_json::from_slice(&api.bytes("/limits").await).expect("JSON");
        limits["workers"] == 5
    })
    .await;
}

/// A node without its servers answers, is not ready, refuses plans and can be stopped.
#[tokio::test]
async fn a_node_without_its_servers_is_alive_but_not_ready() {
    let directory = directory();
    let alone = node(
        directory.path(),
        "nats://127.0.0.1:1",
        &["--role", "api", "--grace", "1"],
    );
    alone.until_ready(503).await;
    assert_eq!(alone.post(&scenario()).await.status(), 503);
    let alive = alone.get("/livez").send().await.expect("an answer");
    assert_eq!(alive.status(), 200);
    alone.signal("TERM");
    assert!(alone.exit().await.success());
}

#[test]
fn file_commands_on_a_shared_store_name_the_nats_commands_instead() {
    let variables = [("NOCTULE_STORE", "nats://127.0.0.1:1")];
    for (arguments, instead) in [
        (&["store", "check"][..], "nats server check jetstream"),
        (&["store", "backup", "copy.db"], "nats stream backup"),
    ] {
        let refused = run_with(&variables, arguments, "");
        assert_eq!(refused.status.code(), Some(1));
        let text = String::from_utf8(refused.stderr).expect("UTF-8");
        assert!(text.contains("the plans are on NATS servers"), "{text}");
        assert!(text.contains(instead), "{text}");
    }
}
