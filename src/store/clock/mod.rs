//! The time, for timestamps and expiry.

mod judge;

use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use rustix::time::{ClockId, clock_gettime};

use judge::Judge;
pub use judge::TOLERANCE_MS;

/// Tells the time: milliseconds since 1970.
pub type Clock = Arc<dyn Fn() -> i64 + Send + Sync>;

/// The machine's clock.
#[must_use]
pub fn wall_clock() -> Clock {
    Arc::new(|| {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        i64::try_from(since.unwrap_or_default().as_millis()).unwrap_or(i64::MAX)
    })
}

/// 2026-01-01: no version of this program is older.
const FIRST_VERSION_MS: i64 = 1_767_225_600_000;

/// A clock that does not follow another when that one jumps, but continues from where it was until the other is back,
/// or has been steady for an hour. So nothing is stamped with a wrong time for long, and nothing expires before its
/// allotted time has passed.
///
/// What the other shows at the start is believed unless it is before what has been seen; see [`SteadyClock::has_seen`].
pub struct SteadyClock {
    followed: Clock,
    passed: Box<dyn Fn() -> Duration + Send + Sync>,
    judge: Mutex<Judge>,
}

impl SteadyClock {
    /// Follows `clock` from what it shows now, but begins no earlier than the first version of this program: a board
    /// without a battery starts in 1970.
    #[must_use]
    pub fn following(clock: Clock) -> Arc<Self> {
        let began = since_boot();
        let is_unset = clock() < FIRST_VERSION_MS;
        let steady = Self::beside(clock, move || since_boot().saturating_sub(began));
        if is_unset {
            steady.has_seen(FIRST_VERSION_MS);
        }
        steady
    }

    /// The same from whatever `clock` shows, where `passed` returns the time elapsed since now.
    #[must_use]
    pub fn beside(
        clock: Clock,
        passed: impl Fn() -> Duration + Send + Sync + 'static,
    ) -> Arc<Self> {
        Arc::new(Self {
            judge: Mutex::new(Judge::new(clock())),
            followed: clock,
            passed: Box::new(passed),
        })
    }

    /// Milliseconds since 1970.
    #[must_use]
    pub fn now_ms(&self) -> i64 {
        self.ask(Judge::look).now_ms
    }

    /// While it is uncertain how much time passed before the start: the time that has been reached in any case, by which
    /// things may expire.
    #[must_use]
    pub fn reached_ms(&self) -> Option<i64> {
        self.ask(Judge::look).reached_ms
    }

    /// What an operator should know of the followed clock while it is not believed.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        let (shown_ms, verdict) =
            self.ask(|judge, shown_ms, passed_ms| (shown_ms, judge.look(shown_ms, passed_ms)));
        if verdict.is_trusted {
            return None;
        }
        let off_ms = shown_ms.saturating_sub(verdict.now_ms);
        let what = if verdict.reached_ms.is_some() {
            format!("is {} ms behind the newest record", off_ms.saturating_abs())
        } else {
            format!("jumped by {off_ms} ms")
        };
        Some(format!("the clock {what} and is not believed for now"))
    }

    /// An earlier process has stamped something with this time. In the first hour of this one,
    /// - a clock that is before it has not been set yet: this one goes on from there, and follows the other as soon as it
    ///   shows a later time, or has been steady for an hour after all;
    /// - a clock that is hours after it may be right, since the service may have been off, or it may not: it is believed,
    ///   but until it has been steady for an hour nothing may expire by it; see [`SteadyClock::reached_ms`].
    pub fn has_seen(&self, newest_ms: i64) {
        self.ask(|judge, shown_ms, passed_ms| judge.has_seen(newest_ms, shown_ms, passed_ms));
    }

    /// For code that takes any clock.
    #[must_use]
    pub fn clock(self: &Arc<Self>) -> Clock {
        let clock = Arc::clone(self);
        Arc::new(move || clock.now_ms())
    }

    /// Ask the judge with what the followed clock shows and the time elapsed, milliseconds.
    fn ask<T>(&self, question: impl FnOnce(&mut Judge, i64, i64) -> T) -> T {
        let mut judge = self.judge.lock();
        let shown_ms = (self.followed)();
        let passed_ms = i64::try_from((self.passed)().as_millis()).unwrap_or(i64::MAX);
        question(&mut judge, shown_ms, passed_ms)
    }
}

/// A machine that sleeps has not jumped: where the system counts that time, it counts as elapsed.
fn since_boot() -> Duration {
    #[cfg(target_os = "linux")]
    const PASSING: ClockId = ClockId::Boottime;
    #[cfg(not(target_os = "linux"))]
    const PASSING: ClockId = ClockId::Monotonic;
    Duration::try_from(clock_gettime(PASSING)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_that_starts_in_1970_begins_with_the_first_version() {
        let clock = SteadyClock::following(Arc::new(|| 5_000));
        let begin_ms = clock.now_ms();
        assert!((FIRST_VERSION_MS..FIRST_VERSION_MS + 60_000).contains(&begin_ms));
        let warning = clock.warning().expect("it is not believed");
        assert!(warning.contains("ms behind the newest record"), "{warning}");
        assert_eq!(SteadyClock::following(wall_clock()).warning(), None);
    }
}
