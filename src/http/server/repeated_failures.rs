//! Repeated failures, logged in few lines.

use std::time::Duration;

use tokio::time::Instant;

/// Minimum pause between log lines.
const PAUSE: Duration = Duration::from_secs(10);

/// When the next line is due, and how many failures it covers.
#[derive(Debug, Default)]
pub(super) struct RepeatedFailures {
    last_line: Option<Instant>,
    since: u64,
}

impl RepeatedFailures {
    /// A failure at `now`. Returns the number of failures since the last line, if one is due.
    pub(super) fn count(&mut self, now: Instant) -> Option<u64> {
        self.since += 1;
        if self
            .last_line
            .is_some_and(|last_line| now < last_line + PAUSE)
        {
            return None;
        }
        self.last_line = Some(now);
        Some(std::mem::take(&mut self.since))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_failure_is_logged_at_once_and_later_ones_together() {
        let begin = Instant::now();
        let mut failures = RepeatedFailures::default();
        for (after_ms, expected) in [
            (0, Some(1)),
            (100, None),
            (9_999, None),
            (10_000, Some(3)),
            (10_100, None),
            (60_000, Some(2)),
        ] {
            let now = begin + Duration::from_millis(after_ms);
            assert_eq!(failures.count(now), expected, "after {after_ms} ms");
        }
    }
}
