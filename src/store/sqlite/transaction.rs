//! The writer's transaction, which combines many operations.

use rusqlite::{Connection, params};
use tokio::sync::watch;

use super::packed;
use super::postponed::Postponed;
use super::row::PlanRow;
use crate::job::{Event, Plan, PlanId};
use crate::store::parts::parts;
use crate::store::{Options, StoreError};

/// An open transaction and its state so far.
pub(super) struct Transaction<'a> {
    pub(super) connection: &'a Connection,
    pub(super) options: &'a Options,
    /// Plans that go after the others. What is in it does no harm if the transaction fails.
    pub(super) postponed: &'a mut Postponed,
    /// Plans queued, including changes made in this transaction.
    pub(super) queued: u64,
    /// No claim whose commit failed had a greater attempt.
    pub(super) void_attempt: u64,
    /// Notifications to send once the transaction is durable.
    pub(super) effects: Vec<Effect>,
    /// The failure that makes a commit impossible.
    pub(super) spoiled: Option<StoreError>,
    /// The disk was found full, and nothing as large as a plan has been written since.
    pub(super) found_full: bool,
}

/// A notification to send once a change is durable.
pub(super) enum Effect {
    /// A plan, or its events, changed.
    Changed(PlanId),
    /// A plan is being run; its worker listens here for a stop.
    Leased(PlanId, watch::Sender<bool>),
    /// The plan's worker must stop.
    Stop(PlanId),
    /// Nobody runs the plan any more.
    Unleased(PlanId),
    /// The store itself has ended the plan.
    Ended(Box<Plan>),
}

impl Transaction<'_> {
    /// Do `work` entirely or not at all: when it fails after it has changed something, the whole transaction is
    /// spoiled, does nothing more and cannot be committed. That is rare, and cheaper than a savepoint for each step.
    pub(super) fn step<T>(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        self.sound()?;
        let changes = self.connection.total_changes();
        let (queued, n_effects) = (self.queued, self.effects.len());
        let result = work(self);
        if let Err(error) = &result {
            self.queued = queued;
            self.effects.truncate(n_effects);
            // After some failures, such as a full disk, SQLite ends the transaction by itself.
            if self.connection.is_autocommit() || self.connection.total_changes() != changes {
                self.spoiled = Some(error.clone());
            }
        }
        result
    }

    /// Fails with the error that spoiled it.
    pub(super) fn sound(&self) -> Result<(), StoreError> {
        self.spoiled.clone().map_or(Ok(()), Err)
    }

    /// Now, milliseconds since 1970.
    pub(super) fn now_ms(&self) -> i64 {
        (self.options.clock)()
    }

    /// The time by which things expire now.
    pub(super) fn expiry_ms(&self) -> i64 {
        self.options.expiry_ms(self.now_ms())
    }

    /// Add to the events of a plan, and delete its oldest when there are too many; the caller writes the row.
    pub(super) fn add_events(
        &mut self,
        row: &mut PlanRow,
        events: &[Event],
    ) -> Result<(), StoreError> {
        for batch in parts(events) {
            let batch = Batch::of(row, batch)?;
            self.keep(row, &batch)?;
        }
        self.forget(row)
    }

    /// Write a batch of events; the plan's row must be there.
    fn keep(&mut self, row: &PlanRow, batch: &Batch) -> Result<(), StoreError> {
        self.connection
            .prepare_cached(
                "INSERT INTO events (plan_seq, last_id, first_id, batch, packed) VALUES (?1, ?2, ?3, ?4, ?5)",
            )?
            .execute(params![row.seq, batch.last_id, batch.first_id, batch.text, batch.packed])?;
        self.effects.push(Effect::Changed(row.plan.id));
        Ok(())
    }

    /// Deletes whole batches, and only once there are half again as many events as are to be kept, so that most steps
    /// delete nothing.
    fn forget(&mut self, row: &mut PlanRow) -> Result<(), StoreError> {
        let kept = self.options.events_kept;
        if row.last_event - row.forgotten <= kept.saturating_add(kept / 2) {
            return Ok(());
        }
        // The first event has no row of its own, so it counts as forgotten.
        row.forgotten = row.forgotten.max(1);
        let oldest = (row.last_event - kept).cast_signed();
        let (last_id, bytes): (Option<i64>, Option<i64>) = self
            .connection
            .prepare_cached(
                "SELECT max(last_id), sum(octet_length(batch) + coalesce(octet_length(packed), 0)) FROM events \
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

/// A row of the table of events.
struct Batch {
    first_id: i64,
    last_id: i64,
    text: String,
    packed: Option<Vec<u8>>,
}

impl Batch {
    /// The next events of a plan, counted in its row.
    fn of(row: &mut PlanRow, events: &[Event]) -> Result<Self, StoreError> {
        let packed = packed::pack(events);
        let text = match packed {
            Some(_) => String::new(),
            None => serde_json::to_string(events).map_err(|error| {
                StoreError::unavailable(format!("events of plan {}: {error}", row.plan.id))
            })?,
        };
        let first_id = row.last_event + 1;
        row.last_event += events.len() as u64;
        row.bytes += (text.len() + packed.as_ref().map_or(0, Vec::len)) as u64;
        Ok(Self {
            first_id: first_id.cast_signed(),
            last_id: row.last_event.cast_signed(),
            text,
            packed,
        })
    }
}
