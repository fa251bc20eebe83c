//! How long a test waits. No test measures its machine: what is slow comes late, what hangs is told apart.

use std::panic::Location;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Far more than anything takes, on however slow a machine; what has not come by then hangs.
pub(crate) const PATIENCE: Duration = Duration::from_secs(600);

/// How long to leave alone what was found not to be so yet.
const PAUSE: Duration = Duration::from_millis(20);

/// What `wait` comes to. A test that hangs fails here.
#[track_caller]
pub(crate) fn in_time<T>(wait: impl Future<Output = T>) -> impl Future<Output = T> {
    let caller = Location::caller();
    async move {
        let waited = tokio::time::timeout(PATIENCE, wait).await;
        waited.unwrap_or_else(|_| panic!("{caller}: still waiting after {PATIENCE:?}"))
    }
}

/// Ask until it is so.
#[track_caller]
pub(crate) fn eventually(is_so: impl AsyncFn() -> bool) -> impl Future<Output = ()> {
    in_time(async move {
        while !is_so().await {
            tokio::time::sleep(PAUSE).await;
        }
    })
}

/// Do what costs far less of a processor than this, on one thread, unless its cost grows faster than its input.
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
