//! Operations that change the store, each a step of the writer's transaction.

use std::sync::Arc;

use rusqlite::params;
use tokio::sync::watch;

use super::read::missing;
use super::row::{COLUMNS, PlanRow};
use super::transaction::{Effect, Transaction};
use super::{head, idempotency, removal, webhooks};
use crate::export::document::Incumbent;
use crate::job::{Event, Plan, PlanId, Status, Submission};
use crate::store::{
    End, Ending, LastEvent, Lease, StoreError, Submitted, Tombstone, expected, lost,
};

/// More than the documents of nearly all plans.
const BALLAST_BYTES: i64 = 512 << 10;

pub(super) fn submit(
    tx: &mut Transaction<'_>,
    submission: &Submission,
) -> Result<Submitted, StoreError> {
    let owner = submission.owner.as_ref();
    if let Some(idempotency) = &submission.idempotency
        && let Some(plan) = idempotency::earlier(tx.connection, owner, idempotency, tx.expiry_ms())?
    {
        return Ok(Submitted {
            plan,
            replayed: true,
        });
    }
    if tx.queued >= tx.options.queue_limit {
        return Err(StoreError::QueueFull { queued: tx.queued });
    }
    within_quota(tx, submission)?;
    let mut row = PlanRow {
        seq: 0,
        attempt: 0,
        // The event of its acceptance.
        last_event: 1,
        forgotten: 0,
        bytes: submission.scenario.len() as u64,
        lost: 0,
        plan: Plan::accepted(submission, tx.queued + 1),
    };
    row.insert(tx.connection, submission.dataset.as_deref())?;
    tx.connection
        .prepare_cached("INSERT INTO scenarios (plan_seq, document) VALUES (?1, ?2)")?
        .execute(params![row.seq, submission.scenario])?;
    idempotency::remember(tx, submission)?;
    webhooks::keep(tx, row.seq, submission)?;
    tx.queued += 1;
    tx.effects.push(Effect::Changed(row.plan.id));
    Ok(Submitted {
        plan: row.plan,
        replayed: false,
    })
}

fn within_quota(tx: &Transaction<'_>, submission: &Submission) -> Result<(), StoreError> {
    let (Some(quota), Some(owner)) = (submission.quota, &submission.owner) else {
        return Ok(());
    };
    let active: i64 = tx
        .connection
        .prepare_cached(
            "SELECT count(*) FROM plans INDEXED BY plans_active \
             WHERE owner = ?1 AND status IN ('queued', 'running')",
        )?
        .query_row([owner], |row| row.get(0))?;
    let active = active.cast_unsigned();
    if active >= quota {
        return Err(StoreError::QuotaReached { active, quota });
    }
    Ok(())
}

/// `None` when nothing is queued.
pub(super) fn claim(tx: &mut Transaction<'_>) -> Result<Option<Lease>, StoreError> {
    let Some((mut row, scenario)) = head::take(tx)? else {
        return Ok(None);
    };
    tx.postponed.remove(row.seq);
    row.plan.start(tx.now_ms())?;
    // A claim that failed after its lease was handed out must not be mistaken for this one.
    row.attempt = row.attempt.max(tx.void_attempt) + 1;
    tx.queued -= 1;
    tell_status(tx, &mut row)?;
    row.update(tx.connection)?;
    let (cancel, cancelled) = watch::channel(false);
    tx.effects.push(Effect::Leased(row.plan.id, cancel));
    Ok(Some(Lease {
        plan: row.plan,
        scenario: Arc::from(scenario),
        attempt: row.attempt,
        cancel: cancelled,
    }))
}

pub(super) fn append(
    tx: &mut Transaction<'_>,
    id: PlanId,
    attempt: u64,
    events: &[Event],
) -> Result<(), StoreError> {
    let mut row = leased(tx, id, attempt)?;
    row.plan.advance(events);
    let best = events.iter().rev().find_map(|event| match event {
        Event::Incumbent(incumbent) => Some(incumbent),
        _ => None,
    });
    if let Some(best) = best {
        keep_incumbent(tx, &row, best)?;
    }
    tx.add_events(&mut row, events)?;
    row.update_progress(tx.connection)?;
    Ok(())
}

