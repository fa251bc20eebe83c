//! The page and its files: policy, entity tags, codings; and the endpoints it uses.

use std::io::Read as _;

use axum::http::{Method, StatusCode};
use flate2::read::GzDecoder;
use serde_json::{Value, json};

use crate::support::api::Api;
use crate::support::keys::{bearer, entry};

/// Ground that rises by 1 m every 200 m to the east, and by 10 m to the north.
fn sloping() -> Value {
    json!({
        "start": {"x": 0, "y": 0, "z": 50}, "target": {"x": 1000, "y": 0, "z": 50},
        "area": {"min": {"x": -100, "y": -200}, "max": {"x": 1100, "y": 200}},
        "terrain": {"kind": "grid", "origin": {"x": -200, "y": -300}, "cell": 200, "columns": 8, "rows": 4,
            "elevations": [0,1,2,3,4,5,6,7, 10,11,12,13,14,15,16,17, 20,21,22,23,24,25,26,27, 30,31,32,33,34,35,36,37]},
        "altitude": {"min": 0, "max": 100}
    })
}

#[tokio::test]
async fn the_page_needs_no_key_and_loads_only_from_its_own_origin() {
    let api = Api::with_keys(&entry("alice", "of alice", "plan", ""));
    for (path, media_type) in [
        ("/", "text/html; charset=utf-8"),
        ("/page/main.js", "text/javascript; charset=utf-8"),
        ("/page/page.css", "text/css; charset=utf-8"),
        ("/page/mark.svg", "image/svg+xml"),
        ("/page/vendor/three.js", "text/javascript; charset=utf-8"),
    ] {
        let answer = api.get(path).await;
        assert_eq!(answer.status, StatusCode::OK, "{path}");
        assert_eq!(answer.header("content-type"), media_type);
        assert_eq!(answer.header("x-content-type-options"), "nosniff");
        let policy = answer.header("content-security-policy");
        assert!(policy.starts_with("default-src 'none'; script-src 'self'; style-src 'self'"));
        assert!(
            !policy.contains("unsafe") && !policy.contains("http"),
            "{policy}"
        );
    }
    for path in [
        "/page/nothing.js",
        "/page/vendor/nothing.js",
        "/page/%2e%2e",
        "/page/SHA256SUMS",
    ] {
        assert_eq!(api.get(path).await.status, StatusCode::NOT_FOUND, "{path}");
    }
    assert_eq!(
        api.get("/page/main.js?v=1").await.status,
        StatusCode::BAD_REQUEST
    );
}

/// Everything that the markup refers to exists: the page has no dead links of its own.
#[tokio::test]
async fn every_path_named_in_the_page_is_served() {
    let api = Api::new();
    let page = String::from_utf8(api.get("/").await.body.to_vec()).expect("text");
    let named: Vec<_> = page
        .split(['"'])
        .filter(|text| text.starts_with("/page/") || text.starts_with("/docs"))
        .collect();
    assert!(named.len() > 5, "{named:?}");
    for path in named {
        assert_eq!(api.get(path).await.status, StatusCode::OK, "{path}");
    }
    assert!(!page.contains("http://") && !page.contains("https://"));
    assert!(!page.contains("style=") && !page.contains("onclick"));
}

#[tokio::test]
async fn an_unchanged_file_is_not_sent_again() {
    let api = Api::new();
    for (path, coding, offered) in [
        ("/page/main.js", None, "identity"),
        ("/page/main.js", Some("gzip"), "gzip, deflate, br"),
        ("/page/vendor/three.js", Some("br"), "gzip, deflate, br"),
        ("/page/vendor/three.js", Some("gzip"), "gzip, br;q=0"),
    ] {
        let answer = api.get_with(path, &[("accept-encoding", offered)]).await;
        let sent = answer.headers.get("content-encoding");
        assert_eq!(
            sent.map(|sent| sent.to_str().expect("ASCII")),
            coding,
            "{path}"
        );
        assert!(answer.header("vary").contains("accept-encoding"));
        let tag = answer.header("etag").to_owned();
        let again = [
            ("accept-encoding", offered),
            ("if-none-match", tag.as_str()),
        ];
        let same = api.get_with(path, &again).await;
        assert_eq!(same.status, StatusCode::NOT_MODIFIED, "{path}");
        assert_eq!(same.header("etag"), tag);
        assert!(same.body.is_empty());
        let other = [("accept-encoding", offered), ("if-none-match", "\"other\"")];
        assert_eq!(api.get_with(path, &other).await.status, StatusCode::OK);
    }
}

