//! Masses of callers who send too slowly or nothing at all, while others are served.

use std::fs::{self, File};
use std::io::ErrorKind;
use std::net::SocketAddr;
use std::process::Stdio;
use std::time::{Duration, Instant};

use futures_util::future::join_all;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::sync::watch;

use crate::support::lives::{a_plan, running};
use crate::support::patience::in_time;
use crate::support::process::Service;
use crate::support::scenario;
use crate::support::size::size;
use crate::support::sse::Block;

/// Everything received until the service closes the connection.
async fn until_closed(mut stream: TcpStream) -> String {
    let mut text = Vec::new();
    if let Err(error) = in_time(stream.read_to_end(&mut text)).await {
        assert_eq!(error.kind(), ErrorKind::ConnectionReset);
    }
    String::from_utf8(text).expect("UTF-8")
}

/// Sends `text` at once, then `drip` byte by byte until the service closes the connection.
async fn drip(address: SocketAddr, text: &str, drip: u8) -> String {
    let stream = TcpStream::connect(address).await.expect("connected");
    let (mut reading, mut writing) = stream.into_split();
    writing.write_all(text.as_bytes()).await.expect("sent");
    let dripping = tokio::spawn(async move {
        while writing.write_all(&[drip]).await.is_ok() {
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    });
    let mut text = Vec::new();
    if let Err(error) = in_time(reading.read_to_end(&mut text)).await {
        assert_eq!(error.kind(), ErrorKind::ConnectionReset);
    }
    dripping.abort();
    String::from_utf8(text).expect("UTF-8")
}

#[tokio::test(flavor = "multi_thread")]
async fn slow_and_silent_callers_are_disconnected_while_others_are_served() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let limits = [
        "--http-head-timeout",
        "1",
        "--http-body-timeout",
        "1",
        "--workers",
        "1",
    ];
    let service = Service::start(directory.path(), &limits);
    let address = service.address();
    let (done, over) = watch::channel(());
    let watched = async {
        let mut waits = Vec::new();
        while over.has_changed().is_ok() {
            let asked = Instant::now();
            let answer = service.get("/readyz").send().await.expect("an answer");
            assert_eq!(answer.status(), 200);
            waits.push(asked.elapsed());
        }
        waits.into_iter().max()
    };
    let siege = async {
        let head = "POST /plans HTTP/1.1\r\nhost: localhost\r\n";
        let body = format!("{head}content-type: application/json\r\ncontent-length: 1000\r\n\r\n");
        // One at a time: a caller who finds the listener's backlog full is not even refused.
        let mut silent = Vec::new();
        for caller in 0..size(1_000, 10_000) {
            let mut stream = TcpStream::connect(address).await.expect("connected");
            // Half of them send one request and then nothing more.
            let asks = caller % 2 == 0;
            if asks {
                let request = "GET /livez HTTP/1.1\r\nhost: localhost\r\n\r\n";
                stream.write_all(request.as_bytes()).await.expect("sent");
            }
            silent.push(async move {
                let text = until_closed(stream).await;
                assert_eq!(text.contains("200 OK"), asks, "{text}");
            });
        }
        let silent = join_all(silent);
        let heads = join_all((0..20).map(|_| drip(address, head, b'x')));
        let bodies = join_all((0..20).map(|_| drip(address, &body, b' ')));
        let (_, heads, bodies) = tokio::join!(silent, heads, bodies);
        for answer in heads {
            assert!(
                answer.is_empty() || answer.starts_with("HTTP/1.1 4"),
                "{answer}"
            );
        }
        for answer in bodies {
            assert!(answer.starts_with("HTTP/1.1 408"), "{answer}");
        }
        drop(done);
    };
    let (longest, ()) = tokio::join!(watched, siege);
    let longest = longest.expect("it was asked");
    println!("the longest wait for /readyz: {longest:.1?}");
}

/// The service raises its soft limit.
#[tokio::test(flavor = "multi_thread")]
async fn the_service_raises_its_soft_file_limit() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let few = "ulimit -S -n 128";
    let patient = ["--http-head-timeout", "3600"];
    let service = Service::start_with_few_files(few, directory.path(), &patient, Stdio::null());
    let mut asking = Vec::new();
    for _ in 0..300 {
        let mut stream = TcpStream::connect(service.address())
            .await
            .expect("connected");
        let request = "GET /livez HTTP/1.1\r\nhost: localhost\r\n\r\n";
        stream.write_all(request.as_bytes()).await.expect("sent");
        let mut first = [0; 12];
        in_time(stream.read_exact(&mut first))
            .await
            .expect("an answer");
        assert_eq!(&first, b"HTTP/1.1 200");
        asking.push(stream);
    }
}

