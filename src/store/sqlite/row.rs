//! A plan's row, to and from columns.

use rusqlite::types::{FromSql, Type};
use rusqlite::{Connection, OptionalExtension, Row, params};

use super::unreadable::{Unreadable, is_the_row_s};
use crate::job::{Failure, Plan, PlanId, Status};

/// The columns that [`PlanRow::read`] expects, in its order.
pub(super) const COLUMNS: &str = "seq, id, owner, name, status, stop_reason, feasible, best_cost, progress, \
     iteration, iterations, evaluations, algorithm, seed, created_ms, started_ms, finished_ms, expires_ms, \
     cancel_requested, error_kind, error_detail, revision, attempt, last_event, \
     forgotten, bytes, lost";

/// A record with the data that only the store knows.
#[derive(Debug)]
pub(super) struct PlanRow {
    pub(super) seq: i64,
    pub(super) attempt: u64,
    pub(super) last_event: u64,
    /// Events up to this one are no longer kept.
    pub(super) forgotten: u64,
    /// Bytes of its documents and events.
    pub(super) bytes: u64,
    /// Runs that were cut off when their process died.
    pub(super) lost: u64,
    /// `queue_position` is not a column: see [`queue_position`].
    pub(super) plan: Plan,
}

impl PlanRow {
    pub(super) fn read(row: &Row<'_>) -> rusqlite::Result<Self> {
        // In column order: looking a column up by name compares it with all before it.
        let mut row = Cells { row, next: 0 };
        let seq = row.take()?;
        let plan = Plan {
            id: row.text("id", |id| PlanId::parse_str(id).ok())?,
            owner: row.take()?,
            name: row.take()?,
            status: row.text("status", Status::from_name)?,
            stop_reason: row.take()?,
            feasible: row.take()?,
            best_cost: row.take()?,
            progress: row.take()?,
            iteration: row.count()?,
            iterations: row.count()?,
            evaluations: row.count()?,
            queue_position: None,
            algorithm: row.take()?,
            seed: row.count()?,
            created_ms: row.take()?,
            started_ms: row.take()?,
            finished_ms: row.take()?,
            expires_ms: row.take()?,
            cancel_requested: row.take()?,
            error: row.failure()?,
            revision: row.count()?,
        };
        Ok(Self {
            seq,
            plan,
            attempt: row.count()?,
            last_event: row.count()?,
            forgotten: row.count()?,
            bytes: row.count()?,
            lost: row.count()?,
        })
    }

    /// As [`PlanRow::read`], but a row whose content cannot be read does not fail the query.
    pub(super) fn try_read(row: &Row<'_>) -> rusqlite::Result<Result<Self, Unreadable>> {
        match Self::read(row) {
            Err(error) if is_the_row_s(&error) => {
                let seq = row.get(0)?;
                Ok(Err(Unreadable { seq, error }))
            }
            read => read.map(Ok),
        }
    }

    /// The row of this plan, including its place in the queue.
    pub(super) fn load(connection: &Connection, id: PlanId) -> rusqlite::Result<Option<Self>> {
        let row = connection
            .prepare_cached(&format!("SELECT {COLUMNS} FROM plans WHERE id = ?1"))?
            .query_row([id.to_string()], Self::read)
            .optional()?;
        row.map(|row| row.placed(connection)).transpose()
    }

    /// The first row of the queue from this one on. Without the hint, the database would take the index by status and
    /// sort the whole queue.
    pub(super) fn head(
        connection: &Connection,
        from: i64,
    ) -> rusqlite::Result<Option<Result<Self, Unreadable>>> {
        connection
            .prepare_cached(&format!(
                "SELECT {COLUMNS} FROM plans INDEXED BY plans_queue WHERE status = 'queued' AND seq >= ?1 \
                 ORDER BY seq LIMIT 1"
            ))?
            .query_row([from], Self::try_read)
            .optional()
    }

    /// Adds its place in the queue.
    pub(super) fn placed(mut self, connection: &Connection) -> rusqlite::Result<Self> {
        self.plan.queue_position = match self.plan.status {
            Status::Queued => Some(queue_position(connection, self.seq)?),
            _ => None,
        };
        Ok(self)
    }

