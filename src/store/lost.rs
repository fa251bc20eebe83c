//! What becomes of a plan whose run was cut off because its process or machine died, or whose document is gone: one rule
//! for all stores. A run that was given back was not cut off.

use std::fmt::Display;

use crate::job::state::Refused;
use crate::job::{Failure, FailureKind, Plan, PlanId};

/// After this many cut-off runs, the plan itself is taken to be the cause.
const LOST_RUNS: u64 = 5;

/// Why a queued plan fails whose document cannot be read: for `error`.
pub(super) fn scenario(plan: PlanId, error: &dyn Display) -> Failure {
    tracing::error!(plan_id = %plan, %error, "a queued plan has lost its document and fails");
    FailureKind::ScenarioLost.because("the store has lost the document that was accepted")
}

/// End a running plan that must not run again after its `lost`th run was cut off, counted from 1: it is cancelled if
/// that was requested, otherwise it has failed. Returns true if ended; if not, the caller queues it.
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
