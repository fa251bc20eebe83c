//! Idle connections, over either version of HTTP: closed, unless they carry an event stream.

use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

use bytes::Bytes;
use http_body_util::{BodyExt as _, Empty};
use hyper::client::conn::http2::{self, SendRequest};
use hyper::{Request, Response, body::Incoming};
use hyper_util::rt::{TokioExecutor, TokioIo};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::task::JoinHandle;

use crate::support::lives::waiting;
use crate::support::patience::{eventually, in_time};
use crate::support::process::Service;

/// A service with short timeouts, and a plan that waits in its queue.
async fn impatient(data_dir: &Path) -> (Service, String) {
    let limits = [
        "--http-head-timeout",
        "1",
        "--http-body-timeout",
        "1",
        "--workers",
        "1",
        "--grace",
        "0",
    ];
    let service = Service::start(data_dir, &limits);
    let waiting = waiting(&service).await;
    (service, waiting)
}

/// An HTTP/2 connection that answers pings and sends nothing else by itself.
pub(super) struct Http2 {
    sender: SendRequest<Empty<Bytes>>,
    until_closed: JoinHandle<hyper::Result<()>>,
}

impl Http2 {
    /// Accepts at most `window` bytes of a response until they are read.
    pub(super) async fn new(service: SocketAddr, window: u32) -> Self {
        let stream = TcpStream::connect(service).await.expect("connected");
        let (sender, connection) = http2::Builder::new(TokioExecutor::new())
            .initial_stream_window_size(window)
            .handshake(TokioIo::new(stream))
            .await
            .expect("it speaks HTTP/2");
        Self {
            sender,
            until_closed: tokio::spawn(connection),
        }
    }

    pub(super) async fn get(&mut self, url: String) -> Response<Incoming> {
        let request = Request::get(url).body(Empty::<Bytes>::new());
        let answer = self.sender.send_request(request.expect("a request"));
        in_time(answer).await.expect("an answer")
    }

    /// Waits until the service closes it; sends nothing meanwhile.
    async fn closed(self) {
        let closed = in_time(self.until_closed).await;
        // With or without a GOAWAY.
        let _ = closed.expect("no panic");
    }
}

const WINDOW: u32 = 65_535;

#[tokio::test(flavor = "multi_thread")]
async fn idle_connections_are_closed_and_event_streams_stay_open() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let (service, waiting) = impatient(directory.path()).await;
    let events = format!("{waiting}/events");
    let mut following = Http2::new(service.address(), WINDOW).await;
    let second = following.get(service.url(&events)).await.into_body();
    let mut first = service.get(&events).send().await.expect("an answer");

    // One after the other, so that the streams stay idle for much longer than the timeout.
    for _ in 0..3 {
        Http2::new(service.address(), WINDOW).await.closed().await;
        let mut asked = Http2::new(service.address(), WINDOW).await;
        let answer = asked.get(service.url("/livez")).await;
        assert_eq!(answer.status(), 200);
        answer.collect().await.expect("a whole body");
        asked.closed().await;
    }

    let cancelled = service.request(reqwest::Method::POST, &format!("{waiting}/cancel"));
    assert!(
        cancelled
            .send()
            .await
            .expect("an answer")
            .status()
            .is_success()
    );
    let mut told = Vec::new();
    while let Some(some) = in_time(first.chunk()).await.expect("an unbroken stream") {
        told.extend_from_slice(&some);
    }
    let also_told = in_time(second.collect()).await.expect("an unbroken stream");
    for told in [Bytes::from(told), also_told.to_bytes()] {
        let told = String::from_utf8_lossy(&told).into_owned();
        assert!(told.contains("\nevent: end\n"), "{told}");
    }
    following.closed().await;
}

/// The largest file of the page, so that much of it stays unsent.
const LARGE: &str = "/page/vendor/three.js";

#[tokio::test(flavor = "multi_thread")]
async fn a_caller_who_does_not_read_the_response_is_disconnected() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let (service, _) = impatient(directory.path()).await;

    let mut unread = TcpStream::connect(service.address())
        .await
        .expect("connected");
    let request = format!("GET {LARGE} HTTP/1.1\r\nhost: localhost\r\n\r\n");
    let requests = request.repeat(20);
    unread.write_all(requests.as_bytes()).await.expect("sent");
    // Writing to a closed connection is answered with a reset.
    let said = tokio::sync::Mutex::new(unread);
    eventually(async || said.lock().await.write_all(b"\r\n").await.is_err()).await;

    let mut unread = Http2::new(service.address(), 1).await;
    let answer = unread.get(service.url(LARGE)).await;
    assert_eq!(answer.status(), 200);
    unread.closed().await;
    drop(answer);
}

/// A caller who never completes a head is not granted the body timeout.
#[tokio::test(flavor = "multi_thread")]
async fn an_incomplete_head_is_closed_after_the_head_timeout() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let limits = ["--http-head-timeout", "1", "--http-body-timeout", "3600"];
    let service = Service::start(directory.path(), &limits);
    let asked = "GET /livez HTTP/1.1\r\nhost: localhost\r\n\r\n";
    let half = "POST /plans HT";
    // The first letter could also begin HTTP/2.
    for (n_asked, alone) in [(0, 0), (1, 0), (2, 0), (0, 1)] {
        let mut stream = TcpStream::connect(service.address())
            .await
            .expect("connected");
        let said = asked.repeat(n_asked) + half;
        let (first, rest) = said.split_at(alone);
        stream.write_all(first.as_bytes()).await.expect("sent");
        tokio::time::sleep(Duration::from_millis(200)).await;
        stream.write_all(rest.as_bytes()).await.expect("sent");
        let mut told = String::new();
        in_time(stream.read_to_string(&mut told))
            .await
            .expect("an end");
        assert_eq!(told.matches("HTTP/1.1 200 OK").count(), n_asked, "{told}");
    }
}
