//! Files of earlier versions of the embedded store are migrated without loss.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::sync::Arc;

use noctule::job::{Event, Idempotency, Plan, PlanId, Status};
use noctule::store::sqlite::SqliteStore;
use noctule::store::{DatasetUse, ListQuery, Options, Retention, Store, StoreError, wall_clock};
use tempfile::TempDir;

use crate::support::plans::{ending, history, point};

fn options() -> Options {
    Options::new(1_000)
}

/// A data directory with the database of `dump`.
fn left(dump: &str) -> TempDir {
    let directory = TempDir::new().unwrap();
    let database = rusqlite::Connection::open(directory.path().join("noctule.db")).unwrap();
    database.execute_batch(dump).unwrap();
    directory
}

/// Written before owners, idempotency keys and retention existed.
#[tokio::test(flavor = "multi_thread")]
async fn a_file_of_version_1_is_migrated_and_goes_on() {
    use Status::{Queued, Succeeded};
    let directory = left(include_str!("fixtures/store-version-1.sql"));
    let file = directory.path().join("noctule.db");
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let all = ListQuery {
        limit: 10,
        ..ListQuery::default()
    };
    let plans = store.list(all.clone()).await.unwrap();
    let statuses: Vec<_> = plans.iter().map(|plan| plan.status).collect();
    assert_eq!(statuses, [Queued, Queued, Succeeded, Succeeded]);
    for plan in &plans {
        assert_eq!((&plan.owner, plan.expires_ms), (&None, None));
        let told = history(&store, plan.id).await;
        assert!(matches!(&told[0], Event::Status(first) if first.id == plan.id));
        let document = store.result(plan.id).await.unwrap();
        assert_eq!(document.is_some(), plan.status == Succeeded);
        assert!(store.scenario(plan.id).await.unwrap().contains("planner"));
    }
    // The interrupted run is next in the queue, and the bytes of old plans count.
    let lease = store.claim().await.unwrap();
    assert_eq!(lease.plan.name.as_deref(), Some("long"));
    store
        .append(&lease, vec![point(1, Some(9.0))])
        .await
        .unwrap();
    store
        .finish(&lease, ending(Succeeded).at(wall_clock()()))
        .await
        .unwrap();
    store.close().await;

    let database = rusqlite::Connection::open(&file).unwrap();
    let short: i64 = database
        .query_row("SELECT count(*) FROM plans WHERE bytes < 500", [], |row| {
            row.get(0)
        })
        .unwrap();
    assert_eq!(short, 0);
    drop(database);
    let keep_none = Options {
        retention: Retention {
            plans: Some(0),
            ..Retention::default()
        },
        ..options()
    };
    let store = SqliteStore::open(directory.path(), keep_none).unwrap();
    assert_eq!(store.sweep(wall_clock()()).await.unwrap(), 3);
    assert_eq!(store.list(all).await.unwrap().len(), 1);
}

/// One second after the process of the fourth version was killed.
const SOON_MS: i64 = 1_795_369_517_000;

/// Everything of a plan of the fourth version is there, and in order.
async fn is_whole(store: &SqliteStore, plan: &Plan) {
    let is_long = plan.name.as_deref() == Some("long");
    let ended = plan.status.is_final();
    assert_eq!(plan.expires_ms.is_some(), ended, "a week from its end");
    let result = store.result(plan.id).await.unwrap();
    assert_eq!(result.is_some(), plan.status == Status::Succeeded);
    assert!(result.is_none_or(|result| result.contains(&plan.id.to_string())));
    assert!(store.scenario(plan.id).await.unwrap().contains("planner"));
    let page = store.events(plan.id, 0, 100).await.unwrap();
    let ids: Vec<_> = page.events.iter().map(|event| event.id).collect();
    assert_eq!(ids, (1..=ids.len() as u64).collect::<Vec<_>>());
    let told = history(store, plan.id).await;
    assert!(matches!(&told[0], Event::Status(first) if first.id == plan.id));
    let end = told.last().filter(|last| matches!(last, Event::End(_)));
    assert_eq!(end, ended.then_some(&Event::End(plan.status)));
    let searched = told
        .iter()
        .any(|event| matches!(event, Event::Convergence(_)));
    assert_eq!(searched, is_long || plan.status == Status::Succeeded);
}

