//! What every store guarantees. Each test runs on each backend of the table.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on shall panic")]

mod datasets;
mod endings;
mod keeping;
mod model;
mod queue;
mod reading;
mod repetition;
mod telling;