pub(super) fn finish(
    tx: &mut Transaction<'_>,
    id: PlanId,
    attempt: u64,
    end: &End,
) -> Result<Plan, StoreError> {
    let mut row = leased(tx, id, attempt)?;
    tx.add_events(&mut row, &end.events)?;
    end.apply(&mut row.plan)?;
    forget_incumbent(tx, &row)?;
    if let Ending::Result { document, .. } = &end.ending {
        row.bytes += document.len() as u64;
        tx.connection
            .prepare_cached("INSERT INTO results (plan_seq, document) VALUES (?1, ?2)")?
            .execute(params![row.seq, document])?;
    }
    tell_end(tx, &mut row)?;
    row.update(tx.connection)?;
    tx.effects.push(Effect::Unleased(id));
    Ok(row.plan)
}

pub(super) fn release(
    tx: &mut Transaction<'_>,
    id: PlanId,
    attempt: u64,
) -> Result<Plan, StoreError> {
    let row = leased(tx, id, attempt)?;
    give_back(tx, row)
}

pub(super) fn postpone(
    tx: &mut Transaction<'_>,
    id: PlanId,
    attempt: u64,
) -> Result<Plan, StoreError> {
    let row = leased(tx, id, attempt)?;
    tx.postponed.add(row.seq, attempt);
    give_back(tx, row)
}

/// Give back everything that is being run, when the store is closed.
pub(super) fn release_all(tx: &mut Transaction<'_>) -> Result<(), StoreError> {
    for row in running(tx)? {
        give_back(tx, row)?;
    }
    Ok(())
}

/// Plans that an earlier process was running when it died are queued again, or ended; their leases are void. Returns
/// the plans that have ended.
pub(super) fn recover(tx: &mut Transaction<'_>) -> Result<Vec<Plan>, StoreError> {
    let mut ended = Vec::new();
    for mut row in running(tx)? {
        row.lost += 1;
        if lost::end(&mut row.plan, row.lost, tx.now_ms())? {
            forget_incumbent(tx, &row)?;
            tell_end(tx, &mut row)?;
            row.update(tx.connection)?;
            ended.push(row.plan);
        } else {
            requeue(tx, row)?;
        }
    }
    Ok(ended)
}

/// Running plans in order of acceptance. Those whose record cannot be read are set aside.
fn running(tx: &Transaction<'_>) -> Result<Vec<PlanRow>, StoreError> {
    let rows: Vec<_> = tx
        .connection
        .prepare_cached(&format!(
            "SELECT {COLUMNS} FROM plans WHERE status = 'running' ORDER BY seq"
        ))?
        .query_map([], PlanRow::try_read)?
        .collect::<Result<_, _>>()?;
    let mut running = Vec::new();
    for row in rows {
        match row {
            Ok(row) => running.push(row),
            Err(unreadable) => unreadable.set_aside(tx)?,
        }
    }
    Ok(running)
}

pub(super) fn request_cancel(
    tx: &mut Transaction<'_>,
    id: PlanId,
    revision: Option<u64>,
    now_ms: i64,
) -> Result<Plan, StoreError> {
    let Some(mut row) = PlanRow::load(tx.connection, id)? else {
        return Err(missing(tx.connection, id, tx.expiry_ms())?);
    };
    expected(&row.plan, revision)?;
    match row.plan.status {
        Status::Queued => {
            row.plan.cancel(now_ms)?;
            tx.queued -= 1;
            tell_end(tx, &mut row)?;
            row.update(tx.connection)?;
        }
        Status::Running if !row.plan.cancel_requested => {
            row.plan.request_cancel();
            tell_status(tx, &mut row)?;
            row.update(tx.connection)?;
            tx.effects.push(Effect::Stop(id));
        }
        Status::Running | Status::Succeeded | Status::Failed | Status::Cancelled => {}
    }
    Ok(row.plan)
}

