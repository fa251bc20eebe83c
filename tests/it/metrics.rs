//! `GET /metrics`: well-formed, correct, and with a bounded number of series.

use axum::http::Method;
use serde_json::{Value, json};

use crate::support::api::Api;
use crate::support::lives::{a_plan, a_run_of, await_run, running};
use crate::support::openmetrics::Reading;
use crate::support::patience::eventually;
use crate::support::process::Service;
use crate::support::stores::{Place, for_every_backend};
use crate::support::{run, scenario};

async fn read(api: &Api) -> Reading {
    let answer = api.get("/metrics").await;
    Reading::read(std::str::from_utf8(&answer.body).expect("UTF-8"))
}

async fn read_from(service: &Service) -> Reading {
    let text = service.bytes("/metrics").await;
    Reading::read(std::str::from_utf8(&text).expect("UTF-8"))
}

#[tokio::test]
async fn the_queue_metrics_show_the_current_queue() {
    let api = Api::with_queue(5);
    let empty = read(&api).await;
    assert!(empty.value("noctule_queue_oldest_age_seconds") == 0.0);
    for _ in 0..3 {
        api.submit().await;
    }
    let lease = api.store.claim().await.expect("a plan");
    let reading = read(&api).await;
    for (series, expected) in [
        ("noctule_plans{status=\"queued\"}", 2.0),
        ("noctule_plans{status=\"running\"}", 1.0),
        ("noctule_plans_accepted_total", 3.0),
        ("noctule_queue_limit", 5.0),
        ("noctule_workers", 2.0),
        (
            "noctule_store_operation_seconds_count{operation=\"submit\"}",
            3.0,
        ),
        (
            "noctule_http_requests_total{method=\"POST\",route=\"/plans\",status=\"202\"}",
            3.0,
        ),
    ] {
        let value = reading.value(series);
        assert!((value - expected).abs() < 0.5, "{series} is {value}");
    }
    let age_s = reading.value("noctule_queue_oldest_age_seconds");
    assert!((0.0..60.0).contains(&age_s), "{age_s}");
    drop(lease);
}

/// A rate is seen from the first failure on only if the series was there before.
#[tokio::test]
async fn failures_of_each_route_are_counted_from_zero() {
    let reading = read(&Api::new()).await;
    for route in noctule::http::routes() {
        let (method, path) = (route.method, route.path);
        let labels = format!("{{method=\"{method}\",route=\"{path}\",status=\"500\"}}");
        let failures = reading.value(&format!("noctule_http_requests_total{labels}"));
        assert!(failures == 0.0, "{labels} is {failures}");
    }
}

/// The store is sound, and so are the other plans: nobody is to be called for it, or told to try again.
#[tokio::test]
async fn a_lost_scenario_is_its_plan_s_alone() {
    let api = Api::new();
    let [lost, sound] = [api.submit().await, api.submit().await];
    for _ in 0..2 {
        run::complete(&*api.store, vec![run::convergence(0, 0.1)]).await;
    }
    let file = api.data_dir().join("noctule.db");
    let database = rusqlite::Connection::open(file).expect("the store's file");
    for damage in [
        "UPDATE scenarios SET document = CAST(x'ff' AS TEXT) WHERE plan_seq = 1",
        "DELETE FROM scenarios WHERE plan_seq = 1",
    ] {
        assert_eq!(database.execute(damage, []).expect(damage), 1);
        for path in ["/scenario", "/result?format=svg", "/result?format=kml"] {
            let answer = api.get(&format!("{lost}{path}")).await;
            let problem = answer.expect_problem(409, "scenario-lost");
            let detail = problem["detail"].as_str().expect("a text");
            assert!(detail.contains("no longer in the store"), "{detail}");
            assert!(!answer.headers.contains_key("retry-after"), "{path}");
        }
    }
    let stored = api.get(&format!("{lost}/result")).await;
    assert_eq!(stored.status, 200);
    let accept = [("accept", "image/svg+xml, application/json;q=0.5")];
    let accepted = api.get_with(&format!("{lost}/result"), &accept).await;
    assert_eq!(accepted.body, stored.body);
    assert_eq!(api.get(&format!("{sound}/scenario")).await.status, 200);
    assert_eq!(api.get("/readyz").await.status, 200);
    let failures = "noctule_store_operation_failures_total{operation=\"scenario\"}";
    let counted = read(&api).await.series.get(failures).copied();
    assert!(counted.unwrap_or(0.0) < 0.5, "{counted:?}");
}

