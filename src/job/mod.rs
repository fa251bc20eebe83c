//! A plan's life: its record, its states, its events.
//!
//! Deliberately absent: where records are kept, and how they travel.

mod event;
mod failure;
mod id;
mod life;
mod plan;
pub mod state;

pub use event::{Event, NumberedEvent};
pub use failure::{Failure, FailureKind};
pub use id::{draw_seed, new_id};
pub use plan::{Idempotency, Owner, Plan, PlanId, Submission};
pub use state::Status;
