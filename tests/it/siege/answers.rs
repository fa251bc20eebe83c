//! Long answers that nobody reads.

use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use bytes::Bytes;
use futures_util::future::join_all;
use http_body_util::{BodyExt as _, Empty};
use hyper::Request;
use hyper::client::conn::http2;
use hyper_util::rt::{TokioExecutor, TokioIo};
use reqwest::StatusCode;
use serde_json::{Value, json};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::task::JoinHandle;

use super::still::Http2;
use crate::support::lives::waiting;
use crate::support::patience::{eventually, in_time};
use crate::support::process::Service;
use crate::support::scenario;

/// A scenario of some five bytes for each node of a square grid.
fn over_a_grid(side: usize) -> Value {
    let mut document = scenario();
    document["terrain"] = json!({
        "kind": "grid", "origin": {"x": -2000, "y": -2000}, "cell": 6000 / side, "columns": side, "rows": side,
        "elevations": vec![-0.5; side * side],
    });
    document
}

/// A connection of which nothing more is read once this is set.
struct Deaf {
    stream: TcpStream,
    is_deaf: Arc<AtomicBool>,
}

impl AsyncRead for Deaf {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if self.is_deaf.load(Ordering::Relaxed) {
            return Poll::Pending;
        }
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Deaf {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

/// HTTP/2 takes in what its window has room for, whether the system takes it or not.
#[tokio::test(flavor = "multi_thread")]
async fn wide_windows_take_no_more_memory() {
    const ASKED: usize = 250;
    const WIDE: u32 = 1 << 30;
    let directory = tempfile::tempdir().expect("a temporary directory");
    let room = (8 << 20).to_string();
    let limits = [
        "--http-answers-bytes",
        &room,
        "--workers",
        "1",
        "--grace",
        "0",
    ];
    let service = Service::start(directory.path(), &limits);
    waiting(&service).await;
    let plan = service.submit(&over_a_grid(250)).await;
    let document = service.url(&format!("{plan}/scenario"));

    let is_deaf = Arc::new(AtomicBool::new(false));
    let stream = TcpStream::connect(service.address()).await;
    let deaf = Deaf {
        stream: stream.expect("connected"),
        is_deaf: is_deaf.clone(),
    };
    let (mut sender, connection) = http2::Builder::new(TokioExecutor::new())
        .initial_stream_window_size(WIDE)
        .initial_connection_window_size(WIDE)
        .handshake(TokioIo::new(deaf))
        .await
        .expect("it speaks HTTP/2");
    tokio::spawn(connection);
    let mut ask = |uri: &str| {
        let request = Request::get(uri).body(Empty::<Bytes>::new());
        sender.send_request(request.expect("a request"))
    };
    let heard = in_time(ask(&service.url("/livez"))).await;
    assert_eq!(heard.expect("an answer").status(), StatusCode::OK);

    is_deaf.store(true, Ordering::Relaxed);
    let before = service.peak_rss_kib();
    let mut asked = Vec::new();
    for _ in 0..ASKED {
        asked.push(tokio::spawn(ask(&document)));
        // One after the other, about: documents that are being read are not meant here.
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    eventually(async || {
        let metrics = service.bytes("/metrics").await;
        let metrics = String::from_utf8_lossy(&metrics).into_owned();
        let of_route = |line: &&str| {
            line.starts_with("noctule_http_requests_total{") && line.contains("/scenario\"")
        };
        let counts = metrics.lines().filter(of_route);
        let counts = counts.filter_map(|line| line.rsplit(' ').next()?.parse::<usize>().ok());
        counts.sum::<usize>() >= ASKED
    })
    .await;
    let grown = service.peak_rss_kib() - before;
    assert!(grown < 48 * 1024, "{grown} KiB more");
    asked.iter().for_each(JoinHandle::abort);
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
    let plan = service.submit(&over_a_grid(600)).await;
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

/// Exports wait for a core, and each needs the scenario as well as the result.
#[tokio::test(flavor = "multi_thread")]
async fn documents_that_wait_to_be_exported_take_little_memory() {
    const ASKED: usize = 400;
    let directory = tempfile::tempdir().expect("a temporary directory");
    let room = (8 << 20).to_string();
    let service = Service::start(directory.path(), &["--http-answers-bytes", &room]);
    let mut document = over_a_grid(600);
    document["planner"]["iterations"] = 1.into();
    let plan = service.submit(&document).await;
    service.ended(&plan).await;
    let export = format!("{plan}/result?format=csv");
    let whole = service.bytes(&export).await;

    let before = service.peak_rss_kib();
    let exports = (0..ASKED).map(async |_| {
        let answer = service.get(&export).send().await.expect("an answer");
        let status = answer.status();
        (status, answer.bytes().await.expect("a whole body"))
    });
    let answers = in_time(join_all(exports)).await;
    let grown = service.peak_rss_kib() - before;
    assert!(grown < 300 * 1024, "{grown} KiB more");
    let (written, refused): (Vec<_>, Vec<_>) = answers
        .into_iter()
        .partition(|(status, _)| *status == StatusCode::OK);
    assert!(!written.is_empty() && !refused.is_empty());
    assert!(written.iter().all(|(_, body)| *body == whole));
    for (status, body) in refused {
        assert_eq!(status, StatusCode::SERVICE_UNAVAILABLE);
        let problem: Value = serde_json::from_slice(&body).expect("JSON");
        assert_eq!(problem["type"], "/problems/busy");
    }
    assert_eq!(service.bytes(&export).await, whole);
}
