//! The service's responses, one by one; `support::api` checks each of them against `openapi.yaml`.

use std::io::Read as _;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::http::{Method, Request, StatusCode};
use noctule::http::{self, Answers, Phase};
use noctule::job::Status;
use noctule::store::{Options, Retention};
use serde_json::{Value, json};
use tower::ServiceExt as _;

use crate::support::api::Api;
use crate::support::faulty_store::FaultyStore;
use crate::support::patience::{PATIENCE, eventually};
use crate::support::stores::for_every_backend;
use crate::support::{run, scenario};

#[tokio::test]
async fn a_plan_is_accepted_run_and_delivered() {
    let api = Api::new();
    let answer = api.post("/plans", &scenario()).await;
    assert_eq!(answer.status, StatusCode::ACCEPTED);
    let accepted = answer.json();
    let address = answer.header("location");
    assert_eq!(accepted["links"]["self"], address);
    assert_eq!(accepted["status"], "queued");
    assert_eq!(accepted["queue_position"], 1);
    assert_eq!(accepted["seed"], 7);
    assert_eq!(accepted["iterations"], 20);

    let lease = run::complete(&*api.store, vec![run::convergence(0, 0.1)]).await;

    let ended = api.get(address).await.json();
    assert_eq!(ended["status"], "succeeded");
    assert_eq!(ended["progress"], 1.0);
    assert_eq!(ended["best_cost"], 580.0);
    let result = api.get(&format!("{address}/result")).await;
    assert_eq!(result.status, StatusCode::OK);
    let stored = api
        .store
        .result(lease.plan.id)
        .await
        .expect("readable")
        .expect("finished");
    assert_eq!(result.body, stored, "the stored bytes are served");
    let named = api.get(&format!("{address}/result?format=json")).await;
    assert_eq!(named.body, stored);
}

#[tokio::test]
async fn an_accepted_scenario_has_its_drawn_seed_and_can_be_posted_again() {
    let api = Api::new();
    let mut document = scenario();
    document["planner"]["seed"].take();
    document["planner"]
        .as_object_mut()
        .expect("an object")
        .remove("seed");
    let accepted = api.post("/plans", &document).await;
    let address = accepted.header("location");
    let kept = api.get(&format!("{address}/scenario")).await;
    let drawn = kept.json()["planner"]["seed"]
        .as_u64()
        .expect("a drawn seed");
    assert!(drawn < 1 << 53);
    assert_eq!(accepted.json()["seed"], drawn);
    let again = api.post("/plans", &kept.json()).await;
    assert_eq!(again.status, StatusCode::ACCEPTED);
    let again = api
        .get(&format!("{}/scenario", again.header("location")))
        .await;
    assert_eq!(again.body, kept.body);
}

#[tokio::test]
async fn validate_only_stores_no_plan() {
    let api = Api::new();
    let answer = api.post("/plans?validate_only=true", &scenario()).await;
    assert_eq!(answer.status, StatusCode::OK);
    assert_eq!(answer.json()["valid"], true);
    assert_eq!(answer.json()["scenario"]["vehicle"]["max_turn_deg"], 60);
    let mut wrong = scenario();
    wrong["threats"][0]["radius"] = json!(-3);
    api.post("/plans?validate_only=true", &wrong)
        .await
        .expect_problem(422, "invalid-scenario");
    assert_eq!(api.get("/plans").await.json()["plans"], json!([]));
}

#[tokio::test]
async fn prefer_wait_returns_the_ended_plan() {
    let api = Api::new();
    let worker = tokio::spawn({
        let store = api.store.clone();
        async move { run::complete(&*store, vec![run::convergence(0, 0.1)]).await }
    });
    let headers = [("content-type", "application/json"), ("prefer", "wait=99")];
    let answer = api
        .send(Method::POST, "/plans", &headers, scenario().to_string())
        .await;
    assert_eq!(answer.status, StatusCode::OK);
    assert_eq!(answer.header("preference-applied"), "wait=30");
    assert_eq!(answer.json()["status"], "succeeded");
    assert_eq!(answer.json()["links"]["self"], answer.header("location"));
    worker.await.expect("the worker is done");

    let headers = [("content-type", "application/json"), ("prefer", "wait=0")];
    let answer = api
        .send(Method::POST, "/plans", &headers, scenario().to_string())
        .await;
    assert_eq!(
        answer.status,
        StatusCode::ACCEPTED,
        "it did not end in time"
    );
    assert!(!answer.headers.contains_key("preference-applied"));
}

