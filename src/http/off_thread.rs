//! Long work, away from the threads that answer requests.
//!
//! Work that computes shares places of which there is one per core. Work that may wait for a network or for a caller
//! must not take one of these, else a few silent servers hold up everything: it has places of its own. Callers wait for
//! all of these in turn.

use std::collections::HashMap;
use std::num::NonZero;
use std::sync::{Arc, LazyLock};
use std::thread::available_parallelism;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::caller::Caller;
use super::problem::{Busy, Problem};
use crate::job::Owner;

/// For so long a request waits for a place.
const PATIENCE: Duration = Duration::from_secs(30);

/// One place per core: more would only compete for time and memory.
static CORES: LazyLock<Places> = LazyLock::new(|| {
    let cores = available_parallelism().map_or(1, NonZero::get);
    Places::new(cores, Busy::Cores)
});

/// Compute something for a caller on a thread of its own.
pub(super) async fn run<T: Send + 'static>(
    caller: &Caller,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Problem> {
    CORES.run(caller, work).await
}

/// How much work of one kind is done at once.
///
/// A place that becomes free is for whoever has waited longest, but of each owner only one request waits for that; the
/// others stand in line behind it. Thus nobody waits for all that another has asked for.
#[derive(Clone)]
pub(super) struct Places {
    free: Arc<Semaphore>,
    lines: Arc<Mutex<HashMap<Option<Owner>, Line>>>,
    /// What is said to those who get none in time.
    busy: Busy,
}

/// Whose turn it is among the requests of one owner.
type Line = Arc<tokio::sync::Mutex<()>>;

/// One of these places, until the last clone is dropped.
#[derive(Clone)]
pub(super) struct Place(#[expect(dead_code, reason = "held")] Arc<OwnedSemaphorePermit>);

impl Places {
    pub(super) fn new(count: usize, busy: Busy) -> Self {
        Self {
            free: Arc::new(Semaphore::new(count)),
            lines: Arc::default(),
            busy,
        }
    }

    /// Do `work` on a thread of its own once there is a place for it.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        caller: &Caller,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let place = self.take(caller, PATIENCE).await;
        place.ok_or(Problem::Busy(self.busy))?.run(work).await
    }

    /// A place, if there is one within `patience`.
    pub(super) async fn take(&self, caller: &Caller, patience: Duration) -> Option<Place> {
        tokio::time::timeout(patience, self.next(caller)).await.ok()
    }

    /// A place, as soon as there is one.
    pub(super) async fn next(&self, caller: &Caller) -> Place {
        let line = self.line(caller.owner.as_ref());
        let _turn = line.lock().await;
        let place = self.free.clone().acquire_owned().await;
        Place(Arc::new(place.expect("nobody closes it")))
    }

    fn line(&self, owner: Option<&Owner>) -> Line {
        let mut lines = self.lines.lock();
        if let Some(line) = lines.get(&owner.cloned()) {
            return line.clone();
        }
        // Lines in which nobody stands are forgotten.
        lines.retain(|_, line| Arc::strong_count(line) > 1);
        lines.entry(owner.cloned()).or_default().clone()
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
        let caller = &Caller::ANYBODY;
        assert_eq!(places.run(caller, || 7).await.ok(), Some(7));
        let held = places.take(caller, PATIENCE).await.expect("it is free");
        let begin = tokio::time::Instant::now();
        let refused = places.run(caller, || 7).await;
        assert!(matches!(refused, Err(Problem::Busy(Busy::Cores))));
        assert_eq!(begin.elapsed().as_secs(), PATIENCE.as_secs());
        drop(held);
        assert_eq!(places.run(caller, || 7).await.ok(), Some(7));
    }

    #[tokio::test]
    async fn work_keeps_its_place_when_its_caller_has_gone() {
        let places = Places::new(1, Busy::Cores);
        let (let_go, waits) = std::sync::mpsc::channel::<()>();
        {
            let mut work = Box::pin(places.run(&Caller::ANYBODY, move || waits.recv()));
            assert!(futures_util::poll!(&mut work).is_pending());
        }
        let soon = places.take(&Caller::ANYBODY, Duration::ZERO);
        assert!(soon.await.is_none());
        drop(let_go);
        let later = places.take(&Caller::ANYBODY, PATIENCE);
        assert!(later.await.is_some());
    }

    fn owner(name: &str) -> Caller {
        Caller {
            owner: Some(name.to_owned()),
            ..Caller::ANYBODY
        }
    }

    #[tokio::test]
    async fn nobody_waits_for_all_that_another_has_asked_for() {
        let places = Places::new(1, Busy::Cores);
        let (one, other) = (owner("one"), owner("other"));
        let mut held = places.next(&one).await;
        let [mut first, mut second, mut third] = [(); 3].map(|()| Box::pin(places.next(&one)));
        let mut others = Box::pin(places.next(&other));
        assert!(futures_util::poll!(&mut first).is_pending());
        assert!(futures_util::poll!(&mut second).is_pending());
        assert!(futures_util::poll!(&mut third).is_pending());
        assert!(futures_util::poll!(&mut others).is_pending());
        for next in [&mut first, &mut others, &mut second, &mut third] {
            drop(held);
            held = next.await;
        }
    }

    #[tokio::test]
    async fn whoever_stops_waiting_holds_up_nobody() {
        let places = Places::new(1, Busy::Cores);
        let one = owner("one");
        let held = places.next(&one).await;
        let mut gone = Box::pin(places.next(&one));
        assert!(futures_util::poll!(&mut gone).is_pending());
        let mut next = Box::pin(places.next(&one));
        assert!(futures_util::poll!(&mut next).is_pending());
        drop((held, gone));
        drop(next.await);
        places.next(&owner("other")).await;
        assert_eq!(places.lines.lock().len(), 1, "forgotten");
    }
}
