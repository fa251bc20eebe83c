//! A plan's row, to and from columns.

use rusqlite::{Connection, OptionalExtension, Row, named_params};

use crate::job::{Failure, Plan, PlanId, Status};

/// The columns that [`PlanRow::read`] wants.
pub(super) const COLUMNS: &str = "seq, id, owner, name, status, stop_reason, feasible, best_cost, progress, \
     iteration, iterations, evaluations, algorithm, seed, created_ms, started_ms, finished_ms, expires_ms, \
     cancel_requested, error_kind, error_detail, revision, attempt, last_event, \
     forgotten, bytes";

/// A record with what the store alone knows of it.
#[derive(Debug)]
pub(super) struct PlanRow {
    pub(super) seq: i64,
    pub(super) attempt: u64,
    pub(super) last_event: u64,
    /// Events up to this one are no longer kept.
    pub(super) forgotten: u64,
    /// Of its documents and events.
    pub(super) bytes: u64,
    /// `queue_position` is no column: see [`queue_position`].
    pub(super) plan: Plan,
}

impl PlanRow {
    pub(super) fn read(row: &Row<'_>) -> rusqlite::Result<Self> {
        let plan = Plan {
            id: text(row, "id", |id| PlanId::parse_str(id).ok())?,
            owner: row.get("owner")?,
            name: row.get("name")?,
            status: text(row, "status", Status::from_name)?,
            stop_reason: row.get("stop_reason")?,
            feasible: row.get("feasible")?,
            best_cost: row.get("best_cost")?,
            progress: row.get("progress")?,
            iteration: count(row, "iteration")?,
            iterations: count(row, "iterations")?,
            evaluations: count(row, "evaluations")?,
            queue_position: None,
            algorithm: row.get("algorithm")?,
            seed: count(row, "seed")?,
            created_ms: row.get("created_ms")?,
            started_ms: row.get("started_ms")?,
            finished_ms: row.get("finished_ms")?,
            expires_ms: row.get("expires_ms")?,
            cancel_requested: row.get("cancel_requested")?,
            error: error(row)?,
            revision: count(row, "revision")?,
        };
        Ok(Self {
            seq: row.get("seq")?,
            attempt: count(row, "attempt")?,
            last_event: count(row, "last_event")?,
            forgotten: count(row, "forgotten")?,
            bytes: count(row, "bytes")?,
            plan,
        })
    }

    /// The row of that plan, its place in the queue included.
    pub(super) fn load(connection: &Connection, id: PlanId) -> rusqlite::Result<Option<Self>> {
        let row = connection
            .prepare_cached(&format!("SELECT {COLUMNS} FROM plans WHERE id = ?1"))?
            .query_row([id.to_string()], Self::read)
            .optional()?;
        row.map(|row| row.placed(connection)).transpose()
    }

    /// The row at the head of the queue. Left to itself, the database would take the index by
    /// status and sort the whole queue.
    pub(super) fn head(connection: &Connection) -> rusqlite::Result<Option<Self>> {
        let row = connection
            .prepare_cached(&format!(
                "SELECT {COLUMNS} FROM plans INDEXED BY plans_queue WHERE status = 'queued' \
                 ORDER BY seq LIMIT 1"
            ))?
            .query_row([], Self::read)
            .optional()?;
        row.map(|row| row.placed(connection)).transpose()
    }

    /// With its place in the queue.
    pub(super) fn placed(mut self, connection: &Connection) -> rusqlite::Result<Self> {
        self.plan.queue_position = match self.plan.status {
            Status::Queued => Some(queue_position(connection, self.seq)?),
            _ => None,
        };
        Ok(self)
    }

    /// Add it to the table; its `seq` is given by the table.
    pub(super) fn insert(
        &mut self,
        connection: &Connection,
        dataset: Option<&str>,
    ) -> rusqlite::Result<()> {
        let plan = &self.plan;
        connection
            .prepare_cached(
                "INSERT INTO plans (id, owner, name, status, progress, iteration, iterations, evaluations, \
                 algorithm, seed, created_ms, cancel_requested, revision, attempt, last_event, bytes, dataset) \
                 VALUES (:id, :owner, :name, :status, :progress, :iteration, :iterations, :evaluations, \
                 :algorithm, :seed, :created_ms, :cancel_requested, :revision, :attempt, :last_event, :bytes, :dataset)",
            )?
            .execute(named_params! {
                ":id": plan.id.to_string(),
                ":owner": plan.owner,
                ":name": plan.name,
                ":status": plan.status.name(),
                ":progress": plan.progress,
                ":iteration": plan.iteration.cast_signed(),
                ":iterations": plan.iterations.cast_signed(),
                ":evaluations": plan.evaluations.cast_signed(),
                ":algorithm": plan.algorithm,
                ":seed": plan.seed.cast_signed(),
                ":created_ms": plan.created_ms,
                ":cancel_requested": plan.cancel_requested,
                ":revision": plan.revision.cast_signed(),
                ":attempt": self.attempt.cast_signed(),
                ":last_event": self.last_event.cast_signed(),
                ":bytes": self.bytes.cast_signed(),
                ":dataset": dataset,
            })?;
        self.seq = connection.last_insert_rowid();
        Ok(())
    }