#[tokio::test]
async fn a_plan_deleted_while_its_caller_waits_is_reported_as_accepted() {
    let api = Api::new();
    let headers = [("content-type", "application/json"), ("prefer", "wait=30")];
    let waiting = api.send(Method::POST, "/plans", &headers, scenario().to_string());
    let deleting = async {
        let only = async || api.get("/plans").await.json()["plans"][0]["links"]["self"].clone();
        eventually(async || only().await.is_string()).await;
        let address = only().await.as_str().expect("it is one").to_owned();
        assert_eq!(api.delete(&address).await.status, 204);
        address
    };
    let (answer, address) = tokio::join!(waiting, deleting);
    assert_eq!(answer.status, StatusCode::ACCEPTED, "{answer:?}");
    assert_eq!(answer.header("location"), address);
    assert!(!answer.headers.contains_key("preference-applied"));
}

#[tokio::test]
async fn a_status_document_is_sent_only_when_it_has_changed() {
    let api = Api::new();
    let address = api.submit().await;
    let first = api.get(&address).await;
    let tag = first.header("etag").to_owned();
    assert_eq!(first.header("cache-control"), "no-cache");
    let seconds: u64 = first.header("retry-after").parse().expect("seconds");
    assert!((1..=600).contains(&seconds));
    for known in [
        tag.as_str(),
        "*",
        &format!("\"other\", {tag}"),
        tag.trim_start_matches("W/"),
    ] {
        let answer = api.get_with(&address, &[("if-none-match", known)]).await;
        assert_eq!(answer.status, StatusCode::NOT_MODIFIED, "{known}");
        assert_eq!(answer.header("etag"), tag);
        let seconds: u64 = answer.header("retry-after").parse().expect("seconds");
        assert!((1..=600).contains(&seconds), "{seconds}");
    }
    let answer = api
        .get_with(&address, &[("if-none-match", "\"other\"")])
        .await;
    assert_eq!(answer.status, StatusCode::OK);

    // A wait that names the known version ends at the next change, not only at the end.
    let known = [("if-none-match", tag.as_str()), ("prefer", "wait=30")];
    let (answer, lease) = tokio::join!(api.get_with(&address, &known), async {
        api.store.claim().await.expect("a queued plan")
    });
    assert_eq!(answer.status, StatusCode::OK);
    assert_eq!(answer.json()["status"], "running");
    assert_eq!(answer.header("preference-applied"), "wait=30");

    // A wait without a version ends when the plan ends.
    let wait = [("prefer", "wait=30")];
    let (answer, ()) = tokio::join!(api.get_with(&address, &wait), async {
        let events = vec![run::convergence(0, 0.1)];
        api.store
            .append(&lease, events)
            .await
            .expect("the lease holds");
        run::finish(&*api.store, &lease, Status::Succeeded).await;
    });
    assert_eq!(answer.json()["status"], "succeeded");
    assert!(!answer.headers.contains_key("retry-after"));

    // Nothing changes after that, so there is nothing to wait for.
    let tag = answer.header("etag").to_owned();
    let known = [("if-none-match", tag.as_str()), ("prefer", "wait=30")];
    let asked = Instant::now();
    let answer = api.get_with(&address, &known).await;
    assert_eq!(answer.status, StatusCode::NOT_MODIFIED);
    assert!(!answer.headers.contains_key("retry-after"));
    assert!(asked.elapsed() < Duration::from_secs(30), "it waited");
}

#[tokio::test]
async fn waits_end_when_the_service_stops() {
    let api = Api::new();
    let address = api.submit().await;
    let wait = [("prefer", "wait=30")];
    let (answer, ()) = tokio::join!(api.get_with(&address, &wait), async {
        api.phase.send_replace(Phase::Stopping);
    });
    assert_eq!(answer.json()["status"], "queued");
}

