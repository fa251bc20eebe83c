//! Histories that are not in memory: read from the stream once for all who ask for one at the same time, and few at a
//! time. Each comes over the node's one connection, which the servers cut when too much waits on it.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;
use tokio::sync::Semaphore;

use super::history::History;
use crate::job::PlanId;
use crate::store::StoreError;

/// Number of histories that are read at the same time.
const AT_ONCE: usize = 4;

/// The reading of histories.
pub(super) struct Recalling {
    desks: Mutex<HashMap<PlanId, Arc<Desk>>>,
    permits: Semaphore,
}

/// Where those who ask for the same plan's history meet.
#[derive(Default)]
struct Desk {
    /// How often it was asked for.
    asked: AtomicU64,
    /// What was read last, and how often it had been asked for when the reading began.
    read: tokio::sync::Mutex<Option<(u64, Arc<History>)>>,
}

impl Default for Recalling {
    fn default() -> Self {
        Self {
            desks: Mutex::default(),
            permits: Semaphore::new(AT_ONCE),
        }
    }
}

impl Recalling {
    /// The plan's history as `read` finds it, or as it was found by another reading that began after this call; then
    /// `read` is not begun.
    pub(super) async fn recall(
        &self,
        id: PlanId,
        read: impl Future<Output = Result<History, StoreError>>,
    ) -> Result<Arc<History>, StoreError> {
        let visit = Visit::to(self, id);
        let asked = visit.desk.asked.fetch_add(1, Ordering::Relaxed);
        let mut found = visit.desk.read.lock().await;
        if let Some((began, history)) = &*found
            && asked < *began
        {
            return Ok(Arc::clone(history));
        }
        let _permit = self.permits.acquire().await;
        let began = visit.desk.asked.load(Ordering::Relaxed);
        let history = Arc::new(read.await?);
        *found = Some((began, Arc::clone(&history)));
        Ok(history)
    }
}

/// Somebody at a desk; the last to leave takes it away.
struct Visit<'a> {
    recalling: &'a Recalling,
    id: PlanId,
    desk: Arc<Desk>,
}

impl<'a> Visit<'a> {
    fn to(recalling: &'a Recalling, id: PlanId) -> Self {
        let desk = Arc::clone(recalling.desks.lock().entry(id).or_default());
        Self {
            recalling,
            id,
            desk,
        }
    }
}

impl Drop for Visit<'_> {
    fn drop(&mut self) {
        let mut desks = self.recalling.desks.lock();
        // One is the map's, one is this.
        if Arc::strong_count(&self.desk) == 2 {
            desks.remove(&self.id);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use futures_util::future::join_all;

    use super::*;

    /// The first reading began before the others asked; one more answers all of them.
    #[tokio::test]
    async fn a_crowd_causes_two_readings_and_leaves_nothing() {
        let (recalling, id) = (Recalling::default(), PlanId::now_v7());
        let reads = AtomicUsize::new(0);
        let read = async || {
            reads.fetch_add(1, Ordering::Relaxed);
            tokio::task::yield_now().await;
            Ok(History::whole())
        };
        let found = join_all((0..200).map(|_| recalling.recall(id, read()))).await;
        assert!(found.iter().all(Result::is_ok));
        assert_eq!(reads.load(Ordering::Relaxed), 2);
        assert!(recalling.desks.lock().is_empty());
        recalling.recall(id, read()).await.expect("it is read");
        assert_eq!(reads.load(Ordering::Relaxed), 3, "nothing old is passed on");
    }

    #[tokio::test]
    async fn who_leaves_or_fails_leaves_the_reading_to_the_next() {
        let (recalling, id) = (Recalling::default(), PlanId::now_v7());
        {
            let mut gone = Box::pin(recalling.recall(id, std::future::pending()));
            assert!(futures_util::poll!(&mut gone).is_pending());
        }
        let fails = async { Err(StoreError::unavailable("not now")) };
        assert!(recalling.recall(id, fails).await.is_err());
        let read = async || Ok(History::whole());
        recalling.recall(id, read()).await.expect("it is read");
        assert!(recalling.desks.lock().is_empty());
    }

    #[tokio::test]
    async fn few_histories_are_read_at_the_same_time() {
        let recalling = Recalling::default();
        let (now, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let read = async || {
            most.fetch_max(now.fetch_add(1, Ordering::Relaxed) + 1, Ordering::Relaxed);
            tokio::task::yield_now().await;
            now.fetch_sub(1, Ordering::Relaxed);
            Ok(History::whole())
        };
        join_all((0..50).map(|_| recalling.recall(PlanId::now_v7(), read()))).await;
        assert_eq!(most.load(Ordering::Relaxed), AT_ONCE);
    }
}
