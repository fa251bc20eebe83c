//! Operator's maintenance of the file: check for damage, and back up.

use std::fs::{File, Permissions, TryLockError};
use std::io;
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use rusqlite::types::{ToSqlOutput, ValueRef};
use rusqlite::{Connection, OpenFlags};

use super::{BUSY_TIMEOUT, DATABASE, StoreError};
use crate::durable;
use crate::job::{PlanId, Status};

/// What [`check`] looked at, and what it found wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Findings {
    /// Plans checked; 0 in a damaged file.
    pub plans: u64,
    /// One sentence for each fault.
    pub faults: Vec<String>,
}

/// Damage that the database itself finds in its file: pages, indexes, rows with dangling references.
pub(super) fn damage(connection: &Connection) -> rusqlite::Result<Vec<String>> {
    found_by(connection, "PRAGMA quick_check(20)")
}

fn found_by(connection: &Connection, check: &str) -> rusqlite::Result<Vec<String>> {
    let mut faults: Vec<String> = connection
        .prepare(check)?
        .query_map([], |row| row.get(0))?
        .collect::<Result<_, _>>()?;
    faults.retain(|fault| fault != "ok");
    Ok(faults)
}

/// Check the whole store in `data_dir`, whether a service is using it or not: the database's own integrity, and that
/// each plan's record, documents and events agree.
///
/// # Errors
/// [`StoreError::Unavailable`] when there is no store to check, or it cannot be read at all.
pub fn check(data_dir: &Path) -> Result<Findings, StoreError> {
    let mut connection = open(data_dir)?;
    // All in one transaction, or a busy service would seem to contradict itself.
    let connection = connection.transaction()?;
    let mut faults = found_by(&connection, "PRAGMA integrity_check(100)")?;
    let plans = if faults.is_empty() {
        records(&connection, &mut faults)?
    } else {
        // Its records cannot be relied on, or cannot even be read.
        0
    };
    Ok(Findings { plans, faults })
}

/// Check that each plan's record, documents and events agree; returns the number of plans.
fn records(connection: &Connection, faults: &mut Vec<String>) -> Result<u64, StoreError> {
    for (sql, what) in CONTRADICTIONS {
        let plans = connection
            .prepare(sql)?
            .query_map([], |row| row.get::<_, String>(0))?
            .collect::<Result<Vec<_>, _>>()?;
        faults.extend(plans.into_iter().map(|id| format!("plan {id} {what}")));
    }
    let mut plans = 0;
    let mut statement = connection.prepare(
        "SELECT id, status, (SELECT batch FROM events WHERE plan_seq = seq ORDER BY last_id DESC LIMIT 1) \
         FROM plans",
    )?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        plans += 1;
        let (id, status, batch): (String, String, Option<String>) =
            (row.get(0)?, row.get(1)?, row.get(2)?);
        if PlanId::parse_str(&id).is_err() {
            faults.push(format!("plan {id:?} has no id"));
        }
        let status = Status::from_name(&status);
        let ended = status.is_some_and(Status::is_final);
        if ended != batch.is_some_and(|batch| ends(&batch)) {
            faults.push(format!(
                "plan {id} and its last event disagree on whether it has ended"
            ));
        }
    }
    Ok(plans)
}

/// States that no plan may be in, and the queries for the ids of those that are.
const CONTRADICTIONS: [(&str, &str); 5] = [
    (
        "SELECT id FROM plans LEFT JOIN scenarios ON plan_seq = seq WHERE document IS NULL",
        "has lost its scenario",
    ),
    (
        "SELECT id FROM plans LEFT JOIN results ON plan_seq = seq \
         WHERE (stop_reason IS NULL) <> (document IS NULL)",
        "has a result and no reason for its end, or the reason and no result",
    ),
    (
        "SELECT id FROM plans LEFT JOIN results ON plan_seq = seq \
         WHERE document IS NOT NULL AND NOT json_valid(document)",
        "has a result that is not JSON",
    ),
    (
        "SELECT id FROM plans WHERE (finished_ms IS NULL) <> (status IN ('queued', 'running'))",
        "has ended without a time, or has a time without an end",
    ),
    (
        // The first event has a row of its own only in files of earlier versions.
        "SELECT id FROM plans WHERE last_event - max(forgotten, 1) <> (SELECT \
         coalesce(sum(last_id - first_id + 1), 0) FROM events WHERE plan_seq = seq AND last_id > 1)",
        "has lost events",
    ),
];