#[tokio::test]
async fn plans_are_listed_newest_first_page_by_page() {
    let api = Api::new();
    let mut addresses = Vec::new();
    for _ in 0..5 {
        addresses.insert(0, api.submit().await);
    }
    let mut listed = Vec::new();
    let mut next = Some("/plans?limit=2".to_owned());
    let mut pages = 0;
    while let Some(uri) = next {
        let page = api.get(&uri).await;
        let document = page.json();
        let plans = document["plans"].as_array().expect("a list");
        listed.extend(plans.iter().map(|plan| plan["links"]["self"].clone()));
        next = document["links"]["next"].as_str().map(ToOwned::to_owned);
        let link = page
            .headers
            .get("link")
            .map(|link| link.to_str().expect("visible ASCII").to_owned());
        assert_eq!(
            link,
            next.as_ref().map(|next| format!("<{next}>; rel=\"next\""))
        );
        pages += 1;
    }
    assert_eq!(listed, addresses);
    assert_eq!(pages, 3);

    run::complete(&*api.store, Vec::new()).await;
    let ended = api.get("/plans?status=succeeded").await.json();
    assert_eq!(
        ended["plans"][0]["links"]["self"],
        *addresses.last().expect("five")
    );
    assert_eq!(ended["plans"].as_array().expect("a list").len(), 1);
    let queued = api.get("/plans?status=queued&limit=3").await.json();
    assert!(
        queued["links"]["next"]
            .as_str()
            .expect("more")
            .contains("status=queued")
    );
}

#[tokio::test]
async fn a_cancelled_plan_keeps_its_best_route() {
    let api = Api::new();
    let address = api.submit().await;
    let lease = api.store.claim().await.expect("a queued plan");
    let cancel = format!("{address}/cancel");
    for _ in 0..2 {
        let answer = api.send(Method::POST, &cancel, &[], "").await;
        assert_eq!(answer.status, StatusCode::ACCEPTED);
        assert_eq!(answer.json()["cancel_requested"], true);
    }
    assert!(*lease.cancel.borrow(), "the worker is told");
    run::finish(&*api.store, &lease, Status::Cancelled).await;
    let answer = api.send(Method::POST, &cancel, &[], "").await;
    assert_eq!(answer.status, StatusCode::OK);
    assert_eq!(answer.json()["status"], "cancelled");
    assert_eq!(answer.json()["stop_reason"], "cancelled");
    assert_eq!(
        api.get(&format!("{address}/result")).await.status,
        StatusCode::OK
    );
}

#[tokio::test]
async fn cancel_and_delete_honour_if_match_and_if_none_match() {
    let api = Api::new();
    let address = api.submit().await;
    let queued = api.get(&address).await.header("etag").to_owned();
    api.store.claim().await.expect("a queued plan");
    let running = api.get(&address).await.header("etag").to_owned();

    let cancel = format!("{address}/cancel");
    for (method, uri) in [(Method::POST, &cancel), (Method::DELETE, &address)] {
        for (header, value) in [
            ("if-match", &*queued),
            ("if-match", "\"x, *\""),
            ("if-match", "\"caf\u{e9}\""),
            ("if-none-match", &running),
            ("if-none-match", "*"),
        ] {
            let headers = [(header, value)];
            let answer = api.send(method.clone(), uri, &headers, "");
            let problem = answer.await.expect_problem(412, "precondition-failed");
            let detail = problem["detail"].as_str().expect("text");
            assert!(detail.contains(&running), "{detail}");
        }
    }
    let after = api.get(&address).await;
    assert_eq!(after.header("etag"), running, "nothing has happened");

    let as_it_is = [("if-match", &*format!("\"x\", {running}"))];
    let cancelled = api.send(Method::POST, &cancel, &as_it_is, "").await;
    assert_eq!(cancelled.status, StatusCode::ACCEPTED);
    for (header, value, status) in [
        ("if-match", &*running, 412),
        ("if-match", "*", 204),
        // A removed plan matches no version.
        ("if-match", "*", 412),
        ("if-none-match", "*", 204),
    ] {
        let headers = [(header, value)];
        let answer = api.send(Method::DELETE, &address, &headers, "");
        assert_eq!(answer.await.status, status, "{header}: {value}");
    }
}

