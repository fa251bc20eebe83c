//! A plan's life: its record, its states, its events.
//!
//! Deliberately absent: where records are kept, and how they travel.

mod event;
mod id;
mod life;
mod plan;
pub mod state;

pub use event::{Event, NumberedEvent};
pub use id::{draw_seed, new_id};
pub use plan::{Failure, Idempotency, Owner, Plan, PlanId, Submission};
pub use state::Status;
