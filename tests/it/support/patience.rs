//! How long tests wait. No test measures the machine's speed: slow is allowed, only hanging fails.

use std::panic::Location;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Far longer than anything takes on any machine; what has not happened by then hangs.
pub(crate) const PATIENCE: Duration = Duration::from_secs(600);

/// The pause between two checks.
const PAUSE: Duration = Duration::from_millis(20);

/// The result of `wait`. A test that hangs fails here.
#[track_caller]
pub(crate) fn in_time<T>(wait: impl Future<Output = T>) -> impl Future<Output = T> {
    let caller = Location::caller();
    async move {
        let waited = tokio::time::timeout(PATIENCE, wait).await;
        waited.unwrap_or_else(|_| panic!("{caller}: still waiting after {PATIENCE:?}"))
    }
}

/// Waits until `is_so` returns true.
#[track_caller]
pub(crate) fn eventually(is_so: impl AsyncFn() -> bool) -> impl Future<Output = ()> {
    in_time(async move {
        while !is_so().await {
            tokio::time::sleep(PAUSE).await;
        }
    })
}

/// Runs work that costs far less processor time than this on one thread, unless its cost grows faster than its input.
#[track_caller]
pub(crate) fn at_little_cost<T>(work: impl FnOnce() -> T) -> T {
    const MOST: Duration = Duration::from_secs(5);
    let cost = || {
        let now = clock_gettime(ClockId::ThreadCPUTime);
        Duration::try_from(now).expect("a time since the thread began")
    };
    let before = cost();
    let done = work();
    let taken = cost().saturating_sub(before);
    assert!(taken < MOST, "it took {taken:?} of a processor");
    done
}
