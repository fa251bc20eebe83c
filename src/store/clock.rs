//! The time, for timestamps and expiry.

use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use rustix::time::{ClockId, clock_gettime};

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

/// A clock that is ahead of or behind the elapsed time by more than this has jumped.
pub const TOLERANCE_MS: i64 = 60_000;

/// A clock that has jumped is trusted again once it has run steadily for this long.
const PROBATION: Duration = Duration::from_secs(60 * 60);

/// A clock that does not follow another when that one jumps, but continues from where it was until the other is back,
/// or has been steady for an hour. So nothing is stamped with a wrong time for long, and nothing expires before its
/// allotted time has passed.
pub struct SteadyClock {
    followed: Clock,
    passed: Box<dyn Fn() -> Duration + Send + Sync>,
    judge: Mutex<Judge>,
}

impl SteadyClock {
    /// Follows `clock` from what it shows now.
    #[must_use]
    pub fn following(clock: Clock) -> Arc<Self> {
        let began = since_boot();
        Self::beside(clock, move || since_boot().saturating_sub(began))
    }

    /// The same, where `passed` returns the time elapsed since now.
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
        let (shown_ms, jump_ms) = self.look();
        shown_ms.saturating_sub(jump_ms.unwrap_or(0))
    }

    /// How far the followed clock has jumped, milliseconds, while it is not trusted.
    #[must_use]
    pub fn jump_ms(&self) -> Option<i64> {
        self.look().1
    }

    /// For code that takes any clock.
    #[must_use]
    pub fn clock(self: &Arc<Self>) -> Clock {
        let clock = Arc::clone(self);
        Arc::new(move || clock.now_ms())
    }

    /// What the followed clock shows, and how far off it is.
    fn look(&self) -> (i64, Option<i64>) {
        // The state is consistent after every look, so a panic leaves nothing wrong behind.
        let mut judge = self.judge.lock();
        let shown_ms = (self.followed)();
        (shown_ms, judge.jump_ms(shown_ms, (self.passed)()))
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

/// Compares the wall clock with elapsed time.
struct Judge {
    /// What the wall clock showed at elapsed time 0, as far as it is trusted.
    origin_ms: i64,
    /// Another origin that the clock has kept to, and since when.
    doubtful: Option<(i64, Duration)>,
}

impl Judge {
    fn new(now_ms: i64) -> Self {
        Self {
            origin_ms: now_ms,
            doubtful: None,
        }
    }

    /// How far the clock is from where it should be at this elapsed time, while it is not trusted.
    fn jump_ms(&mut self, now_ms: i64, passed: Duration) -> Option<i64> {
        let passed_ms = i64::try_from(passed.as_millis()).unwrap_or(i64::MAX);
        let origin_ms = now_ms.saturating_sub(passed_ms);
        let agrees = |other: i64| origin_ms.saturating_sub(other).saturating_abs() <= TOLERANCE_MS;
        if agrees(self.origin_ms) {
            // Clocks are slewed; small steps add up.
            self.origin_ms = origin_ms;
            if self.doubtful.take().is_some() {
                tracing::info!("the clock is where it was");
            }
            return None;
        }
        let jump_ms = origin_ms.saturating_sub(self.origin_ms);
        match self.doubtful {
            Some((kept_to, since)) if agrees(kept_to) => {
                if passed.saturating_sub(since) < PROBATION {
                    return Some(jump_ms);
                }
                tracing::info!(
                    jump_ms,
                    "the clock has been steady since it jumped and is believed"
                );
                self.origin_ms = origin_ms;
                self.doubtful = None;
                None
            }
            _ => {
                tracing::warn!(
                    jump_ms,
                    "the clock jumped; it is not believed until it has been steady for an hour"
                );
                self.doubtful = Some((origin_ms, passed));
                Some(jump_ms)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const YEAR_MS: i64 = 365 * 24 * 60 * 60 * 1_000;

    /// The judge's verdict `minutes` after the start, on a clock that is ahead by `ahead_ms`.
    fn judged(judge: &mut Judge, minutes: u64, ahead_ms: i64) -> Option<i64> {
        let passed = Duration::from_secs(60 * minutes);
        judge.jump_ms(
            1_000_000 + 60_000 * minutes.cast_signed() + ahead_ms,
            passed,
        )
    }

    #[test]
    fn a_clock_that_jumped_is_trusted_after_an_hour() {
        for jump_ms in [YEAR_MS, -YEAR_MS, 61_000] {
            let mut judge = Judge::new(1_000_000);
            assert_eq!(judged(&mut judge, 1, 59_000), None, "slewed");
            for minutes in 2..62 {
                let told = judged(&mut judge, minutes, 59_000 + jump_ms);
                assert_eq!(told, Some(jump_ms), "after {minutes} minutes");
            }
            assert_eq!(judged(&mut judge, 62, 59_000 + jump_ms), None);
        }
    }

    #[test]
    fn a_clock_that_returns_is_trusted_at_once() {
        let mut judge = Judge::new(1_000_000);
        assert_eq!(judged(&mut judge, 1, YEAR_MS), Some(YEAR_MS));
        assert_eq!(judged(&mut judge, 2, 2 * YEAR_MS), Some(2 * YEAR_MS));
        assert_eq!(judged(&mut judge, 3, 0), None);
    }
}
