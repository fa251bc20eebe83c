//! Plans over datasets: the same document has the same ground, whatever happens to the name.

use reqwest::Method;
use serde_json::{Value, json};

use super::{hill, over, shipped};
use crate::support::patience::in_time;
use crate::support::process::{Service, run};

async fn upload(service: &Service, uri: &str, body: impl Into<Vec<u8>>) -> Value {
    let request = service.request(Method::PUT, uri).body(body.into());
    let answer = request.send().await.expect("an answer");
    assert!(answer.status().is_success(), "{}", answer.status());
    answer.json().await.expect("JSON")
}

async fn result(service: &Service, address: &str) -> Value {
    let status = service.ended(address).await;
    assert_eq!(status["status"], "succeeded", "{status}");
    let bytes = service.bytes(&format!("{address}/result")).await;
    serde_json::from_slice(&bytes).expect("JSON")
}

/// The parts of a result that do not depend on the machine.
fn route(result: &Value) -> [Value; 4] {
    ["waypoints", "path", "cost", "scenario_sha256"].map(|name| result[name].clone())
}

#[tokio::test]
async fn an_accepted_plan_keeps_its_ground() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--workers", "1"]);
    let high = upload(&service, "/terrains/hill", hill(100.0)).await;
    let first = service.submit(&over("hill")).await;
    let before = result(&service, &first).await;
    let document = service.bytes(&format!("{first}/scenario")).await;
    let document: Value = serde_json::from_slice(&document).expect("JSON");
    assert_eq!(document["terrain"]["sha256"], high["sha256"]);

    // The same document again, after its name has moved to other content, and after a restart.
    upload(&service, "/terrains/hill", hill(5.0)).await;
    let again = service.submit(&document).await;
    assert_eq!(route(&result(&service, &again).await), route(&before));
    let other = service.submit(&over("hill")).await;
    let low = result(&service, &other).await;
    assert_ne!(route(&low)[2], route(&before)[2]);
    service.kill();
    let service = Service::start(directory.path(), &["--workers", "1"]);
    let again = service.submit(&document).await;
    assert_eq!(route(&result(&service, &again).await), route(&before));
    for format in ["svg", "geojson", "kml", "qgc"] {
        service
            .bytes(&format!("{first}/result?format={format}"))
            .await;
    }
    // Content that never existed.
    let mut wrong = over("hill");
    wrong["terrain"]["sha256"] = json!("0".repeat(64));
    let refused: Value = service.post(&wrong).await.json().await.expect("JSON");
    assert_eq!(
        refused["errors"][0]["code"], "replaced-dataset",
        "{refused}"
    );
}

#[tokio::test]
async fn the_service_and_the_command_line_plan_the_same_route() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let terrains = shipped();
    let terrains = terrains.to_str().expect("UTF-8");
    let service = Service::start(
        directory.path(),
        &["--workers", "1", "--terrain-dir", terrains],
    );
    let mut scenario: Value =
        serde_json::from_str(include_str!("../../../scenarios/jacksboro-wgs84.json"))
            .expect("JSON");
    scenario["planner"] = json!({"seed": 3, "population": 40, "iterations": 20});
    let address = service.submit(&scenario).await;
    let served = result(&service, &address).await;
    assert_eq!(served["feasible"], true);
    let arguments = ["plan", "-", "--terrain-dir", terrains];
    let output = run(&arguments, &scenario.to_string());
    let errors = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(0), "{errors}");
    let planned: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(route(&planned), route(&served));

    // With its ground the result can be exported.
    let file = directory.path().join("scenario.json");
    std::fs::write(&file, scenario.to_string()).expect("written");
    let file = file.to_str().expect("UTF-8");
    let export = ["export", "-", "--scenario", file, "--format", "svg"];
    let result = planned.to_string();
    let output = run(
        &[&export[..], &["--terrain-dir", terrains]].concat(),
        &result,
    );
    let errors = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(0), "{errors}");

    // Without its ground the scenario is refused, and so is the export.
    for (arguments, input) in [
        (&["plan", "-"][..], scenario.to_string()),
        (&export, result),
    ] {
        let output = run(arguments, &input);
        let errors = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(2), "{errors}");
        assert!(errors.contains("unknown-dataset"), "{errors}");
    }
}

#[tokio::test]
async fn a_plan_whose_ground_changed_while_it_waited_fails_and_says_why() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let mounted = tempfile::tempdir().expect("a temporary directory");
    let file = mounted.path().join("hill.asc");
    std::fs::write(&file, hill(100.0)).expect("written");
    let path = mounted.path().to_str().expect("UTF-8").to_owned();
    let arguments = ["--workers", "1", "--terrain-dir", &path];
    let service = Service::start(directory.path(), &arguments);
    let done = service.submit(&over("hill")).await;
    result(&service, &done).await;
    // It waits behind a long plan.
    let mut long = over("hill");
    long["planner"] = json!({"population": 400, "iterations": 100_000, "seed": 1});
    let running = service.submit(&long).await;
    let waiting = service.submit(&over("hill")).await;
    std::fs::write(&file, hill(101.5)).expect("written");
    let cancel = service.request(Method::POST, &format!("{running}/cancel"));
    cancel.send().await.expect("an answer");
    let status = in_time(service.ended(&waiting)).await;
    assert_eq!(status["status"], "failed", "{status}");
    let detail = status["error"]["detail"].as_str().expect("text");
    assert!(detail.contains("no longer kept"), "{detail}");
    assert_eq!(status["error"]["type"], "/problems/no-ground");
    // Formats that need the ground are refused as well; the stored result is not.
    service.bytes(&format!("{done}/result")).await;
    let answer = service
        .get(&format!("{done}/result?format=svg"))
        .send()
        .await;
    let answer = answer.expect("an answer");
    assert_eq!(answer.status(), 409);
    let problem: Value = answer.json().await.expect("JSON");
    assert_eq!(problem["type"], "/problems/no-ground");
}
