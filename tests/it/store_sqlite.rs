//! Behaviour of the embedded store alone.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::ffi::OsStr;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::sync::Arc;

use noctule::job::{Event, PlanId, Status, Submission};
use noctule::store::sqlite::{SqliteStore, upkeep};
use noctule::store::{ListQuery, Options, Retention, Store, StoreError, Trouble};
use tempfile::TempDir;

use crate::support::plans::{ending, history, point, submission};

fn options() -> Options {
    Options::new(1_000)
}

/// The message of a refused opening.
fn refusal(data_dir: &Path) -> String {
    match SqliteStore::open(data_dir, options()) {
        Ok(_) => panic!("{} was opened", data_dir.display()),
        Err(error) => error.to_string(),
    }
}

#[tokio::test]
async fn a_new_data_directory_is_private_to_its_owner() {
    let parent = TempDir::new().unwrap();
    let data_dir = parent.path().join("a/b");
    let store = SqliteStore::open(&data_dir, options()).unwrap();
    store.health().await.unwrap();
    let mode = data_dir.metadata().unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o700);
}

#[tokio::test]
async fn a_second_opener_is_refused_until_the_first_has_closed() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let second = SqliteStore::open(directory.path(), options());
    assert!(matches!(second, Err(StoreError::InUse(path)) if path == directory.path()));
    store.close().await;
    let second = SqliteStore::open(directory.path(), options()).unwrap();
    // Dropping closes as well.
    drop(second);
    SqliteStore::open(directory.path(), options()).unwrap();
}

#[tokio::test]
async fn a_newer_schema_is_refused_and_left_unchanged() {
    let directory = TempDir::new().unwrap();
    SqliteStore::open(directory.path(), options()).unwrap();
    let file = directory.path().join("noctule.db");
    let database = rusqlite::Connection::open(&file).unwrap();
    database.pragma_update(None, "user_version", 99).unwrap();
    drop(database);
    let message = refusal(directory.path());
    assert!(
        message.contains("schema version 99") && message.contains("up to 10"),
        "{message}"
    );
    let database = rusqlite::Connection::open(&file).unwrap();
    let version: i64 = database
        .query_row("PRAGMA user_version", [], |row| row.get(0))
        .unwrap();
    assert_eq!(version, 99);
}

/// A caller's failed plans are found without a look at all its others.
#[tokio::test]
async fn an_index_serves_each_kind_of_list() {
    let directory = TempDir::new().unwrap();
    SqliteStore::open(directory.path(), options()).unwrap();
    let database = rusqlite::Connection::open(directory.path().join("noctule.db")).unwrap();
    for (filter, index) in [
        ("status = 'failed'", "plans_by_status"),
        ("owner = 'a'", "plans_by_owner"),
        (
            "status = 'failed' AND owner = 'a'",
            "plans_by_owner_and_status",
        ),
        (
            "status = 'failed' AND owner = 'a' AND id < 'b'",
            "plans_by_owner_and_status",
        ),
    ] {
        let sql = format!(
            "EXPLAIN QUERY PLAN SELECT * FROM plans WHERE {filter} ORDER BY id DESC LIMIT 9"
        );
        let mut statement = database.prepare(&sql).unwrap();
        let steps = statement.query_map([], |row| row.get(3)).unwrap();
        let steps: Vec<String> = steps.map(Result::unwrap).collect();
        assert_eq!(steps.len(), 1, "nothing is sorted: {steps:?}");
        let served = format!("SEARCH plans USING INDEX {index} (");
        assert!(steps[0].starts_with(&served), "{filter}: {steps:?}");
    }
}

#[test]
fn a_path_or_file_that_is_not_a_store_is_refused_by_name() {
    let directory = TempDir::new().unwrap();
    let in_the_way = directory.path().join("file");
    std::fs::write(&in_the_way, "").unwrap();
    for data_dir in [in_the_way.clone(), in_the_way.join("below")] {
        let message = refusal(&data_dir);
        assert!(message.contains(data_dir.to_str().unwrap()), "{message}");
    }

    let no_database = directory.path().join("data");
    std::fs::create_dir(&no_database).unwrap();
    std::fs::write(
        no_database.join("noctule.db"),
        "a letter to my aunt, ".repeat(100),
    )
    .unwrap();
    let message = refusal(&no_database);
    assert!(
        message.contains("noctule.db") && message.contains("not a database"),
        "{message}"
    );
}