fn ends(batch: &str) -> bool {
    let events: Vec<serde_json::Value> = serde_json::from_str(batch).unwrap_or_default();
    events.last().is_some_and(|event| event["event"] == "end")
}

/// Why no copy was written.
#[derive(Debug, thiserror::Error)]
pub enum BackupError {
    /// The store is not there, or cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// There is a file of that name, which may be an earlier copy.
    #[error("the copy cannot be written: {} exists, must be a new file", .0.display())]
    Exists(PathBuf),
    /// The file system's error; not a source, because the message has all of it.
    #[error("the copy cannot be written: {}: {error}", .to.display())]
    Unwritable {
        /// The file to write.
        to: PathBuf,
        /// Why not.
        error: io::Error,
    },
}

/// Write a compact copy of the store in `data_dir`, as of one moment, to the new file `to`, whether a service is using
/// the store or not. The copy is on the disk when this returns.
///
/// # Errors
/// [`BackupError::Store`] when there is no store, [`BackupError::Exists`], and [`BackupError::Unwritable`].
pub fn backup(data_dir: &Path, to: &Path) -> Result<(), BackupError> {
    let unusable = |error| BackupError::Unwritable {
        to: to.to_owned(),
        error,
    };
    let exists = || BackupError::Exists(to.to_owned());
    if to.exists() {
        return Err(exists());
    }
    let connection = open(data_dir)?;
    // Written under another name until complete, so that nobody takes half of it for a backup.
    let mut name = to.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = to.with_file_name(name);
    let _held = hold(&part).map_err(unusable)?;
    // Another backup may just have been completed.
    if to.exists() {
        let _ = std::fs::remove_file(&part);
        return Err(exists());
    }
    // SQLite passes the path to the system unchanged, even when it is not valid UTF-8.
    let path = ToSqlOutput::Borrowed(ValueRef::Text(part.as_os_str().as_encoded_bytes()));
    let written = connection
        .execute("VACUUM INTO ?1", [path])
        .map_err(|error| BackupError::Store(error.into()))
        .and_then(|_| put_in_place(&part, to).map_err(unusable));
    if written.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    written
}

/// An empty file that no other backup is writing at the same time, until this one is dropped. What a backup that was
/// killed has left is thrown away. Only its owner may read it, as with the store itself.
fn hold(part: &Path) -> io::Result<File> {
    let another = || io::Error::other("another backup is writing it");
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .mode(0o600)
        .open(part)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Err(another()),
        Err(TryLockError::Error(error)) => return Err(error),
    }
    // Another backup that was completed between opening and locking has given it its final name.
    let named = std::fs::metadata(part).map_err(|_| another())?;
    let held = file.metadata()?;
    if (named.dev(), named.ino()) != (held.dev(), held.ino()) {
        return Err(another());
    }
    file.set_permissions(Permissions::from_mode(0o600))?;
    file.set_len(0)?;
    Ok(file)
}

/// Rename a complete file to its final name; file and name are on the disk when this returns.
fn put_in_place(part: &Path, to: &Path) -> io::Result<()> {
    File::open(part)?.sync_all()?;
    durable::put(part, to)
}

fn open(data_dir: &Path) -> Result<Connection, StoreError> {
    let file = data_dir.join(DATABASE);
    if !file.is_file() {
        let nowhere = format!("there is no store at {}", file.display());
        return Err(StoreError::unavailable(nowhere));
    }
    let connection = Connection::open_with_flags(&file, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
    connection.busy_timeout(BUSY_TIMEOUT)?;
    // A copy of a database that is not ours would be no backup.
    connection.prepare("SELECT id FROM plans")?;
    Ok(connection)
}
