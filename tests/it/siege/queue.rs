//! More submissions than the queue holds, and reading plans immediately after acceptance.

use axum::http::StatusCode;
use futures_util::future::join_all;
use reqwest::Client;

use crate::support::api::Api;
use crate::support::process::address_of;
use crate::support::scenario;
use crate::support::server::Server;

#[tokio::test(flavor = "multi_thread")]
async fn every_submission_beyond_the_queue_limit_is_refused() {
    const QUEUE: usize = 50;
    let api = Api::with_queue(QUEUE);
    let mut running = Vec::new();
    for _ in 0..api.state.capacity.workers {
        api.submit().await;
        running.push(api.store.claim().await.expect("it is queued"));
    }
    let scenario = scenario();
    let posts = (0..QUEUE + 1_000).map(|_| api.post("/plans", &scenario));
    let mut accepted = 0;
    for answer in join_all(posts).await {
        if answer.status == StatusCode::ACCEPTED {
            accepted += 1;
        } else {
            answer.expect_problem(503, "queue-full");
            let seconds: u64 = answer.header("retry-after").parse().expect("seconds");
            assert!((1..=600).contains(&seconds), "{seconds}");
        }
    }
    assert_eq!(accepted, QUEUE);
    let stats = api.store.stats().await.expect("the store is open");
    assert_eq!((stats.queued, stats.running), (QUEUE as u64, 2));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_accepted_plan_can_be_read_at_once() {
    let api = Api::new();
    let server = Server::start(&api).await;
    let client = Client::builder().no_proxy().build().expect("a client");
    let scenario = scenario();
    join_all((0..200).map(async |_| {
        let request = client.post(server.url("/plans")).json(&scenario);
        let answer = request.send().await.expect("an answer");
        let address = address_of(&answer);
        for path in ["", "/scenario"] {
            let request = client.get(server.url(&format!("{address}{path}")));
            assert_eq!(request.send().await.expect("an answer").status(), 200);
        }
    }))
    .await;
}