/// Written when events were stored as text: one of everything, for two owners.
#[tokio::test(flavor = "multi_thread")]
async fn a_file_of_version_4_is_migrated_with_all_its_contents() {
    use Status::{Cancelled, Queued, Succeeded};
    let directory = left(include_str!("fixtures/store-version-4.sql"));
    let soon = Options {
        clock: Arc::new(|| SOON_MS),
        ..options()
    };
    let store = SqliteStore::open(directory.path(), soon).unwrap();
    let all = ListQuery {
        limit: 10,
        ..ListQuery::default()
    };
    let plans = store.list(all).await.unwrap();
    let told = plans.iter().rev().map(|plan| {
        let (name, owner) = (plan.name.as_deref(), plan.owner.as_deref());
        (name.unwrap(), owner.unwrap(), plan.status)
    });
    assert_eq!(
        told.collect::<Vec<_>>(),
        [
            ("ended", "alice", Succeeded),
            ("told", "alice", Succeeded),
            ("over ground", "bob", Succeeded),
            ("long", "alice", Queued),
            ("queued", "bob", Queued),
            ("cancelled", "alice", Cancelled),
        ]
    );
    for plan in &plans {
        is_whole(&store, plan).await;
    }
    let [cancelled, queued, long, over, told, ended] = plans.as_slice() else {
        panic!("there are six");
    };

    // Keys, tombstones, datasets and webhooks keep their meaning.
    let repeated = async |owner: &str, key: &str, body_sha256: &str| {
        let (key, body_sha256) = (key.to_owned(), body_sha256.to_owned());
        let idempotency = Idempotency { key, body_sha256 };
        let plan = store.repeated(Some(&owner.to_owned()), &idempotency).await;
        plan.unwrap().map(|plan| plan.id)
    };
    let once = "004320fa65512926393a42996f7c8afc8246ebc6d5dde0cd1c6bb0be35d0b319";
    assert_eq!(repeated("alice", "once", once).await, Some(ended.id));
    let waits = "c19aad1dffafa282e413de661589c458a5ad5f13ebc9ada04b6974b39fb9d75e";
    assert_eq!(repeated("bob", "waits", waits).await, Some(queued.id));
    assert_eq!(repeated("bob", "once", once).await, None);
    let gone: PlanId = "01a2045c-b9cb-7367-9f43-adb49f9b3654".parse().unwrap();
    let Err(StoreError::Gone(tombstone)) = store.get(gone).await else {
        panic!("it was deleted");
    };
    assert_eq!(
        (tombstone.owner.as_deref(), tombstone.expired, tombstone.end),
        (Some("bob"), false, None)
    );
    let used = DatasetUse {
        sha256: "85e41b0da922754e1be762d1b21ae5ac213333287d8fad6f571dc3319eef2f47".to_owned(),
        active: 0,
        plans: 1,
    };
    assert_eq!(store.datasets_in_use().await.unwrap(), [used]);
    assert_eq!(over.owner.as_deref(), Some("bob"));
    assert_eq!(store.due_webhooks(SOON_MS, 10).await.unwrap(), []);
    let due = store.due_webhooks(i64::MAX, 10).await.unwrap();
    let due: Vec<_> = due
        .iter()
        .map(|one| (one.plan.id, one.url.as_str(), one.tries))
        .collect();
    assert_eq!(due, [(told.id, "http://127.0.0.1:9/hook", 1)]);

    // The interrupted run is next, starts over, and its end is due at its caller's webhook.
    assert_eq!(
        (long.queue_position, queued.queue_position),
        (Some(1), Some(2))
    );
    assert_eq!(store.incumbent(long.id).await.unwrap(), None);
    let lease = store.claim().await.unwrap();
    assert_eq!((lease.plan.id, lease.attempt), (long.id, 2));
    store
        .append(&lease, vec![point(1, Some(9.0))])
        .await
        .unwrap();
    store
        .finish(&lease, ending(Succeeded).at(SOON_MS))
        .await
        .unwrap();
    let due = store.due_webhooks(SOON_MS, 10).await.unwrap();
    let due: Vec<_> = due
        .iter()
        .map(|one| (one.plan.id, one.url.as_str(), one.tries))
        .collect();
    assert_eq!(due, [(long.id, "http://127.0.0.1:9/long", 0)]);
    let told = history(&store, long.id).await;
    assert!(told.contains(&point(1, Some(9.0))), "beside what is text");
    assert_eq!(told.last(), Some(&Event::End(Succeeded)));
    assert_eq!(cancelled.finished_ms, Some(1_795_369_516_115));
    store.close().await;
}
