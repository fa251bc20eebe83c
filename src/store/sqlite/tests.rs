//! What the store does with the disk beneath it, and with a file that somebody has changed.

use rusqlite::types::Value;

use super::*;

fn submission(bytes: usize) -> Submission {
    Submission {
        id: PlanId::now_v7(),
        scenario: "x".repeat(bytes),
        ..Submission::example()
    }
}

/// The settings of the writer's own connection after opening: only with these does a commit return after
/// the log has reached the disk.
#[tokio::test]
async fn a_commit_waits_for_the_disk() {
    let directory = tempfile::TempDir::new().expect("a temporary directory");
    let store = SqliteStore::open(directory.path(), Options::new(1)).expect("it opens");
    let set = |name: &'static str| {
        store.writer.change(move |tx| {
            let connection = tx.connection;
            Ok(connection.pragma_query_value(None, name, |row| row.get::<_, Value>(0))?)
        })
    };
    let wal = Value::Text("wal".to_owned());
    assert_eq!(set("journal_mode").await.expect("a setting"), wal);
    // FULL, on the scale from OFF, 0, to EXTRA, 3.
    let full = Value::Integer(2);
    assert_eq!(set("synchronous").await.expect("a setting"), full);
    store.close().await;
}

/// The schema holds other programs to the known states; a file with an unknown one counts as damaged.
#[test]
fn unknown_plan_states_are_refused_and_count_as_damage() {
    let directory = tempfile::TempDir::new().expect("a temporary directory");
    let file = directory.path().join(DATABASE);
    drop(open_database(&file).expect("the directory can be written"));
    let other = Connection::open(&file).expect("nobody has locked it");
    let insert = || {
        other.execute(
            "INSERT INTO plans (id, status, progress, iteration, iterations, evaluations, algorithm, \
             seed, created_ms, cancel_requested, revision, attempt, last_event) \
             VALUES ('x', 'paused', 0, 0, 1, 0, 'sba', 1, 0, 0, 1, 0, 0)",
            [],
        )
    };
    let refusal = insert().expect_err("no plan is paused").to_string();
    assert!(refusal.contains("CHECK"), "{refusal}");
    other
        .pragma_update(None, "ignore_check_constraints", true)
        .expect("it can be told not to look");
    insert().expect("nothing looks now");
    drop(other);
    let opened = SqliteStore::open_suspicious(directory.path(), Options::new(1));
    let Err(StoreError::Unavailable { trouble, detail }) = opened else {
        panic!("a paused plan is none");
    };
    assert_eq!(trouble, Trouble::Damaged);
    assert!(detail.contains("CHECK"), "{detail}");
}

/// A store in `directory` whose file may have this many pages of 4 KiB.
fn of_pages(directory: &Path, pages: u32) -> SqliteStore {
    let lock = lock(directory).expect("nobody else has it");
    let file = directory.join(DATABASE);
    let connection = open_database(&file).expect("the directory can be written");
    connection
        .pragma_update(None, "max_page_count", pages)
        .expect("the file is smaller");
    SqliteStore::assemble(connection, lock, file, Options::new(1_000))
        .expect("the tables are there")
}

#[tokio::test]
async fn a_full_store_is_unwell_until_a_plan_fits_again() {
    let directory = tempfile::TempDir::new().expect("a temporary directory");
    let store = of_pages(directory.path(), 400);
    store.health().await.expect("there is room");
    let mut accepted = Vec::new();
    while let Ok(submitted) = store.submit(submission(100_000)).await {
        accepted.push(submitted.plan.id);
    }
    for _ in 0..3 {
        let unwell = store.health().await;
        let Err(StoreError::Unavailable { trouble, .. }) = unwell else {
            panic!("no plan fits, though a row does");
        };
        assert_eq!(trouble, Trouble::Full);
    }
    for id in &accepted[..7] {
        store.delete(*id, 0).await.expect("deleting makes room");
    }
    for _ in 0..3 {
        store.health().await.expect("there is room again");
    }
    // What the check has written is not in the way of plans.
    for _ in 0..6 {
        let submitted = store.submit(submission(100_000)).await;
        submitted.expect("a plan fits");
    }
    store.close().await;
}

#[tokio::test]
async fn a_full_disk_refuses_what_does_not_fit_and_damages_nothing() {
    let directory = tempfile::TempDir::new().expect("a temporary directory");
    let store = of_pages(directory.path(), 200);
    let mut accepted = Vec::new();
    let refusal = loop {
        match store.submit(submission(20_000)).await {
            Ok(submitted) => accepted.push(submitted.plan.id),
            Err(error) => break error,
        }
    };
    assert!(refusal.to_string().contains("full"), "{refusal}");
    assert!(accepted.len() > 10);
    let stats = store.stats().await.expect("reading goes on");
    assert_eq!(stats.queued, accepted.len() as u64);

    // Submissions that share a transaction with one that does not fit are at worst refused, never half done.
    let together = [20, 500_000, 30].map(|bytes| store.submit(submission(bytes)));
    for answer in futures_util::future::join_all(together).await {
        accepted.extend(answer.map(|submitted| submitted.plan.id));
    }
    for id in &accepted[..5] {
        store.delete(*id, 0).await.expect("deleting makes room");
    }
    let last = store
        .submit(submission(20_000))
        .await
        .expect("there is room again");
    assert_eq!(last.plan.queue_position, Some(accepted.len() as u64 - 4));
    for id in &accepted[5..] {
        let lease = store.claim().await.expect("they are queued");
        assert_eq!(lease.plan.id, *id);
    }
    store.close().await;
}
