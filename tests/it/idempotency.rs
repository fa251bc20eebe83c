//! `Idempotency-Key`: repeating a request makes one plan.

use axum::body::Body;
use axum::http::{Method, StatusCode};
use bytes::Bytes;
use futures_util::FutureExt as _;
use futures_util::future::join_all;
use http_body_util::StreamBody;
use hyper::body::Frame;
use noctule::http::Phase;
use noctule::store::Options;

use crate::support::api::{Answer, Api};
use crate::support::stores::for_every_backend;
use crate::support::{run, scenario};

async fn post(api: &Api, key: &str, body: String) -> Answer {
    let headers = [
        ("content-type", "application/json"),
        ("idempotency-key", key),
    ];
    api.send(Method::POST, "/plans", &headers, body).await
}

#[tokio::test]
async fn a_repeated_request_gets_the_same_plan_in_every_state() {
    for_every_backend(async |backend| {
        let api = Api::on(backend, Options::new(1)).await;
        let mut unseeded = scenario();
        let planner = unseeded["planner"].as_object_mut().expect("an object");
        planner.remove("seed");
        let body = unseeded.to_string();
        let first = post(&api, "k", body.clone()).await;
        assert_eq!(first.status, StatusCode::ACCEPTED);
        assert!(!first.headers.contains_key("idempotency-replayed"));
        // The queue is full by now, and no new seed is drawn.
        let again = post(&api, "\"k\"", body.clone()).await;
        assert_eq!(again.status, StatusCode::ACCEPTED);
        assert_eq!(again.header("idempotency-replayed"), "true");
        assert_eq!(again.header("location"), first.header("location"));
        assert_eq!(again.json(), first.json());

        run::complete(&*api.store, Vec::new()).await;
        let ended = post(&api, "k", body.clone()).await;
        assert_eq!(ended.json()["status"], "succeeded");

        let other = post(&api, "k", scenario().to_string()).await;
        other.expect_problem(422, "idempotency-key-reused");
        let listed = api.get("/plans").await.json();
        assert_eq!(listed["plans"].as_array().expect("a list").len(), 1);

        api.delete(first.header("location")).await;
        post(&api, "k", body).await.expect_problem(410, "gone");
    })
    .await;
}

/// A repeated request asks for no plan that is not there.
#[tokio::test]
async fn a_repeated_request_gets_its_plan_from_a_draining_service() {
    let api = Api::new();
    let first = post(&api, "k", scenario().to_string()).await;
    api.phase.send_replace(Phase::Draining);
    let again = post(&api, "k", scenario().to_string()).await;
    assert_eq!(again.status, StatusCode::ACCEPTED);
    assert_eq!(again.header("idempotency-replayed"), "true");
    assert_eq!(again.header("location"), first.header("location"));
    let other = post(&api, "l", scenario().to_string()).await;
    other.expect_problem(503, "draining");
}

/// It could no longer be accepted, but it once was.
#[tokio::test]
async fn a_repeated_request_gets_its_plan_after_its_warm_start_is_deleted() {
    for_every_backend(async |backend| {
        let api = Api::on(backend, Options::new(1_000)).await;
        let known = api.submit().await;
        run::complete(&*api.store, Vec::new()).await;
        let mut warm = scenario();
        let id = known.rsplit('/').next().expect("an id");
        warm["planner"]["warm_start"] = serde_json::json!({"plan_id": id});
        let first = post(&api, "k", warm.to_string()).await;
        assert_eq!(first.status, StatusCode::ACCEPTED);
        api.delete(&known).await;

        let again = post(&api, "k", warm.to_string()).await;
        assert_eq!(again.status, StatusCode::ACCEPTED, "{again:?}");
        assert_eq!(again.header("idempotency-replayed"), "true");
        assert_eq!(again.json(), first.json());
        post(&api, "other", warm.to_string())
            .await
            .expect_problem(422, "invalid-scenario");
        post(&api, "k", "{".to_owned())
            .await
            .expect_problem(422, "idempotency-key-reused");
    })
    .await;
}

#[tokio::test]
async fn a_refused_request_leaves_its_key_free() {
    for_every_backend(async |backend| {
        let api = Api::on(backend, Options::new(1_000)).await;
        post(&api, "k", "{".to_owned())
            .await
            .expect_problem(400, "invalid-json");
        let accepted = post(&api, "k", scenario().to_string()).await;
        assert_eq!(accepted.status, StatusCode::ACCEPTED);
        post(&api, "two words", scenario().to_string())
            .await
            .expect_problem(400, "invalid-parameter");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_thousand_concurrent_requests_make_one_plan() {
    for_every_backend(async |backend| {
        let api = Api::on(backend, Options::new(1_000)).await;
        let body = scenario().to_string();
        let answers = join_all((0..1_000).map(|_| post(&api, "k", body.clone()))).await;
        let mut places = Vec::new();
        for answer in answers {
            if answer.status == StatusCode::ACCEPTED {
                places.push(answer.header("location").to_owned());
            } else {
                answer.expect_problem(409, "idempotency-in-flight");
                assert_eq!(answer.header("retry-after"), "1");
            }
        }
        assert!(!places.is_empty() && places.iter().all(|place| *place == places[0]));
        assert_eq!(api.store.stats().await.expect("open").queued, 1);
        let late = post(&api, "k", body).await;
        assert_eq!(late.header("location"), places[0]);
    })
    .await;
}

#[tokio::test]
async fn a_key_is_in_flight_while_its_first_request_is_still_arriving() {
    let api = Api::new();
    let never = futures_util::stream::pending::<Result<Frame<Bytes>, std::io::Error>>();
    let headers = [
        ("content-type", "application/json"),
        ("idempotency-key", "k"),
    ];
    let body = Body::new(StreamBody::new(never));
    let mut first = Box::pin(api.send(Method::POST, "/plans", &headers, body));
    assert!((&mut first).now_or_never().is_none());
    let second = post(&api, "k", scenario().to_string()).await;
    second.expect_problem(409, "idempotency-in-flight");
    // A caller who disconnects releases the key.
    drop(first);
    let third = post(&api, "k", scenario().to_string()).await;
    assert_eq!(third.status, StatusCode::ACCEPTED);
}
