//! Noctule plans 3-D routes for unmanned aircraft.
//!
//! The rooms, in reading order; each imports only from those above it.

pub mod cli;
pub mod config;
pub mod cost;
pub mod export;
pub mod geometry;
pub mod http;
pub mod job;
pub mod optimizer;
pub mod planner;
pub mod scenario;
pub mod seeding;
pub mod store;
pub mod telemetry;
pub mod terrain;
pub mod threat;
pub mod worker;
