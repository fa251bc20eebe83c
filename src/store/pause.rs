//! How long others go before a plan that could not be run.

use std::time::Duration;

/// After its first run.
const FIRST: Duration = Duration::from_secs(10);

/// How often that is doubled, at most: plans that are tried for some seconds each leave most of the time to others, as
/// long as there are no more than dozens of them for each worker.
const MOST_DOUBLINGS: u64 = 5;

/// After its run of this number, counted from 1.
pub(super) fn pause_after(attempt: u64) -> Duration {
    FIRST * (1 << attempt.saturating_sub(1).min(MOST_DOUBLINGS))
}
