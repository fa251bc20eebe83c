//! What the service refuses, and the problem document of each refusal.

use axum::http::Method;
use serde_json::{Value, json};

use crate::support::api::{Answer, Api};

/// A request header.
type Header = (&'static str, &'static str);

const JSON: Header = ("content-type", "application/json");

/// Requests without a body; `{plan}` is a queued plan.
const WITHOUT_BODY: &[(&str, u16)] = &[
    ("GET /nothing", 404),
    ("GET /plans/", 404),
    ("GET /plans/01936f2c-7d1a-7c55-9a53-27b1b44c1a10", 404),
    ("GET /plans/01936F2C-7D1A-7C55-9A53-27B1B44C1A10", 404),
    (
        "GET /plans/01936f2c-7d1a-7c55-9a53-27b1b44c1a10/result",
        404,
    ),
    (
        "GET /plans/01936f2c-7d1a-7c55-9a53-27b1b44c1a10/scenario",
        404,
    ),
    (
        "GET /plans/01936f2c-7d1a-7c55-9a53-27b1b44c1a10/events",
        404,
    ),
    (
        "POST /plans/01936f2c-7d1a-7c55-9a53-27b1b44c1a10/cancel",
        404,
    ),
    ("DELETE /plans/01936f2c-7d1a-7c55-9a53-27b1b44c1a10", 404),
    ("GET /plans/first", 404),
    ("GET /plans/%FF", 404),
    ("PUT /plans", 405),
    ("POST /livez", 405),
    ("GET {plan}/cancel", 405),
    ("GET /plans?limit=0", 400),
    ("GET /plans?limit=1001", 400),
    ("GET /plans?limit=many", 400),
    ("GET /plans?limit=1&limit=2", 400),
    ("GET /plans?status=done", 400),
    ("GET /plans?cursor=xyz", 400),
    ("GET /plans?page=2", 400),
    ("GET /livez?verbose", 400),
    ("DELETE {plan}?force", 400),
    ("GET {plan}/events?rate=-1", 400),
    ("GET {plan}/events?rate=1001", 400),
    ("GET {plan}/events?rate=NaN", 400),
    ("GET {plan}/events?last_event_id=x", 400),
    ("GET {plan}/result?format=kmz", 400),
];

/// The same, with a header.
const WITH_HEADER: &[(&str, Header, u16)] = &[
    ("GET {plan}/events", ("last-event-id", "-1"), 400),
    ("GET {plan}/events", ("accept", "text/html"), 406),
    ("GET {plan}/result", ("accept", "text/html"), 406),
];

/// Bodies of `POST /plans`.
const BODIES: &[(&[Header], &str, u16)] = &[
    (&[], "{}", 415),
    (
        &[("content-type", "application/x-www-form-urlencoded")],
        "{}",
        415,
    ),
    (
        &[("content-type", "application/json; charset=latin1")],
        "{}",
        415,
    ),
    (&[JSON, ("content-encoding", "br")], "{}", 415),
    (&[JSON, ("content-encoding", "gzip")], "{}", 400),
    (&[JSON, ("content-length", "5000")], "{}", 413),
    (&[JSON], "", 400),
    (&[JSON], "{\"start\":\n  nope}", 400),
    (&[JSON], "[]", 422),
    (&[JSON], "{\"start\": 3, \"colour\": \"red\"}", 422),
];

#[tokio::test]
async fn every_refusal_is_a_problem_document() {
    let api = Api::new();
    let plan = api.submit().await;
    let mut problems = Vec::new();
    let without_header = WITHOUT_BODY
        .iter()
        .map(|(request, status)| (*request, None, *status));
    let with_header = WITH_HEADER
        .iter()
        .map(|(request, header, status)| (*request, Some(*header), *status));
    for (request, header, status) in without_header.chain(with_header) {
        let (method, uri) = request.split_once(' ').expect("a method and a path");
        let method: Method = method.parse().expect("a method");
        let answer = api
            .send(method, &uri.replace("{plan}", &plan), header.as_slice(), "")
            .await;
        problems.push(record(request, &answer, status));
    }
    for (headers, body, status) in BODIES {
        let answer = api.send(Method::POST, "/plans", headers, *body).await;
        problems.push(record(
            &format!("POST /plans {headers:?} {body}"),
            &answer,
            *status,
        ));
    }
    insta::assert_json_snapshot!("refusals", problems, {"[].problem.instance" => "[request]"});
}

fn record(request: &str, answer: &Answer, status: u16) -> Value {
    assert_eq!(answer.status, status, "{request}");
    assert_eq!(
        answer.header("content-type"),
        "application/problem+json",
        "{request}"
    );
    let allow = answer
        .headers
        .get("allow")
        .map(|allow| allow.to_str().expect("visible ASCII"));
    assert_eq!(allow.is_some(), status == 405, "{request}");
    json!({"request": request, "allow": allow, "problem": answer.json()})
}

#[tokio::test]
async fn a_body_beyond_the_limit_is_refused_with_and_without_a_length() {
    let api = Api::new();
    let chunks = futures_util::stream::repeat_with(|| {
        Ok::<_, std::io::Error>(bytes::Bytes::from(vec![b' '; 1000]))
    });
    let endless = axum::body::Body::from_stream(chunks);
    for body in [endless, " ".repeat(4097).into()] {
        let answer = api.send(Method::POST, "/plans", &[JSON], body).await;
        answer.expect_problem(413, "body-too-large");
    }
    let answer = api
        .send(Method::POST, "/plans", &[JSON], " ".repeat(4096))
        .await;
    answer.expect_problem(400, "invalid-json");
}

/// The head of a request may have 64 KiB, of which an answer repeats the beginning.
#[tokio::test]
async fn what_a_caller_sent_is_repeated_in_part() {
    let api = Api::new();
    let long: &str = "x".repeat(10_000).leak();
    let media_type: &str = format!("application/x-www-form-urlencoded{long}").leak();
    let requests: [(&str, String, &[Header]); 12] = [
        ("GET", format!("/{long}"), &[]),
        ("GET", format!("/plans/{long}"), &[]),
        ("GET", format!("/plans/first/{long}"), &[]),
        ("GET", format!("/problems/{long}"), &[]),
        ("GET", format!("/terrains/{long}"), &[]),
        ("GET", format!("/terrains/{long}/elevations"), &[]),
        ("GET", format!("/plans?{long}=3"), &[]),
        ("GET", format!("/plans?limit={long}"), &[]),
        ("POST", "/plans".to_owned(), &[("content-type", long)]),
        ("POST", "/plans".to_owned(), &[("content-type", media_type)]),
        (
            "POST",
            "/plans".to_owned(),
            &[JSON, ("content-encoding", long)],
        ),
        (
            "POST",
            "/plans".to_owned(),
            &[JSON, ("transfer-encoding", long)],
        ),
    ];
    for (method, uri, headers) in requests {
        let begin = format!("{method} {uri:.40} {headers:?}");
        let method: Method = method.parse().expect("a method");
        let answer = api.send(method, &uri, headers, "{}").await;
        let problem = answer.json();
        let detail = problem["detail"].as_str().expect("a problem");
        assert!(detail.contains("xxx..."), "{begin}: {detail:.200}");
        assert!(answer.body.len() < 1000, "{begin}");
    }
}