#[test]
fn a_lock_file_that_cannot_be_made_is_refused_by_name() {
    let directory = TempDir::new().unwrap();
    let data_dir = directory.path().join("data");
    std::fs::create_dir(&data_dir).unwrap();
    // A directory in place of the lock file stops even root.
    std::fs::create_dir(data_dir.join("noctule.lock")).unwrap();
    let message = refusal(&data_dir);
    assert!(
        message.contains("lock file") && message.contains("noctule.lock"),
        "{message}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn the_database_can_be_read_with_plain_sql() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let submission = submission();
    store.submit(submission.clone()).await.unwrap();
    let lease = store.claim().await.unwrap();
    store
        .finish(&lease, ending(Status::Succeeded).at(12_000))
        .await
        .unwrap();

    let database = rusqlite::Connection::open(directory.path().join("noctule.db")).unwrap();
    let row: (String, String, f64, String, bool) = database
        .query_row(
            "SELECT id, status, best_cost, scenarios.document, results.document LIKE '{%' FROM plans \
             JOIN scenarios ON scenarios.plan_seq = seq JOIN results ON results.plan_seq = seq",
            [],
            |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?)),
        )
        .unwrap();
    let id = submission.id.to_string();
    assert_eq!(
        row,
        (id, "succeeded".to_owned(), 471.2, submission.scenario, true)
    );
}

/// The event has no row of its own, yet it reads back unchanged whatever has become of the plan.
#[tokio::test(flavor = "multi_thread")]
async fn the_acceptance_event_of_a_plan_reads_back_unchanged() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let mut accepted = Vec::new();
    for _ in 0..3 {
        let submitted = store.submit(submission()).await.unwrap();
        accepted.push(submitted.plan);
    }
    let lease = store.claim().await.unwrap();
    let told = vec![point(3, Some(480.0))];
    store.append(&lease, told).await.unwrap();
    let end = ending(Status::Succeeded).at(12_000);
    store.finish(&lease, end).await.unwrap();
    store.claim().await.unwrap();
    store.close().await;

    let store = SqliteStore::open(directory.path(), options()).unwrap();
    for plan in accepted {
        let page = store.events(plan.id, 0, 1).await.unwrap();
        assert_eq!((page.forgotten, page.events[0].id), (0, 1));
        assert_eq!(page.events[0].event, Event::Status(Box::new(plan.clone())));
        let rest = store.events(plan.id, 1, 10).await.unwrap();
        assert!(rest.events.first().is_none_or(|second| second.id == 2));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn one_failed_write_does_not_fail_the_others() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let twice = submission();
    store.submit(twice.clone()).await.unwrap();
    let tries = (0..100).map(|nth| {
        store.submit(if nth % 10 == 0 {
            twice.clone()
        } else {
            submission()
        })
    });
    let answers = futures_util::future::join_all(tries).await;
    for (nth, answer) in answers.iter().enumerate() {
        assert_eq!(answer.is_err(), nth % 10 == 0, "{nth}: {answer:?}");
    }
    assert_eq!(store.stats().await.unwrap().queued, 91);
    let positions = answers
        .into_iter()
        .flatten()
        .map(|submitted| submitted.plan.queue_position);
    assert!(positions.eq((2..=91).map(Some)));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_write_waits_for_another_process_that_locks_the_file() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let person = rusqlite::Connection::open(directory.path().join("noctule.db")).unwrap();
    person.execute_batch("BEGIN IMMEDIATE").unwrap();
    let mut submit = store.submit(submission());
    assert!(futures_util::FutureExt::now_or_never(&mut submit).is_none());
    // Reads go on meanwhile.
    assert_eq!(store.stats().await.unwrap().queued, 0);
    person.execute_batch("COMMIT").unwrap();
    submit.await.unwrap();
}

