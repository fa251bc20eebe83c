//! The steps that a run has appended so far, so that the oldest steps can be deleted when there are too many events.

use std::collections::VecDeque;

/// A step that a run appended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Appended {
    /// Counts the steps of the run.
    pub(super) number: u64,
    /// Its sequence in the plans' stream.
    pub(super) sequence: u64,
    pub(super) events: u64,
    pub(super) bytes: u64,
}

/// The steps of a run that are still kept.
#[derive(Debug, Default)]
pub(super) struct RunSteps {
    steps: VecDeque<Appended>,
    events: u64,
    bytes: u64,
    /// Whether some have been deleted: the events of earlier runs of the plan go with them.
    has_forgotten: bool,
}

impl RunSteps {
    /// Add a step, unless it is there already: a retry appends again what was followed by a failure.
    pub(super) fn push(&mut self, step: Appended) {
        if self
            .steps
            .back()
            .is_some_and(|last| step.number <= last.number)
        {
            return;
        }
        self.events += step.events;
        self.bytes += step.bytes;
        self.steps.push_back(step);
    }

    /// Where the steps to keep begin, once there are half again as many events as `events_kept`, so that most steps do
    /// not cause a deletion on the servers.
    pub(super) fn excess(&self, events_kept: u64) -> Option<u64> {
        if self.events <= events_kept.saturating_add(events_kept / 2) {
            return None;
        }
        let mut left = self.events;
        let spare = self.steps.iter().take_while(|step| {
            left -= step.events;
            left >= events_kept
        });
        let first = spare.count();
        let first = self.steps.get(first).filter(|_| first > 0)?;
        Some(first.sequence)
    }

    /// Steps before this sequence are no longer kept.
    pub(super) fn forget_before(&mut self, sequence: u64) {
        self.has_forgotten = true;
        let spare = self.steps.partition_point(|step| step.sequence < sequence);
        for step in self.steps.drain(..spare) {
            self.events -= step.events;
            self.bytes -= step.bytes;
        }
    }

    /// Bytes of all kept events of the plan, once they are no longer the sum of what was written.
    pub(super) fn bytes_left(&self) -> Option<u64> {
        self.has_forgotten.then_some(self.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_events_are_kept_in_whole_steps() {
        let mut steps = RunSteps::default();
        for sequence in 1..=7 {
            assert_eq!(steps.excess(20), None);
            let step = Appended {
                number: sequence,
                sequence: 10 * sequence,
                events: 4,
                bytes: 100,
            };
            steps.push(step);
            steps.push(step);
        }
        assert_eq!((steps.excess(20), steps.bytes_left()), (None, None));
        steps.push(Appended {
            number: 8,
            sequence: 80,
            events: 4,
            bytes: 100,
        });
        assert_eq!(steps.excess(20), Some(40));
        steps.forget_before(40);
        assert_eq!((steps.events, steps.bytes_left()), (20, Some(500)));
        assert_eq!(steps.excess(20), None);
        // A single step above the limit is kept whole.
        steps.push(Appended {
            number: 9,
            sequence: 90,
            events: 256,
            bytes: 6_400,
        });
        assert_eq!(steps.excess(20), Some(90));
        steps.forget_before(90);
        assert_eq!((steps.events, steps.bytes_left()), (256, Some(6_400)));
        assert_eq!(steps.excess(20), None);
    }
}
