//! Disks that are full, read-only or damaged, and data directories that are in use: the service reports it,
//! loses nothing, and goes on when the cause is gone.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

use std::fs::File;
use std::io::Write as _;
use std::os::unix::fs::FileExt as _;
use std::path::Path;
use std::sync::Arc;

use noctule::job::{PlanId, Submission};
use noctule::store::reopening::{Open, Reopening};
use noctule::store::sqlite::{SqliteStore, upkeep};
use noctule::store::{Options, Store, StoreError, Trouble};
use serde_json::Value;
use tempfile::TempDir;

use crate::support::patience::eventually;
use crate::support::plans::submission;
use crate::support::process::{Service, address_of, run};
use crate::support::scenario;

/// Fills the disk with a file at `path`.
fn fill(path: &Path) {
    let mut ballast = File::create(path).unwrap();
    while ballast.write_all(&[1; 4096]).is_ok() {}
    // Down to the last byte.
    while ballast.write_all(&[1]).is_ok() {}
}

async fn all_end(service: &Service, accepted: &[String]) {
    for address in accepted {
        let ended = service.ended(address).await;
        assert_eq!(ended["status"], "succeeded", "{ended}");
    }
}

#[tokio::test]
async fn a_full_disk_refuses_plans_and_loses_none() {
    let directory = TempDir::new().unwrap();
    let service = Service::start_on_a_small_disk(directory.path(), "size=3m");
    let mut accepted = vec![service.submit(&scenario()).await];
    service.ended(&accepted[0]).await;
    let ballast = service.seen(&directory.path().join("ballast"));
    fill(&ballast);

    let refused = loop {
        let answer = service.post(&scenario()).await;
        if answer.status() != 202 {
            assert_eq!(answer.status(), 503);
            break answer.json::<Value>().await.unwrap();
        }
        accepted.push(address_of(&answer));
    };
    assert_eq!(refused["type"], "/problems/store-unavailable");
    let detail = service.until_ready(503).await;
    assert!(detail.contains("disk of the store is full"), "{detail}");
    service.bytes("/livez").await;
    // Finished plans can still be read.
    service.bytes(&format!("{}/result", accepted[0])).await;

    std::fs::remove_file(&ballast).unwrap();
    service.until_ready(200).await;
    accepted.push(service.submit(&scenario()).await);
    all_end(&service, &accepted).await;
}

/// A plan that was being run cannot be given back before there is room, and nothing waits for that which is only read.
#[tokio::test]
async fn results_can_be_read_after_a_restart_on_a_full_disk() {
    let directory = TempDir::new().unwrap();
    let data_dir = directory.path().join("restarted");
    let disk = Service::start_on_a_small_disk(directory.path(), "size=6m");
    let service = disk.start_beside(&data_dir);
    let finished = service.submit(&scenario()).await;
    service.ended(&finished).await;
    let result = service.bytes(&format!("{finished}/result")).await;
    let mut long = scenario();
    long["planner"]["iterations"] = 10_000.into();
    long["planner"]["population"] = 1_000.into();
    let long = service.submit(&long).await;
    let is_running = async |service: &Service| {
        let status: Value = service
            .get(&long)
            .send()
            .await
            .unwrap()
            .json()
            .await
            .unwrap();
        status["status"] == "running"
    };
    eventually(async || is_running(&service).await).await;
    let ballast = disk.seen(&directory.path().join("ballast"));
    fill(&ballast);
    service.kill();

    let service = disk.start_beside(&data_dir);
    let detail = service.until_ready(503).await;
    assert!(detail.contains("disk of the store is full"), "{detail}");
    assert_eq!(service.bytes(&format!("{finished}/result")).await, result);
    service.bytes("/plans").await;
    assert_eq!(service.post(&scenario()).await.status(), 503);

    std::fs::remove_file(&ballast).unwrap();
    service.until_ready(200).await;
    eventually(async || is_running(&service).await).await;
}

#[tokio::test]
async fn a_read_only_directory_is_reported_and_retried() {
    let directory = TempDir::new().unwrap();
    let service = Service::start_on_a_small_disk(directory.path(), "size=3m,ro");
    let detail = service.until_ready(503).await;
    assert!(detail.contains("directory cannot be written"), "{detail}");
    service.bytes("/livez").await;
    assert_eq!(service.post(&scenario()).await.status(), 503);
    service.remount(directory.path(), "rw");
    service.until_ready(200).await;
    let accepted = service.submit(&scenario()).await;
    all_end(&service, &[accepted]).await;
}

#[tokio::test]
async fn a_second_process_waits_until_the_first_is_gone() {
    let directory = TempDir::new().unwrap();
    let first = Service::start(directory.path(), &[]);
    let accepted = first.submit(&scenario()).await;
    let second = Service::start(directory.path(), &[]);
    let detail = second.until_ready(503).await;
    assert!(detail.contains("another process"), "{detail}");
    // What the alert on a failing store looks at.
    let metrics = second.bytes("/metrics").await;
    let failures: f64 = String::from_utf8_lossy(&metrics)
        .lines()
        .filter(|line| line.starts_with("noctule_store_operation_failures_total{"))
        .filter_map(|line| line.rsplit(' ').next()?.parse::<f64>().ok())
        .sum();
    assert!(failures > 0.0);
    first.until_ready(200).await;
    first.kill();
    second.until_ready(200).await;
    all_end(&second, &[accepted]).await;
}