/// Callers cannot add series, whatever they send.
#[tokio::test]
async fn callers_cannot_make_series() {
    let api = Api::new();
    let provoke = async |number: u128| {
        let id = uuid::Uuid::from_u128(number);
        for path in [format!("/plans/{id}"), format!("/nothing/{id}")] {
            api.get(&path).await;
            let method = Method::from_bytes(format!("M{number}").as_bytes()).expect("a token");
            api.send(method, &path, &[], "").await;
        }
    };
    provoke(0).await;
    read(&api).await;
    let before = read(&api).await;
    for number in 1..20 {
        provoke(number).await;
    }
    let after = read(&api).await;
    let names = |reading: &Reading| reading.series.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&before), names(&after));
    let route = "{method=\"GET\",route=\"/plans/{id}\",status=\"404\"}";
    let known = after.value(&format!("noctule_http_requests_total{route}"));
    assert!((known - 20.0).abs() < 0.5, "{known}");
    let unmatched = "{method=\"OTHER\",route=\"unmatched\",status=\"404\"}";
    after.value(&format!("noctule_http_requests_total{unmatched}"));
}

#[tokio::test]
async fn a_finished_run_is_counted() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    let address = service.submit(&scenario()).await;
    let status = service.ended(&address).await;
    assert_eq!(status["status"], "succeeded");
    // Callers may learn of the end before the worker has counted it.
    let ended = "noctule_plans_ended_total{status=\"succeeded\"}";
    eventually(async || read_from(&service).await.value(ended) > 0.5).await;
    let reading = read_from(&service).await;
    let count = |series: &str| reading.value(series);
    for series in [
        ended,
        "noctule_plan_run_seconds_count{status=\"succeeded\"}",
        "noctule_plan_wait_seconds_count",
        "noctule_plan_gap_ratio_count",
    ] {
        assert!((count(series) - 1.0).abs() < 0.5, "{series}");
    }
    assert!(count("noctule_plans_ended_total{status=\"failed\"}") < 0.5);
    for (series, told) in [
        ("noctule_search_iterations_total", "iteration"),
        ("noctule_search_evaluations_total", "evaluations"),
    ] {
        let told = status[told].as_f64().expect("a count");
        assert!((count(series) - told).abs() < 0.5, "{series} is not {told}");
    }
    assert!(count("noctule_http_connections") >= 1.0);
    let build = format!(
        "noctule_build_info{{version=\"{}\"}}",
        env!("CARGO_PKG_VERSION")
    );
    assert!((count(&build) - 1.0).abs() < 0.5);
}

#[tokio::test]
async fn a_run_whose_plan_is_deleted_is_counted_as_lost() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--workers", "1"]);
    let address = service.submit(&a_run_of(3_600_000)).await;
    drop(running(&service, &address).await);
    let lost = async || {
        read_from(&service)
            .await
            .value("noctule_plan_runs_lost_total")
    };
    assert!(lost().await < 0.5);
    let deleted = service.request(Method::DELETE, &address).send().await;
    assert_eq!(deleted.expect("an answer").status(), 204);
    eventually(async || lost().await > 0.5).await;
    // The only worker is free once it has concluded that run.
    let next = service.submit(&a_plan(2, 1, 1)).await;
    service.ended(&next).await;
    assert!((lost().await - 1.0).abs() < 0.5, "it is counted once");
}

