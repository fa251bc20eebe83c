//! What a name refers to, and who may change it.

use axum::http::Method;

use super::{hill, jacksboro, kept, over, put, put_with};
use crate::support::api::Api;
use crate::support::keys::{bearer, entry};

#[tokio::test]
async fn an_upload_is_described_and_its_content_stored_once() {
    let api = Api::new();
    let answer = put(&api, "/terrains/jacksboro", jacksboro()).await;
    assert_eq!(answer.status, 201, "{answer:?}");
    assert_eq!(answer.header("location"), "/terrains/jacksboro");
    let created = answer.json();
    let sum = created["sha256"].as_str().expect("a sum");
    assert_eq!(answer.header("etag"), format!("\"{sum}\""));
    assert_eq!(created["format"], "geotiff");
    assert_eq!(created["crs"], "EPSG:4326");
    assert_eq!(
        (&created["columns"], &created["rows"]),
        (&403.into(), &344.into())
    );
    assert_eq!(
        (&created["min"], &created["max"]),
        (&236.0.into(), &1076.0.into())
    );
    assert_eq!(created["no_data_share"], 0.0);
    assert_eq!(
        (&created["mounted"], &created["in_use"]),
        (&false.into(), &0.into())
    );

    let shown = api.get("/terrains/jacksboro").await;
    assert_eq!(
        (shown.status, shown.json()),
        (200.try_into().expect("a status"), created.clone())
    );
    let listed = api.get("/terrains").await.json();
    assert_eq!(
        listed["terrains"].as_array().expect("a list"),
        std::slice::from_ref(&created)
    );

    // Uploading it again changes nothing, not even its time.
    let again = put(&api, "/terrains/jacksboro", jacksboro()).await;
    assert_eq!(again.status, 200);
    assert_eq!(again.json(), created);
    // Under another name it is the same content, stored once.
    let other = put(&api, "/terrains/other", jacksboro()).await;
    assert_eq!(other.status, 201);
    assert_eq!(other.json()["sha256"], sum);
    assert_eq!(kept(&api.uploads()), [2, 2, 0]);
}

#[tokio::test]
async fn a_name_can_be_moved_to_other_content_on_conditions() {
    let api = Api::new();
    let first = put(&api, "/terrains/hill", hill(100.0)).await.json();
    let second = put(&api, "/terrains/hill", hill(50.0)).await;
    assert_eq!(second.status, 200);
    let second = second.json();
    assert_ne!(first["sha256"], second["sha256"]);
    assert_eq!(api.get("/terrains/hill").await.json(), second);
    // Conditional on the content that the caller expects.
    let tag = |document: &serde_json::Value| {
        format!("\"{}\"", document["sha256"].as_str().expect("a sum"))
    };
    for (header, value, status) in [
        ("if-none-match", "*", 412),
        ("if-match", &*tag(&first), 412),
        ("if-match", &*tag(&second), 200),
        ("if-match", "*", 200),
        ("if-match", "\"caf\u{e9}\"", 412),
        ("if-none-match", &*tag(&second), 412),
        ("if-none-match", &*format!("\"x\", W/{}", tag(&second)), 412),
        ("if-none-match", &*tag(&first), 200),
    ] {
        let answer = put_with(&api, "/terrains/hill", &[(header, value)], hill(25.0)).await;
        assert_eq!(answer.status, status, "{header}: {value}");
        if status == 200 {
            put(&api, "/terrains/hill", hill(50.0)).await;
        }
    }
    for (header, value, status) in [
        ("if-match", &*tag(&first), 412),
        ("if-none-match", &*tag(&second), 412),
        ("if-match", &*tag(&second), 204),
        // A repeated deletion may be a retry after a lost response.
        ("if-match", &*tag(&second), 204),
    ] {
        let headers = [(header, value)];
        let answer = api.send(Method::DELETE, "/terrains/hill", &headers, "");
        assert_eq!(answer.await.status, status, "{header}: {value}");
    }
    let any = [("if-match", "*")];
    let absent = put_with(&api, "/terrains/new", &any, hill(25.0)).await;
    let absent = absent.expect_problem(412, "precondition-failed");
    assert_eq!(
        absent["detail"],
        "no dataset is called \"new\", and one was expected"
    );
    for (header, value, status) in [
        ("if-match", "*", 412),
        ("if-none-match", "*", 201),
        ("if-none-match", "\"x\"", 201),
    ] {
        let answer = put_with(&api, "/terrains/new", &[(header, value)], hill(25.0)).await;
        assert_eq!(answer.status, status, "{header}: {value}");
        api.delete("/terrains/new").await;
    }
}

