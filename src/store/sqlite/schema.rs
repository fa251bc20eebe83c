//! The tables, meant to be read with `sqlite3` too.

use rusqlite::Connection;

use crate::store::{StoreError, Trouble};

/// The migration from each version to the next, the first from an empty file. The version reached is kept in
/// `user_version`. Rows are only ever added here: a file of any earlier version is brought up step by step, and a new
/// one goes the same way.
const STEPS: &[&str] = &[
    "
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
",
    "
ALTER TABLE plans ADD COLUMN owner TEXT;                         -- name of the key it came with
ALTER TABLE plans ADD COLUMN forgotten INTEGER NOT NULL DEFAULT 0; -- events up to this id are no longer kept
ALTER TABLE plans ADD COLUMN bytes INTEGER NOT NULL DEFAULT 0;   -- of its documents and events
UPDATE plans SET bytes =
    coalesce((SELECT octet_length(document) FROM scenarios WHERE plan_seq = seq), 0)
    + coalesce((SELECT octet_length(document) FROM results WHERE plan_seq = seq), 0)
    + coalesce((SELECT sum(octet_length(batch)) FROM events WHERE plan_seq = seq), 0);
CREATE INDEX plans_by_owner ON plans (owner, id) WHERE owner IS NOT NULL;
CREATE INDEX plans_active ON plans (owner) WHERE owner IS NOT NULL AND status IN ('queued', 'running');
CREATE INDEX plans_ended ON plans (finished_ms, bytes) WHERE finished_ms IS NOT NULL;
CREATE INDEX plans_expiring ON plans (expires_ms) WHERE expires_ms IS NOT NULL;

CREATE TABLE incumbents (                  -- the best route of each run so far
    plan_seq INTEGER PRIMARY KEY REFERENCES plans (seq) ON DELETE CASCADE,
    document TEXT NOT NULL
) STRICT;

ALTER TABLE tombstones ADD COLUMN owner TEXT;
ALTER TABLE tombstones ADD COLUMN expired INTEGER NOT NULL DEFAULT 0; -- else deleted by somebody
CREATE INDEX tombstones_by_age ON tombstones (deleted_ms);

CREATE TABLE idempotency_keys (            -- for a day
    owner TEXT NOT NULL,                   -- '' where nobody has a key
    key TEXT NOT NULL,
    body_sha256 TEXT NOT NULL,
    plan_id TEXT NOT NULL,
    seen_ms INTEGER NOT NULL,
    PRIMARY KEY (owner, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX idempotency_keys_by_age ON idempotency_keys (seen_ms);
",
    "
CREATE TABLE webhooks (                    -- until they have been told or given up
    plan_seq INTEGER PRIMARY KEY REFERENCES plans (seq) ON DELETE CASCADE,
    url TEXT NOT NULL,
    tries INTEGER NOT NULL,
    due_ms INTEGER                         -- NULL until the plan has ended
) STRICT;
CREATE INDEX webhooks_due ON webhooks (due_ms) WHERE due_ms IS NOT NULL;
",
    "
ALTER TABLE plans ADD COLUMN dataset TEXT; -- what stands for the dataset that it is planned over
CREATE INDEX plans_by_dataset ON plans (dataset, status) WHERE dataset IS NOT NULL;
",
    "
ALTER TABLE events ADD COLUMN packed BLOB; -- what a search tells, as bytes; batch is empty then
",
    "
ALTER TABLE plans ADD COLUMN lost INTEGER NOT NULL DEFAULT 0; -- runs that ended with their process
",
    "
ALTER TABLE plans ADD COLUMN place INTEGER; -- in the queue as it was accepted; NULL where events has event 1
",
    "
ALTER TABLE health ADD COLUMN ballast BLOB; -- as large as a plan once the disk was found full, to see whether one fits
",
    "
ALTER TABLE tombstones ADD COLUMN status TEXT;        -- how the plan ended; NULL where an earlier version removed it
ALTER TABLE tombstones ADD COLUMN last_event INTEGER; -- id of its end
",
    "
CREATE INDEX plans_by_owner_and_status ON plans (owner, status, id) WHERE owner IS NOT NULL;
",
];

/// Bring the file up to this version; refuse files of a newer one.
pub(super) fn prepare(connection: &mut Connection) -> Result<(), StoreError> {
    let transaction = connection.transaction()?;
    let version: i64 = transaction.query_row("PRAGMA user_version", [], |row| row.get(0))?;
    let missing = usize::try_from(version)
        .ok()
        .and_then(|version| STEPS.get(version..));
    let Some(missing) = missing else {
        let newest = STEPS.len();
        return Err(StoreError::Unavailable {
            trouble: Trouble::Newer,
            detail: format!(
                "the database has schema version {version}, this program knows up to {newest}: use a newer one"
            ),
        });
    };
    for step in missing {
        transaction.execute_batch(step)?;
    }
    if !missing.is_empty() {
        let version = version + missing.len().cast_signed() as i64;
        transaction.pragma_update(None, "user_version", version)?;
    }
    transaction.commit()?;
    Ok(())
}
