//! Long work, away from the threads that answer requests.
//!
//! Work that computes shares places of which there is one per core. Work that may wait for a network or for a caller
//! must not take one of these, else a few silent servers hold up everything: it has places of its own.

use std::num::NonZero;
use std::sync::{Arc, LazyLock};
use std::thread::available_parallelism;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::problem::{Busy, Problem};

/// For so long a request waits for a place.
const PATIENCE: Duration = Duration::from_secs(30);

/// One place per core: more would only compete for time and memory.
static CORES: LazyLock<Places> = LazyLock::new(|| {
    let cores = available_parallelism().map_or(1, NonZero::get);
    Places::new(cores, Busy::Cores)
});

/// Compute something on a thread of its own.
pub(super) async fn run<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Problem> {
    CORES.run(work).await
}

/// How much work of one kind is done at once.
#[derive(Clone)]
pub(super) struct Places {
    places: Arc<Semaphore>,
    /// What is said to those who get none in time.
    busy: Busy,
}

/// One of these places, until the last clone is dropped.
#[derive(Clone)]
pub(super) struct Place(#[expect(dead_code, reason = "held")] Arc<OwnedSemaphorePermit>);

impl Places {
    pub(super) fn new(count: usize, busy: Busy) -> Self {
        Self {
            places: Arc::new(Semaphore::new(count)),
            busy,
        }
    }

    /// Do `work` on a thread of its own once there is a place for it.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let place = self.take(PATIENCE).await;
        place.ok_or(Problem::Busy(self.busy))?.run(work).await
    }

    /// A place, if there is one within `patience`.
    pub(super) async fn take(&self, patience: Duration) -> Option<Place> {
        tokio::time::timeout(patience, self.next()).await.ok()
    }

    /// A place, as soon as there is one.
    pub(super) async fn next(&self) -> Place {
        let place = self.places.clone().acquire_owned().await;
        Place(Arc::new(place.expect("nobody closes it")))
    }
}

impl Place {
    /// Do `work` on a thread of its own; a panic there is passed on here. Its log lines keep the request's id.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let span = tracing::Span::current();
        let place = self.clone();
        let work = move || {
            // Work continues when its caller has hung up, and keeps its place until it is done.
            let _place = place;
            span.in_scope(work)
        };
        let done = tokio::task::spawn_blocking(work).await;
        done.or_else(|broken| match broken.try_into_panic() {
            Ok(panic) => std::panic::resume_unwind(panic),
            Err(_) => Err(Problem::Draining { retry_after_s: 1 }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn whoever_gets_no_place_in_time_is_told_that_the_service_is_busy() {
        let places = Places::new(1, Busy::Cores);
        assert_eq!(places.run(|| 7).await.ok(), Some(7));
        let held = places.take(PATIENCE).await.expect("it is free");
        let begin = tokio::time::Instant::now();
        let refused = places.run(|| 7).await;
        assert!(matches!(refused, Err(Problem::Busy(Busy::Cores))));
        assert_eq!(begin.elapsed().as_secs(), PATIENCE.as_secs());
        drop(held);
        assert_eq!(places.run(|| 7).await.ok(), Some(7));
    }

    #[tokio::test]
    async fn work_keeps_its_place_when_its_caller_has_gone() {
        let places = Places::new(1, Busy::Cores);
        let (let_go, waits) = std::sync::mpsc::channel::<()>();
        {
            let mut work = Box::pin(places.run(move || waits.recv()));
            assert!(futures_util::poll!(&mut work).is_pending());
        }
        assert!(places.take(Duration::ZERO).await.is_none());
        drop(let_go);
        assert!(places.take(PATIENCE).await.is_some());
    }
}
