//! Noctule plans 3-D routes for unmanned aircraft, as an HTTP service, on the command line, or from a program of
//! one's own:
//!
//! ```
//! use noctule::planner::{self, Nobody};
//! use noctule::scenario::{json, limits::Limits};
//!
//! let document = br#"{
//!     "start": {"x": 0, "y": 0, "z": 50},
//!     "target": {"x": 1000, "y": 0, "z": 50},
//!     "threats": [{"kind": "cylinder", "center": {"x": 400, "y": 10}, "radius": 50}],
//!     "altitude": {"min": 0, "max": 100},
//!     "planner": {"waypoints": 3, "population": 20, "iterations": 20}
//! }"#;
//! let rules = planner::rules(Limits::default());
//! let drawn_seed = 7; // For a document that names none.
//! let scenario = json::read(document, &rules, drawn_seed)?;
//! let outcome = planner::plan(&scenario, &mut Nobody, &Nobody);
//! assert!(outcome.feasible);
//! assert!(outcome.bound.lower <= outcome.cost.total);
//! # Ok::<(), json::Refusal>(())
//! ```
//!
//! A [`planner::Observer`] follows a search and a [`planner::Stop`] ends it. [`planner::so_far`] prices and certifies a
//! route that comes from elsewhere, [`seeding::lower_bound`] is the proven bound, and [`planner::objective`] lets an
//! [`optimizer::Optimizer`] of one's own fly the same routes. [`export`] writes what a [`scenario`] and its outcome have
//! become in each format.
//!
//! The modules in reading order, each of which imports only from those before it: [`geometry`], [`terrain`], [`threat`],
//! [`digest`], [`durable`], [`scenario`], [`cost`], [`optimizer`], [`seeding`], [`planner`], [`export`], [`import`], [`job`],
//! [`catalogue`], [`store`], [`worker`], [`http`], [`cli`]; besides [`config`] and [`telemetry`]. ARCHITECTURE.md, beside
//! the manifest, walks through them.

// What the earth looks like: no network, no clock.
pub mod geometry;
pub mod terrain;
pub mod threat;

// What identifies bytes, and how they are kept.
pub mod digest;
pub mod durable;

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

// Used by all of the service: plain settings, and logging.
pub mod config;
pub mod telemetry;