/// The others wait until some have left.
#[tokio::test(flavor = "multi_thread")]
async fn the_hard_file_limit_bounds_the_connections() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let log = directory.path().join("log");
    let service = Service::start_with_few_files(
        "ulimit -n 128",
        &directory.path().join("data"),
        &["--http-head-timeout", "1"],
        File::create(&log).expect("a file"),
    );
    let mut silent = Vec::new();
    for _ in 0..300 {
        let stream = TcpStream::connect(service.address())
            .await
            .expect("connected");
        silent.push(until_closed(stream));
    }
    let answer = service.get("/readyz").send();
    let (answer, _) = tokio::join!(answer, join_all(silent));
    assert_eq!(answer.expect("an answer").status(), 200);
    let log = fs::read_to_string(log).expect("UTF-8");
    let told = log.matches("fewer connections than http.max_connections, 20000");
    assert_eq!(told.count(), 1, "{log}");
    assert!(log.contains("connections=96"), "{log}");
    assert!(!log.contains("could not be accepted"), "{log}");
}

/// Sent whole or byte by byte; the first bytes may belong to either version.
#[tokio::test(flavor = "multi_thread")]
async fn both_versions_of_http_are_recognised_in_any_pieces() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--workers", "1"]);
    // An empty SETTINGS frame follows the preface; the service's own begins with its length and type.
    let http2: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";
    let get: &[u8] = b"GET /livez HTTP/1.1\r\nhost: localhost\r\n\r\n";
    let put: &[u8] = b"PUT /livez HTTP/1.1\r\nhost: localhost\r\ncontent-length: 0\r\n\r\n";
    for (said, answer) in [
        (http2, &b"\x04"[..]),
        (get, b"/1.1 200"),
        (put, b"/1.1 405"),
    ] {
        for piece in [said.len(), 1] {
            let mut stream = TcpStream::connect(service.address())
                .await
                .expect("connected");
            stream.set_nodelay(true).expect("set");
            for piece in said.chunks(piece) {
                stream.write_all(piece).await.expect("sent");
                tokio::task::yield_now().await;
            }
            let mut first = [0; 12];
            let read = in_time(stream.read_exact(&mut first)).await;
            read.expect("an answer");
            let place = if answer.len() == 1 { 3 } else { 4 };
            assert!(first[place..].starts_with(answer), "{first:?}");
        }
    }
}

/// KiB per connection with an open stream. hyper alone keeps two 8 KiB buffers for each, some pages of which are
/// never touched.
const MOST_KIB: f64 = 16.0;

#[tokio::test(flavor = "multi_thread")]
async fn an_idle_stream_costs_little_memory() {
    // With the hundred opened first, as many as the service allows.
    let n_streams = size(1_000, 9_900);
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--workers", "1", "--grace", "0"]);
    // The search has allocated all its memory, some megabytes, only once its bats fly.
    let lasting = service.submit(&a_plan(10_000, 30_000, 7)).await;
    let mut search = running(&service, &lasting).await;
    let mut flown = 0;
    while flown < 3 {
        let block = search.next().await.expect("it lasts");
        flown += i32::from(matches!(block, Block::Event { name, .. } if name == "convergence"));
    }
    drop(search);
    let waiting = service.submit(&scenario()).await;
    let open = async || {
        let mut stream = TcpStream::connect(service.address())
            .await
            .expect("connected");
        let request = format!("GET {waiting}/events HTTP/1.1\r\nhost: localhost\r\n\r\n");
        stream.write_all(request.as_bytes()).await.expect("sent");
        let mut text = String::new();
        while !text.contains("\nevent: status\n") {
            let mut some = [0; 2048];
            let n = stream.read(&mut some).await.expect("an unbroken stream");
            assert!(n > 0, "{text}");
            text += std::str::from_utf8(&some[..n]).expect("UTF-8");
        }
        stream
    };
    // The first streams also pay for what the service allocates once.
    let mut streams = Vec::new();
    for _ in 0..100 {
        streams.push(open().await);
    }
    let before = service.rss_kib();
    for _ in 0..n_streams {
        streams.push(open().await);
    }
    let each = service.rss_kib().saturating_sub(before) as f64 / f64::from(n_streams);
    println!("{each:.1} KiB for each of {n_streams} idle streams");
    assert!(each <= MOST_KIB, "{each:.1} KiB for each stream");
}
