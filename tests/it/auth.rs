//! Authorization: keys, scopes, plan ownership, tickets, rate limits, streams.

use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::http::{Method, Request, StatusCode};
use http_body_util::BodyExt as _;
use noctule::digest::sha256_hex;
use noctule::http;
use noctule::http::auth::{Access, Keys, Needs, Scope, Settings};
use noctule::store::wall_clock;
use serde_json::Value;
use tower::ServiceExt as _;

use crate::support::api::{Answer, Api};
use crate::support::description::DESCRIPTION;
use crate::support::keys::{bearer, entry, post, send};
use crate::support::patience::{eventually, in_time};
use crate::support::{run, scenario};

/// Alice and Bob may plan, Rita may read Alice's plans, Max may read the metrics, Ada may do everything.
fn house() -> String {
    [
        entry("alice", "of alice", "plan", ""),
        entry("bob", "of bob", "plan", ""),
        entry("rita", "of rita", "read", "owner = \"alice\""),
        entry("max", "of max", "metrics", ""),
        entry("ada", "of ada", "admin", ""),
        entry("eve", "of eve", "plan", "expires = 2020-01-01T00:00:00Z"),
    ]
    .concat()
}

/// Submits a plan with the key; the plan's address.
async fn submit(api: &Api, secret: &str) -> String {
    let answer = post(api, secret).await;
    assert_eq!(answer.status, 202, "{answer:?}");
    answer.header("location").to_owned()
}

const NOBODY: &str = "01936f2c-7d1a-7c55-9a53-27b1b44c1a10";

/// Every request that can be made about a plan.
const OF_A_PLAN: [&str; 9] = [
    "GET {plan}",
    "HEAD {plan}",
    "GET {plan}/result",
    "GET {plan}/result?format=svg",
    "GET {plan}/scenario",
    "GET {plan}/events",
    "POST {plan}/tickets",
    "POST {plan}/cancel",
    "DELETE {plan}",
];

/// The contents of a response, without what differs between requests.
fn said(answer: &Answer, id: &str) -> (StatusCode, String, Vec<String>) {
    let request_id = answer.header("x-request-id");
    let text = String::from_utf8(answer.body.to_vec()).expect("UTF-8");
    let mut headers: Vec<String> = answer.headers.keys().map(ToString::to_string).collect();
    headers.sort();
    let text = text.replace(request_id, "REQUEST").replace(id, "PLAN");
    (answer.status, text, headers)
}

#[tokio::test]
async fn another_owners_plan_looks_like_one_that_never_existed() {
    let api = Api::with_keys(&house());
    for ended in [false, true] {
        let plan = submit(&api, "of alice").await;
        if ended {
            run::complete(&*api.store, Vec::new()).await;
        }
        let id = plan.strip_prefix("/plans/").expect("an address");
        for request in OF_A_PLAN {
            let theirs = send(&api, "of bob", &request.replace("{plan}", &plan)).await;
            let none = format!("/plans/{NOBODY}");
            let none = send(&api, "of bob", &request.replace("{plan}", &none)).await;
            assert_eq!(theirs.status, 404, "{request}");
            assert_eq!(said(&theirs, id), said(&none, NOBODY), "{request}");
        }
        let status = send(&api, "of alice", &format!("GET {plan}")).await.json();
        assert_eq!(status["cancel_requested"], false, "nothing was done to it");

        // A deleted plan is gone for its owner and unknown to others.
        assert_eq!(
            send(&api, "of alice", &format!("DELETE {plan}"))
                .await
                .status,
            204
        );
        let gone = send(&api, "of alice", &format!("GET {plan}")).await;
        gone.expect_problem(410, "gone");
        for request in OF_A_PLAN {
            let theirs = send(&api, "of bob", &request.replace("{plan}", &plan)).await;
            assert_eq!(theirs.status, 404, "{request} of a deleted plan");
        }
    }
}