/// Callers who give up and try again must not fill the memory.
#[tokio::test(flavor = "multi_thread")]
async fn documents_that_wait_for_a_locked_file_take_limited_memory() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let person = rusqlite::Connection::open(directory.path().join("noctule.db")).unwrap();
    person.execute_batch("BEGIN IMMEDIATE").unwrap();
    let long = || {
        let mut submission = submission();
        submission.scenario = " ".repeat(100 << 20);
        store.submit(submission)
    };
    let mut waiting = [long(), long()];
    for submit in &mut waiting {
        assert!(futures_util::FutureExt::now_or_never(submit).is_none());
    }
    // Their callers give up, but they have been sent.
    drop(waiting);
    let refused = long().await.unwrap_err();
    assert!(matches!(refused, StoreError::Unavailable { .. }));
    let refused = refused.to_string();
    assert!(refused.contains("waiting to be written"), "{refused}");
    person.execute_batch("COMMIT").unwrap();
    store.health().await.unwrap();
    assert_eq!(store.stats().await.unwrap().queued, 2);
    long().await.unwrap();
}

/// A run may begin before its claim is durable; here the claim then fails to commit.
#[tokio::test(flavor = "multi_thread")]
async fn an_early_lease_whose_claim_fails_is_lost() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let id = store.submit(submission()).await.unwrap().plan.id;
    let database = rusqlite::Connection::open(directory.path().join("noctule.db")).unwrap();
    // Breaks as late as possible: at the commit.
    database
        .execute_batch(
            "CREATE TABLE broken (of INTEGER REFERENCES plans (seq) DEFERRABLE INITIALLY DEFERRED);
             CREATE TRIGGER break AFTER UPDATE OF attempt ON plans BEGIN INSERT INTO broken VALUES (-1); END;",
        )
        .unwrap();
    let void = store.claim_early().await.unwrap();
    assert_eq!((void.plan.id, void.plan.status), (id, Status::Running));
    // This write comes after the one that fails.
    store.health().await.unwrap();
    assert_eq!(store.get(id).await.unwrap().status, Status::Queued);
    let lost = store.append(&void, vec![point(1, None)]).await;
    assert!(matches!(lost, Err(StoreError::LeaseLost(plan)) if plan == id));

    database.execute_batch("DROP TRIGGER break").unwrap();
    let lease = store.claim_early().await.unwrap();
    let lost = store
        .finish(&void, ending(Status::Succeeded).at(12_000))
        .await;
    assert!(matches!(lost, Err(StoreError::LeaseLost(plan)) if plan == id));
    let ended = store
        .finish(&lease, ending(Status::Succeeded).at(12_000))
        .await
        .unwrap();
    assert_eq!(ended.status, Status::Succeeded);
    let told = store.events(id, 0, 100).await.unwrap().events;
    let ids: Vec<u64> = told.iter().map(|event| event.id).collect();
    assert_eq!(ids, [1, 2, 3, 4], "nothing remains of the void run");
}

/// Whoever claims learns that claims fail, rather than running the same plan over and over.
#[tokio::test(flavor = "multi_thread")]
async fn after_a_lost_claim_none_is_early_until_one_succeeds() {
    const BREAK: &str = "CREATE TRIGGER break AFTER UPDATE OF attempt ON plans \
                         BEGIN INSERT INTO broken VALUES (-1); END";
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    for _ in 0..2 {
        store.submit(submission()).await.unwrap();
    }
    let database = rusqlite::Connection::open(directory.path().join("noctule.db")).unwrap();
    database
        .execute_batch(
            "CREATE TABLE broken (of INTEGER REFERENCES plans (seq) DEFERRABLE INITIALLY DEFERRED)",
        )
        .unwrap();
    database.execute_batch(BREAK).unwrap();
    let void = store.claim_early().await.unwrap();
    for _ in 0..3 {
        // Neither a write that succeeds nor one that finds nothing to write says anything about claims.
        store.health().await.unwrap();
        let lost = store.append(&void, vec![point(1, None)]).await;
        assert!(matches!(lost, Err(StoreError::LeaseLost(_))), "{lost:?}");
        let failed = store.claim_early().await.map(|lease| lease.attempt);
        assert!(
            matches!(failed, Err(StoreError::Unavailable { .. })),
            "{failed:?}"
        );
    }

    database.execute_batch("DROP TRIGGER break").unwrap();
    let lease = store.claim_early().await.unwrap();
    assert_eq!(lease.plan.id, void.plan.id);
    store
        .finish(&lease, ending(Status::Succeeded).at(12_000))
        .await
        .unwrap();
    // Claims are early again: this one comes although its commit fails.
    database.execute_batch(BREAK).unwrap();
    store.claim_early().await.unwrap();
}

