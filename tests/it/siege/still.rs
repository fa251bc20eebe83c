//! Connections on which nothing moves, by either version of HTTP: let go, but for streams of events.

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

/// A service that lets go soon, and a plan that waits there.
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

/// A connection of HTTP/2, which answers pings and asks for nothing by itself.
struct Http2 {
    sender: SendRequest<Empty<Bytes>>,
    until_closed: JoinHandle<hyper::Result<()>>,
}

impl Http2 {
    /// Taking at most so many bytes of an answer before somebody reads them.
    async fn new(service: &Service, window: u32) -> Self {
        let stream = TcpStream::connect(service.address())
            .await
            .expect("connected");
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

    async fn get(&mut self, url: String) -> Response<Incoming> {
        let request = Request::get(url).body(Empty::<Bytes>::new());
        let answer = self.sender.send_request(request.expect("a request"));
        in_time(answer).await.expect("an answer")
    }

    /// Nothing more is asked meanwhile.
    async fn closed(self) {
        let closed = in_time(self.until_closed).await;
        // Whether it was told first or not.
        let _ = closed.expect("no panic");
    }
}

const WINDOW: u32 = 65_535;

#[tokio::test(flavor = "multi_thread")]
async fn who_asks_for_nothing_more_is_let_go_and_a_stream_stays() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let (service, waiting) = impatient(directory.path()).await;
    let events = format!("{waiting}/events");
    let mut following = Http2::new(&service, WINDOW).await;
    let second = following.get(service.url(&events)).await.into_body();
    let mut first = service.get(&events).send().await.expect("an answer");

    // One after the other, so that the streams have stood still for much longer than is allowed.
    for _ in 0..3 {
        Http2::new(&service, WINDOW).await.closed().await;
        let mut asked = Http2::new(&service, WINDOW).await;
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

/// The largest file of the page, so that much of it waits to be sent.
const LARGE: &str = "/page/vendor/three.js";

#[tokio::test(flavor = "multi_thread")]
async fn who_does_not_take_what_it_asked_for_is_let_go() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let (service, _) = impatient(directory.path()).await;

    let mut unread = TcpStream::connect(service.address())
        .await
        .expect("connected");
    let request = format!("GET {LARGE} HTTP/1.1\r\nhost: localhost\r\n\r\n");
    let requests = request.repeat(20);
    unread.write_all(requests.as_bytes()).await.expect("sent");
    // What is said to a connection that is over is answered with a reset.
    let said = tokio::sync::Mutex::new(unread);
    eventually(async || said.lock().await.write_all(b"\r\n").await.is_err()).await;

    let mut unread = Http2::new(&service, 1).await;
    let answer = unread.get(service.url(LARGE)).await;
    assert_eq!(answer.status(), 200);
    unread.closed().await;
    drop(answer);
}

/// Who has asked for nothing does not get the time of those who have yet to take an answer.
#[tokio::test(flavor = "multi_thread")]
async fn a_head_that_never_ends_is_waited_for_no_longer_than_it_may_take() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let limits = ["--http-head-timeout", "1", "--http-body-timeout", "3600"];
    let service = Service::start(directory.path(), &limits);
    let asked = "GET /livez HTTP/1.1\r\nhost: localhost\r\n\r\n";
    let half = "POST /plans HT";
    // The first letter might begin the other version, too.
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
