//! Noctule plans 3-D routes for unmanned aircraft.
//!
//! The rooms, in reading order; each imports only from those above it. ARCHITECTURE.md walks
//! through them.

// The ground rules: no room, no network, no clock.
pub mod geometry;
pub mod terrain;
pub mod threat;

// What every room may tell of bytes.
pub mod digest;

// What is asked for, and what a route costs.
pub mod scenario;

pub mod cost;

// The search. `optimizer` knows no aircraft; `planner` joins it to the rest.
pub mod optimizer;
pub mod seeding;

pub mod planner;

// What people take away, and the life of a plan.
pub mod export;
pub mod import;
pub mod job;

// Which datasets there are, and where their bytes lie.
pub mod catalogue;

// Where plans are kept, who runs them, and how the world reaches them.
pub mod store;
pub mod worker;

pub mod http;

pub mod cli;

// Of no rank: plain settings, and logging.
pub mod config;
pub mod telemetry;
