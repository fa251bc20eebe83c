//! Malformed requests: refused with a problem document before any handler sees them.

use bytes::Bytes;
use http_body_util::{BodyExt as _, Empty};
use hyper::Request;
use hyper::client::conn::http2;
use hyper_util::rt::{TokioExecutor, TokioIo};
use serde_json::Value;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

use crate::support::patience::in_time;
use crate::support::process::Service;

/// Everything received for `bytes` until the service closes the connection.
async fn answers(service: &Service, bytes: &[u8]) -> String {
    let mut stream = TcpStream::connect(service.address())
        .await
        .expect("connected");
    stream.write_all(bytes).await.expect("sent");
    let mut answers = String::new();
    let read = in_time(stream.read_to_string(&mut answers)).await;
    read.expect("an answer");
    answers
}

/// Checks that the last of the responses is a well-formed problem of this type.
fn expect_problem(answers: &str, status: u16, slug: &str) {
    let begin = answers.rfind("HTTP/1.1 4").expect("a status line");
    let parts = answers[begin..].split_once("\r\n\r\n");
    let (head, body) = parts.expect("a head and a body");
    let lines: Vec<&str> = head.lines().collect();
    let header = |name: &str| {
        let of = |line: &&str| {
            let (found, value) = line.split_once(": ")?;
            found.eq_ignore_ascii_case(name).then(|| value.to_owned())
        };
        let mut values = lines[1..].iter().filter_map(of);
        let value = values.next();
        assert!(values.next().is_none(), "{name} twice: {head}");
        value.unwrap_or_else(|| panic!("no {name}: {head}"))
    };
    assert_eq!(lines[0].split(' ').nth(1), Some(&*status.to_string()));
    assert_eq!(header("content-type"), "application/problem+json");
    assert_eq!(header("content-length"), body.len().to_string());
    assert_eq!(header("connection"), "close");
    assert_eq!(header("cache-control"), "no-store");
    assert_eq!(header("x-content-type-options"), "nosniff");
    assert!(!header("date").is_empty());
    let problem: Value = serde_json::from_str(body).expect("JSON");
    assert_eq!(problem["type"], format!("/problems/{slug}"));
    assert_eq!(problem["status"], status);
    assert_eq!(problem["instance"], header("x-request-id"));
}

#[tokio::test]
async fn a_malformed_request_gets_a_problem() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    for request in [
        "GARBAGE\r\n\r\n",
        "\x16\x03\x01\x02",
        "GET / HTTP/3.1\r\nhost: localhost\r\n\r\n",
        "GET / HTTP/1.1\r\nhost : localhost\r\n\r\n",
        "GET /\x01 HTTP/1.1\r\nhost: localhost\r\n\r\n",
        "POST /plans HTTP/1.1\r\nhost: localhost\r\ncontent-length: many\r\n\r\n",
        "POST /plans HTTP/1.1\r\nhost: localhost\r\ncontent-length: 5\r\ncontent-length: 6\r\n\r\n",
        "POST /plans HTTP/1.1\r\nhost: localhost\r\ntransfer-encoding: folded\r\n\r\n",
    ] {
        let answer = answers(&service, request.as_bytes()).await;
        assert!(
            answer.starts_with("HTTP/1.1 400 Bad Request\r\n"),
            "{answer}"
        );
        expect_problem(&answer, 400, "malformed-request");
    }
    let metrics = service.bytes("/metrics").await;
    let metrics = str::from_utf8(&metrics).expect("UTF-8");
    let counted = r#"{method="OTHER",route="unmatched",status="400"} 8"#;
    assert!(metrics.contains(counted), "{metrics}");
}

/// To a caller who reads nothing until it has sent everything.
#[tokio::test]
async fn a_caller_who_is_still_sending_gets_its_answer() {
    const LENGTH: usize = 9_000_000;
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    let body = "x".repeat(LENGTH);
    for (request, kind, status, slug) in [
        ("POST /plans", "application/json", 413, "body-too-large"),
        ("POST /plans", "text/plain", 415, "unsupported-media-type"),
        ("POST /nowhere", "application/json", 404, "not-found"),
        ("PUT /terrains/NAME", "image/tiff", 400, "invalid-parameter"),
    ] {
        let head = format!(
            "{request} HTTP/1.1\r\nhost: localhost\r\ncontent-type: {kind}\r\ncontent-length: {LENGTH}\r\n\r\n"
        );
        let answer = answers(&service, (head + &body).as_bytes()).await;
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {status} ")),
            "{answer}"
        );
        let (head, problem) = answer.split_once("\r\n\r\n").expect("a head and a body");
        assert!(head.contains("\r\nconnection: close"), "{head}");
        let problem: Value = serde_json::from_str(problem).expect("JSON");
        assert_eq!(problem["type"], format!("/problems/{slug}"));
    }
}

