//! The integration tests: one binary, one module a subject.

mod access;
mod algorithms;
mod api;
mod auth;
mod bench;
mod bound;
mod browser;
mod cli;
mod config;
mod crash;
mod determinism;
mod events;
mod idempotency;
mod layering;

mod logs;
mod metrics;
mod openapi;
mod refusals;
mod scenario;
mod shutdown;
mod store_conformance;
mod store_sqlite;
mod store_trouble;
mod support;
mod svg;
mod warm_start;
mod webhook;
mod worker;
