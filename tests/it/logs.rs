//! The log: which lines it has, and that each names its request and its plan.

use std::fs::{self, File};
use std::path::Path;
use std::process::Stdio;

use serde_json::{Value, json};

use crate::support::collector::{Collector, Taken};
use crate::support::patience::eventually;
use crate::support::process::{Service, json_of};
use crate::support::scenario;

const TRACE_ID: &str = "4bf92f3577b34da6a3ce929d0e0e4736";

/// Posts `document` to a service with JSON logs, as request `caller-1` of a trace, and stops the service when
/// the plan has ended. The plan's id and the log lines.
async fn logged(arguments: &[&str], document: &Value) -> (String, Vec<Value>) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let log = directory.path().join("log");
    let file = File::create(&log).expect("a file");
    // Few enough connections for any machine's file limit; otherwise the service logs a warning.
    let few = ["--http-max-connections", "100"];
    let arguments = [&["--log-format", "json"], &few[..], arguments].concat();
    let service = Service::start_with_log(&directory.path().join("data"), &arguments, file);
    let request = service
        .request(reqwest::Method::POST, "/plans")
        .header("x-request-id", "caller-1")
        .header("traceparent", format!("00-{TRACE_ID}-00f067aa0ba902b7-01"))
        .json(document);
    let accepted = json_of(request).await;
    let id = accepted["id"].as_str().expect("an id").to_owned();
    service.ended(&format!("/plans/{id}")).await;
    service.signal("TERM");
    assert!(service.exit().await.success());
    (id, lines(&log))
}

fn lines(log: &Path) -> Vec<Value> {
    let text = fs::read_to_string(log).expect("UTF-8");
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("no JSON: {line}")))
        .collect()
}

fn line<'a>(lines: &'a [Value], message: &str) -> &'a Value {
    let found = lines.iter().find(|line| line["message"] == message);
    found.unwrap_or_else(|| panic!("{message} is not in {lines:#?}"))
}

#[tokio::test]
async fn log_lines_of_a_plan_name_the_plan_and_its_request() {
    let (id, lines) = logged(&["--log", "debug"], &scenario()).await;
    for (message, span) in [
        ("accepted", "request"),
        ("answered", "request"),
        ("plan started", "plan"),
        ("plan ended", "plan"),
    ] {
        let line = line(&lines, message);
        assert_eq!(
            line["span"],
            json!({"name": span, "plan_id": id, "request_id": "caller-1", "trace_id": TRACE_ID}),
            "{line}"
        );
    }
    let ended = line(&lines, "plan ended");
    assert_eq!(ended["status"], "succeeded");
    assert!(ended["run_ms"].is_number(), "{ended}");
}

/// The spans that a collector received.
fn spans(collector: &Collector) -> Vec<Value> {
    let mut spans = Vec::new();
    for Taken {
        path,
        headers,
        document,
    } in collector.taken()
    {
        assert_eq!(path, "/v1/traces");
        let authorized = headers
            .iter()
            .filter(|line| *line == "authorization: Bearer hush");
        assert_eq!(authorized.count(), 1, "{headers:?}");
        for resource in document["resourceSpans"].as_array().expect("a list") {
            let attributes = resource["resource"]["attributes"].to_string();
            assert!(attributes.contains("noctule"), "{attributes}");
            for scope in resource["scopeSpans"].as_array().expect("a list") {
                spans.extend(scope["spans"].as_array().expect("a list").iter().cloned());
            }
        }
    }
    spans
}

#[tokio::test]
async fn request_and_run_spans_are_exported_within_the_callers_trace() {
    let collector = Collector::start();
    let endpoint = format!("http://{}", collector.address);
    let (id, lines) = logged(
        &[
            "--otlp-endpoint",
            &endpoint,
            "--otlp-headers",
            "authorization=Bearer%20hush",
            "--log",
            "warn",
        ],
        &scenario(),
    )
    .await;
    assert!(lines.is_empty(), "{lines:#?}");
    let spans = spans(&collector);
    let span = |name: &str| {
        let found = spans.iter().find(|span| span["name"] == name);
        found.unwrap_or_else(|| panic!("{name} is not in {spans:#?}"))
    };
    let (request, run) = (span("POST /plans"), span("plan"));
    assert_eq!(request["traceId"], TRACE_ID);
    assert_eq!(request["parentSpanId"], "00f067aa0ba902b7");
    assert_eq!(run["traceId"], TRACE_ID);
    assert_eq!(run["parentSpanId"], request["spanId"]);
    for (span, part) in [
        (request, "\"caller-1\""),
        (request, "http.response.status_code"),
        (request, &id),
        (run, &id),
        (run, "plan ended"),
    ] {
        assert!(span.to_string().contains(part), "{part} is not in {span:#}");
    }
}

