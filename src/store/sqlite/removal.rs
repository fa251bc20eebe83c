//! Removal of plans that have expired, and what remains of removed ones.

use rusqlite::{Params, Row, params};

use super::idempotency;
use super::transaction::{Effect, Transaction};
use crate::job::{PlanId, Status};
use crate::store::{LastEvent, SWEEP, StoreError, TOMBSTONE_MS, Tombstone};

/// An ended plan that may have to be removed.
struct Ended {
    seq: i64,
    bytes: u64,
    /// `None` when its id or owner cannot be read.
    tombstone: Option<Tombstone>,
}

impl Ended {
    /// From `seq, id, owner, bytes, status, last_event`. A text that cannot be read is done without, or the plan would
    /// hold up the removal of all others for ever.
    fn read(row: &Row<'_>) -> rusqlite::Result<Self> {
        let id = row.get::<_, String>(1).ok();
        let id = id.and_then(|id| PlanId::parse_str(&id).ok());
        let owner = row.get(2).ok();
        let status = row.get::<_, String>(4).ok();
        let status = status.as_deref().and_then(Status::from_name);
        let last: Option<i64> = row.get(5).ok();
        Ok(Self {
            seq: row.get(0)?,
            bytes: row.get::<_, i64>(3)?.cast_unsigned(),
            tombstone: id.zip(owner).map(|(id, owner)| Tombstone {
                id,
                owner,
                expired: true,
                end: status
                    .zip(last)
                    .map(|(status, last)| LastEvent::of(status, last.cast_unsigned())),
            }),
        })
    }
}

/// See [`Store::sweep`](crate::store::Store::sweep).
pub(super) fn sweep(tx: &mut Transaction<'_>, now_ms: i64) -> Result<usize, StoreError> {
    let expiry_ms = tx.options.expiry_ms(now_ms);
    bury_for_good(tx, expiry_ms)?;
    idempotency::forget(tx, expiry_ms)?;
    let mut removed = 0;
    for plan in expired(tx, expiry_ms)? {
        expire(tx, plan, now_ms)?;
        removed += 1;
    }
    for plan in beyond_limits(tx, SWEEP - removed)? {
        expire(tx, plan, now_ms)?;
        removed += 1;
    }
    Ok(removed)
}

fn expired(tx: &Transaction<'_>, expiry_ms: i64) -> Result<Vec<Ended>, StoreError> {
    ended(
        tx,
        "SELECT seq, id, owner, bytes, status, last_event FROM plans WHERE expires_ms <= ?1 ORDER BY expires_ms LIMIT ?2",
        [expiry_ms, SWEEP.cast_signed() as i64],
    )
}

/// The plans that ended longest ago, where count or bytes exceed what is to be kept.
fn beyond_limits(tx: &Transaction<'_>, at_most: usize) -> Result<Vec<Ended>, StoreError> {
    let retention = tx.options.retention;
    let max_plans = retention.plans.unwrap_or(u64::MAX);
    let max_bytes = retention.bytes.unwrap_or(u64::MAX);
    let (plans, bytes): (i64, i64) = tx
        .connection
        .prepare_cached(
            "SELECT count(*), coalesce(sum(bytes), 0) FROM plans INDEXED BY plans_ended \
             WHERE finished_ms IS NOT NULL",
        )?
        .query_row([], |row| Ok((row.get(0)?, row.get(1)?)))?;
    let (mut plans, mut bytes) = (plans.cast_unsigned(), bytes.cast_unsigned());
    if plans <= max_plans && bytes <= max_bytes {
        return Ok(Vec::new());
    }
    let oldest = ended(
        tx,
        "SELECT seq, id, owner, bytes, status, last_event FROM plans INDEXED BY plans_ended \
         WHERE finished_ms IS NOT NULL ORDER BY finished_ms LIMIT ?1",
        [at_most.cast_signed() as i64],
    )?;
    let beyond = oldest.into_iter().take_while(|plan| {
        let too_many = plans > max_plans || bytes > max_bytes;
        plans -= 1;
        bytes = bytes.saturating_sub(plan.bytes);
        too_many
    });
    Ok(beyond.collect())
}

fn ended(
    tx: &Transaction<'_>,
    sql: &str,
    parameters: impl Params,
) -> Result<Vec<Ended>, StoreError> {
    let mut statement = tx.connection.prepare_cached(sql)?;
    let rows = statement.query_map(parameters, Ended::read)?;
    Ok(rows.collect::<Result<_, _>>()?)
}

fn expire(tx: &mut Transaction<'_>, plan: Ended, now_ms: i64) -> Result<(), StoreError> {
    if let Some(tombstone) = plan.tombstone {
        return remove(tx, plan.seq, tombstone, now_ms);
    }
    let seq = plan.seq;
    tracing::error!(
        seq,
        "an expired plan whose record cannot be read is removed without a trace"
    );
    delete_row(tx, seq)
}

/// Remove a plan and all that belongs to it; its tombstone remains.
pub(super) fn remove(
    tx: &mut Transaction<'_>,
    seq: i64,
    tombstone: Tombstone,
    now_ms: i64,
) -> Result<(), StoreError> {
    let Tombstone {
        id,
        owner,
        expired,
        end,
    } = tombstone;
    delete_row(tx, seq)?;
    tx.connection
        .prepare_cached(
            "INSERT OR REPLACE INTO tombstones (id, deleted_ms, owner, expired, status, last_event) \
             VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
        )?
        .execute(params![
            id.to_string(),
            now_ms,
            owner,
            expired,
            end.map(|end| end.status.name()),
            end.map(|end| end.id.cast_signed()),
        ])?;
    tx.effects.push(Effect::Changed(id));
    Ok(())
}

fn delete_row(tx: &Transaction<'_>, seq: i64) -> Result<(), StoreError> {
    tx.connection
        .prepare_cached("DELETE FROM plans WHERE seq = ?1")?
        .execute([seq])?;
    Ok(())
}

/// Delete the tombstones that have expired.
pub(super) fn bury_for_good(tx: &Transaction<'_>, expiry_ms: i64) -> Result<(), StoreError> {
    tx.connection
        .prepare_cached("DELETE FROM tombstones WHERE deleted_ms <= ?1")?
        .execute([expiry_ms.saturating_sub(TOMBSTONE_MS)])?;
    Ok(())
}
