//! What the operator sees: log lines, metrics, traces, and which request a plan came from.

mod lines;
pub mod log;
pub mod metrics;
mod origins;
mod otlp;
pub mod spans;
pub mod traceparent;

pub use metrics::{Metrics, WebhookTry};
pub use origins::{Origin, Origins};

/// What the parts of the service report to.
#[derive(Debug, Default)]
pub struct Instruments {
    /// Counters and times.
    pub metrics: Metrics,
    /// Which request each plan came from.
    pub origins: Origins,
}
