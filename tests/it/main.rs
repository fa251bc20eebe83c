//! Integration tests, one binary, one module a subject.

mod support;

mod api;
mod events;
mod openapi;
