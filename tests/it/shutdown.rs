//! SIGTERM on the real binary: nothing is lost, streams end, and the process exits in time.

use std::fs::{self, File};
use std::net::TcpListener;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use futures_util::future::join_all;
use noctule::http::{Phase, server};
use reqwest::Method;
use serde_json::Value;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::sync::watch;

use crate::support::lives::{a_run_of, await_run, life, running, running_at};
use crate::support::patience::{PATIENCE, in_time};
use crate::support::process::Service;
use crate::support::sse::{Block, events};
use crate::support::stores::{Place, for_every_backend};

/// Longer than any test waits for a service to end: a plan in milliseconds, a grace period in seconds.
const AN_HOUR_MS: u64 = 3_600_000;
const AN_HOUR: &str = "3600";

/// An exit that waited for such a plan, for a stream, or for a whole idle grace period would come later.
const LONG_BEFORE: Duration = Duration::from_secs(30);

#[tokio::test]
async fn an_idle_service_exits_at_once() {
    for_every_backend(async |backend| {
        for signal in ["TERM", "INT"] {
            let place = Place::new(backend);
            let service = place.serve(&["--grace", AN_HOUR]);
            assert_eq!(service.bytes("/readyz").await, r#"{"status":"ok"}"#);
            let begun = Instant::now();
            service.signal(signal);
            assert!(service.exit().await.success());
            assert!(begun.elapsed() < LONG_BEFORE, "{:?}", begun.elapsed());
        }
    })
    .await;
}

#[tokio::test]
async fn a_plan_that_outlasts_the_grace_period_runs_again_after_a_restart() {
    for_every_backend(async |backend| {
        let place = Place::new(backend);
        let service = place.serve(&["--workers", "1", "--grace", "5"]);
        let address = service.submit(&a_run_of(AN_HOUR_MS)).await;
        let waiting = service.submit(&a_run_of(10)).await;
        let stream = running(&service, &address).await;

        let begun = Instant::now();
        service.signal("TERM");
        service.until_ready(503).await;
        let refused = service.post(&a_run_of(10)).await;
        assert_eq!(refused.status(), 503);
        assert!(refused.headers().contains_key("retry-after"));
        let problem: Value = refused.json().await.expect("JSON");
        assert_eq!(problem["type"], "/problems/draining");

        let rest = stream.rest().await;
        assert_eq!(
            rest.last(),
            Some(&Block::Comment("the service is shutting down".to_owned()))
        );
        assert!(
            events(&rest).iter().all(|(_, name)| name != "end"),
            "the plan has not ended"
        );
        assert!(service.exit().await.success());
        assert!(begun.elapsed() < LONG_BEFORE, "{:?}", begun.elapsed());

        let service = place.serve(&["--workers", "1"]);
        let mut again = running(&service, &address).await;
        await_run(&mut again).await;
        let cancel = service.request(Method::POST, &format!("{address}/cancel"));
        cancel.send().await.expect("an answer");
        for (address, status) in [(&address, "cancelled"), (&waiting, "succeeded")] {
            assert_eq!(service.ended(address).await["status"], status);
        }
        let told = life(&service, &address).await;
        let (both_runs, end) = told.split_at(4);
        assert_eq!(both_runs, ["queued", "running", "queued", "running"]);
        // Cancelling a running plan repeats its status `running`.
        assert_eq!(end, ["running", "cancelled"]);
        assert_eq!(
            life(&service, &waiting).await,
            ["queued", "running", "succeeded"]
        );
    })
    .await;
}

#[tokio::test]
async fn a_plan_that_ends_within_the_grace_period_keeps_its_result() {
    for_every_backend(async |backend| {
        let place = Place::new(backend);
        let service = place.serve(&["--workers", "1", "--grace", "30"]);
        let address = service.submit(&a_run_of(1000)).await;
        let stream = running(&service, &address).await;
        service.signal("TERM");
        let rest = stream.rest().await;
        let last = rest.last();
        assert!(
            matches!(last, Some(Block::Event { name, .. }) if name == "end"),
            "{last:?}"
        );
        assert!(service.exit().await.success());

        let service = place.serve(&["--workers", "1"]);
        assert_eq!(service.ended(&address).await["status"], "succeeded");
        assert_eq!(
            life(&service, &address).await,
            ["queued", "running", "succeeded"]
        );
    })
    .await;
}

#[tokio::test]
async fn a_second_signal_exits_without_waiting() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--workers", "1", "--grace", AN_HOUR]);
    let address = service.submit(&a_run_of(AN_HOUR_MS)).await;
    let _stream = running(&service, &address).await;
    service.signal("TERM");
    service.until_ready(503).await;
    service.signal("TERM");
    assert_eq!(service.exit().await.code(), Some(1));
}