/// Several callers have seen the same version of a plan, and each would change that one.
#[tokio::test(flavor = "multi_thread")]
async fn of_many_who_would_change_one_version_of_a_plan_one_does() {
    for_every_backend(async |backend| {
        let api = Api::on(backend, Options::new(100)).await;
        for round in 0..20 {
            let address = api.submit().await;
            let cancel = format!("{address}/cancel");
            let seen = api.get(&address).await.header("etag").to_owned();
            let seen = [("if-match", &*seen)];
            let change = |nth: usize| {
                if nth.is_multiple_of(2) {
                    api.send(Method::DELETE, &address, &seen, "")
                } else {
                    api.send(Method::POST, &cancel, &seen, "")
                }
            };
            let answers = futures_util::future::join_all((round..round + 8).map(change)).await;
            let (done, refused): (Vec<_>, Vec<_>) = answers
                .iter()
                .partition(|answer| answer.status.is_success());
            assert_eq!(done.len(), 1, "{answers:?}");
            // Whoever would cancel a plan that is gone is told that it is.
            assert!(
                refused
                    .iter()
                    .all(|answer| [410, 412].contains(&answer.status.as_u16())),
                "{answers:?}"
            );
        }
    })
    .await;
}

#[tokio::test]
async fn a_deleted_plan_is_gone() {
    let api = Api::new();
    let address = api.submit().await;
    for _ in 0..2 {
        assert_eq!(api.delete(&address).await.status, StatusCode::NO_CONTENT);
    }
    for part in ["", "/result", "/scenario", "/events"] {
        api.get(&format!("{address}{part}"))
            .await
            .expect_problem(410, "gone");
    }
    let cancel = api
        .send(Method::POST, &format!("{address}/cancel"), &[], "")
        .await;
    cancel.expect_problem(410, "gone");
    assert_eq!(api.get("/plans").await.json()["plans"], json!([]));
}

#[tokio::test]
async fn a_missing_result_says_why_it_is_missing() {
    let api = Api::new();
    let mut problems = Vec::new();

    let address = api.submit().await;
    let result = format!("{address}/result");
    let queued = api.get(&result).await;
    assert!(queued.headers.contains_key("retry-after"));
    problems.push(queued.expect_problem(409, "not-ready"));
    let lease = api.store.claim().await.expect("a queued plan");
    problems.push(api.get(&result).await.expect_problem(409, "not-ready"));
    run::fail(&*api.store, &lease).await;
    problems.push(api.get(&result).await.expect_problem(409, "no-result"));
    let failed = api.get(&address).await.json();
    assert_eq!(failed["progress"], 1.0);
    assert_eq!(failed["error"]["type"], "/problems/planner-panic");
    assert_eq!(failed["error"]["detail"], "the planner broke");

    let address = api.submit().await;
    let cancelled = api
        .send(Method::POST, &format!("{address}/cancel"), &[], "")
        .await;
    assert_eq!(
        cancelled.status,
        StatusCode::OK,
        "a queued plan ends at once"
    );
    assert_eq!(cancelled.json()["progress"], 1.0);
    problems.push(
        api.get(&format!("{address}/result"))
            .await
            .expect_problem(409, "no-result"),
    );

    let ids = [address, result].map(|path| path.split('/').nth(2).expect("an id").to_owned());
    let mut text = serde_json::to_string_pretty(&problems).expect("JSON");
    for id in ids {
        text = text.replace(&id, "[plan]");
    }
    let problems: Value = serde_json::from_str(&text).expect("JSON");
    insta::assert_json_snapshot!("results_that_are_not_there", problems, {"[].instance" => "[request]"});
}

#[tokio::test]
async fn a_full_queue_refuses_and_says_when_to_retry() {
    let api = Api::with_queue(2);
    for _ in 0..2 {
        api.submit().await;
    }
    let answer = api.post("/plans", &scenario()).await;
    let problem = answer.expect_problem(503, "queue-full");
    assert_eq!(
        answer.header("retry-after"),
        "1",
        "two runs of an unknown second on two workers"
    );
    assert_eq!(
        problem["detail"],
        "2 plans wait, the limit; try again in 1 s"
    );
    // A claim makes room.
    let _lease = api.store.claim().await.expect("a queued plan");
    assert_eq!(
        api.post("/plans", &scenario()).await.status,
        StatusCode::ACCEPTED
    );
}