    /// Write what changes within a state. No index of active plans has these columns, so this alone is
    /// cheaper than [`PlanRow::update`].
    pub(super) fn update_progress(&self, connection: &Connection) -> rusqlite::Result<()> {
        let plan = &self.plan;
        connection
            .prepare_cached(
                "UPDATE plans SET feasible = :feasible, best_cost = :best_cost, \
                 progress = :progress, iteration = :iteration, evaluations = :evaluations, \
                 revision = :revision, last_event = :last_event, forgotten = :forgotten, \
                 bytes = :bytes WHERE seq = :seq",
            )?
            .execute(named_params! {
                ":feasible": plan.feasible,
                ":best_cost": plan.best_cost,
                ":progress": plan.progress,
                ":iteration": plan.iteration.cast_signed(),
                ":evaluations": plan.evaluations.cast_signed(),
                ":revision": plan.revision.cast_signed(),
                ":last_event": self.last_event.cast_signed(),
                ":forgotten": self.forgotten.cast_signed(),
                ":bytes": self.bytes.cast_signed(),
                ":seq": self.seq,
            })?;
        Ok(())
    }

    /// Write what may have changed since it was read.
    pub(super) fn update(&self, connection: &Connection) -> rusqlite::Result<()> {
        let plan = &self.plan;
        let error = plan.error.as_ref();
        connection
            .prepare_cached(
                "UPDATE plans SET status = :status, stop_reason = :stop_reason, \
                 started_ms = :started_ms, finished_ms = :finished_ms, expires_ms = :expires_ms, \
                 cancel_requested = :cancel_requested, error_kind = :error_kind, \
                 error_detail = :error_detail, attempt = :attempt WHERE seq = :seq",
            )?
            .execute(named_params! {
                ":status": plan.status.name(),
                ":stop_reason": plan.stop_reason,
                ":started_ms": plan.started_ms,
                ":finished_ms": plan.finished_ms,
                ":expires_ms": plan.expires_ms,
                ":cancel_requested": plan.cancel_requested,
                ":error_kind": error.map(|error| &error.kind),
                ":error_detail": error.map(|error| &error.detail),
                ":attempt": self.attempt.cast_signed(),
                ":seq": self.seq,
            })?;
        self.update_progress(connection)
    }
}

/// Place in the queue of the queued plan with that `seq`, from 1.
fn queue_position(connection: &Connection, seq: i64) -> rusqlite::Result<u64> {
    let ahead: i64 = connection
        .prepare_cached(
            "SELECT count(*) FROM plans INDEXED BY plans_queue WHERE status = 'queued' AND seq < ?1",
        )?
        .query_row([seq], |row| row.get(0))?;
    Ok(ahead.cast_unsigned() + 1)
}

/// Counts are kept bit for bit in `SQLite`'s signed integers.
fn count(row: &Row<'_>, column: &str) -> rusqlite::Result<u64> {
    row.get::<_, i64>(column).map(i64::cast_unsigned)
}

fn error(row: &Row<'_>) -> rusqlite::Result<Option<Failure>> {
    let kind: Option<String> = row.get("error_kind")?;
    let detail: Option<String> = row.get("error_detail")?;
    Ok(kind.map(|kind| Failure {
        kind,
        detail: detail.unwrap_or_default(),
    }))
}

fn text<T>(row: &Row<'_>, column: &str, parse: impl Fn(&str) -> Option<T>) -> rusqlite::Result<T> {
    let value: String = row.get(column)?;
    parse(&value).ok_or_else(|| {
        let index = row.as_ref().column_index(column).unwrap_or_default();
        rusqlite::Error::InvalidColumnType(
            index,
            format!("{column} {value:?}"),
            rusqlite::types::Type::Text,
        )
    })
}