/// A short body that has come along is no reason to close the connection.
#[tokio::test]
async fn a_refusal_of_a_short_body_leaves_the_connection_open() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    let refused = "POST /nowhere HTTP/1.1\r\nhost: localhost\r\ncontent-length: 5\r\n\r\nshort";
    let last = "GET /livez HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n";
    let requests = [refused, refused, last].concat();
    let all = answers(&service, requests.as_bytes()).await;
    let statuses: Vec<&str> = all.matches("HTTP/1.1 404").collect();
    assert_eq!(statuses.len(), 2, "{all}");
    assert!(all.contains("HTTP/1.1 200 OK\r\n"), "{all}");
}

#[tokio::test]
async fn a_faulty_transfer_encoding_is_explained() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    for (coding, status, detail) in [
        (
            "chunked",
            400,
            "the chunks that the body comes in cannot be",
        ),
        ("gzip, chunked", 501, "transfer-encoding is gzip, chunked;"),
    ] {
        for line in ["POST /plans", "PUT /terrains/hill"] {
            let request = format!(
                "{line} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-type: application/json\r\n\
                 transfer-encoding: {coding}\r\n\r\nmany\r\n{{}}\r\n0\r\n\r\n"
            );
            let answer = answers(&service, request.as_bytes()).await;
            let begins = answer.starts_with(&format!("HTTP/1.1 {status} "));
            assert!(begins && answer.contains(detail), "{line}: {answer}");
        }
    }
}

#[tokio::test]
async fn a_head_that_is_too_large_gets_a_problem() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    // hyper lets heads pass that are slightly above the limit when they are read at once.
    let (above, long) = ("a".repeat(64 * 1024), "a".repeat(2 * 64 * 1024));
    let many = "x: 1\r\n".repeat(101);
    for request in [
        format!("GET /{above} HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        format!("GET /livez HTTP/1.1\r\nhost: localhost\r\nx: {above}\r\n\r\n"),
        format!("GET /{long} HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        format!("GET /livez HTTP/1.1\r\nhost: localhost\r\nx: {long}\r\n\r\n"),
        format!("GET /livez HTTP/1.1\r\n{many}\r\n"),
    ] {
        let answer = answers(&service, request.as_bytes()).await;
        expect_problem(&answer, 431, "head-too-large");
    }
    let well = "a".repeat(60 * 1024);
    let request =
        format!("GET /livez HTTP/1.1\r\nhost: localhost\r\nx: {well}\r\nconnection: close\r\n\r\n");
    let answer = answers(&service, request.as_bytes()).await;
    assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{answer}");
}

#[tokio::test]
async fn a_head_that_is_too_large_gets_a_problem_over_http2_too() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    let stream = TcpStream::connect(service.address()).await;
    let stream = TokioIo::new(stream.expect("connected"));
    let (mut sender, connection) = http2::handshake(TokioExecutor::new(), stream)
        .await
        .expect("it speaks HTTP/2");
    tokio::spawn(connection);
    for (headers, length, status) in [
        (100, 1, 200),
        (101, 1, 431),
        (4, 15_000, 200),
        (4, 17_000, 431),
    ] {
        let value = "a".repeat(length);
        let request = Request::get(service.url("/livez"));
        let request = (0..headers).fold(request, |request, _| request.header("x", &value));
        let answer = sender.send_request(request.body(Empty::<Bytes>::new()).expect("a request"));
        let answer = in_time(answer).await.expect("an answer");
        assert_eq!(answer.status(), status, "{headers} of {length}");
        let body = answer
            .into_body()
            .collect()
            .await
            .expect("a body")
            .to_bytes();
        if status != 200 {
            let problem: Value = serde_json::from_slice(&body).expect("JSON");
            assert_eq!(problem["type"], "/problems/head-too-large");
        }
    }
}

#[tokio::test]
async fn garbage_after_a_request_gets_its_own_problem() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    let request = "GET /livez HTTP/1.1\r\nhost: localhost\r\n\r\nGARBAGE\r\n\r\n";
    let both = answers(&service, request.as_bytes()).await;
    assert!(both.starts_with("HTTP/1.1 200 OK\r\n"), "{both}");
    expect_problem(&both, 400, "malformed-request");
}
