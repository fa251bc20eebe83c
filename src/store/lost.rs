//! What becomes of a plan whose run was cut off, by the end of its process or of the machine: the one rule, for
//! all stores. A run that was given back was not cut off.

use crate::job::state::Refused;
use crate::job::{FailureKind, Plan};

/// Runs of a plan that are cut off, after which it is taken to be the reason.
const LOST_RUNS: u64 = 5;

/// End a running plan that is not to run again after its `lost`th run was cut off, counted from 1: it is cancelled
/// where that was asked for, or has failed. True when so; else the caller queues it.
///
/// # Errors
/// [`Refused`] when the plan is not running.
pub(super) fn end(plan: &mut Plan, lost: u64, now_ms: i64) -> Result<bool, Refused> {
    if plan.cancel_requested {
        plan.cancel(now_ms)?;
    } else if lost >= LOST_RUNS {
        let detail = format!("{lost} workers were lost while they ran the plan");
        plan.fail(FailureKind::WorkerLost.because(detail), now_ms)?;
    } else {
        tracing::warn!(plan_id = %plan.id, lost, "a plan whose worker was lost runs again");
        return Ok(false);
    }
    let status = plan.status.name();
    tracing::warn!(plan_id = %plan.id, lost, status, "a plan whose worker was lost ends");
    Ok(true)
}
