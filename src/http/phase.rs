//! The stages of the service between its start and its end.

use tokio::sync::watch;

/// Only ever moves forward.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// Takes plans.
    Serving,
    /// Still answers, takes no new plans; running plans may finish.
    Draining,
    /// Streams end, waits return, the listener closes.
    Stopping,
}

/// Resolves when the service stops.
pub(super) async fn stopping(phase: &mut watch::Receiver<Phase>) {
    // Without its sender the service is gone too.
    let _ = phase.wait_for(|phase| *phase == Phase::Stopping).await;
}
