//! Webhooks for ends of plans: stored with the plan, due when it ends.

use rusqlite::{Connection, params};

use super::row::{COLUMNS, PlanRow};
use super::transaction::Transaction;
use super::unreadable::Passed;
use crate::job::{PlanId, Submission};
use crate::store::{StoreError, Webhook};

/// Store where the end of an accepted plan is to be sent.
pub(super) fn keep(
    tx: &Transaction<'_>,
    seq: i64,
    submission: &Submission,
) -> Result<(), StoreError> {
    if let Some(url) = &submission.webhook {
        tx.connection
            .prepare_cached("INSERT INTO webhooks (plan_seq, url, tries) VALUES (?1, ?2, 0)")?
            .execute(params![seq, url])?;
    }
    Ok(())
}

/// The plan has just ended.
pub(super) fn make_due(tx: &Transaction<'_>, row: &PlanRow) -> Result<(), StoreError> {
    tx.connection
        .prepare_cached("UPDATE webhooks SET due_ms = ?2 WHERE plan_seq = ?1")?
        .execute(params![row.seq, row.plan.finished_ms])?;
    Ok(())
}

/// See [`Store::due_webhooks`](crate::store::Store::due_webhooks).
pub(super) fn due(
    connection: &Connection,
    now_ms: i64,
    limit: usize,
    passed: &Passed,
) -> Result<Vec<Webhook>, StoreError> {
    let [each, limit] =
        [limit.div_ceil(2), limit].map(|most| i64::try_from(most).unwrap_or(i64::MAX));
    let mut statement = connection.prepare_cached(
        "SELECT seq, url, tries FROM ( \
           SELECT seq, url, tries, due_ms, row_number() OVER (PARTITION BY owner ORDER BY due_ms) AS turn \
           FROM webhooks JOIN plans ON seq = plan_seq WHERE due_ms <= ?1 \
         ) WHERE turn <= ?2 ORDER BY turn, due_ms LIMIT ?3",
    )?;
    let rows = statement.query_map([now_ms, each, limit], |row| {
        Ok((row.get(0)?, row.get(1)?, row.get(2)?))
    })?;
    let mut due = Vec::new();
    for row in rows {
        let (seq, url, tries): (i64, String, u32) = row?;
        let ended = connection
            .prepare_cached(&format!("SELECT {COLUMNS} FROM plans WHERE seq = ?1"))?
            .query_row([seq], PlanRow::try_read)?;
        match ended {
            Ok(PlanRow { plan, .. }) => due.push(Webhook { plan, url, tries }),
            Err(unreadable) => passed.over(&unreadable),
        }
    }
    Ok(due)
}

/// See [`Store::webhook_tried`](crate::store::Store::webhook_tried).
pub(super) fn tried(
    tx: &Transaction<'_>,
    id: PlanId,
    next_ms: Option<i64>,
) -> Result<(), StoreError> {
    const OF_PLAN: &str = "plan_seq = (SELECT seq FROM plans WHERE id = ?1)";
    let id = id.to_string();
    match next_ms {
        Some(next_ms) => tx
            .connection
            .prepare_cached(&format!(
                "UPDATE webhooks SET due_ms = ?2, tries = tries + 1 WHERE {OF_PLAN}"
            ))?
            .execute(params![id, next_ms])?,
        None => tx
            .connection
            .prepare_cached(&format!("DELETE FROM webhooks WHERE {OF_PLAN}"))?
            .execute([id])?,
    };
    Ok(())
}