#[tokio::test]
async fn open_streams_do_not_delay_the_exit() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--workers", "1", "--grace", "8"]);
    let address = service.submit(&a_run_of(AN_HOUR_MS)).await;
    // Of so many readers it only matters that they are released.
    let streams = join_all((0..500).map(|_| running_at(&service, &address, 0.01))).await;
    let begun = Instant::now();
    service.signal("TERM");
    service.until_ready(503).await;
    for stream in streams {
        let rest = stream.rest().await;
        assert!(
            matches!(rest.last(), Some(Block::Comment(_))),
            "{:?}",
            rest.last()
        );
    }
    assert!(service.exit().await.success());
    assert!(begun.elapsed() < LONG_BEFORE, "{:?}", begun.elapsed());
    let service = Service::start(directory.path(), &["--workers", "1", "--grace", "0"]);
    let status: Value = serde_json::from_slice(&service.bytes(&address).await).expect("JSON");
    let status = status["status"].as_str().expect("text");
    assert!(["queued", "running"].contains(&status), "{status}");
}

/// The store is on a server that accepts connections and never says anything.
#[tokio::test]
async fn a_service_that_is_starting_ends_at_the_first_signal_and_outlives_a_hangup() {
    let server = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let store = format!("nats://{}", server.local_addr().expect("bound"));
    let directory = tempfile::tempdir().expect("a temporary directory");
    let log = directory.path().join("log");
    let file = File::create(&log).expect("a file");
    let service = Service::starting(directory.path(), &["--store", &store], file);
    let accepted = tokio::task::spawn_blocking(move || (server.accept(), server));
    let connected = in_time(accepted).await.expect("no panic");
    service.signal("HUP");
    service.signal("TERM");
    let status = service.exit().await;
    let log = fs::read_to_string(&log).expect("UTF-8");
    assert!(status.success(), "{status}: {log}");
    assert!(
        log.contains("leaving before the service has begun"),
        "{log}"
    );
    assert!(!log.contains("panicked"), "{log}");
    drop(connected);
}

/// They wait in the listener's backlog, and nothing tells them from those who came a moment earlier.
#[tokio::test]
async fn callers_whom_nobody_has_taken_yet_are_answered_at_the_end() {
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await;
    let listener = listener.expect("a free port");
    let address = listener.local_addr().expect("bound");
    let (_phase, watched) = watch::channel(Phase::Stopping);
    let mut callers = Vec::new();
    for _ in 0..20 {
        let mut caller = TcpStream::connect(address).await.expect("a connection");
        let request = b"GET / HTTP/1.1\r\nhost: here\r\n\r\n";
        caller.write_all(request).await.expect("sent");
        callers.push(caller);
    }
    let settings = server::Settings {
        head_timeout: Duration::from_secs(30),
        body_timeout: Duration::from_secs(30),
        reader_patience: Duration::from_secs(30),
        max_connections: 30,
        patience: PATIENCE,
        instruments: Arc::default(),
    };
    let router = Router::new().fallback(async || "here");
    server::serve(listener, router, watched, settings).await;
    for mut caller in callers {
        let mut answer = String::new();
        caller.read_to_string(&mut answer).await.expect("an answer");
        assert!(answer.starts_with("HTTP/1.1 200 "), "{answer}");
    }
}
