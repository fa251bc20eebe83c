//! Repeated failures, logged in few lines.

use std::time::Duration;

use tokio::time::Instant;

/// Minimum pause between log lines.
const PAUSE: Duration = Duration::from_secs(10);

/// When the next line is due, and how many failures it covers.
#[derive(Debug, Default)]
pub(super) struct Complaints {
    told: Option<Instant>,
    untold: u64,
}

impl Complaints {
    /// A failure at `now`. Returns the number of failures since the last line, if one is due.
    pub(super) fn count(&mut self, now: Instant) -> Option<u64> {
        self.untold += 1;
        if self.told.is_some_and(|told| now < told + PAUSE) {
            return None;
        }
        self.told = Some(now);
        Some(std::mem::take(&mut self.untold))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_complaint_is_reported_and_later_ones_are_batched() {
        let begin = Instant::now();
        let mut complaints = Complaints::default();
        for (after_ms, expected) in [
            (0, Some(1)),
            (100, None),
            (9_999, None),
            (10_000, Some(3)),
            (10_100, None),
            (60_000, Some(2)),
        ] {
            let now = begin + Duration::from_millis(after_ms);
            assert_eq!(complaints.count(now), expected, "after {after_ms} ms");
        }
    }
}