#[tokio::test]
async fn a_warm_start_from_another_owners_plan_is_refused() {
    let api = Api::with_keys(&house());
    let plan = submit(&api, "of alice").await;
    run::complete(&*api.store, Vec::new()).await;
    let mut document = scenario();
    let id = plan.strip_prefix("/plans/").expect("an address");
    document["planner"]["warm_start"] = serde_json::json!({"plan_id": id});
    let start = async |secret: &str| {
        let bearer = bearer(secret);
        let headers = [
            ("authorization", bearer.as_str()),
            ("content-type", "application/json"),
        ];
        let body = document.to_string();
        api.send(Method::POST, "/plans", &headers, body).await
    };
    assert_eq!(start("of alice").await.status, 202);
    assert_eq!(start("of ada").await.status, 202);
    let refused = start("of bob")
        .await
        .expect_problem(422, "invalid-scenario");
    assert_eq!(refused["errors"][0]["code"], "unknown-plan");
}

#[tokio::test]
async fn lists_and_idempotency_keys_are_scoped_by_owner() {
    let anna = entry("anna", "of anna", "plan", "owner = \"alice\"");
    let api = Api::with_keys(&(house() + &anna));
    let of_alice = submit(&api, "of alice").await;
    let of_bob = submit(&api, "of bob").await;
    for (secret, expected) in [
        ("of alice", vec![&of_alice]),
        ("of rita", vec![&of_alice]),
        ("of bob", vec![&of_bob]),
        ("of ada", vec![&of_bob, &of_alice]),
    ] {
        let listed = send(&api, secret, "GET /plans").await.json();
        let plans = listed["plans"].as_array().expect("a list").iter();
        let found: Vec<_> = plans.map(|plan| plan["links"]["self"].as_str()).collect();
        let expected: Vec<_> = expected
            .into_iter()
            .map(|plan| Some(plan.as_str()))
            .collect();
        assert_eq!(found, expected, "{secret}");
    }
    // The same idempotency key of two owners names two requests; two keys of one owner share it.
    let once = async |secret: &str| {
        let bearer = bearer(secret);
        let headers = [
            ("authorization", bearer.as_str()),
            ("content-type", "application/json"),
            ("idempotency-key", "k"),
        ];
        let body = scenario().to_string();
        let answer = api.send(Method::POST, "/plans", &headers, body).await;
        answer.header("location").to_owned()
    };
    assert_ne!(once("of alice").await, once("of bob").await);
    assert_eq!(once("of alice").await, once("of anna").await);
}

#[tokio::test]
async fn requests_without_a_valid_key_are_refused() {
    const NONE: &str = "Bearer realm=\"noctule\"";
    const WRONG: &str = "Bearer realm=\"noctule\", error=\"invalid_token\"";
    let api = Api::with_keys(&house());
    let plan = submit(&api, "of alice").await;
    let asked = format!("GET {plan}");
    let refuse = |answer: &Answer, challenge: &str| {
        let problem = answer.expect_problem(401, "unauthorized");
        assert_eq!(answer.header("www-authenticate"), challenge);
        problem["detail"].as_str().expect("text").to_owned()
    };

    refuse(&api.get(&plan).await, NONE);
    // Unknown and malformed keys get the same response.
    let unknown = refuse(&send(&api, "of nobody", &asked).await, WRONG);
    for value in [
        "Bearer",
        "Bearer ",
        "Basic b2YgYWxpY2U=",
        "of alice",
        "Bearerof alice",
        "\u{e9}",
    ] {
        let answer = api.get_with(&plan, &[("authorization", value)]).await;
        assert_eq!(refuse(&answer, WRONG), unknown, "{value}");
    }
    let twice = [
        ("authorization", "Bearer of alice"),
        ("authorization", "Bearer of alice"),
    ];
    assert_eq!(refuse(&api.get_with(&plan, &twice).await, WRONG), unknown);
    // The holder of an expired key may learn that it has expired.
    let expired = refuse(&send(&api, "of eve", &asked).await, WRONG);
    assert!(expired.contains("expired"), "{expired}");
    // The scheme's name is case-insensitive.
    let lower = api
        .get_with(&plan, &[("authorization", "bearer of alice")])
        .await;
    assert_eq!(lower.status, 200);
}

