//! What a plan is given when it is accepted: its id, and its seed when the caller names none.

use uuid::Uuid;

use super::PlanId;

/// A new id; ids sort by the time of acceptance.
#[must_use]
pub fn new_id() -> PlanId {
    Uuid::now_v7()
}

/// A seed from the operating system, below 2^53 so that every JSON reader keeps it.
#[must_use]
pub fn draw_seed() -> u64 {
    // The low 62 bits of a version 4 UUID are random.
    let (_, low) = Uuid::new_v4().as_u64_pair();
    low & ((1 << 53) - 1)
}
