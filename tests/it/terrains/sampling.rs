//! Sampling a dataset for drawing.

use serde_json::{Value, json};

use super::{hill, put};
use crate::support::api::Api;

#[tokio::test]
async fn a_dataset_is_sampled_from_south_to_north() {
    let api = Api::new();
    let text = crate::support::elevations::ascii_grid([5, 5], [-85.0, 36.0], 0.1, |column, row| {
        (100 * row + 10 * column) as f64
    });
    let sum = put(&api, "/terrains/steps", text).await.json()["sha256"].clone();
    let uri = "/terrains/steps/elevations";
    let whole = api.get(&format!("{uri}?columns=5&rows=3")).await;
    let document = whole.json();
    assert_eq!(document["sha256"], sum);
    assert_eq!(
        document["elevations"],
        json!(
            [
                0, 10, 20, 30, 40, 200, 210, 220, 230, 240, 400, 410, 420, 430, 440
            ]
            .map(f64::from)
        )
    );
    // Bilinear between samples, null beyond the outermost ones.
    let part = api
        .get(&format!(
            "{uri}?south=36.1&west=-85.05&north=36.2&east=-84.95&columns=3&rows=2"
        ))
        .await
        .json();
    assert_eq!(
        part["elevations"],
        json!([Value::Null, 100.0, 105.0, Value::Null, 200.0, 205.0])
    );
    let defaults = api.get(uri).await.json();
    assert_eq!(
        defaults["elevations"].as_array().expect("a list").len(),
        64 * 64
    );

    let tag = whole.header("etag").to_owned();
    let known = api.get_with(uri, &[("if-none-match", &tag)]).await;
    assert_eq!(known.status, 304);
    // A weak tag, because the compressed response has other bytes.
    let gzip = [("accept-encoding", "gzip")];
    let packed = api.get_with(uri, &gzip).await;
    assert_eq!(packed.header("content-encoding"), "gzip");
    for answer in [packed, known] {
        assert_eq!(answer.header("etag"), tag);
        assert_eq!(answer.header("vary"), "accept-encoding");
    }
    assert!(tag.starts_with("W/"), "{tag}");
    // The content that a plan was made over, after the name has moved.
    put(&api, "/terrains/steps", hill(1.0)).await;
    let sum = sum.as_str().expect("a sum");
    let pinned = api
        .get(&format!("{uri}?columns=5&rows=3&sha256={sum}"))
        .await
        .json();
    assert_eq!(pinned["elevations"], document["elevations"]);
    let zeros = "0".repeat(64);
    let lost = api.get(&format!("{uri}?sha256={zeros}")).await;
    lost.expect_problem(409, "no-ground");
    for malformed in ["x".to_owned(), sum.to_uppercase(), format!("{sum}0")] {
        let answer = api.get(&format!("{uri}?sha256={malformed}")).await;
        answer.expect_problem(400, "invalid-parameter");
    }
}

#[tokio::test]
async fn invalid_sampling_requests_are_refused() {
    let api = Api::new();
    put(&api, "/terrains/hill", hill(1.0)).await;
    for query in [
        "columns=1",
        "rows=513",
        "columns=512&rows=512",
        "columns=many",
        "south=36",
        "south=91&west=0&north=92&east=1",
        "south=36.2&west=-85&north=36.1&east=-84",
        "south=NaN&west=0&north=1&east=1",
        "height=3",
    ] {
        let answer = api.get(&format!("/terrains/hill/elevations?{query}")).await;
        answer.expect_problem(400, "invalid-parameter");
    }
    api.get("/terrains/hull/elevations")
        .await
        .expect_problem(404, "not-found");
}