/// Of writes that share a transaction, one that fails after it has written is refused alone.
#[tokio::test(flavor = "multi_thread")]
async fn a_write_that_fails_halfway_leaves_nothing_and_fails_no_other() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let database = rusqlite::Connection::open(directory.path().join("noctule.db")).unwrap();
    database
        .execute_batch(
            "CREATE TRIGGER break BEFORE INSERT ON scenarios WHEN NEW.document = 'bad' \
             BEGIN SELECT raise(ABORT, 'no such document'); END",
        )
        .unwrap();
    let tries = (0..100).map(|nth| {
        let mut submission = submission();
        if nth % 10 == 0 {
            submission.scenario = "bad".to_owned();
        }
        store.submit(submission)
    });
    let answers = futures_util::future::join_all(tries).await;
    for (nth, answer) in answers.iter().enumerate() {
        assert_eq!(answer.is_err(), nth % 10 == 0, "{nth}: {answer:?}");
    }
    assert_eq!(store.stats().await.unwrap().queued, 90);
    let positions = answers
        .into_iter()
        .flatten()
        .map(|submitted| submitted.plan.queue_position);
    assert!(positions.eq((1..=90).map(Some)));
    let orphans: i64 = database
        .query_row(
            "SELECT (SELECT count(*) FROM plans) + (SELECT count(*) FROM scenarios) - 180",
            [],
            |row| row.get(0),
        )
        .unwrap();
    assert_eq!(orphans, 0);
}

#[tokio::test]
async fn a_backup_may_have_any_file_name() {
    use std::os::unix::ffi::OsStrExt as _;
    use std::os::unix::fs::PermissionsExt as _;

    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let id = store.submit(submission()).await.unwrap().plan.id;
    let copies = TempDir::new().unwrap();
    let copy = copies.path().join(OsStr::from_bytes(b"no text: \xff"));
    // What was left by an earlier backup that anybody may read.
    let left = copies.path().join(OsStr::from_bytes(b"no text: \xff.part"));
    std::fs::write(&left, "half").unwrap();
    std::fs::set_permissions(left, std::fs::Permissions::from_mode(0o644)).unwrap();
    upkeep::backup(directory.path(), &copy).unwrap();
    let made: Vec<_> = copies.path().read_dir().unwrap().collect();
    assert_eq!(made.len(), 1, "{made:?}");
    // It holds the plans of all, as the store does.
    let mode = std::fs::metadata(&copy).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    std::fs::rename(copy, copies.path().join("noctule.db")).unwrap();
    let restored = SqliteStore::open(copies.path(), options()).unwrap();
    assert_eq!(restored.get(id).await.unwrap().status, Status::Queued);
}

/// Nothing is thrown away, and nobody takes the half of another's for a backup.
#[tokio::test]
async fn two_backups_to_one_file_do_not_mix() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    accepted(&store, 1).await;
    let copies = TempDir::new().unwrap();
    let [copy, part] = ["copy", "copy.part"].map(|name| copies.path().join(name));
    // One that was killed has left something.
    std::fs::write(&part, "half").unwrap();
    let other = std::fs::File::open(&part).unwrap();
    other.lock().unwrap();
    let refused = upkeep::backup(directory.path(), &copy).unwrap_err();
    assert!(refused.to_string().contains("another backup"), "{refused}");
    assert_eq!(std::fs::read(&part).unwrap(), b"half");
    other.unlock().unwrap();
    upkeep::backup(directory.path(), &copy).unwrap();
    assert!(copy.exists() && !part.exists());
}

#[tokio::test]
async fn nothing_is_accepted_into_a_file_that_was_moved() {
    let directory = TempDir::new().unwrap();
    let [file, elsewhere] = ["noctule.db", "moved.db"].map(|name| directory.path().join(name));
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let first = accepted(&store, 1).await[0];
    store.get(first).await.unwrap();
    std::fs::rename(&file, &elsewhere).unwrap();
    for another in [false, true] {
        if another {
            std::fs::write(&file, "").unwrap();
        }
        for refused in [
            store.submit(submission()).await.map(drop),
            store.health().await,
        ] {
            let moved = matches!(
                refused,
                Err(StoreError::Unavailable {
                    trouble: Trouble::Moved,
                    ..
                })
            );
            assert!(moved, "{refused:?}");
        }
        assert_eq!(store.get(first).await.unwrap().status, Status::Queued);
    }
    std::fs::rename(&elsewhere, &file).unwrap();
    store.health().await.unwrap();
    accepted(&store, 1).await;
}