    /// Add it to the table, which assigns its `seq`. The acceptance event needs no row of its own:
    /// [`Plan::as_accepted`] reconstructs it.
    pub(super) fn insert(
        &mut self,
        connection: &Connection,
        dataset: Option<&str>,
    ) -> rusqlite::Result<()> {
        let plan = &self.plan;
        connection
            .prepare_cached(
                "INSERT INTO plans (id, owner, name, status, progress, iteration, iterations, evaluations, \
                 algorithm, seed, created_ms, cancel_requested, revision, attempt, last_event, bytes, dataset, place) \
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18)",
            )?
            .execute(params![
                plan.id.to_string(),
                plan.owner,
                plan.name,
                plan.status.name(),
                plan.progress,
                plan.iteration.cast_signed(),
                plan.iterations.cast_signed(),
                plan.evaluations.cast_signed(),
                plan.algorithm,
                plan.seed.cast_signed(),
                plan.created_ms,
                plan.cancel_requested,
                plan.revision.cast_signed(),
                self.attempt.cast_signed(),
                self.last_event.cast_signed(),
                self.bytes.cast_signed(),
                dataset,
                plan.queue_position.map(u64::cast_signed),
            ])?;
        self.seq = connection.last_insert_rowid();
        Ok(())
    }

    /// Write the columns that change within a state. No index of active plans has these columns, so this is cheaper
    /// than [`PlanRow::update`].
    pub(super) fn update_progress(&self, connection: &Connection) -> rusqlite::Result<()> {
        let plan = &self.plan;
        connection
            .prepare_cached(
                "UPDATE plans SET feasible = ?2, best_cost = ?3, progress = ?4, iteration = ?5, \
                 evaluations = ?6, revision = ?7, last_event = ?8, forgotten = ?9, bytes = ?10 \
                 WHERE seq = ?1",
            )?
            .execute(params![
                self.seq,
                plan.feasible,
                plan.best_cost,
                plan.progress,
                plan.iteration.cast_signed(),
                plan.evaluations.cast_signed(),
                plan.revision.cast_signed(),
                self.last_event.cast_signed(),
                self.forgotten.cast_signed(),
                self.bytes.cast_signed(),
            ])?;
        Ok(())
    }

    /// Write every column that may have changed since it was read.
    pub(super) fn update(&self, connection: &Connection) -> rusqlite::Result<()> {
        let plan = &self.plan;
        let error = plan.error.as_ref();
        connection
            .prepare_cached(
                "UPDATE plans SET feasible = ?2, best_cost = ?3, progress = ?4, iteration = ?5, \
                 evaluations = ?6, revision = ?7, last_event = ?8, forgotten = ?9, bytes = ?10, \
                 status = ?11, stop_reason = ?12, started_ms = ?13, finished_ms = ?14, expires_ms = ?15, \
                 cancel_requested = ?16, error_kind = ?17, error_detail = ?18, attempt = ?19, lost = ?20 \
                 WHERE seq = ?1",
            )?
            .execute(params![
                self.seq,
                plan.feasible,
                plan.best_cost,
                plan.progress,
                plan.iteration.cast_signed(),
                plan.evaluations.cast_signed(),
                plan.revision.cast_signed(),
                self.last_event.cast_signed(),
                self.forgotten.cast_signed(),
                self.bytes.cast_signed(),
                plan.status.name(),
                plan.stop_reason,
                plan.started_ms,
                plan.finished_ms,
                plan.expires_ms,
                plan.cancel_requested,
                error.map(|error| &error.kind),
                error.map(|error| &error.detail),
                self.attempt.cast_signed(),
                self.lost.cast_signed(),
            ])?;
        Ok(())
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

/// The cells of a row, one after the other.
struct Cells<'r, 's> {
    row: &'r Row<'s>,
    next: usize,
}

impl Cells<'_, '_> {
    fn take<T: FromSql>(&mut self) -> rusqlite::Result<T> {
        let cell = self.row.get(self.next);
        self.next += 1;
        cell
    }

    /// Counts are stored bit for bit in `SQLite`'s signed integers.
    fn count(&mut self) -> rusqlite::Result<u64> {
        self.take().map(i64::cast_unsigned)
    }

    /// Parse the text in the column of this name.
    fn text<T>(&mut self, column: &str, parse: impl Fn(&str) -> Option<T>) -> rusqlite::Result<T> {
        let at = self.next;
        self.next += 1;
        let value = self.row.get_ref(at)?.as_str()?;
        parse(value).ok_or_else(|| {
            rusqlite::Error::InvalidColumnType(at, format!("{column} {value:?}"), Type::Text)
        })
    }

    fn failure(&mut self) -> rusqlite::Result<Option<Failure>> {
        let kind: Option<String> = self.take()?;
        let detail: Option<String> = self.take()?;
        Ok(kind.map(|kind| Failure {
            kind,
            detail: detail.unwrap_or_default(),
        }))
    }
}