#[tokio::test]
async fn every_route_requires_the_scope_that_the_description_states() {
    let api = Api::with_keys(&house());
    for route in noctule::http::routes() {
        let place = format!("{} {}", route.method, route.path);
        let operation = &DESCRIPTION["paths"][route.path][route.method.to_lowercase()];
        let described = &operation["security"];
        let key = |scope: Scope| serde_json::json!({"key": [scope.name()]});
        let expected: Vec<Value> = match route.needs {
            Needs::Nothing => vec![],
            Needs::Scope(scope) => vec![key(scope)],
            Needs::Ticket => vec![key(Scope::Read), serde_json::json!({"ticket": []})],
        };
        assert_eq!(described, &Value::from(expected), "{place}");

        let request = place.replace("{id}", NOBODY).replace("{slug}", "not-found");
        let request = request
            .replace("{name}", "paper-1")
            .replace("{guide}", "terrain");
        let request = request
            .replace("vendor/{file}", "vendor/three.js")
            .replace("{file}", "main.js");
        let (method, uri) = request.split_once(' ').expect("a method and a path");
        let method: Method = method.parse().expect("a method");
        let anonymous = api.send(method, uri, &[], "").await;
        let (allowed, refused) = match route.needs {
            Needs::Nothing => {
                assert_eq!(anonymous.status, 200, "{place}");
                continue;
            }
            Needs::Scope(Scope::Plan) => ("of alice", "of rita"),
            Needs::Scope(Scope::Read) | Needs::Ticket => ("of rita", "of max"),
            Needs::Scope(Scope::Metrics) => ("of max", "of alice"),
            Needs::Scope(Scope::Admin) => ("of ada", "of alice"),
        };
        anonymous.expect_problem(401, "unauthorized");
        let problem = send(&api, refused, &request)
            .await
            .expect_problem(403, "forbidden");
        let scope = match route.needs {
            Needs::Scope(scope) => scope,
            _ => Scope::Read,
        };
        assert_eq!(problem["scope"], scope.name());
        for secret in [allowed, "of ada"] {
            let status = send(&api, secret, &request).await.status;
            assert!(![401, 403].contains(&status.as_u16()), "{place} {status}");
        }
    }
}

#[tokio::test]
async fn a_key_anywhere_in_a_url_is_refused() {
    let key = noctule::http::auth::fresh_key().expect("random");
    let api = Api::with_keys(&entry("alice", &key, "plan", ""));
    for uri in [
        format!("/plans?api_key={key}"),
        "/plans?access_token=x".to_owned(),
        "/plans?key=x".to_owned(),
        format!("/plans?limit={key}"),
        format!("/plans?{key}"),
        format!("/plans?limit={}", key.replace('_', "%5F")),
        format!("/plans/{key}"),
        format!("/livez?x={key}"),
        format!("/nowhere/{key}"),
    ] {
        let bearer = bearer(&key);
        let answer = api.get_with(&uri, &[("authorization", &bearer)]).await;
        answer.expect_problem(400, "key-in-url");
        assert!(
            !String::from_utf8_lossy(&answer.body).contains(&key),
            "{uri}"
        );
    }
    assert_eq!(send(&api, &key, "GET /plans").await.status, 200);
}

#[tokio::test]
async fn a_ticket_opens_the_events_of_one_plan_and_nothing_else() {
    let api = Api::with_keys(&house());
    let plan = submit(&api, "of alice").await;
    let other = submit(&api, "of alice").await;
    let issued = send(&api, "of rita", &format!("POST {plan}/tickets")).await;
    assert_eq!(issued.status, 201);
    let ticket = issued.json();
    let query = format!("?ticket={}", ticket["ticket"].as_str().expect("text"));
    assert_eq!(ticket["events"], format!("{plan}/events{query}"));
    assert!(!format!("{issued:?}").contains("of rita"));
    let until: jiff::Timestamp = ticket["expires_at"]
        .as_str()
        .and_then(|time| time.parse().ok())
        .expect("a time");
    let seconds = until.duration_since(jiff::Timestamp::now()).as_secs();
    assert!((590..=600).contains(&seconds), "{seconds}");

    run::complete(&*api.store, Vec::new()).await;
    for uri in [
        format!("{plan}/events{query}"),
        format!("{plan}/events{query}&last_event_id=1"),
    ] {
        assert_eq!(api.get(&uri).await.status, 200, "{uri}");
    }
    for uri in [
        format!("{other}/events{query}"),
        format!("{plan}/events?ticket=x"),
        format!("{plan}/events?ticket="),
        format!("/plans/x/events{query}"),
        format!("{plan}{query}"),
        format!("{plan}/result{query}"),
        format!("/plans{query}"),
    ] {
        api.get(&uri).await.expect_problem(401, "unauthorized");
    }
    // A ticket is valid only as long as the key that issued it.
    let house = house();
    let without_rita: Vec<&str> = house
        .split("[[key]]")
        .filter(|key| !key.contains("rita"))
        .collect();
    api.state
        .access
        .replace(Keys::read(&without_rita.join("[[key]]")).expect("keys"));
    let dead = api.get(&format!("{plan}/events{query}")).await;
    dead.expect_problem(401, "unauthorized");
}

