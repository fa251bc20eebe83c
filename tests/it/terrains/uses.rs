//! Which datasets plans use, and what becomes of unused ones.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use noctule::catalogue::{Catalogue, Directories};
use noctule::store::wall_clock;
use noctule::worker::Sweeper;

use super::{hill, kept, over, put};
use crate::support::api::Api;
use crate::support::patience::eventually;

/// Removes content as soon as nothing refers to it.
fn impatient() -> Api {
    Api::with_catalogue(|uploads| Directories::with_grace(uploads, None, Duration::ZERO))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dataset_in_use_by_queued_plans_cannot_be_deleted() {
    let api = impatient();
    put(&api, "/terrains/hill", hill(100.0)).await;
    let submit = async || {
        let answer = api.post("/plans", &over("hill")).await;
        assert_eq!(answer.status, 202, "{answer:?}");
        answer.header("location").to_owned()
    };
    let plans = [submit().await, submit().await];
    assert_eq!(api.get("/terrains/hill").await.json()["in_use"], 2);
    assert_eq!(
        api.get("/terrains").await.json()["terrains"][0]["in_use"],
        2
    );
    let problem = api
        .delete("/terrains/hill")
        .await
        .expect_problem(409, "terrain-in-use");
    assert_eq!(problem["plans"], 2);
    // Moving the name to other content leaves the plans' content in place.
    put(&api, "/terrains/hill", hill(50.0)).await;
    let uses = api.store.datasets_in_use().await.expect("it is open");
    let used: BTreeSet<String> = uses.into_iter().map(|used| used.sha256).collect();
    assert_eq!(used.len(), 1);
    assert_eq!(api.state.terrains.catalogue.sweep(&used).expect("swept"), 0);
    assert_eq!(kept(&api.uploads()), [4, 1, 0]);
    assert_eq!(api.delete("/terrains/hill").await.status, 204);
    for plan in &plans {
        let scenario = api.get(&format!("{plan}/scenario")).await;
        assert_eq!(scenario.status, 200);
        assert_eq!(api.delete(plan).await.status, 204);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn content_is_removed_with_the_last_plan_over_it() {
    let api = impatient();
    put(&api, "/terrains/hill", hill(100.0)).await;
    let plan = api
        .post("/plans", &over("hill"))
        .await
        .header("location")
        .to_owned();
    put(&api, "/terrains/hill", hill(50.0)).await;
    put(&api, "/terrains/other", hill(25.0)).await;
    api.delete("/terrains/other").await;
    let catalogue: Arc<dyn Catalogue> = api.state.terrains.catalogue.clone();
    let sweeper = Sweeper::start(api.store.clone(), catalogue, wall_clock());
    until_kept(&api, [4, 1, 0]).await;
    api.delete(&plan).await;
    until_kept(&api, [2, 1, 0]).await;
    drop(sweeper);
}

async fn until_kept(api: &Api, expected: [usize; 3]) {
    eventually(async || kept(&api.uploads()) == expected).await;
}

#[tokio::test]
async fn recently_requested_content_is_kept_for_a_while() {
    let api = Api::new();
    put(&api, "/terrains/hill", hill(100.0)).await;
    let accepted = api
        .post("/plans?validate_only=true", &over("hill"))
        .await
        .json();
    api.delete("/terrains/hill").await;
    let catalogue = &api.state.terrains.catalogue;
    assert!(catalogue.has_unnamed());
    assert_eq!(catalogue.sweep(&BTreeSet::new()).expect("swept"), 0);
    // A caller whose document was just validated may still submit it.
    let answer = api.post("/plans", &accepted["scenario"]).await;
    assert_eq!(answer.status, 202, "{answer:?}");
}

#[tokio::test]
async fn a_restart_keeps_every_dataset_and_removes_crash_remains() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let open =
        || Api::with_catalogue(|_| Directories::new(directory.path().join("terrains"), None));
    let api = open();
    let hill_is = put(&api, "/terrains/hill", hill(100.0)).await.json();
    put(&api, "/terrains/hill", hill(7.0)).await;
    put(
        &api,
        "/terrains/sea?filename=N36W085.hgt",
        vec![0; 2 * 1201 * 1201],
    )
    .await;
    let before = api.get("/terrains").await.json();
    drop(api);
    // Left by a crash: an unfinished upload, and a record whose content never arrived.
    let part = |path: &str| directory.path().join("terrains").join(path);
    std::fs::write(part("incoming/half.part"), "half").expect("written");
    let orphan = format!("content/{}.json", "0".repeat(64));
    std::fs::write(
        part(&orphan),
        r#"{"bytes":4,"min":1.0,"max":2.0,"no_data_share":0.0}"#,
    )
    .expect("written");
    let api = open();
    assert_eq!(api.get("/terrains").await.json(), before);
    assert_eq!(kept(&directory.path().join("terrains")), [6, 2, 0]);
    let mut pinned = over("hill");
    pinned["terrain"]["sha256"] = hill_is["sha256"].clone();
    let answer = api.post("/plans?validate_only=true", &pinned).await;
    assert_eq!(answer.status, 200, "{answer:?}");
}

/// The record may be damaged, or of a newer version: its content must be there once it can be read.
#[tokio::test]
async fn nothing_is_removed_while_the_record_of_a_name_cannot_be_read() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let uploads = directory.path().join("terrains");
    let open =
        || Api::with_catalogue(|_| Directories::with_grace(uploads.clone(), None, Duration::ZERO));
    let api = open();
    put(&api, "/terrains/hill", hill(100.0)).await;
    put(&api, "/terrains/other", hill(50.0)).await;
    api.delete("/terrains/other").await;
    let before = api.get("/terrains").await.json();
    drop(api);

    let record = uploads.join("names/hill.json");
    let text = std::fs::read_to_string(&record).expect("it is there");
    let newer = format!(r#"{{"newer": {text}}}"#);
    for (written, datasets) in [(newer.as_str(), 0), ("", 0), (text.as_str(), 1)] {
        std::fs::write(&record, written).expect("written");
        let api = open();
        let catalogue = &api.state.terrains.catalogue;
        assert_eq!(catalogue.has_unnamed(), datasets > 0, "{written}");
        let removed = catalogue.sweep(&BTreeSet::new()).expect("swept");
        assert_eq!(removed, datasets, "{written}");
        let listed = api.get("/terrains").await.json();
        let listed = listed["terrains"].as_array().expect("a list").len();
        assert_eq!(listed, datasets, "{written}");
    }
    assert_eq!(open().get("/terrains").await.json(), before);
    assert_eq!(kept(&uploads), [2, 1, 0]);

    // A new upload takes the place of a record that cannot be read.
    std::fs::write(&record, newer).expect("written");
    let api = open();
    put(&api, "/terrains/hill", hill(25.0)).await;
    let catalogue = &api.state.terrains.catalogue;
    assert_eq!(catalogue.sweep(&BTreeSet::new()).expect("swept"), 1);
    assert_eq!(kept(&uploads), [2, 1, 0]);
}
