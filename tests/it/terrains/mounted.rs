//! Files mounted by the operator.

use std::path::Path;

use noctule::catalogue::{Directories, Mounted};

use super::{hill, jacksboro, kept, over, put};
use crate::support::api::Api;

fn with_mounted(directory: &Path) -> Api {
    Api::with_catalogue(|uploads| {
        let mounted = Mounted::open(directory).expect("it can be read");
        Directories::new(uploads, Some(mounted))
    })
}

#[tokio::test]
async fn mounted_files_are_datasets_named_after_their_files() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    for (name, content) in [
        ("Hill.ASC", hill(7.0).into_bytes()),
        ("hill.tif", jacksboro()),
        ("fault.tiff", jacksboro()),
        ("N36W085.SRTMGL3.hgt", vec![0; 2 * 1201 * 1201]),
        ("hill.old.tif", jacksboro()),
        ("broken.tif", b"no file".to_vec()),
        ("two words.tif", jacksboro()),
        ("README.md", b"about these files".to_vec()),
    ] {
        std::fs::write(directory.path().join(name), content).expect("written");
    }
    let api = with_mounted(directory.path());
    put(&api, "/terrains/other", hill(1.0)).await;
    let listed = api.get("/terrains").await.json();
    let terrains = listed["terrains"].as_array().expect("a list");
    let names: Vec<_> = terrains
        .iter()
        .map(|terrain| {
            (
                terrain["name"].as_str().expect("text"),
                terrain["mounted"] == true,
            )
        })
        .collect();
    assert_eq!(
        names,
        [
            ("fault", true),
            ("hill", true),
            ("n36w085", true),
            ("other", false)
        ]
    );
    // Figures that take reading the whole file are known after the first request for them.
    assert_eq!(terrains[1]["sha256"], serde_json::Value::Null);
    let hill = api.get("/terrains/hill").await.json();
    assert_eq!(
        (&hill["format"], &hill["max"]),
        (&"asc".into(), &307.0.into())
    );
    assert_eq!(hill["uploaded_at"], serde_json::Value::Null);
    assert_eq!(api.get("/terrains").await.json()["terrains"][1], hill);
    let sea = api.get("/terrains/n36w085").await.json();
    assert_eq!(sea["area"]["min"]["lon"], -85.0);
    let broken = api.get("/terrains/broken").await;
    broken.expect_problem(422, "invalid-terrain");
}

#[tokio::test]
async fn mounted_files_cannot_be_replaced_or_deleted() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(directory.path().join("hill.asc"), hill(7.0)).expect("written");
    let api = with_mounted(directory.path());
    put(&api, "/terrains/hill", hill(8.0))
        .await
        .expect_problem(409, "terrain-mounted");
    api.delete("/terrains/hill")
        .await
        .expect_problem(409, "terrain-mounted");
    assert_eq!(kept(&api.uploads()), [0, 0, 0]);
    assert_eq!(api.get("/terrains/hill").await.json()["max"], 307.0);
}

#[tokio::test]
async fn a_changed_mounted_file_no_longer_matches_its_checksum() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("hill.asc");
    std::fs::write(&file, hill(7.0)).expect("written");
    let api = with_mounted(directory.path());
    let before = api.get("/terrains/hill").await.json();
    let accepted = api
        .post("/plans?validate_only=true", &over("hill"))
        .await
        .json();
    let accepted = &accepted["scenario"];
    assert_eq!(accepted["terrain"]["sha256"], before["sha256"]);
    std::fs::write(&file, hill(8.5)).expect("written");
    let after = api.get("/terrains/hill").await.json();
    assert_ne!(after["sha256"], before["sha256"]);
    assert_eq!(after["max"], 308.5);
    let refused = api.post("/plans", accepted).await;
    let problem = refused.expect_problem(422, "invalid-scenario");
    assert_eq!(problem["errors"][0]["code"], "replaced-dataset");
    assert_eq!(problem["errors"][0]["pointer"], "/terrain/sha256");
    std::fs::remove_file(&file).expect("removed");
    api.get("/terrains/hill")
        .await
        .expect_problem(404, "not-found");
    let refused = api.post("/plans", accepted).await;
    let problem = refused.expect_problem(422, "invalid-scenario");
    assert_eq!(problem["errors"][0]["code"], "unknown-dataset");
}

#[test]
fn a_missing_directory_is_refused_at_startup() {
    let error = Mounted::open(Path::new("/nowhere/at/all")).expect_err("nothing is there");
    assert!(
        error
            .to_string()
            .starts_with("/nowhere/at/all cannot be read"),
        "{error}"
    );
}
