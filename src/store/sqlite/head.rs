//! The head of the queue: the next plan that can be run, and what becomes of an unreadable one before it, which would
//! otherwise block all others for ever.

use rusqlite::Connection;

use super::operations::{tell_end, tell_status};
use super::row::PlanRow;
use super::transaction::{Effect, Transaction};
use super::unreadable::is_the_row_s;
use crate::store::{StoreError, lost};

/// The record and document of the first plan that has both, of those that are not postponed if there are any; those
/// before it that are unreadable have failed. `None` when there is none.
/// Nothing of a plan has been written when reading it fails, so the transaction remains sound.
pub(super) fn take(tx: &mut Transaction<'_>) -> Result<Option<(PlanRow, String)>, StoreError> {
    loop {
        let first = tx.postponed.first(tx.connection)?;
        let row = match PlanRow::head(tx.connection, first)? {
            Some(Ok(row)) => row,
            Some(Err(unreadable)) => {
                unreadable.set_aside(tx)?;
                tx.queued -= 1;
                continue;
            }
            None => return Ok(None),
        };
        match document(tx.connection, row.seq) {
            Ok(document) => return Ok(Some((row, document))),
            Err(error) if is_the_row_s(&error) => fail(tx, row, &error)?,
            Err(error) => return Err(error.into()),
        }
    }
}

fn document(connection: &Connection, seq: i64) -> rusqlite::Result<String> {
    connection
        .prepare_cached("SELECT document FROM scenarios WHERE plan_seq = ?1")?
        .query_row([seq], |row| row.get(0))
}

fn fail(
    tx: &mut Transaction<'_>,
    mut row: PlanRow,
    error: &rusqlite::Error,
) -> Result<(), StoreError> {
    let lost = lost::scenario(row.plan.id, error);
    row.plan.start(tx.now_ms())?;
    tx.queued -= 1;
    tell_status(tx, &mut row)?;
    row.plan.fail(lost, tx.now_ms())?;
    tell_end(tx, &mut row)?;
    row.update(tx.connection)?;
    tx.effects.push(Effect::Ended(Box::new(row.plan)));
    Ok(())
}