pub(super) fn delete(
    tx: &mut Transaction<'_>,
    id: PlanId,
    revision: Option<u64>,
    now_ms: i64,
) -> Result<(), StoreError> {
    let Some(row) = PlanRow::load(tx.connection, id)? else {
        return match missing(tx.connection, id, tx.options.expiry_ms(now_ms))? {
            StoreError::Gone(_) if revision.is_none() => Ok(()),
            other => Err(other),
        };
    };
    expected(&row.plan, revision)?;
    let tombstone = Tombstone {
        id,
        owner: row.plan.owner,
        expired: false,
        end: Some(LastEvent::of(row.plan.status, row.last_event)),
    };
    removal::remove(tx, row.seq, tombstone, now_ms)?;
    if row.plan.status == Status::Queued {
        tx.queued -= 1;
    }
    tx.effects.extend([Effect::Stop(id), Effect::Unleased(id)]);
    Ok(())
}

/// A write that shows whether others would succeed, and how far time has come in any case. Where one has found the disk
/// full, it is as large as a plan: a row still fits into what is left of the log when no plan does.
pub(super) fn touch(tx: &mut Transaction<'_>) -> Result<(), StoreError> {
    let ballast_bytes = if tx.found_full { BALLAST_BYTES } else { 0 };
    tx.connection
        .prepare_cached("UPDATE health SET checked_ms = ?1, ballast = zeroblob(?2)")?
        .execute([tx.expiry_ms(), ballast_bytes])?;
    tx.found_full = false;
    Ok(())
}

/// The row of a plan that is being run under this attempt.
fn leased(tx: &Transaction<'_>, id: PlanId, attempt: u64) -> Result<PlanRow, StoreError> {
    PlanRow::load(tx.connection, id)?
        .filter(|row| row.plan.status == Status::Running && row.attempt == attempt)
        .ok_or(StoreError::LeaseLost(id))
}

/// Back to the queue, or ended if that was requested.
fn give_back(tx: &mut Transaction<'_>, mut row: PlanRow) -> Result<Plan, StoreError> {
    tx.effects.push(Effect::Unleased(row.plan.id));
    if row.plan.cancel_requested {
        row.plan.cancel(tx.now_ms())?;
        forget_incumbent(tx, &row)?;
        tell_end(tx, &mut row)?;
        row.update(tx.connection)?;
        return Ok(row.plan);
    }
    requeue(tx, row)
}

fn requeue(tx: &mut Transaction<'_>, mut row: PlanRow) -> Result<Plan, StoreError> {
    row.plan.requeue()?;
    forget_incumbent(tx, &row)?;
    tx.queued += 1;
    // Its queue position is counted from the table, so its own new state must be there first.
    row.update(tx.connection)?;
    row = row.placed(tx.connection)?;
    tell_status(tx, &mut row)?;
    row.update(tx.connection)?;
    Ok(row.plan)
}

fn keep_incumbent(tx: &Transaction<'_>, row: &PlanRow, best: &Incumbent) -> Result<(), StoreError> {
    let document = serde_json::to_string(best).map_err(|error| {
        StoreError::unavailable(format!("best route of plan {}: {error}", row.plan.id))
    })?;
    tx.connection
        .prepare_cached("INSERT OR REPLACE INTO incumbents (plan_seq, document) VALUES (?1, ?2)")?
        .execute(params![row.seq, document])?;
    Ok(())
}

fn forget_incumbent(tx: &Transaction<'_>, row: &PlanRow) -> Result<(), StoreError> {
    tx.connection
        .prepare_cached("DELETE FROM incumbents WHERE plan_seq = ?1")?
        .execute([row.seq])?;
    Ok(())
}

pub(super) fn tell_status(tx: &mut Transaction<'_>, row: &mut PlanRow) -> Result<(), StoreError> {
    let status = Event::Status(Box::new(row.plan.clone()));
    tx.add_events(row, &[status])
}

/// The caller has just ended the plan. Its retention time starts now.
pub(super) fn tell_end(tx: &mut Transaction<'_>, row: &mut PlanRow) -> Result<(), StoreError> {
    row.plan.expires_ms = tx.options.retention.expires_ms(&row.plan);
    let status = Event::Status(Box::new(row.plan.clone()));
    let end = Event::End(row.plan.status);
    webhooks::make_due(tx, row)?;
    tx.add_events(row, &[status, end])
}