/// After the loss no run of the plan is left to count it.
#[tokio::test]
async fn a_plan_that_loses_its_workers_is_counted_as_failed() {
    for_every_backend(async |backend| {
        let place = Place::new(backend);
        let serve = || place.serve(&["--workers", "1"]);
        let mut service = serve();
        let address = service.submit(&a_run_of(3_600_000)).await;
        for n_lost in 0..5 {
            let mut stream = running(&service, &address).await;
            for _ in 0..n_lost {
                await_run(&mut stream).await;
            }
            service.kill();
            service = serve();
        }
        let status = service.ended(&address).await;
        assert_eq!(status["error"]["type"], "/problems/worker-lost", "{status}");
        let ended = "noctule_plans_ended_total{status=\"failed\"}";
        eventually(async || read_from(&service).await.value(ended) > 0.5).await;
        let runs = "noctule_plan_run_seconds_count{status=\"failed\"}";
        let reading = read_from(&service).await;
        assert!(reading.value(ended) < 1.5);
        assert!(reading.value(runs) < 0.5, "nobody knows how long it ran");
    })
    .await;
}

/// A service that restarts endlessly accepts nothing, so no other metric need change.
#[tokio::test]
async fn a_restart_changes_the_start_time() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let start = async || {
        let service = Service::start(directory.path(), &[]);
        let reading = read_from(&service).await;
        reading.value("noctule_start_time_seconds")
    };
    let now_s = || {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        since.expect("after 1970").as_secs_f64()
    };
    // The metric has millisecond resolution.
    let before = now_s() - 0.001;
    let first = start().await;
    let second = start().await;
    assert!(before <= first && first < second && second <= now_s());
}

/// Every metric that the dashboard shows or an alert uses exists.
#[tokio::test]
async fn dashboard_and_alerts_name_only_existing_metrics() {
    const DASHBOARD: &str = include_str!("../../deploy/grafana/noctule.json");
    const ALERTS: &str = include_str!("../../deploy/prometheus/alerts.yml");
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    let address = service.submit(&scenario()).await;
    service.ended(&address).await;
    let reading = read_from(&service).await;
    // Documentation names a histogram by its family; queries name its series.
    let histograms = reading.families.iter();
    let histograms = histograms.filter(|(_, kind)| *kind == "histogram");
    let mut exported = reading.names();
    exported.extend(histograms.map(|(name, _)| name.as_str()));

    let _: Value = serde_json::from_str(DASHBOARD).expect("JSON");
    let _: Value = serde_yaml_ng::from_str(ALERTS).expect("YAML");
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let mut named: Vec<&str> = [DASHBOARD, ALERTS]
        .iter()
        .flat_map(|text| text.split(|letter| !is_part(letter)))
        .filter(|word| word.starts_with("noctule_"))
        .collect();
    named.sort_unstable();
    named.dedup();
    assert!(named.len() > 15, "{named:?}");
    for name in named {
        assert!(exported.contains(name), "{name} is not in {exported:#?}");
    }
}

/// `docs/OPERATIONS.md` describes every metric, and no others.
#[tokio::test]
async fn the_manual_lists_exactly_the_metrics() {
    let manual = include_str!("../../docs/OPERATIONS.md");
    let api = Api::new();
    api.submit().await;
    let families = read(&api).await.families;
    for (family, kind) in &families {
        let suffix = match kind.as_str() {
            "counter" => "_total",
            "info" => "_info",
            _ => "",
        };
        let row = format!("| `{family}{suffix}` |");
        assert!(manual.contains(&row), "no row begins with {row}");
    }
    let rows = manual
        .lines()
        .filter(|line| line.starts_with("| `noctule_"));
    assert_eq!(rows.count(), families.len());
}

#[tokio::test]
async fn streams_are_counted_while_they_are_open() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    let mut long = scenario();
    long["planner"] = json!({"population": 200, "iterations": 100_000, "seed": 1});
    let address = service.submit(&long).await;
    let stream = service.get(&format!("{address}/events")).send().await;
    let stream = stream.expect("an answer");
    let open = |reading: &Reading| reading.value("noctule_http_event_streams");
    assert!((open(&read_from(&service).await) - 1.0).abs() < 0.5);
    drop(stream);
    eventually(async || open(&read_from(&service).await) < 0.5).await;
}
