//! The head of the queue: the next plan that can be run, and what becomes of an unreadable one before it, which would
//! otherwise block all others for ever.

use rusqlite::Connection;

use super::operations::{tell_end, tell_status};
use super::row::PlanRow;
use super::transaction::{Effect, Transaction};
use crate::job::FailureKind;
use crate::store::{StoreError, lost};

/// The record and document of the first plan that has both; those before it have failed. `None` when there is none.
/// Nothing of a plan has been written when reading it fails, so the transaction remains sound.
pub(super) fn take(tx: &mut Transaction<'_>) -> Result<Option<(PlanRow, String)>, StoreError> {
    loop {
        let row = match PlanRow::head(tx.connection) {
            Ok(Some(row)) => row,
            Ok(None) => return Ok(None),
            Err(error) if is_the_row_s(&error) => {
                set_aside(tx, &error)?;
                continue;
            }
            Err(error) => return Err(error.into()),
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

/// Whether the error comes from the row's content or its absence, and not from the database, which may recover by the
/// next try and reports damage in its own way.
fn is_the_row_s(error: &rusqlite::Error) -> bool {
    error.sqlite_error_code().is_none()
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

/// Without its record the plan's owner cannot be notified, and it cannot be removed by its id: it only leaves the
/// queue, and is kept, without an expiry time, for whoever inspects the file.
fn set_aside(tx: &mut Transaction<'_>, error: &rusqlite::Error) -> Result<(), StoreError> {
    let seq: i64 = tx
        .connection
        .prepare_cached(
            "UPDATE plans SET status = 'failed', error_kind = ?1, error_detail = ?2 WHERE seq = (SELECT seq \
             FROM plans INDEXED BY plans_queue WHERE status = 'queued' ORDER BY seq LIMIT 1) RETURNING seq",
        )?
        .query_row(
            (FailureKind::ScenarioLost.name(), error.to_string()),
            |row| row.get(0),
        )?;
    tracing::error!(seq, %error, "the record of a queued plan cannot be read; it is taken out of the queue");
    tx.queued -= 1;
    Ok(())
}
