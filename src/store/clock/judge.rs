//! Whether a clock is to be believed.

/// A clock that is ahead of or behind the elapsed time by more than this has jumped.
pub const TOLERANCE_MS: i64 = 60_000;

/// A clock that is in doubt is trusted again once it has run steadily for this long.
const PROBATION_MS: i64 = 60 * 60 * 1_000;

/// The end of the year 9999: a record of a later time is damaged.
const LATEST_MS: i64 = 253_402_300_799_999;

/// What to make of a look at the wall clock.
pub(super) struct Verdict {
    /// The time to go by.
    pub(super) now_ms: i64,
    /// Whether that is what the clock shows.
    pub(super) is_trusted: bool,
    /// See [`super::SteadyClock::reached_ms`].
    pub(super) reached_ms: Option<i64>,
}

/// Compares the wall clock with elapsed time. An origin is what the wall clock showed at elapsed time 0.
pub(super) struct Judge {
    /// As far as it is trusted.
    origin_ms: i64,
    /// Another origin that the clock has kept to, and since which elapsed time.
    doubtful: Option<(i64, i64)>,
    /// What is uncertain about the start, for an hour at most.
    start: Option<Start>,
}

/// A start that may have been at another time than the clock showed.
struct Start {
    /// The earliest that it can have been.
    earliest_ms: i64,
    /// The elapsed time since which the clock has been steady.
    steady_from_ms: i64,
}

impl Judge {
    pub(super) fn new(now_ms: i64) -> Self {
        Self {
            origin_ms: now_ms,
            doubtful: None,
            start: None,
        }
    }

    pub(super) fn look(&mut self, shown_ms: i64, passed_ms: i64) -> Verdict {
        let origin_ms = shown_ms.saturating_sub(passed_ms);
        let is_trusted = self.trusts(origin_ms, passed_ms);
        if is_trusted {
            // Clocks are slewed; small steps add up.
            self.origin_ms = origin_ms;
            self.doubtful = None;
            self.settle(passed_ms);
        }
        let start = self.start.as_ref();
        Verdict {
            now_ms: self.origin_ms.saturating_add(passed_ms),
            is_trusted,
            reached_ms: start.map(|start| start.earliest_ms.saturating_add(passed_ms)),
        }
    }

    fn trusts(&mut self, origin_ms: i64, passed_ms: i64) -> bool {
        if is_near(origin_ms, self.origin_ms) {
            if self.doubtful.is_some() {
                tracing::info!("the clock is where it was");
            }
            return true;
        }
        let jump_ms = origin_ms.saturating_sub(self.origin_ms);
        if let Some(start) = &mut self.start
            && origin_ms >= start.earliest_ms.saturating_sub(TOLERANCE_MS)
        {
            tracing::info!(
                jump_ms,
                "the clock was set soon after the start and is believed"
            );
            start.steady_from_ms = passed_ms;
            return true;
        }
        match self.doubtful {
            Some((kept_to, since_ms)) if is_near(origin_ms, kept_to) => {
                if passed_ms.saturating_sub(since_ms) < PROBATION_MS {
                    return false;
                }
                tracing::info!(
                    jump_ms,
                    "the clock has been steady since it jumped and is believed"
                );
                self.start = None;
                true
            }
            _ => {
                tracing::warn!(
                    jump_ms,
                    "the clock jumped; it is not believed until it has been steady for an hour"
                );
                self.doubtful = Some((origin_ms, passed_ms));
                false
            }
        }
    }

    /// Nothing is uncertain about the start any more once the clock has been steady for long, or is where it must be.
    fn settle(&mut self, passed_ms: i64) {
        let origin_ms = self.origin_ms;
        self.start.take_if(|start| {
            passed_ms.saturating_sub(start.steady_from_ms) >= PROBATION_MS
                || origin_ms <= start.earliest_ms.saturating_add(PROBATION_MS)
        });
    }

    /// See [`super::SteadyClock::has_seen`].
    pub(super) fn has_seen(&mut self, newest_ms: i64, shown_ms: i64, passed_ms: i64) {
        if passed_ms >= PROBATION_MS || newest_ms > LATEST_MS {
            return;
        }
        self.look(shown_ms, passed_ms);
        let earliest_ms = newest_ms.saturating_sub(passed_ms);
        let known_ms = self.start.as_ref().map(|start| start.earliest_ms);
        if known_ms.is_some_and(|known_ms| known_ms >= earliest_ms) {
            return;
        }
        let off_ms = self.origin_ms.saturating_sub(earliest_ms);
        let is_behind = off_ms < -TOLERANCE_MS;
        if is_behind {
            tracing::warn!(
                off_ms,
                "the clock is behind the newest record; it is not believed until it is past that, or has been steady for an hour"
            );
            self.origin_ms = earliest_ms;
            self.doubtful = Some((shown_ms.saturating_sub(passed_ms), passed_ms));
        } else if off_ms > PROBATION_MS {
            tracing::warn!(
                off_ms,
                "the clock is hours after the newest record; nothing expires until it has been steady for an hour"
            );
        }
        self.start = (is_behind || off_ms > PROBATION_MS).then_some(Start {
            earliest_ms,
            steady_from_ms: passed_ms,
        });
    }
}