#[tokio::test]
async fn a_draining_service_answers_but_accepts_no_plans() {
    let api = Api::new();
    let address = api.submit().await;
    assert_eq!(api.get("/readyz").await.status, StatusCode::OK);
    api.phase.send_replace(Phase::Draining);
    for answer in [
        api.get("/readyz").await,
        api.post("/plans", &scenario()).await,
    ] {
        answer.expect_problem(503, "draining");
        assert_eq!(answer.header("retry-after"), "1");
    }
    assert_eq!(api.get("/livez").await.status, StatusCode::OK);
    assert_eq!(api.get(&address).await.status, StatusCode::OK);
    assert_eq!(
        api.post("/plans?validate_only=true", &scenario())
            .await
            .status,
        StatusCode::OK
    );
}

#[tokio::test]
async fn the_origin_of_a_plan_is_forgotten_when_it_is_cancelled_or_deleted() {
    let api = Api::new();
    for (method, step) in [(Method::POST, "/cancel"), (Method::DELETE, "")] {
        let address = api.submit().await;
        let id = address.rsplit('/').next().expect("an id");
        let id = id.parse().expect("an id");
        let origins = &api.state.instruments.origins;
        assert!(origins.of(id).is_some());
        api.send(method, &format!("{address}{step}"), &[], "").await;
        assert_eq!(origins.of(id), None);
    }
}

#[tokio::test]
async fn a_closed_store_is_reported_as_unavailable() {
    let api = Api::new();
    let address = api.submit().await;
    api.store.close().await;
    for answer in [
        api.get("/readyz").await,
        api.get(&address).await,
        api.get("/plans").await,
        api.post("/plans", &scenario()).await,
    ] {
        answer.expect_problem(503, "store-unavailable");
        assert!(answer.headers.contains_key("retry-after"));
    }
    assert_eq!(api.get("/livez").await.status, StatusCode::OK);
}

#[tokio::test]
async fn head_is_get_without_its_body() {
    let api = Api::new();
    let address = api.submit().await;
    for path in ["/livez", "/plans", "/openapi.yaml", "/nothing", &address] {
        let got = api.get(path).await;
        let head = api.send(Method::HEAD, path, &[], "").await;
        assert_eq!(head.status, got.status, "{path}");
        assert!(head.body.is_empty(), "{path}");
        assert_eq!(
            head.header("content-type"),
            got.header("content-type"),
            "{path}"
        );
        assert_eq!(
            head.header("content-length"),
            got.body.len().to_string(),
            "{path}"
        );
    }
}

#[tokio::test]
async fn a_response_has_the_callers_request_id_or_a_generated_one() {
    let api = Api::new();
    let answer = api
        .get_with("/nothing", &[("x-request-id", "caller-1")])
        .await;
    assert_eq!(answer.header("x-request-id"), "caller-1");
    assert_eq!(answer.json()["instance"], "caller-1");
    let answer = api
        .get_with("/livez", &[("x-request-id", "not a good one")])
        .await;
    assert_eq!(
        answer.header("x-request-id").len(),
        36,
        "a drawn one instead"
    );
    assert_eq!(answer.header("x-content-type-options"), "nosniff");
    assert_eq!(answer.header("cache-control"), "no-store");
}

#[tokio::test]
async fn the_service_describes_its_version_limits_and_algorithms() {
    let api = Api::new();
    assert_eq!(api.get("/version").await.json()["name"], "noctule");
    let limits = api.get("/limits").await.json();
    assert_eq!(limits["body_bytes"], 4096);
    assert_eq!(limits["workers"], 2);
    assert_eq!(limits["queue"], 1000);
    let algorithms = api.get("/algorithms").await.json();
    assert_eq!(algorithms["algorithms"][0]["name"], "tms-sba");
}