/// Execute each statement on a file that is in use; each changes one row.
fn damage(data_dir: &Path, statements: &[&str]) {
    let database = rusqlite::Connection::open(data_dir.join("noctule.db")).unwrap();
    for damage in statements {
        assert_eq!(database.execute(damage, []).unwrap(), 1, "{damage}");
    }
}

/// So many plans, in the order in which they were accepted.
async fn accepted(store: &SqliteStore, count: usize) -> Vec<PlanId> {
    let mut ids = Vec::new();
    for _ in 0..count {
        ids.push(store.submit(submission()).await.unwrap().plan.id);
    }
    ids
}

/// Whatever is wrong with the plan at the head of the queue, those behind it are still claimed.
#[tokio::test(flavor = "multi_thread")]
async fn an_unreadable_plan_fails_and_does_not_block_the_queue() {
    let directory = TempDir::new().unwrap();
    let (tell, ended) = std::sync::mpsc::channel();
    let options = Options {
        on_lost: Arc::new(move |plan| tell.send(plan.clone()).unwrap()),
        ..options()
    };
    let store = SqliteStore::open(directory.path(), options).unwrap();
    let ids = accepted(&store, 4).await;
    damage(
        directory.path(),
        &[
            "DELETE FROM scenarios WHERE plan_seq = 1",
            "UPDATE scenarios SET document = CAST(x'ff' AS TEXT) WHERE plan_seq = 2",
            "UPDATE plans SET id = 'x' WHERE seq = 3",
        ],
    );

    assert_eq!(store.claim().await.unwrap().plan.id, ids[3]);
    for id in &ids[..2] {
        let plan = store.get(*id).await.unwrap();
        assert_eq!(plan.status, Status::Failed);
        assert_eq!(plan.error.as_ref().unwrap().kind, "scenario-lost");
        let told = history(&store, *id).await;
        assert_eq!(told.last(), Some(&Event::End(Status::Failed)));
        assert_eq!(ended.try_recv().unwrap(), plan);
    }
    assert!(ended.try_recv().is_err());
    let stats = store.stats().await.unwrap();
    assert_eq!((stats.queued, stats.running), (0, 1));
    let database = rusqlite::Connection::open(directory.path().join("noctule.db")).unwrap();
    let status: String = database
        .query_row("SELECT status FROM plans WHERE seq = 3", [], |row| {
            row.get(0)
        })
        .unwrap();
    assert_eq!(status, "failed");
}

async fn run_next(store: &SqliteStore) {
    let lease = store.claim().await.unwrap();
    let end = ending(Status::Succeeded).at(12_000);
    store.finish(&lease, end).await.unwrap();
}