fn is_near(origin_ms: i64, other_ms: i64) -> bool {
    origin_ms.saturating_sub(other_ms).saturating_abs() <= TOLERANCE_MS
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY_MS: i64 = 24 * 60 * 60 * 1_000;
    const YEAR_MS: i64 = 365 * DAY_MS;
    const BEGIN_MS: i64 = 1_800_000_000_000;

    /// The verdict `minutes` after the start, on a clock that is ahead by `ahead_ms`: how far what to go by is ahead, how
    /// far the clock is off, and how far ahead is what has been reached.
    fn judged(judge: &mut Judge, minutes: i64, ahead_ms: i64) -> (i64, Option<i64>, Option<i64>) {
        let passed_ms = 60_000 * minutes;
        let right_ms = BEGIN_MS + passed_ms;
        let shown_ms = right_ms + ahead_ms;
        let verdict = judge.look(shown_ms, passed_ms);
        let off_ms = shown_ms - verdict.now_ms;
        let ahead = |ms: i64| ms - right_ms;
        (
            ahead(verdict.now_ms),
            (!verdict.is_trusted).then_some(off_ms),
            verdict.reached_ms.map(ahead),
        )
    }

    /// On a clock that is ahead by `ahead_ms` at the start, where the newest record is of `off_ms` before it.
    fn begun(ahead_ms: i64, off_ms: i64) -> Judge {
        let mut judge = Judge::new(BEGIN_MS + ahead_ms);
        judge.has_seen(BEGIN_MS - off_ms, BEGIN_MS + ahead_ms, 0);
        judge
    }

    #[test]
    fn a_clock_that_jumped_is_trusted_after_an_hour() {
        for jump_ms in [YEAR_MS, -YEAR_MS, 61_000] {
            let mut judge = Judge::new(BEGIN_MS);
            assert_eq!(
                judged(&mut judge, 1, 59_000),
                (59_000, None, None),
                "slewed"
            );
            for minutes in 2..62 {
                let told = judged(&mut judge, minutes, 59_000 + jump_ms);
                assert_eq!(
                    told,
                    (59_000, Some(jump_ms), None),
                    "after {minutes} minutes"
                );
            }
            let told = judged(&mut judge, 62, 59_000 + jump_ms);
            assert_eq!(told, (59_000 + jump_ms, None, None));
        }
    }

    #[test]
    fn a_clock_that_returns_is_trusted_at_once() {
        let mut judge = Judge::new(BEGIN_MS);
        assert_eq!(judged(&mut judge, 1, YEAR_MS), (0, Some(YEAR_MS), None));
        assert_eq!(
            judged(&mut judge, 2, 2 * YEAR_MS),
            (0, Some(2 * YEAR_MS), None)
        );
        assert_eq!(judged(&mut judge, 3, 0), (0, None, None));
    }

    #[test]
    fn nothing_is_uncertain_after_a_short_pause() {
        for off_ms in [-59_000, 0, PROBATION_MS] {
            let mut judge = begun(0, off_ms);
            assert_eq!(judged(&mut judge, 0, 0), (0, None, None), "{off_ms}");
            let told = judged(&mut judge, 1, YEAR_MS);
            assert_eq!(told, (0, Some(YEAR_MS), None), "{off_ms}: it jumps");
        }
    }

    #[test]
    fn a_clock_that_has_not_been_set_goes_on_from_the_newest_record() {
        let mut judge = begun(-YEAR_MS, DAY_MS);
        for minutes in 0..5 {
            let told = judged(&mut judge, minutes, -YEAR_MS);
            assert_eq!(told, (-DAY_MS, Some(DAY_MS - YEAR_MS), Some(-DAY_MS)));
        }
        // It is set: times are right at once, and for an hour more nothing expires that might not be due.
        for minutes in 5..65 {
            assert_eq!(judged(&mut judge, minutes, 0), (0, None, Some(-DAY_MS)));
        }
        assert_eq!(judged(&mut judge, 65, 0), (0, None, None));
        assert_eq!(judged(&mut judge, 66, YEAR_MS), (0, Some(YEAR_MS), None));
    }

    #[test]
    fn a_clock_that_stays_behind_the_newest_record_is_trusted_after_an_hour() {
        // Something was stamped while the clock was fast.
        let mut judge = begun(0, -YEAR_MS);
        for minutes in 0..60 {
            let told = judged(&mut judge, minutes, 0);
            assert_eq!(told, (YEAR_MS, Some(-YEAR_MS), Some(YEAR_MS)));
        }
        assert_eq!(judged(&mut judge, 60, 0), (0, None, None));
    }

    #[test]
    fn what_a_fast_clock_would_expire_stays_until_it_is_set() {
        let mut judge = begun(8 * DAY_MS, 60_000);
        for minutes in 0..50 {
            let told = judged(&mut judge, minutes, 8 * DAY_MS);
            assert_eq!(told, (8 * DAY_MS, None, Some(-60_000)));
        }
        assert_eq!(judged(&mut judge, 50, 0), (0, None, None));
    }

    #[test]
    fn after_a_long_pause_things_expire_within_an_hour() {
        let mut judge = begun(0, 8 * DAY_MS);
        for minutes in 0..60 {
            assert_eq!(judged(&mut judge, minutes, 0), (0, None, Some(-8 * DAY_MS)));
        }
        assert_eq!(judged(&mut judge, 60, 0), (0, None, None));
    }

    #[test]
    fn what_is_seen_later_is_older_or_damaged_changes_nothing() {
        let mut judge = begun(0, 8 * DAY_MS);
        judge.has_seen(BEGIN_MS - YEAR_MS, BEGIN_MS, 0);
        assert_eq!(judged(&mut judge, 0, 0), (0, None, Some(-8 * DAY_MS)));
        let mut judge = Judge::new(BEGIN_MS);
        judge.has_seen(i64::MAX, BEGIN_MS, 0);
        judge.has_seen(BEGIN_MS + YEAR_MS, BEGIN_MS + PROBATION_MS, PROBATION_MS);
        assert_eq!(judged(&mut judge, 61, 0), (0, None, None));
    }
}