#[tokio::test]
async fn a_body_that_stalls_or_breaks_off_is_refused() {
    let mut api = Api::new();
    api.state.body_timeout = Duration::from_millis(10);
    api.router = noctule::http::router(api.state.clone());
    let stalled = futures_util::stream::pending::<Result<bytes::Bytes, std::io::Error>>();
    let headers = [("content-type", "application/json")];
    let answer = api
        .send(Method::POST, "/plans", &headers, Body::from_stream(stalled))
        .await;
    answer.expect_problem(408, "request-timeout");

    let broken = futures_util::stream::iter([
        Ok(bytes::Bytes::from("{")),
        Err(std::io::Error::other("cut")),
    ]);
    let answer = api
        .send(Method::POST, "/plans", &headers, Body::from_stream(broken))
        .await;
    let broken_off = answer.expect_problem(400, "incomplete-body");
    let detail = "the connection ended before the body did";
    assert_eq!(broken_off["detail"], detail);
}

#[tokio::test]
async fn an_expired_plan_is_gone_and_says_so() {
    let retention = Retention {
        age_ms: Some(1),
        ..Retention::default()
    };
    let api = Api::with_store(Options {
        retention,
        ..Options::new(10)
    });
    let address = api.submit().await;
    run::complete(&*api.store, Vec::new()).await;
    let ended = api.get(&address).await.json();
    assert!(ended["expires_at"].is_string(), "{ended}");
    assert_eq!(api.store.sweep(i64::MAX).await.expect("open"), 1);
    let problem = api.get(&address).await.expect_problem(410, "gone");
    let detail = problem["detail"].as_str().expect("text");
    assert!(detail.contains("as long as the service keeps"), "{detail}");
}

fn gzip(plain: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    flate2::read::GzEncoder::new(plain, flate2::Compression::best())
        .read_to_end(&mut packed)
        .expect("reading from memory");
    packed
}

#[tokio::test]
async fn request_and_response_bodies_may_be_gzipped() {
    let api = Api::new();
    let headers = [
        ("content-type", "application/json"),
        ("content-encoding", "gzip"),
    ];
    let post = async |plain: &[u8]| {
        let body = Body::from(gzip(plain));
        api.send(Method::POST, "/plans", &headers, body).await
    };
    let accepted = post(scenario().to_string().as_bytes()).await;
    assert_eq!(accepted.status, StatusCode::ACCEPTED);
    let bomb = vec![b' '; 10_000_000];
    post(&bomb).await.expect_problem(413, "body-too-large");

    run::complete(&*api.store, vec![run::convergence(0, 0.1)]).await;
    let result = format!("{}/result", accepted.header("location"));
    let plain = api.get(&result).await;
    assert!(!plain.headers.contains_key("content-encoding"));
    let packed = api.get_with(&result, &[("accept-encoding", "gzip")]).await;
    assert_eq!(packed.header("content-encoding"), "gzip");
    let vary: Vec<_> = packed.headers.get_all("vary").iter().collect();
    assert_eq!(vary, ["accept", "accept-encoding"]);
    let mut unpacked = Vec::new();
    flate2::read::GzDecoder::new(&packed.body[..])
        .read_to_end(&mut unpacked)
        .expect("gzip");
    assert_eq!(unpacked, plain.body);

    // Where no coding is acceptable, the response is sent uncompressed, whether success or refusal.
    let none = [("accept-encoding", "identity;q=0")];
    let answer = api.get_with(&result, &none).await;
    assert_eq!((answer.status, answer.body), (StatusCode::OK, plain.body));
    let nowhere = api.get_with("/nothing", &none).await;
    nowhere.expect_problem(404, "not-found");

    // Event streams are never compressed.
    let events = format!("{}/events", accepted.header("location"));
    let told = api.get_with(&events, &[("accept-encoding", "gzip")]).await;
    assert!(!told.headers.contains_key("content-encoding"));
}

