//! The integration tests: one binary, one module a subject.

mod api;
mod events;
mod openapi;
mod scenario;
mod store_conformance;
mod store_sqlite;
mod support;
mod worker;
