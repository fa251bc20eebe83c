//! What a plan is given when it is accepted: its id, and its seed when the caller names none.

use std::sync::Mutex;
use std::time::Duration;

use uuid::timestamp::context::ContextV7;
use uuid::{Timestamp, Uuid};

use super::PlanId;

/// Keeps ids created in the same millisecond in order.
static ORDER: Mutex<ContextV7> = Mutex::new(ContextV7::new());

/// A new id at `now_ms`, milliseconds since 1970; ids sort by the time of acceptance.
#[must_use]
pub fn new_id(now_ms: i64) -> PlanId {
    let now = Duration::from_millis(now_ms.max(0).unsigned_abs());
    let now = Timestamp::from_unix(&ORDER, now.as_secs(), now.subsec_nanos());
    Uuid::new_v7(now)
}

/// A seed from the operating system, below 2^53 so that every JSON reader keeps it.
#[must_use]
pub fn draw_seed() -> u64 {
    // The low 62 bits of a version 4 UUID are random.
    let (_, low) = Uuid::new_v4().as_u64_pair();
    low & ((1 << 53) - 1)
}