#[tokio::test]
async fn a_partial_result_is_measured_like_a_final_one() {
    let api = Api::new();
    let address = api.submit().await;
    let partial = format!("{address}/result?partial=true");
    let problem = api.get(&partial).await.expect_problem(409, "not-ready");
    let detail = problem["detail"].as_str().expect("a text");
    assert!(detail.contains("has no route yet"), "{detail}");
    let lease = api.store.claim().await.expect("a queued plan");
    api.get(&partial).await.expect_problem(409, "not-ready");

    let told = vec![
        run::convergence(0, 0.1),
        run::incumbent(0, 0.1),
        run::convergence(1, 0.2),
    ];
    api.store.append(&lease, told).await.expect("held");
    let so_far = api.get(&partial).await.json();
    assert_eq!(so_far["final"], false);
    assert_eq!(so_far["stop_reason"], Value::Null);
    assert_eq!(so_far["plan_id"], lease.plan.id.to_string());
    assert_eq!(so_far["waypoints"].as_array().expect("a route").len(), 3);
    assert_eq!(so_far["convergence"].as_array().expect("a curve").len(), 2);
    assert_eq!(so_far["evaluations"], 40);
    assert!(so_far["cost"]["total"].as_f64().expect("a figure") > 0.0);
    assert!(so_far["bound"]["lower"].as_f64().expect("a figure") > 0.0);
    let drawing = api.get(&format!("{partial}&format=svg")).await;
    assert_eq!(drawing.header("content-type"), "image/svg+xml");
    // Without `partial=true` the result is not ready yet.
    let whole = api.get(&format!("{address}/result")).await;
    whole.expect_problem(409, "not-ready");
    let query = format!("{address}/result?partial=maybe");
    api.get(&query)
        .await
        .expect_problem(400, "invalid-parameter");

    run::finish(&*api.store, &lease, Status::Succeeded).await;
    let ended = api.get(&partial).await;
    let stored = api.get(&format!("{address}/result")).await;
    assert_eq!(ended.body, stored.body);
}

#[tokio::test]
async fn a_run_that_ends_while_its_route_so_far_is_read_gives_its_result() {
    let mut api = Api::new();
    let address = api.submit().await;
    let lease = api.store.claim().await.expect("a queued plan");
    let told = vec![run::convergence(0, 0.1), run::incumbent(0, 0.1)];
    api.store.append(&lease, told).await.expect("held");
    api.state.store = Arc::new(FaultyStore::that_ends(api.store.clone(), lease));
    api.router = noctule::http::router(api.state.clone());
    let result = api
        .get(&format!("{address}/result?partial=true"))
        .await
        .json();
    assert_eq!(result["stop_reason"], "iterations");
}

#[tokio::test]
async fn a_partial_result_keeps_the_newest_points_of_a_long_convergence_curve() {
    for_every_backend(async |backend| {
        let options = Options {
            events_kept: 20_000,
            ..Options::new(10)
        };
        let api = Api::on(backend, options).await;
        let address = api.submit().await;
        let lease = api.store.claim().await.expect("a queued plan");
        let route = vec![run::incumbent(0, 0.0)];
        api.store.append(&lease, route).await.expect("held");
        for begin in [0, 2_500, 5_000, 7_500, 10_000] {
            let points = (begin..begin + 2_500).map(|nth| run::convergence(nth, nth as f64));
            let points = api.store.append(&lease, points.collect());
            points.await.expect("held");
        }
        let partial = format!("{address}/result?partial=true");
        let so_far = api.get(&partial).await.json();
        let curve = so_far["convergence"].as_array().expect("a curve");
        let iterations = curve.iter().map(|point| &point["iteration"]);
        assert!(iterations.eq((2_500..12_500).collect::<Vec<_>>().iter()));
    })
    .await;
}

/// They need no key, so that callers without one cannot use up the room of others' results.
#[tokio::test]
async fn parts_of_the_program_take_no_room_for_answers() {
    let mut api = Api::new();
    api.state.answers = Answers::new(1, PATIENCE);
    let router = http::router(api.state.clone());
    let mut unread = Vec::new();
    for path in [
        "/openapi.yaml",
        "/openapi.json",
        "/docs",
        "/scenarios/jacksboro",
    ] {
        let request = Request::get(path).header("host", "localhost");
        let request = request.body(Body::empty()).expect("a request");
        let answer = router.clone().oneshot(request).await.expect("never fails");
        assert_eq!(answer.status(), 200, "{path}");
        unread.push(answer);
    }
}
