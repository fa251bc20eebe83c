//! The embedded store: one `SQLite` file in the data directory, written by one thread.
//!
//! Every acknowledged change is on the disk (WAL, `synchronous = FULL`); plans that were running when a process died
//! are queued again when the next one opens the file.

mod claims;
mod head;
mod idempotency;
mod opening;
mod operations;
mod packed;
mod postponed;
mod read;
mod records;
mod removal;
mod row;
mod schema;
#[cfg(test)]
mod tests;
mod transaction;
mod unreadable;
mod unwritten;
pub mod upkeep;
mod webhooks;
mod writer;

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use rusqlite::{Connection, ErrorCode};
use tokio::sync::watch;

use self::claims::When;
use self::opening::{Place, create_directory, lock, open_database, sync_directory};
use self::read::Readers;
use self::records::Records;
use self::unreadable::Passed;
use self::unwritten::Unwritten;
use self::writer::Writer;
use super::changes::Changes;
use super::{
    DatasetUse, End, EventPage, Lease, ListQuery, Options, Stats, Store, StoreError, Submitted,
    Trouble, Webhook,
};
use crate::export::document::Incumbent;
use crate::job::{Event, Idempotency, Owner, Plan, PlanId, Submission};

/// Name of the database in the data directory.
const DATABASE: &str = "noctule.db";

/// How long to wait for a person who has the database locked in `sqlite3`.
const BUSY_TIMEOUT: Duration = Duration::from_secs(5);

/// The embedded store.
///
/// Its methods need a tokio runtime. Dropping it finishes what has been sent to the writer.
pub struct SqliteStore {
    writer: Writer,
    readers: Arc<Readers>,
    changes: Arc<Changes>,
    records: Arc<Records>,
    passed: Arc<Passed>,
    unwritten: Unwritten,
    options: Options,
}

impl SqliteStore {
    /// Open the store in `data_dir`, both created if need be, and return plans that an earlier process was running to
    /// the queue. Blocks on the disk.
    ///
    /// # Errors
    /// [`StoreError::InUse`] when another process has it open; [`StoreError::Unavailable`] when the
    /// directory or the file cannot be used, or was written by a newer version.
    pub fn open(data_dir: &Path, options: Options) -> Result<Self, StoreError> {
        Self::open_after(data_dir, options, |_| Ok(Vec::new()))
    }

    /// As [`SqliteStore::open`], for a file that may be damaged.
    ///
    /// # Errors
    /// Also [`StoreError::Unavailable`] with [`Trouble::Damaged`] when it is.
    pub fn open_suspicious(data_dir: &Path, options: Options) -> Result<Self, StoreError> {
        Self::open_after(data_dir, options, upkeep::damage)
    }

    fn open_after(
        data_dir: &Path,
        options: Options,
        damage: impl FnOnce(&Connection) -> rusqlite::Result<Vec<String>>,
    ) -> Result<Self, StoreError> {
        create_directory(data_dir)?;
        let lock = lock(data_dir)?;
        let file = data_dir.join(DATABASE);
        let connection = open_database(&file).map_err(|error| match error {
            StoreError::Unavailable { trouble, detail } => StoreError::Unavailable {
                trouble,
                detail: format!("database {}: {detail}", file.display()),
            },
            other => other,
        })?;
        let damage = damage(&connection)?;
        if let Some(first) = damage.first() {
            return Err(StoreError::Unavailable {
                trouble: Trouble::Damaged,
                detail: format!("database {}: {first}", file.display()),
            });
        }
        // CHECK constraints guard opening and migration. From here only typed code writes, so they are off: for each
        // `IN (...)` check SQLite builds a temporary table, a quarter of the cost of inserting a plan.
        connection.pragma_update(None, "ignore_check_constraints", true)?;
        sync_directory(data_dir)?;
        options.has_seen(read::newest_ms(&connection, (options.clock)())?);
        Self::assemble(connection, lock, file, options)
    }

    fn assemble(
        connection: Connection,
        lock: File,
        file: PathBuf,
        options: Options,
    ) -> Result<Self, StoreError> {
        let changes = Arc::new(Changes::default());
        let records = Arc::new(Records::default());
        let place = Arc::new(Place::of(file)?);
        Ok(Self {
            writer: Writer::start(
                (connection, Arc::clone(&place)),
                lock,
                options.clone(),
                Arc::clone(&changes),
                Arc::clone(&records),
            )?,
            readers: Readers::new(place),
            changes,
            records,
            passed: Arc::default(),
            unwritten: Unwritten::new(),
            options,
        })
    }

    /// The time by which things expire now.
    fn expiry_ms(&self) -> i64 {
        self.options.expiry_ms((self.options.clock)())
    }
}

#[async_trait]
impl Store for SqliteStore {
    async fn submit(&self, submission: Submission) -> Result<Submitted, StoreError> {
        let share = self.unwritten.share(submission.scenario.len())?;
        self.writer
            .change(move |tx| {
                let _held = &share;
                operations::submit(tx, &submission)
            })
            .await
    }

    async fn repeated(
        &self,
        owner: Option<&Owner>,
        idempotency: &Idempotency,
    ) -> Result<Option<Plan>, StoreError> {
        let (owner, idempotency) = (owner.cloned(), idempotency.clone());
        let expiry_ms = self.expiry_ms();
        self.readers
            .read(move |connection| {
                idempotency::earlier(connection, owner.as_ref(), &idempotency, expiry_ms)
            })
            .await
    }

    async fn claim(&self) -> Result<Lease, StoreError> {
        self.writer.claim(When::Durable).await
    }

