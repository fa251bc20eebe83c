//! Which submission came first with its idempotency key.

use rusqlite::{Connection, OptionalExtension, params};

use super::read;
use super::transaction::Transaction;
use crate::job::{Idempotency, Owner, Plan, PlanId, Submission};
use crate::store::{IDEMPOTENCY_MS, StoreError};

/// The current record of the plan from the first submission with this key, owner and body.
pub(super) fn earlier(
    connection: &Connection,
    owner: Option<&Owner>,
    idempotency: &Idempotency,
    expiry_ms: i64,
) -> Result<Option<Plan>, StoreError> {
    let seen: Option<(String, String)> = connection
        .prepare_cached(
            "SELECT body_sha256, plan_id FROM idempotency_keys \
             WHERE owner = ?1 AND key = ?2 AND seen_ms > ?3",
        )?
        .query_row(
            params![named(owner), idempotency.key, oldest(expiry_ms)],
            |row| Ok((row.get(0)?, row.get(1)?)),
        )
        .optional()?;
    let Some((body_sha256, plan)) = seen else {
        return Ok(None);
    };
    if body_sha256 != idempotency.body_sha256 {
        return Err(StoreError::KeyReused);
    }
    let plan = PlanId::parse_str(&plan)
        .map_err(|error| StoreError::unavailable(format!("plan id {plan:?}: {error}")))?;
    read::get(connection, plan, expiry_ms).map(Some)
}

/// Store the key of a submission that made a plan.
pub(super) fn remember(tx: &Transaction<'_>, submission: &Submission) -> Result<(), StoreError> {
    if let Some(idempotency) = &submission.idempotency {
        // A key that has expired but was not swept yet is replaced.
        tx.connection
            .prepare_cached(
                "INSERT OR REPLACE INTO idempotency_keys (owner, key, body_sha256, plan_id, seen_ms) \
                 VALUES (?1, ?2, ?3, ?4, ?5)",
            )?
            .execute(params![
                named(submission.owner.as_ref()),
                idempotency.key,
                idempotency.body_sha256,
                submission.id.to_string(),
                tx.now_ms()
            ])?;
    }
    Ok(())
}

/// Forget the keys that have expired.
pub(super) fn forget(tx: &Transaction<'_>, expiry_ms: i64) -> Result<(), StoreError> {
    tx.connection
        .prepare_cached("DELETE FROM idempotency_keys WHERE seen_ms <= ?1")?
        .execute([oldest(expiry_ms)])?;
    Ok(())
}

fn oldest(expiry_ms: i64) -> i64 {
    expiry_ms.saturating_sub(IDEMPOTENCY_MS)
}

/// No part of the key may be null.
fn named(owner: Option<&Owner>) -> &str {
    owner.map_or("", String::as_str)
}
