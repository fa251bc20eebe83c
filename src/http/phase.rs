//! Where the service stands between its start and its end.

use tokio::sync::watch;

/// Only ever moves forward.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// Takes plans.
    Serving,
    /// Still answers, takes no plans; what runs may finish.
    Draining,
    /// Streams end, waits return, the listener closes.
    Stopping,
}

/// Until the service stops.
pub(super) async fn stopping(phase: &mut watch::Receiver<Phase>) {
    // A sender that is gone cannot say anything else either.
    let _ = phase.wait_for(|phase| *phase == Phase::Stopping).await;
}