/// The document's tag changes with everything in it; in a conditional change it stands for the content.
/// Each answer describes the file that came with its request, whatever another request has put under the name since.
#[tokio::test(flavor = "multi_thread")]
async fn uploads_at_the_same_time_are_each_answered_for_their_own_file() {
    let api = Api::new();
    let mut sums = Vec::new();
    for height in [100.0, 50.0] {
        let answer = put(&api, "/terrains/hill", hill(height)).await;
        sums.push(answer.json()["sha256"].as_str().expect("a sum").to_owned());
    }
    for _ in 0..30 {
        let deleted = async {
            api.send(Method::DELETE, "/terrains/hill", &[], "").await;
        };
        let (high, low, ()) = tokio::join!(
            put(&api, "/terrains/hill", hill(100.0)),
            put(&api, "/terrains/hill", hill(50.0)),
            deleted
        );
        for (answer, sum) in [high, low].iter().zip(&sums) {
            assert!(answer.status.is_success(), "{answer:?}");
            assert_eq!(answer.json()["sha256"], **sum);
            assert_eq!(answer.header("etag"), format!("\"{sum}\""));
        }
    }
}

#[tokio::test]
async fn a_known_dataset_document_is_answered_with_304() {
    let api = Api::new();
    put(&api, "/terrains/hill", hill(100.0)).await;
    let shown = api.get("/terrains/hill").await;
    let tag = shown.header("etag").to_owned();
    for (known, status) in [
        (tag.clone(), 304),
        (format!("\"x\", W/{tag}"), 304),
        ("*".to_owned(), 304),
        ("\"x\"".to_owned(), 200),
    ] {
        let headers = [("if-none-match", known.as_str())];
        let answer = api.get_with("/terrains/hill", &headers).await;
        assert_eq!(answer.status, status, "{known}");
        assert_eq!(answer.header("etag"), tag);
    }

    let accepted = api.post("/plans", &over("hill")).await;
    let plan = accepted.header("location");
    let used = api
        .get_with("/terrains/hill", &[("if-none-match", &tag)])
        .await;
    assert_eq!(
        (used.status.as_u16(), &used.json()["in_use"]),
        (200, &1.into())
    );
    assert_ne!(used.header("etag"), tag);
    api.delete(plan).await;
    let again = api
        .get_with("/terrains/hill", &[("if-none-match", &tag)])
        .await;
    assert_eq!(again.status, 304);

    for (tag, status) in [(used.header("etag"), 200), (&tag, 412)] {
        let answer = put_with(&api, "/terrains/hill", &[("if-match", tag)], hill(50.0)).await;
        assert_eq!(answer.status, status, "{tag}");
    }
}

#[tokio::test]
async fn deleting_a_name_is_idempotent() {
    let api = Api::new();
    put(&api, "/terrains/hill", hill(100.0)).await;
    for _ in 0..2 {
        assert_eq!(api.delete("/terrains/hill").await.status, 204);
    }
    api.get("/terrains/hill")
        .await
        .expect_problem(404, "not-found");
    assert_eq!(
        api.get("/terrains").await.json()["terrains"],
        serde_json::json!([])
    );
    assert_eq!(api.delete("/terrains/never-there").await.status, 204);
}

#[tokio::test]
async fn only_valid_dataset_names_are_accepted() {
    let api = Api::new();
    for name in [
        "Hill",
        "-hill",
        "hill.tif",
        "%2e%2e",
        "h%2Fl",
        &"a".repeat(65),
    ] {
        let answer = put(&api, &format!("/terrains/{name}"), hill(1.0)).await;
        answer.expect_problem(400, "invalid-parameter");
        let shown = api.get(&format!("/terrains/{name}")).await;
        shown.expect_problem(404, "not-found");
        let removed = api.delete(&format!("/terrains/{name}")).await;
        removed.expect_problem(400, "invalid-parameter");
    }
    assert_eq!(kept(&api.uploads()), [0, 0, 0]);
}

#[tokio::test]
async fn a_file_name_that_is_too_long_is_refused() {
    let api = Api::new();
    let long = format!("/terrains/hill?filename={}.hgt", "n".repeat(300));
    let answer = put(&api, &long, hill(1.0)).await;
    answer.expect_problem(400, "invalid-parameter");
    assert_eq!(kept(&api.uploads()), [0, 0, 0]);
}

