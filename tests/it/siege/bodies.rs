//! Bodies that are longer than allowed, or whose length is wrong.

use futures_util::StreamExt as _;
use futures_util::stream::FuturesUnordered;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

use super::Dice;
use crate::support::api::Api;
use crate::support::gzip::packed;
use crate::support::patience::{eventually, in_time};
use crate::support::process::Service;
use crate::support::server::Server;

/// The body limit of these tests' service.
const LIMIT: usize = 4096;

/// Sends bytes and reads the response until the service closes the connection.
async fn exchange(server: &Server, sent: &[u8]) -> String {
    exchange_or_leave(server, sent, false).await
}

/// The same; with `leaves`, the sending side is closed after the bytes.
async fn exchange_or_leave(server: &Server, sent: &[u8], leaves: bool) -> String {
    let mut stream = TcpStream::connect(server.address).await.expect("connected");
    // The service may refuse before everything is sent.
    let _ = stream.write_all(sent).await;
    if leaves {
        let _ = stream.shutdown().await;
    }
    let mut text = Vec::new();
    let _ = in_time(stream.read_to_end(&mut text)).await;
    String::from_utf8(text).expect("UTF-8")
}

fn statuses(text: &str) -> Vec<&str> {
    text.split("HTTP/1.1 ")
        .skip(1)
        .map(|answer| &answer[..3])
        .collect()
}

fn post(headers: &str, body: &[u8]) -> Vec<u8> {
    let head = format!(
        "POST /plans HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n{headers}\r\n\r\n"
    );
    [head.as_bytes(), body].concat()
}

/// The small scenario, padded to `length` bytes.
fn document(length: usize) -> Vec<u8> {
    let mut document = crate::support::scenario().to_string().into_bytes();
    document.resize(length, b' ');
    document
}

fn chunked(body: &[u8]) -> Vec<u8> {
    let mut chunks = Vec::new();
    for chunk in body.chunks(1000) {
        chunks.extend(format!("{:x}\r\n", chunk.len()).into_bytes());
        chunks.extend_from_slice(chunk);
        chunks.extend(b"\r\n");
    }
    chunks.extend(b"0\r\n\r\n");
    chunks
}

#[tokio::test]
async fn the_body_limit_holds_in_every_transfer_and_content_coding() {
    let api = Api::new();
    let server = Server::start(&api).await;
    for (length, expected) in [(LIMIT, "202"), (LIMIT + 1, "413")] {
        let plain = document(length);
        let packed = packed(&plain);
        for sent in [
            post(
                &format!("connection: close\r\ncontent-length: {length}"),
                &plain,
            ),
            post(
                "connection: close\r\ntransfer-encoding: chunked",
                &chunked(&plain),
            ),
            post(
                &format!(
                    "connection: close\r\ncontent-encoding: gzip\r\ncontent-length: {}",
                    packed.len()
                ),
                &packed,
            ),
            post(
                "connection: close\r\ncontent-encoding: gzip\r\ntransfer-encoding: chunked",
                &chunked(&packed),
            ),
        ] {
            let answer = exchange(&server, &sent).await;
            assert_eq!(statuses(&answer), [expected], "{answer}");
        }
    }
    // Too long even in its packed form.
    let mut dice = Dice::new(5);
    let noise: Vec<u8> = (0..=LIMIT)
        .map(|_| u8::try_from(dice.below(256)).expect("below"))
        .collect();
    let sent = post(
        &format!(
            "connection: close\r\ncontent-encoding: gzip\r\ncontent-length: {}",
            noise.len()
        ),
        &noise,
    );
    assert_eq!(statuses(&exchange(&server, &sent).await), ["413"]);
}

