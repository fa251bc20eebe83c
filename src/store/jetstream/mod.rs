//! The store of many machines: plans, documents and events in streams of NATS `JetStream`.

mod settings;

pub use settings::{Address, Settings};