#[tokio::test]
async fn declared_properties_are_part_of_the_content() {
    let api = Api::new();
    // Sea level everywhere: only the file name tells one tile from another.
    let sea = vec![0; 2 * 1201 * 1201];
    let here = put(&api, "/terrains/n36w085", sea.clone()).await;
    assert_eq!(here.status, 201, "{here:?}");
    let here = here.json();
    assert_eq!(
        here["area"]["min"],
        serde_json::json!({"lat": 36.0, "lon": -85.0})
    );
    let there = put(&api, "/terrains/sea?filename=S01E179.hgt", sea)
        .await
        .json();
    assert_eq!(
        there["area"]["max"],
        serde_json::json!({"lat": 0.0, "lon": 180.0})
    );
    assert_ne!(here["sha256"], there["sha256"]);
    // However the name of its file is written, a tile in one place is one content.
    for filename in ["N36W085.hgt", "n36w085.SRTMGL3.hgt"] {
        let again = put(
            &api,
            &format!("/terrains/n36w085?filename={filename}"),
            vec![0; 2 * 1201 * 1201],
        )
        .await;
        assert_eq!(again.json()["sha256"], here["sha256"], "{filename}");
    }

    let grid = |west, south, cell| {
        crate::support::elevations::ascii_grid([40, 30], [west, south], cell, |_, _| 250.0)
    };
    let map = grid(200_000.0, 4_000_000.0, 100.0);
    let answer = put(&api, "/terrains/map", map.clone()).await;
    let problem = answer.expect_problem(422, "invalid-terrain");
    assert!(
        problem["detail"]
            .as_str()
            .expect("text")
            .contains("names no coordinate"),
        "{problem}"
    );
    let zones = [16, 17].map(|zone| format!("/terrains/map?crs=EPSG:326{zone}"));
    let mut sums = Vec::new();
    for uri in &zones {
        let answer = put(&api, uri, map.clone()).await;
        assert!(answer.status.is_success(), "{answer:?}");
        sums.push(answer.json()["sha256"].clone());
    }
    assert_ne!(sums[0], sums[1]);
    // Declaring what the file already implies makes no difference.
    let degrees = grid(-85.0, 36.0, 0.01);
    let plain = put(&api, "/terrains/plain", degrees.clone()).await.json();
    let said = put(&api, "/terrains/said?crs=epsg:4326&format=asc", degrees)
        .await
        .json();
    assert_eq!(plain["sha256"], said["sha256"]);
}

#[tokio::test]
async fn every_key_reads_datasets_and_only_uploader_or_admin_changes_them() {
    let people = [
        ("reader", "read"),
        ("alice", "plan"),
        ("bob", "plan"),
        ("operator", "admin"),
    ];
    let text: String = people
        .map(|(name, scope)| entry(name, name, scope, ""))
        .concat();
    let api = Api::with_keys(&text);
    let bearer = |who: usize| bearer(people[who].0);
    let upload = async |who: usize, height: f64| {
        let key = bearer(who);
        put_with(
            &api,
            "/terrains/hill",
            &[("authorization", &key)],
            hill(height),
        )
        .await
    };
    put(&api, "/terrains/hill", hill(1.0))
        .await
        .expect_problem(401, "unauthorized");
    upload(0, 1.0).await.expect_problem(403, "forbidden");
    assert_eq!(upload(1, 1.0).await.status, 201);
    let refusal = upload(2, 2.0).await.expect_problem(403, "forbidden");
    assert_eq!(refusal["scope"], "admin");
    assert_eq!(
        refusal["detail"],
        "hill was not uploaded by the key's owner; only who uploaded it, and keys with the scope admin, may replace or delete it"
    );
    assert_eq!(upload(1, 2.0).await.status, 200);
    assert_eq!(upload(3, 3.0).await.status, 200);
    // The dataset is the operator's now.
    upload(1, 4.0).await.expect_problem(403, "forbidden");
    for (who, status) in [(0, 403), (1, 403), (2, 403), (3, 204)] {
        let key = bearer(who);
        let headers = [("authorization", key.as_str())];
        let seen = api.get_with("/terrains/hill", &headers).await;
        assert_eq!(seen.status, 200);
        let answer = api
            .send(Method::DELETE, "/terrains/hill", &headers, "")
            .await;
        assert_eq!(answer.status, status, "{who}");
    }
}
