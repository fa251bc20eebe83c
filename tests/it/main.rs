//! The integration tests: one module per subject.

mod store_conformance;
mod store_sqlite;
mod support;
mod worker;