/// The others are listed, and fill the pages.
#[tokio::test(flavor = "multi_thread")]
async fn an_unreadable_plan_is_left_out_of_lists() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let ids = accepted(&store, 6).await;
    damage(
        directory.path(),
        &[
            "UPDATE plans SET name = CAST(x'ff' AS TEXT) WHERE seq = 3",
            "UPDATE plans SET algorithm = CAST(x'ff' AS TEXT) WHERE seq = 4",
            "UPDATE plans SET id = 'x' WHERE seq = 5",
        ],
    );
    let page = async |before| {
        let query = ListQuery {
            status: None,
            owner: None,
            before,
            limit: 2,
        };
        let plans = store.list(query).await.unwrap();
        plans.iter().map(|plan| plan.id).collect::<Vec<_>>()
    };
    assert_eq!(page(None).await, [ids[5], ids[1]]);
    assert_eq!(page(Some(ids[1])).await, [ids[0]]);
    store.get(ids[3]).await.unwrap_err();
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unreadable_running_plan_is_set_aside_at_the_next_start() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let ids = accepted(&store, 3).await;
    for _ in 0..2 {
        store.claim().await.unwrap();
    }
    // As if its process had died: nothing is given back.
    drop(store);
    damage(
        directory.path(),
        &["UPDATE plans SET id = 'x' WHERE seq = 1"],
    );
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let stats = store.stats().await.unwrap();
    assert_eq!((stats.queued, stats.running), (2, 0));
    for id in &ids[1..] {
        assert_eq!(store.claim().await.unwrap().plan.id, *id);
    }
    // Nor does one keep the others from being given back when the store is closed.
    damage(
        directory.path(),
        &["UPDATE plans SET name = CAST(x'ff' AS TEXT) WHERE seq = 2"],
    );
    store.close().await;
    drop(store);
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let lease = store.claim().await.unwrap();
    assert_eq!((lease.plan.id, lease.attempt), (ids[2], 2));
    assert_eq!(store.stats().await.unwrap().queued, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unreadable_ended_plan_is_removed_in_its_turn() {
    let directory = TempDir::new().unwrap();
    let retention = Retention {
        plans: Some(1),
        ..Retention::default()
    };
    let options = Options {
        retention,
        ..options()
    };
    let store = SqliteStore::open(directory.path(), options).unwrap();
    let mut ids = Vec::new();
    for _ in 0..4 {
        ids.push(store.submit(submission()).await.unwrap().plan.id);
        run_next(&store).await;
    }
    damage(
        directory.path(),
        &[
            "UPDATE plans SET id = 'x' WHERE seq = 1",
            "UPDATE plans SET owner = CAST(x'ff' AS TEXT) WHERE seq = 2",
            "UPDATE plans SET name = CAST(x'ff' AS TEXT) WHERE seq = 3",
        ],
    );
    assert_eq!(store.sweep(13_000).await.unwrap(), 3);
    for id in &ids[..3] {
        store.get(*id).await.unwrap_err();
    }
    store.get(ids[3]).await.unwrap();
    assert_eq!(store.sweep(13_000).await.unwrap(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unreadable_ended_plan_does_not_hold_up_the_webhooks_of_others() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let mut ids = Vec::new();
    for _ in 0..3 {
        let told = Submission {
            webhook: Some("https://receiver.example".to_owned()),
            ..submission()
        };
        ids.push(store.submit(told).await.unwrap().plan.id);
        run_next(&store).await;
    }
    damage(
        directory.path(),
        &[
            "UPDATE plans SET id = 'x' WHERE seq = 1",
            "UPDATE plans SET name = CAST(x'ff' AS TEXT) WHERE seq = 2",
        ],
    );
    let due = store.due_webhooks(13_000, 10).await.unwrap();
    let due: Vec<_> = due.iter().map(|webhook| webhook.plan.id).collect();
    assert_eq!(due, ids[2..]);
}

/// However often claims fail after they have written, other writes in their transactions succeed.
#[tokio::test(flavor = "multi_thread")]
async fn failing_claims_fail_no_other_write() {
    let directory = TempDir::new().unwrap();
    let store = SqliteStore::open(directory.path(), options()).unwrap();
    let id = store.submit(submission()).await.unwrap().plan.id;
    let database = rusqlite::Connection::open(directory.path().join("noctule.db")).unwrap();
    database
        .execute_batch(
            "CREATE TRIGGER break AFTER UPDATE OF attempt ON plans \
             BEGIN SELECT raise(ABORT, 'not taken'); END; BEGIN IMMEDIATE",
        )
        .unwrap();
    // While the file is locked they queue up together; more claims than can be answered before the last write.
    let mut claims = futures_util::future::join_all((0..20).map(|_| store.claim()));
    assert!(futures_util::FutureExt::now_or_never(&mut claims).is_none());
    let mut writes = futures_util::future::join_all((0..10).map(|_| store.submit(submission())));
    assert!(futures_util::FutureExt::now_or_never(&mut writes).is_none());
    database.execute_batch("COMMIT").unwrap();
    let writes = writes.await;
    assert!(writes.iter().all(Result::is_ok), "{writes:?}");
    drop(claims);
    assert_eq!(store.stats().await.unwrap().queued, 11);

    database.execute_batch("DROP TRIGGER break").unwrap();
    assert_eq!(store.claim().await.unwrap().plan.id, id);
}
