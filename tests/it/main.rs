//! The integration tests: one module per subject.

mod api;
mod events;
mod openapi;
mod scenario;
mod store_conformance;
mod store_sqlite;
mod support;
mod worker;
