//! The writer's transaction: many operations, each in a savepoint of its own.

use rusqlite::{Connection, params};
use tokio::sync::watch;

use super::row::PlanRow;
use crate::job::{Event, PlanId};
use crate::store::{Options, StoreError};

/// Events in a row of the table, at most.
const BATCH: usize = 256;

/// An open transaction and what it has come to so far.
pub(super) struct Transaction<'a> {
    pub(super) connection: &'a Connection,
    pub(super) options: &'a Options,
    /// Plans queued, what this transaction did included.
    pub(super) queued: u64,
    /// What the world is told once it is durable.
    pub(super) effects: Vec<Effect>,
    /// The failure after which `SQLite` gave up the whole transaction.
    pub(super) lost: Option<String>,
}

/// What the world is told once a change is durable.
pub(super) enum Effect {
    /// A plan, or its events, changed.
    Changed(PlanId),
    /// A plan is being run; whoever runs it listens here.
    Leased(PlanId, watch::Sender<bool>),
    /// Whoever runs the plan shall stop.
    Stop(PlanId),
    /// Nobody runs the plan any more.
    Unleased(PlanId),
}

impl Transaction<'_> {
    /// Do `work` wholly or not at all, without harm to the rest of the transaction.
    pub(super) fn savepoint<T>(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        self.still_open()?;
        self.run("SAVEPOINT operation")?;
        let (queued, n_effects) = (self.queued, self.effects.len());
        let result = work(self);
        if let Err(error) = &result {
            self.queued = queued;
            self.effects.truncate(n_effects);
            if self.connection.is_autocommit() {
                self.lost = Some(error.to_string());
                return result;
            }
            self.run("ROLLBACK TO operation")?;
        }
        self.run("RELEASE operation")?;
        result
    }

    /// `SQLite` ends the whole transaction by itself after some failures, such as a full disk.
    pub(super) fn still_open(&self) -> Result<(), StoreError> {
        if self.connection.is_autocommit() {
            let cause = self.lost.as_deref().unwrap_or("unknown");
            return Err(StoreError::unavailable(format!(
                "the transaction was lost: {cause}"
            )));
        }
        Ok(())
    }

    fn run(&self, sql: &str) -> Result<(), StoreError> {
        self.connection.prepare_cached(sql)?.execute([])?;
        Ok(())
    }

    /// Now, milliseconds since 1970.
    pub(super) fn now_ms(&self) -> i64 {
        (self.options.clock)()
    }

    /// Add to the events of a plan, and forget its oldest when there are too many; the caller writes
    /// the row.
    pub(super) fn tell(&mut self, row: &mut PlanRow, events: &[Event]) -> Result<(), StoreError> {
        for batch in events.chunks(BATCH) {
            let first_id = row.last_event + 1;
            row.last_event += batch.len() as u64;
            let text = serde_json::to_string(batch).map_err(|error| {
                StoreError::unavailable(format!("events of plan {}: {error}", row.plan.id))
            })?;
            row.bytes += text.len() as u64;
            self.connection
                .prepare_cached(
                    "INSERT INTO events (plan_seq, last_id, first_id, batch) VALUES (?1, ?2, ?3, ?4)",
                )?
                .execute(params![
                    row.seq,
                    row.last_event.cast_signed(),
                    first_id.cast_signed(),
                    text
                ])?;
        }
        self.effects.push(Effect::Changed(row.plan.id));
        self.forget(row)
    }

    /// Whole batches at once, and only when there are half as many again as are to be kept: so that
    /// most steps delete nothing.
    fn forget(&mut self, row: &mut PlanRow) -> Result<(), StoreError> {
        let kept = self.options.events_kept;
        if row.last_event - row.forgotten <= kept.saturating_add(kept / 2) {
            return Ok(());
        }
        let oldest = (row.last_event - kept).cast_signed();
        let (last_id, bytes): (Option<i64>, Option<i64>) = self
            .connection
            .prepare_cached(
                "SELECT max(last_id), sum(octet_length(batch)) FROM events \
                 WHERE plan_seq = ?1 AND last_id <= ?2",
            )?
            .query_row([row.seq, oldest], |sums| Ok((sums.get(0)?, sums.get(1)?)))?;
        if let (Some(last_id), Some(bytes)) = (last_id, bytes) {
            self.connection
                .prepare_cached("DELETE FROM events WHERE plan_seq = ?1 AND last_id <= ?2")?
                .execute([row.seq, last_id])?;
            row.forgotten = last_id.cast_unsigned();
            row.bytes = row.bytes.saturating_sub(bytes.cast_unsigned());
        }
        Ok(())
    }
}
