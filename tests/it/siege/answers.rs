//! Long answers that nobody reads.

use http_body_util::BodyExt as _;
use reqwest::StatusCode;
use serde_json::{Value, json};

use super::still::Http2;
use crate::support::lives::waiting;
use crate::support::patience::eventually;
use crate::support::process::Service;
use crate::support::scenario;

/// A scenario of more than a mebibyte.
fn over_a_grid() -> Value {
    const SIDE: usize = 600;
    let mut document = scenario();
    document["terrain"] = json!({
        "kind": "grid", "origin": {"x": -2000, "y": -2000}, "cell": 10, "columns": SIDE, "rows": SIDE,
        "elevations": vec![-0.5; SIDE * SIDE],
    });
    document
}

#[tokio::test(flavor = "multi_thread")]
async fn unread_answers_take_little_memory_and_make_room_for_those_that_are_read() {
    const ROOM: usize = 8 << 20;
    const ASKED: usize = 40;
    let directory = tempfile::tempdir().expect("a temporary directory");
    let room = ROOM.to_string();
    let limits = [
        "--http-answers-bytes",
        &room,
        "--http-head-timeout",
        "1",
        "--http-body-timeout",
        "5",
        "--workers",
        "1",
        "--grace",
        "0",
    ];
    let service = Service::start(directory.path(), &limits);
    let waiting = waiting(&service).await;
    let plan = service.submit(&over_a_grid()).await;
    let document = format!("{plan}/scenario");
    let length = service.bytes(&document).await.len();
    assert!(length > 1 << 20, "{length} bytes");

    let before = service.peak_rss_kib();
    let mut connection = Http2::new(service.address(), 4096).await;
    // Whoever follows a plan keeps the connection, with whatever else is asked for on it.
    let followed = service.url(&format!("{waiting}/events"));
    let followed = connection.get(followed).await;
    let mut unread = Vec::new();
    for _ in 0..ASKED {
        let answer = connection.get(service.url(&document)).await;
        if answer.status() == StatusCode::OK {
            unread.push(answer);
            continue;
        }
        assert_eq!(answer.status(), StatusCode::SERVICE_UNAVAILABLE);
        assert!(answer.headers().contains_key("retry-after"));
        let problem = answer.collect().await.expect("a whole body").to_bytes();
        let problem = String::from_utf8_lossy(&problem).into_owned();
        assert!(problem.contains("/problems/busy"), "{problem}");
    }
    assert_eq!(unread.len(), ROOM / length);
    let grown = service.peak_rss_kib() - before;
    assert!(grown < 32 * 1024, "{grown} KiB more");

    // Another caller gets all of it, once the others have taken nothing for a while.
    let whole = async || {
        let answer = service.get(&document).send().await.expect("an answer");
        answer
            .bytes()
            .await
            .is_ok_and(|bytes| bytes.len() == length)
    };
    eventually(whole).await;
    let let_go = unread.swap_remove(0).collect().await;
    let_go.expect_err("it was let go of");
    drop(followed);
}