#[tokio::test]
async fn a_damaged_file_is_reported_and_its_backup_can_be_restored() {
    let directory = TempDir::new().unwrap();
    let file = directory.path().join("noctule.db");
    let backup = directory.path().join("backup.db");
    let paths = [directory.path(), &backup].map(|path| path.to_str().unwrap());
    let service = Service::start(directory.path(), &[]);
    let address = service.submit(&scenario()).await;
    service.ended(&address).await;
    // While the service runs.
    let copied = run(&["store", "backup", "--data-dir", paths[0], paths[1]], "");
    assert_eq!(copied.status.code(), Some(0), "{copied:?}");
    let again = run(&["store", "backup", "--data-dir", paths[0], paths[1]], "");
    assert_eq!(again.status.code(), Some(1), "nothing is overwritten");
    let refusal = String::from_utf8(again.stderr).unwrap();
    let expected = format!("the copy cannot be written: {} exists", paths[1]);
    assert!(refusal.contains(&expected), "{refusal}");
    assert!(!refusal.contains("unavailable"), "{refusal}");
    let checked = run(&["store", "check", "--data-dir", paths[0]], "");
    let expected = format!("1 plans, 0 faults in {}\n", paths[0]);
    assert_eq!(checked.stdout, expected.as_bytes(), "{checked:?}");
    let result = service.bytes(&format!("{address}/result")).await;
    service.kill();

    for name in ["noctule.db", "noctule.db-wal"] {
        let _ = std::fs::remove_file(directory.path().join(name));
    }
    std::fs::write(&file, "a letter to my aunt, ".repeat(1_000)).unwrap();
    let service = Service::start(directory.path(), &[]);
    let detail = service.until_ready(503).await;
    assert!(detail.contains("damaged"), "{detail}");
    service.bytes("/livez").await;
    let checked = run(&["store", "check", "--data-dir", paths[0]], "");
    assert_eq!(checked.status.code(), Some(1), "{checked:?}");

    std::fs::rename(&backup, &file).unwrap();
    service.until_ready(200).await;
    let again = service.bytes(&format!("{address}/result")).await;
    assert_eq!(again, result);
    service.submit(&scenario()).await;
}

#[test]
fn a_file_that_is_not_a_store_is_not_backed_up() {
    let directory = TempDir::new().unwrap();
    std::fs::write(directory.path().join("noctule.db"), "").unwrap();
    let backup = directory.path().join("backup.db");
    let paths = [directory.path(), &backup].map(|path| path.to_str().unwrap());
    let refused = run(&["store", "backup", "--data-dir", paths[0], paths[1]], "");
    assert_eq!(refused.status.code(), Some(1), "{refused:?}");
    assert!(!backup.exists());
}

/// Damage that shows only when the page in question is read.
#[tokio::test(flavor = "multi_thread")]
async fn damage_found_while_reading_closes_the_store_until_it_is_repaired() {
    let directory = TempDir::new().unwrap();
    let data_dir = directory.path().to_owned();
    let open: Open = Arc::new(move |suspicious| {
        let open = if suspicious {
            SqliteStore::open_suspicious
        } else {
            SqliteStore::open
        };
        Ok(Arc::new(open(&data_dir, Options::new(1_000))?))
    });
    let store = Reopening::start(Arc::clone(&open)).await;
    let mut ids: Vec<PlanId> = Vec::new();
    for _ in 0..200 {
        let large = Submission {
            scenario: "x".repeat(50_000),
            ..submission()
        };
        ids.push(store.submit(large).await.unwrap().plan.id);
    }
    store.close().await;

    let path = directory.path().join("noctule.db");
    let sound = std::fs::read(&path).unwrap();
    let file = File::options().write(true).open(&path).unwrap();
    // A page that holds only a part of a document, and the number of the next page.
    let page_bytes = 4096;
    let part = (0..sound.len() / page_bytes)
        .map(|page| page * page_bytes)
        .find(|at| {
            sound[at + 4..at + page_bytes]
                .iter()
                .all(|byte| *byte == b'x')
        })
        .expect("the documents are long");
    file.write_all_at(&[0xff; 4], part as u64).unwrap();
    assert!(!upkeep::check(directory.path()).unwrap().faults.is_empty());
    // No partial backup is left.
    let backups = TempDir::new().unwrap();
    upkeep::backup(directory.path(), &backups.path().join("backup.db")).unwrap_err();
    assert_eq!(std::fs::read_dir(backups.path()).unwrap().count(), 0);

    let store = Reopening::start(open).await;
    store.stats().await.expect("the rest is sound");
    let followed = store.changes(ids[0]);
    let mut told = None;
    for id in &ids {
        if let Err(StoreError::Unavailable { trouble, .. }) = store.scenario(*id).await {
            told = Some(trouble);
            break;
        }
    }
    assert_eq!(told, Some(Trouble::Damaged));
    // Closed, even to what would not have touched the damage.
    until(&store, false).await;
    file.write_all_at(&sound[part..part + 4], part as u64)
        .unwrap();
    until(&store, true).await;
    // Whoever followed a plan is woken, to follow it in the store that is open now.
    followed
        .has_changed()
        .expect_err("the closed store is gone");
    for id in &ids {
        assert_eq!(store.scenario(*id).await.unwrap().len(), 50_000);
    }
    store.close().await;
    assert_eq!(upkeep::check(directory.path()).unwrap().faults, [""; 0]);
}

async fn until(store: &Reopening, healthy: bool) {
    eventually(async || store.health().await.is_ok() == healthy).await;
}