#[tokio::test]
async fn a_long_poll_ends_with_its_key() {
    let api = Api::with_keys(&house());
    let plan = submit(&api, "of alice").await;
    let bearer = bearer("of alice");
    let headers = [("authorization", &*bearer), ("prefer", "wait=30")];
    let polled = api.send(Method::GET, &plan, &headers, "");
    let withdrawn = async {
        let others = entry("bob", "of bob", "plan", "");
        api.state.access.replace(Keys::read(&others).expect("keys"));
    };
    let (polled, ()) = in_time(async { tokio::join!(polled, withdrawn) }).await;
    polled.expect_problem(401, "unauthorized");
}

#[tokio::test]
async fn a_submission_stops_waiting_when_its_key_is_withdrawn() {
    let api = Api::with_keys(&house());
    let bearer = bearer("of alice");
    let headers = [
        ("authorization", &*bearer),
        ("content-type", "application/json"),
        ("prefer", "wait=30"),
    ];
    let posted = api.send(Method::POST, "/plans", &headers, scenario().to_string());
    let withdrawn = async {
        eventually(async || api.store.stats().await.expect("counted").queued == 1).await;
        let others = entry("bob", "of bob", "plan", "");
        api.state.access.replace(Keys::read(&others).expect("keys"));
        // A request that went on waiting would see the end.
        tokio::time::sleep(Duration::from_secs(10)).await;
        run::complete(&*api.store, Vec::new()).await;
        std::future::pending::<()>().await;
    };
    let posted = in_time(async {
        tokio::select! {
            posted = posted => posted,
            () = withdrawn => unreachable!("it goes on"),
        }
    });
    let posted = posted.await;
    assert_eq!(posted.status, 202, "{posted:?}");
    assert_eq!(posted.json()["status"], "queued");
}

/// A page may open its stream on any node, and a restarted node counts as another one.
#[tokio::test]
async fn a_ticket_is_valid_on_every_node_with_the_same_keys() {
    let mut api = Api::with_keys(&house());
    let plan = submit(&api, "of alice").await;
    let issued = send(&api, "of rita", &format!("POST {plan}/tickets")).await;
    let events = issued.json()["events"].as_str().expect("text").to_owned();
    run::complete(&*api.store, Vec::new()).await;
    let other_key = house().replace(&sha256_hex(b"of rita"), &sha256_hex(b"of rita too"));
    for (keys, status) in [(house(), 200), (other_key, 401)] {
        let keys = Keys::read(&keys).expect("keys");
        api.state.access = Access::new(Some(keys), Settings::default(), wall_clock());
        api.router = http::router(api.state.clone());
        assert_eq!(api.get(&events).await.status, status);
    }
}

#[tokio::test]
async fn a_ticket_expires() {
    let settings = Settings {
        ticket_life: std::time::Duration::ZERO,
        ..Settings::default()
    };
    let api = Api::with_access(&house(), settings);
    let plan = submit(&api, "of alice").await;
    let ticket = send(&api, "of alice", &format!("POST {plan}/tickets"))
        .await
        .json();
    let events = ticket["events"].as_str().expect("text");
    let problem = api.get(events).await.expect_problem(401, "unauthorized");
    assert!(problem["detail"].as_str().expect("text").contains("ticket"));
}

#[tokio::test]
async fn a_ticket_expires_no_later_than_its_key() {
    let expires = jiff::Timestamp::now() + std::time::Duration::from_secs(60);
    let expires = expires.round(jiff::Unit::Second).expect("a time");
    let key = entry("amy", "of amy", "plan", &format!("expires = {expires}"));
    let api = Api::with_keys(&key);
    let plan = submit(&api, "of amy").await;
    let ticket = send(&api, "of amy", &format!("POST {plan}/tickets")).await;
    let until = ticket.json()["expires_at"].as_str().map(str::to_owned);
    let until: jiff::Timestamp = until.expect("text").parse().expect("a time");
    assert_eq!(until, expires);
}