#[tokio::test]
async fn gzip_carries_the_same_bytes() {
    let api = Api::new();
    let plain = api.get("/page/scene.js").await;
    let coded = api
        .get_with("/page/scene.js", &[("accept-encoding", "gzip")])
        .await;
    let mut text = Vec::new();
    let read = GzDecoder::new(coded.body.as_ref()).read_to_end(&mut text);
    assert_eq!(read.expect("gzip"), plain.body.len());
    assert_eq!(text, plain.body);
    assert!(coded.body.len() < plain.body.len() / 2);
}

#[tokio::test]
async fn shipped_scenarios_need_no_key() {
    let api = Api::with_keys(&entry("alice", "of alice", "plan", ""));
    let list = api.get("/scenarios").await.json();
    let scenarios = list["scenarios"].as_array().expect("a list").clone();
    assert!(scenarios.len() >= 5);
    for scenario in scenarios {
        let href = scenario["href"].as_str().expect("an address");
        let document = api.get(href).await;
        assert_eq!(document.json()["name"], scenario["title"]);
    }
    assert_eq!(
        api.get("/scenarios/nothing").await.status,
        StatusCode::NOT_FOUND
    );
}

#[tokio::test]
async fn ground_is_sampled_over_the_area() {
    let api = Api::new();
    let ground = |query: &str| format!("/scenarios:ground{query}");
    let answer = api.post(&ground("?columns=3&rows=2"), &sloping()).await;
    assert_eq!(answer.status, StatusCode::OK);
    let expected = json!({
        "area": {"min": {"x": -100.0, "y": -200.0}, "max": {"x": 1100.0, "y": 200.0}},
        "columns": 3, "rows": 2,
        "elevations": [5.5, 8.5, 11.5, 25.5, 28.5, 31.5],
    });
    assert_eq!(answer.json(), expected);
    for (query, names) in [
        ("?columns=1", "columns"),
        ("?rows=402", "rows"),
        ("?rows=many", "rows"),
        ("?depth=2", "depth"),
    ] {
        let refused = api.post(&ground(query), &sloping()).await;
        assert_eq!(refused.status, StatusCode::BAD_REQUEST, "{query}");
        assert_eq!(refused.json()["parameter"], names);
    }
    let wrong = api.post(&ground(""), &json!({})).await;
    assert_eq!(wrong.status, StatusCode::UNPROCESSABLE_ENTITY);
}

#[tokio::test]
async fn ground_in_degrees_is_sampled_in_degrees() {
    let api = Api::new();
    let document = json!({
        "frame": "wgs84",
        "start": {"lat": 0.0, "lon": 179.99, "alt": 50}, "target": {"lat": 0.0, "lon": -179.99, "alt": 50},
        "area": {"min": {"lat": -0.02, "lon": 179.98}, "max": {"lat": 0.02, "lon": -179.98}},
        "terrain": {"kind": "peaks", "base": 7, "peaks": [
            {"center": {"lat": 0.0, "lon": 180.0}, "height": 100, "spread": {"x": 500, "y": 500}}]},
        "altitude": {"min": 0, "max": 200},
    });
    let answer = api
        .post("/scenarios:ground?columns=3&rows=3", &document)
        .await;
    assert_eq!(answer.status, StatusCode::OK, "{answer:?}");
    let ground: Value = answer.json();
    assert_eq!(
        ground["area"]["max"]["lon"], -179.98,
        "across the antimeridian"
    );
    let elevations: Vec<f64> =
        serde_json::from_value(ground["elevations"].clone()).expect("numbers");
    let peak = elevations[4];
    assert!((peak - 107.0).abs() < 0.1, "{elevations:?}");
    assert!(
        elevations
            .iter()
            .enumerate()
            .all(|(at, z)| at == 4 || (z - 7.0).abs() < 0.1)
    );
}

#[tokio::test]
async fn sampling_ground_needs_a_key_that_may_read() {
    let keys = [
        entry("alice", "of alice", "plan", ""),
        entry("rita", "of rita", "read", ""),
        entry("max", "of max", "metrics", ""),
    ];
    let api = Api::with_keys(&keys.concat());
    let ask = async |more: &[(&str, &str)]| {
        let headers = [&[("content-type", "application/json")], more].concat();
        let body = sloping().to_string();
        api.send(Method::POST, "/scenarios:ground", &headers, body)
            .await
    };
    assert_eq!(ask(&[]).await.status, StatusCode::UNAUTHORIZED);
    for (secret, expected) in [
        ("of max", StatusCode::FORBIDDEN),
        ("of rita", StatusCode::OK),
        ("of alice", StatusCode::OK),
    ] {
        let answer = ask(&[("authorization", &bearer(secret))]).await;
        assert_eq!(answer.status, expected, "{secret}");
    }
}