    async fn claim_early(&self) -> Result<Lease, StoreError> {
        self.writer.claim(When::Chosen).await
    }

    async fn append(&self, lease: &Lease, events: Vec<Event>) -> Result<(), StoreError> {
        let (id, attempt) = (lease.plan.id, lease.attempt);
        self.writer
            .change(move |tx| operations::append(tx, id, attempt, &events))
            .await
    }

    async fn finish(&self, lease: &Lease, end: Arc<End>) -> Result<Plan, StoreError> {
        let (id, attempt) = (lease.plan.id, lease.attempt);
        self.writer
            .change(move |tx| operations::finish(tx, id, attempt, &end))
            .await
    }

    async fn release(&self, lease: &Lease) -> Result<Plan, StoreError> {
        let (id, attempt) = (lease.plan.id, lease.attempt);
        self.writer
            .change(move |tx| operations::release(tx, id, attempt))
            .await
    }

    async fn postpone(&self, lease: &Lease) -> Result<Plan, StoreError> {
        let (id, attempt) = (lease.plan.id, lease.attempt);
        self.writer
            .change(move |tx| operations::postpone(tx, id, attempt))
            .await
    }

    async fn request_cancel_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<Plan, StoreError> {
        self.writer
            .change(move |tx| operations::request_cancel(tx, id, revision, now_ms))
            .await
    }

    async fn delete_if(
        &self,
        id: PlanId,
        revision: Option<u64>,
        now_ms: i64,
    ) -> Result<(), StoreError> {
        self.writer
            .change(move |tx| operations::delete(tx, id, revision, now_ms))
            .await
    }

    async fn get(&self, id: PlanId) -> Result<Plan, StoreError> {
        if let Some(plan) = self.records.plan(id) {
            return Ok(plan);
        }
        let expiry_ms = self.expiry_ms();
        let records = Arc::clone(&self.records);
        self.readers
            .read(move |connection| {
                let version = records.version();
                let plan = read::get(connection, id, expiry_ms)?;
                records.keep_plan(version, &plan);
                Ok(plan)
            })
            .await
    }

    async fn scenario(&self, id: PlanId) -> Result<String, StoreError> {
        let expiry_ms = self.expiry_ms();
        self.readers
            .read(move |connection| read::scenario(connection, id, expiry_ms))
            .await
    }

    async fn result(&self, id: PlanId) -> Result<Option<String>, StoreError> {
        let expiry_ms = self.expiry_ms();
        self.readers
            .read(move |connection| read::result(connection, id, expiry_ms))
            .await
    }

    async fn incumbent(&self, id: PlanId) -> Result<Option<Incumbent>, StoreError> {
        let expiry_ms = self.expiry_ms();
        self.readers
            .read(move |connection| read::incumbent(connection, id, expiry_ms))
            .await
    }

    async fn list(&self, query: ListQuery) -> Result<Vec<Plan>, StoreError> {
        let passed = Arc::clone(&self.passed);
        self.readers
            .read(move |connection| read::list(connection, &query, &passed))
            .await
    }

    async fn events(&self, id: PlanId, after: u64, limit: usize) -> Result<EventPage, StoreError> {
        let expiry_ms = self.expiry_ms();
        self.readers
            .read(move |connection| read::events(connection, id, after, limit, expiry_ms))
            .await
    }

    async fn has_event(&self, id: PlanId, event: u64) -> Result<bool, StoreError> {
        let page = self.events(id, event.saturating_sub(1), 1).await?;
        Ok(event <= page.forgotten || !page.events.is_empty())
    }

    fn changes(&self, id: PlanId) -> watch::Receiver<u64> {
        self.changes.subscribe(id)
    }

    async fn sweep(&self, now_ms: i64) -> Result<usize, StoreError> {
        self.writer
            .change(move |tx| removal::sweep(tx, now_ms))
            .await
    }

    async fn due_webhooks(&self, now_ms: i64, limit: usize) -> Result<Vec<Webhook>, StoreError> {
        let passed = Arc::clone(&self.passed);
        self.readers
            .read(move |connection| webhooks::due(connection, now_ms, limit, &passed))
            .await
    }

    async fn webhook_tried(&self, id: PlanId, next_ms: Option<i64>) -> Result<(), StoreError> {
        self.writer
            .change(move |tx| webhooks::tried(tx, id, next_ms))
            .await
    }

    async fn datasets_in_use(&self) -> Result<Vec<DatasetUse>, StoreError> {
        self.readers.read(read::datasets_in_use).await
    }

    async fn stats(&self) -> Result<Stats, StoreError> {
        if let Some(stats) = self.records.stats() {
            return Ok(stats);
        }
        let records = Arc::clone(&self.records);
        self.readers
            .read(move |connection| {
                let version = records.version();
                let stats = read::stats(connection)?;
                records.keep_stats(version, stats);
                Ok(stats)
            })
            .await
    }

    async fn health(&self) -> Result<(), StoreError> {
        self.writer.change(operations::touch).await
    }

    async fn close(&self) {
        self.readers.close().await;
        self.writer.close().await;
        self.records.close();
    }
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        let trouble = match error.sqlite_error_code() {
            Some(ErrorCode::DiskFull) => Trouble::Full,
            Some(ErrorCode::ReadOnly | ErrorCode::PermissionDenied | ErrorCode::CannotOpen) => {
                Trouble::ReadOnly
            }
            Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => Trouble::Damaged,
            _ => Trouble::Other,
        };
        Self::Unavailable {
            trouble,
            detail: error.to_string(),
        }
    }
}