#[tokio::test]
async fn without_a_collector_plans_run_and_one_line_is_logged() {
    let endpoint = format!("http://{}", nobodys());
    let (_, lines) = logged(&["--otlp-endpoint", &endpoint], &scenario()).await;
    let told = lines
        .iter()
        .filter(|line| line["message"] == "traces cannot be exported; they are dropped");
    assert_eq!(told.count(), 1, "{lines:#?}");
    line(&lines, "plan ended");
}

/// A port that nothing listens on: it has just been released.
fn nobodys() -> std::net::SocketAddr {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    listener.local_addr().expect("bound")
}

/// Webhooks are sent after both the request and the run are over.
#[tokio::test]
async fn a_failed_webhook_is_logged_with_its_plan() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let (log, secret) = (
        directory.path().join("log"),
        directory.path().join("secret"),
    );
    let text = "whsec_MDEyMzQ1Njc4OWFiY2RlZjAxMjM0NTY3ODlhYmNkZWY=";
    fs::write(&secret, text).expect("written");
    let arguments = [
        "--log-format",
        "json",
        "--webhook-allow-private",
        "--webhook-secret-file",
        secret.to_str().expect("UTF-8"),
    ];
    let file = File::create(&log).expect("a file");
    let service = Service::start_with_log(&directory.path().join("data"), &arguments, file);
    let request = service
        .request(reqwest::Method::POST, "/plans")
        .header("noctule-webhook", format!("http://{}/", nobodys()))
        .json(&scenario());
    let answer = request.send().await.expect("an answer");
    let accepted: Value = answer.json().await.expect("JSON");
    let tried = || {
        let text = fs::read_to_string(&log).expect("UTF-8");
        let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
        let mut lines = whole
            .lines()
            .map(|line| serde_json::from_str(line).expect("JSON"));
        lines.find(|line: &Value| line["message"] == "a webhook did not get through")
    };
    eventually(async || tried().is_some()).await;
    assert_eq!(tried().expect("told")["plan_id"], accepted["id"]);
}

#[tokio::test]
async fn a_log_that_nobody_reads_stops_nothing() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    // The pipe is full after some hundred lines.
    let arguments = ["--log", "trace"];
    let service = Service::start_with_log(directory.path(), &arguments, Stdio::piped());
    for _ in 0..500 {
        service.bytes("/version").await;
    }
    let address = service.submit(&scenario()).await;
    service.ended(&address).await;
    service.signal("TERM");
    assert!(service.exit().await.success());
}

/// Whether a log line has a field `plan` that is written with `%` or `?`: its value then is no word of ours.
fn logs_as_plan(text: &str) -> bool {
    text.match_indices("plan").any(|(at, word)| {
        let (before, after) = (&text[..at], &text[at + word.len()..]);
        let is_whole = !before.ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let value = after.trim_start().strip_prefix('=').map(str::trim_start);
        is_whole && value.is_some_and(|value| value.starts_with(['%', '?']))
    })
}

/// Searching the log for a plan takes one field name.
#[test]
fn no_source_logs_a_plan_id_as_plan() {
    for (text, expected) in [
        ("info!(plan = %id, \"a\")", true),
        ("info!(a, plan=?id)", true),
        ("info!(\n    plan\n = %id)", true),
        ("info!(plan_id = %id, plan = \"a\")", false),
        ("info!(of_plan = %id)", false),
    ] {
        assert_eq!(logs_as_plan(text), expected, "{text}");
    }
    let mut rooms = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("src")];
    while let Some(room) = rooms.pop() {
        for entry in fs::read_dir(&room).expect("a directory") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                rooms.push(path);
            } else if path.extension().is_some_and(|end| end == "rs") {
                let text = fs::read_to_string(&path).expect("UTF-8");
                assert!(!logs_as_plan(&text), "{}", path.display());
            }
        }
    }
}
