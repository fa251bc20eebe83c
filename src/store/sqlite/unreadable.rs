//! Rows of plans that cannot be read, because something else has written or damaged them. Each is contained: whatever
//! reads many rows passes over it, and the other plans go on.

use std::collections::HashSet;

use parking_lot::Mutex;

use super::transaction::Transaction;
use crate::job::FailureKind;
use crate::store::StoreError;

/// A plan's row, and why it cannot be read.
#[derive(Debug)]
pub(super) struct Unreadable {
    pub(super) seq: i64,
    pub(super) error: rusqlite::Error,
}

impl Unreadable {
    /// Without its record the plan's owner cannot be notified, and it cannot be removed by its id: it only ends, and is
    /// kept, without an expiry time, for whoever inspects the file.
    pub(super) fn set_aside(&self, tx: &Transaction<'_>) -> Result<(), StoreError> {
        let Self { seq, error } = self;
        tx.connection
            .prepare_cached(
                "UPDATE plans SET status = 'failed', error_kind = ?2, error_detail = ?3 WHERE seq = ?1",
            )?
            .execute((seq, FailureKind::ScenarioLost.name(), error.to_string()))?;
        tracing::error!(seq, %error, "the record of an active plan cannot be read; the plan is not run");
        Ok(())
    }
}

/// Whether the error comes from the row's content or its absence, and not from the database, which may recover by the
/// next try and reports damage in its own way.
pub(super) fn is_the_row_s(error: &rusqlite::Error) -> bool {
    error.sqlite_error_code().is_none()
}

/// The rows that have been passed over. Some are read twice a second, but each is logged once.
#[derive(Default)]
pub(super) struct Passed(Mutex<HashSet<i64>>);

impl Passed {
    pub(super) fn over(&self, Unreadable { seq, error }: &Unreadable) {
        let is_new = self.0.lock().insert(*seq);
        if is_new {
            tracing::error!(seq, %error, "the record of a plan cannot be read; the plan is left out");
        }
    }
}
