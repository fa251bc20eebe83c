//! What a node still runs when its store is closed goes back to the queue.

use std::time::Duration;

use futures_util::future::join_all;
use tokio::time::timeout;

use super::JetStream;

/// How long a node whose streams have vanished tries to give back what it runs.
const PATIENCE: Duration = Duration::from_secs(3);

impl JetStream {
    /// Each run in turn, so that they go on in the order in which they were queued.
    pub(super) async fn give_back_in_order(&self) {
        let mut runs = self.leases.all();
        runs.sort_by_key(|(id, _)| self.view.known().place(*id));
        for (id, attempt) in runs {
            if let Err(error) = self.release(id, attempt).await {
                tracing::debug!(plan_id = %id, %error, "a run is left to the end of its lease");
            }
        }
    }

    /// Where a stream has vanished, a plan whose record is still there is queued again. Its job may be gone: all at once,
    /// for servers that have lost it do not answer.
    pub(super) async fn give_back_at_once(&self) {
        let runs = self.leases.all().into_iter();
        let releases = runs.map(|(id, attempt)| self.release(id, attempt));
        if timeout(PATIENCE, join_all(releases)).await.is_err() {
            tracing::debug!(
                "not all runs were given back; they are left to the end of their leases"
            );
        }
        for (id, attempt) in self.leases.all() {
            self.leases.let_go(id, attempt);
        }
    }
}