#[tokio::test]
async fn a_wrong_content_length_never_accepts_a_plan() {
    let api = Api::new();
    let server = Server::start(&api).await;
    let body = document(1000);

    // A length that is too large: half a document is no document.
    let answer = exchange_or_leave(&server, &post("content-length: 2000", &body), true).await;
    assert!(matches!(statuses(&answer)[..], [] | ["400"]), "{answer}");
    // A length that is too small: the rest is not a request.
    let answer = exchange(&server, &post("content-length: 10", &body)).await;
    let found = statuses(&answer);
    assert!(!found.is_empty(), "no answer");
    assert!(found.iter().all(|status| *status == "400"), "{answer}");
    // Two lengths, or something that is not a length.
    for headers in [
        "content-length: 1000\r\ncontent-length: 10",
        "content-length: -1",
        "content-length: 1e3",
        "content-length: 99999999999999999999999",
        "transfer-encoding: chunked\r\ncontent-length: 10",
    ] {
        let answer = exchange(&server, &post(headers, &body)).await;
        let (found, known) = (statuses(&answer), ["400", "413"]);
        assert!(!found.is_empty(), "{headers}: no answer");
        assert!(
            found.iter().all(|status| known.contains(status)),
            "{headers}: {answer}"
        );
    }
    let stats = api.store.stats().await.expect("the store is open");
    assert_eq!(stats.queued, 0);
    assert_eq!(api.get("/readyz").await.status, 200);
}

#[tokio::test]
async fn a_gzip_bomb_of_a_gibibyte_is_refused_in_little_memory() {
    const MEMBERS: usize = 64;
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &["--workers", "1"]);
    // Zeros, 16 MiB in each gzip member.
    let bomb = packed(&vec![0; 1 << 24]).repeat(MEMBERS);
    let before = service.peak_rss_kib();
    let request = service
        .request(reqwest::Method::POST, "/plans")
        .header("content-type", "application/json")
        .header("content-encoding", "gzip")
        .body(bomb);
    let answer = request.send().await.expect("an answer");
    assert_eq!(answer.status(), 413);
    let grown = service.peak_rss_kib() - before;
    assert!(grown < 64 * 1024, "{grown} KiB more");
}

/// One caller who begins a body and never ends it; what the service says to that, and the connection.
async fn begin_a_body(service: &Service, sent: &[u8]) -> (String, TcpStream) {
    let mut stream = TcpStream::connect(service.address())
        .await
        .expect("connected");
    // The service may refuse before everything is sent.
    let _ = stream.write_all(sent).await;
    let mut text = vec![0; 4096];
    let length = stream.read(&mut text).await.unwrap_or(0);
    text.truncate(length);
    (String::from_utf8(text).expect("UTF-8"), stream)
}

#[tokio::test(flavor = "multi_thread")]
async fn unfinished_bodies_take_little_memory_and_short_ones_pass() {
    const ROOM: usize = 16 << 20;
    /// Of one of them, what has come.
    const HALF: usize = 4 << 20;
    const CALLERS: usize = 64;
    let directory = tempfile::tempdir().expect("a temporary directory");
    let room = ROOM.to_string();
    let limits = [
        "--http-bodies-bytes",
        &room,
        "--http-body-timeout",
        "3600",
        "--workers",
        "1",
    ];
    let service = Service::start(directory.path(), &limits);
    let before = service.peak_rss_kib();
    let half = post(&format!("content-length: {}", 2 * HALF), &document(HALF));
    let mut callers: FuturesUnordered<_> = (0..CALLERS)
        .map(|_| begin_a_body(&service, &half))
        .collect();
    // The others may stay, for they fit.
    let mut refused = Vec::new();
    for _ in 0..CALLERS - ROOM / HALF {
        let (answer, stream) = in_time(callers.next()).await.expect("one of them");
        assert_eq!(statuses(&answer), ["503"], "{answer}");
        assert!(answer.contains("/problems/busy"), "{answer}");
        assert!(answer.contains("\r\nretry-after: "), "{answer}");
        refused.push(stream);
    }
    service.submit(&crate::support::scenario()).await;
    let grown = service.peak_rss_kib() - before;
    assert!(grown < 64 * 1024, "{grown} KiB more");

    // What is broken off or read gives its room to others.
    drop((callers, refused));
    let long = async || {
        let request = service.request(reqwest::Method::POST, "/plans");
        let request = request.header("content-type", "application/json");
        let answer = request.body(document(HALF)).send().await;
        answer.expect("an answer").status()
    };
    eventually(async || long().await == 202).await;
    for _ in 0..2 * ROOM / HALF {
        assert_eq!(long().await, 202);
    }
}
