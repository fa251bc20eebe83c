//! What pages may do with the service: cross-origin access for exact origins only, and every response is safe to
//! open.

use axum::body::Body;
use axum::http::{Method, Request, Response};
use tower::ServiceExt as _;

use crate::support::api::Api;
use crate::support::run;

const PAGE: &str = "https://plans.example";

/// A browser's preflight request.
async fn preflight(api: &Api, origin: &str) -> Response<Body> {
    let request = Request::builder()
        .method(Method::OPTIONS)
        .uri("/plans")
        .header("host", "localhost")
        .header("origin", origin)
        .header("access-control-request-method", "POST")
        .header(
            "access-control-request-headers",
            "authorization,content-type",
        )
        .body(Body::empty())
        .expect("a request");
    api.router
        .clone()
        .oneshot(request)
        .await
        .expect("never fails")
}

fn list<'a>(response: &'a Response<Body>, name: &str) -> Vec<&'a str> {
    let value = response.headers()[name].to_str().expect("visible ASCII");
    value.split(',').map(str::trim).collect()
}

#[tokio::test]
async fn a_page_of_a_listed_origin_may_send_requests_and_read_responses() {
    let api = Api::with_origins(&[PAGE, "http://localhost:5173"]);
    let told = preflight(&api, PAGE).await;
    assert!(told.status().is_success(), "and without credentials");
    assert_eq!(told.headers()["access-control-allow-origin"], PAGE);
    assert_eq!(told.headers()["access-control-max-age"], "600");
    assert!(
        !told
            .headers()
            .contains_key("access-control-allow-credentials")
    );
    for method in ["GET", "POST", "PUT", "DELETE"] {
        assert!(list(&told, "access-control-allow-methods").contains(&method));
    }
    for name in [
        "authorization",
        "content-type",
        "idempotency-key",
        "if-match",
        "if-none-match",
        "last-event-id",
        "prefer",
        "traceparent",
        "x-request-id",
    ] {
        assert!(
            list(&told, "access-control-allow-headers").contains(&name),
            "{name}"
        );
    }
    // Refusals are readable as well.
    for uri in ["/livez", "/nowhere"] {
        let answer = api.get_with(uri, &[("origin", PAGE)]).await;
        assert_eq!(answer.header("access-control-allow-origin"), PAGE);
        assert_eq!(
            answer.header("cross-origin-resource-policy"),
            "cross-origin"
        );
        assert!(answer.header("vary").contains("origin"));
        for name in [
            "location",
            "etag",
            "retry-after",
            "x-request-id",
            "link",
            "ratelimit",
            "idempotency-replayed",
        ] {
            assert!(
                answer
                    .header("access-control-expose-headers")
                    .contains(name),
                "{name}"
            );
        }
    }
}

#[tokio::test]
async fn a_page_of_any_other_origin_gets_no_access() {
    for api in [Api::new(), Api::with_origins(&[PAGE])] {
        for origin in [
            "https://evil.example",
            "https://plans.example.evil.example",
            "null",
            "http://plans.example",
        ] {
            let told = preflight(&api, origin).await;
            assert!(
                !told.headers().contains_key("access-control-allow-origin"),
                "{origin}"
            );
            let answer = api.get_with("/livez", &[("origin", origin)]).await;
            assert!(
                !answer.headers.contains_key("access-control-allow-origin"),
                "{origin}"
            );
            assert_eq!(answer.header("cross-origin-resource-policy"), "same-origin");
        }
    }
}

#[tokio::test]
async fn every_response_is_safe_to_open_in_a_browser() {
    let api = Api::new();
    let plan = api.submit().await;
    run::complete(&*api.store, Vec::new()).await;
    for uri in [
        "/livez",
        "/nowhere",
        "/plans?limit=x",
        "/openapi.yaml",
        &plan,
        &format!("{plan}/events"),
    ] {
        let answer = api.get(uri).await;
        assert_eq!(answer.header("x-content-type-options"), "nosniff");
        assert_eq!(answer.header("referrer-policy"), "no-referrer");
        assert_eq!(answer.header("cross-origin-resource-policy"), "same-origin");
        let policy = "default-src 'none'; frame-ancestors 'none'";
        assert_eq!(answer.header("content-security-policy"), policy, "{uri}");
    }
    let drawing = api.get(&format!("{plan}/result?format=svg")).await;
    let policy = drawing.header("content-security-policy");
    assert!(
        policy.contains("default-src 'none'") && policy.ends_with("; sandbox"),
        "{policy}"
    );
}