/// Not by the machine's clock, which may have jumped.
#[tokio::test]
async fn keys_and_tickets_expire_by_the_clock_of_the_service() {
    let expires = jiff::Timestamp::now() + Duration::from_secs(3_600);
    let key = entry("amy", "of amy", "plan", &format!("expires = {expires}"));
    let mut api = Api::with_keys(&key);
    let plan = submit(&api, "of amy").await;
    let ticket = send(&api, "of amy", &format!("POST {plan}/tickets")).await;
    let events = ticket.json()["events"].as_str().expect("text").to_owned();
    run::complete(&*api.store, Vec::new()).await;
    for (ahead_ms, status) in [(0, 200), (7_200_000, 401)] {
        let keys = Keys::read(&key).expect("keys");
        let clock = Arc::new(move || wall_clock()() + ahead_ms);
        api.state.access = Access::new(Some(keys), Settings::default(), clock);
        api.router = http::router(api.state.clone());
        assert_eq!(
            send(&api, "of amy", &format!("GET {plan}")).await.status,
            status
        );
        assert_eq!(api.get(&events).await.status, status);
    }
}

#[tokio::test]
async fn tickets_also_work_without_keys() {
    let api = Api::new();
    let plan = api.submit().await;
    let ticket = api
        .send(Method::POST, &format!("{plan}/tickets"), &[], "")
        .await
        .json();
    run::complete(&*api.store, Vec::new()).await;
    let events = ticket["events"].as_str().expect("text");
    assert_eq!(api.get(events).await.status, 200);
    let forged = format!("{plan}/events?ticket=x");
    api.get(&forged).await.expect_problem(401, "unauthorized");
}

#[tokio::test]
async fn an_owner_cannot_exceed_its_limit_of_active_plans() {
    let keys = entry("alice", "of alice", "plan", "active_plans = 2")
        + &entry(
            "alice new",
            "of alice too",
            "plan",
            "active_plans = 2\nowner = \"alice\"",
        );
    let api = Api::with_keys(&(keys + &entry("bob", "of bob", "plan", "")));
    submit(&api, "of alice").await;
    submit(&api, "of alice too").await;
    for secret in ["of alice", "of alice too"] {
        let refused = post(&api, secret).await;
        let problem = refused.expect_problem(429, "quota-reached");
        let detail = problem["detail"].as_str().expect("text");
        assert!(detail.starts_with("2 plans of the key's owner"), "{detail}");
        assert!(refused.headers.contains_key("retry-after"));
        assert_eq!(refused.header("ratelimit-policy"), "\"plans\";q=2");
        assert_eq!(refused.header("ratelimit"), "\"plans\";r=0");
    }
    submit(&api, "of bob").await;
    run::complete(&*api.store, Vec::new()).await;
    submit(&api, "of alice").await;
}

#[tokio::test]
async fn a_key_cannot_exceed_its_request_rate() {
    let slow = "requests_per_second = 0.01\nburst = 3";
    let keys = entry("alice", "of alice", "read", slow) + &entry("bob", "of bob", "plan", "");
    let api = Api::with_keys(&keys);
    for (request, status, left) in [
        ("GET /plans", 200, 2),
        ("GET /nowhere", 404, 2),
        ("GET /livez", 200, 2),
        ("GET /plans?limit=x", 400, 1),
        ("POST /plans", 403, 0),
    ] {
        let answer = send(&api, "of alice", request).await;
        assert_eq!(answer.status, status, "{request}");
        if request.contains("/plans") {
            assert_eq!(answer.header("ratelimit-policy"), "\"requests\";q=3;w=300");
            let fields = answer.header("ratelimit").to_owned();
            assert!(
                fields.starts_with(&format!("\"requests\";r={left};t=")),
                "{fields}"
            );
        }
    }
    let refused = send(&api, "of alice", "GET /plans").await;
    refused.expect_problem(429, "rate-limited");
    let seconds: u64 = refused.header("retry-after").parse().expect("seconds");
    assert!((90..=100).contains(&seconds), "{seconds}");
    assert!(
        refused
            .header("ratelimit")
            .starts_with("\"requests\";r=0;t=")
    );
    // A reload does not reset the rate limit.
    api.state.access.replace(Keys::read(&keys).expect("keys"));
    send(&api, "of alice", "GET /plans")
        .await
        .expect_problem(429, "rate-limited");
    let free = send(&api, "of bob", "GET /plans").await;
    assert_eq!(free.status, 200);
    assert!(!free.headers.contains_key("ratelimit"));
}

