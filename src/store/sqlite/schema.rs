//! The tables, meant to be read with `sqlite3` too.

use rusqlite::Connection;

use crate::store::StoreError;

/// Kept in `user_version`.
const VERSION: i64 = 1;

const TABLES: &str = "
CREATE TABLE plans (
    seq INTEGER PRIMARY KEY AUTOINCREMENT, -- order of acceptance, and of the queue
    id TEXT NOT NULL UNIQUE,               -- UUID version 7: sorts by the time of acceptance
    name TEXT,
    status TEXT NOT NULL CHECK (status IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
    stop_reason TEXT,                      -- set if and only if there is a result
    feasible INTEGER,
    best_cost REAL,
    progress REAL NOT NULL,
    iteration INTEGER NOT NULL,
    iterations INTEGER NOT NULL,
    evaluations INTEGER NOT NULL,
    algorithm TEXT NOT NULL,
    seed INTEGER NOT NULL,
    created_ms INTEGER NOT NULL,           -- times: milliseconds since 1970
    started_ms INTEGER,
    finished_ms INTEGER,
    expires_ms INTEGER,
    cancel_requested INTEGER NOT NULL,
    error_kind TEXT,
    error_detail TEXT,
    revision INTEGER NOT NULL,
    attempt INTEGER NOT NULL,              -- grows with each run; fences off earlier ones
    last_event INTEGER NOT NULL            -- id of the newest event
) STRICT;
CREATE INDEX plans_queue ON plans (seq) WHERE status = 'queued';
CREATE INDEX plans_by_status ON plans (status, id);
CREATE INDEX plans_with_result ON plans (finished_ms) WHERE stop_reason IS NOT NULL;

CREATE TABLE scenarios (
    plan_seq INTEGER PRIMARY KEY REFERENCES plans (seq) ON DELETE CASCADE,
    document TEXT NOT NULL
) STRICT;

CREATE TABLE results (
    plan_seq INTEGER PRIMARY KEY REFERENCES plans (seq) ON DELETE CASCADE,
    document TEXT NOT NULL
) STRICT;

CREATE TABLE events (                      -- in batches
    plan_seq INTEGER NOT NULL REFERENCES plans (seq) ON DELETE CASCADE,
    last_id INTEGER NOT NULL,
    first_id INTEGER NOT NULL,
    batch TEXT NOT NULL,                   -- JSON array of last_id - first_id + 1 events
    PRIMARY KEY (plan_seq, last_id)
) STRICT;

CREATE TABLE tombstones (                  -- of deleted plans, for a day
    id TEXT PRIMARY KEY,
    deleted_ms INTEGER NOT NULL
) STRICT, WITHOUT ROWID;

CREATE TABLE health (                      -- one row, touched to see whether writing works
    only INTEGER PRIMARY KEY CHECK (only = 1),
    checked_ms INTEGER NOT NULL
) STRICT;
INSERT INTO health VALUES (1, 0);
";

/// Create the tables in a new file; refuse those of a newer version.
pub(super) fn prepare(connection: &mut Connection) -> Result<(), StoreError> {
    let transaction = connection.transaction()?;
    let version: i64 = transaction.query_row("PRAGMA user_version", [], |row| row.get(0))?;
    match version {
        VERSION => {}
        0 => {
            transaction.execute_batch(TABLES)?;
            transaction.pragma_update(None, "user_version", VERSION)?;
        }
        other => {
            return Err(StoreError::Unavailable(format!(
                "the database has schema version {other}, this program knows up to {VERSION}: use a newer one"
            )));
        }
    }
    transaction.commit()?;
    Ok(())
}