/// Longer than any other `Retry-After`, as documented.
#[tokio::test]
async fn retry_after_covers_the_full_wait_of_a_slow_key() {
    let slow = "requests_per_second = 0.001\nburst = 1";
    let api = Api::with_keys(&entry("alice", "of alice", "read", slow));
    assert_eq!(send(&api, "of alice", "GET /plans").await.status, 200);
    let refused = send(&api, "of alice", "GET /plans").await;
    refused.expect_problem(429, "rate-limited");
    let seconds: u64 = refused.header("retry-after").parse().expect("seconds");
    assert!((900..=1000).contains(&seconds), "{seconds}");
}

/// An open stream whose head has arrived.
async fn open(api: &Api, plan: &str, secret: Option<&str>) -> axum::http::Response<Body> {
    let request = Request::get(format!("{plan}/events")).header("host", "localhost");
    let request = match secret {
        Some(secret) => request.header("authorization", bearer(secret)),
        None => request,
    };
    let request = request.body(Body::empty()).expect("a request");
    api.router
        .clone()
        .oneshot(request)
        .await
        .expect("never fails")
}

#[tokio::test]
async fn a_stream_counts_until_its_body_is_dropped() {
    let settings = Settings {
        streams: 3,
        streams_per_key: 2,
        ..Settings::default()
    };
    let api = Api::with_access(&house(), settings);
    let limits = api.get("/limits").await.json();
    assert_eq!(
        (&limits["streams"], &limits["streams_per_key"]),
        (&3.into(), &2.into())
    );
    let plan = submit(&api, "of alice").await;
    let refused = async |secret: &str| {
        let answer = send(&api, secret, &format!("GET {plan}/events")).await;
        assert!(answer.headers.contains_key("retry-after"));
        let problem = answer.expect_problem(429, "too-many-streams");
        let limit = problem["limit"].clone();
        let name = limit.as_str().expect("text");
        let detail = problem["detail"].as_str().expect("text");
        let of_owner = detail.contains("of the key's owner");
        assert_eq!(of_owner, name == "streams_per_key", "{detail}");
        let policy = format!("\"{name}\";q={}", limits[name]);
        assert_eq!(answer.header("ratelimit-policy"), policy);
        assert_eq!(answer.header("ratelimit"), format!("\"{name}\";r=0"));
        limit
    };
    let mut first = open(&api, &plan, Some("of alice")).await;
    let second = open(&api, &plan, Some("of rita")).await;
    assert_eq!(
        (first.status(), second.status()),
        (StatusCode::OK, StatusCode::OK)
    );
    assert_eq!(refused("of rita").await, "streams_per_key");
    // Reading does not free a place, dropping does.
    first
        .body_mut()
        .frame()
        .await
        .expect("a frame")
        .expect("unbroken");
    assert_eq!(refused("of alice").await, "streams_per_key");
    let third = open(&api, &plan, Some("of ada")).await;
    assert_eq!(refused("of ada").await, "streams");
    drop(first);
    let again = open(&api, &plan, Some("of alice")).await;
    assert_eq!(again.status(), StatusCode::OK);
    assert_eq!(refused("of ada").await, "streams");
    drop((second, third, again));
    // A stream that reaches its end frees its place as well.
    for _ in 0..4 {
        let followed = open(&api, &plan, Some("of alice")).await;
        assert_eq!(followed.status(), StatusCode::OK);
    }
}

#[tokio::test]
async fn removing_a_key_ends_its_streams() {
    let api = Api::with_keys(&house());
    let plan = submit(&api, "of alice").await;
    let of_rita = open(&api, &plan, Some("of rita")).await.into_body();
    let of_alice = open(&api, &plan, Some("of alice")).await.into_body();
    let reading = tokio::spawn(of_rita.collect());
    api.state
        .access
        .replace(Keys::read(&entry("alice", "of alice", "plan", "")).expect("keys"));
    let read = reading
        .await
        .expect("no panic")
        .expect("a clean end")
        .to_bytes();
    assert!(!String::from_utf8_lossy(&read).contains("event: end"));
    run::complete(&*api.store, Vec::new()).await;
    let read = of_alice.collect().await.expect("a clean end").to_bytes();
    assert!(String::from_utf8_lossy(&read).contains("event: end"));
}
