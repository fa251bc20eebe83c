//! `?rate=`: thins a fast run to a maximum number of points a second.
//!
//! Time is divided into windows by the events' own `elapsed_ms`, so that a reader who resumes gets the same windows. Of
//! each window the latest convergence and the latest incumbent remain; they are sent in the order of their ids when the
//! window closes: at the first event beyond it, at a status or the end, or when [`Throttle::release`] is called because
//! nothing more seems to come. What comes of that window all the same counts for the next.

use crate::job::{Event, NumberedEvent};

/// Thins a sequence of events.
#[derive(Debug)]
pub(super) struct Throttle {
    /// `None` lets everything pass.
    window_ms: Option<f64>,
    /// Which window the last event belongs to.
    window: u64,
    /// Events of that window have been sent.
    served: bool,
    convergence: Option<NumberedEvent>,
    incumbent: Option<NumberedEvent>,
}

impl Throttle {
    /// At most `rate_hz` events of each kind a second; 0 is no limit.
    pub(super) fn new(rate_hz: f64) -> Self {
        Self {
            window_ms: (rate_hz > 0.0).then(|| 1000.0 / rate_hz),
            window: 0,
            served: false,
            convergence: None,
            incumbent: None,
        }
    }

    /// Length of a window, milliseconds.
    pub(super) fn window_ms(&self) -> Option<f64> {
        self.window_ms
    }

    /// Whether events are being held back.
    pub(super) fn holds(&self) -> bool {
        self.convergence.is_some() || self.incumbent.is_some()
    }

    /// Whether events are held back whose window nothing has been sent of.
    pub(super) fn may_release(&self) -> bool {
        self.holds() && !self.served
    }

    /// Take the next event; events that may be sent are added to `out`.
    pub(super) fn push(&mut self, event: NumberedEvent, out: &mut Vec<NumberedEvent>) {
        let Some(window_ms) = self.window_ms else {
            out.push(event);
            return;
        };
        let (elapsed_ms, place) = match &event.event {
            Event::Convergence(point) => (point.elapsed_ms, &mut self.convergence),
            Event::Incumbent(incumbent) => (incumbent.elapsed_ms, &mut self.incumbent),
            Event::Status(_) | Event::End(_) => {
                self.flush(out);
                out.push(event);
                return;
            }
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a count of windows"
        )]
        let window = (elapsed_ms / window_ms) as u64;
        if window == self.window {
            *place = Some(event);
        } else {
            if !self.served {
                self.flush(out);
            }
            self.served = false;
            self.window = window;
            self.push(event, out);
        }
    }

    /// Send what is held, as if its window had closed.
    pub(super) fn release(&mut self, out: &mut Vec<NumberedEvent>) {
        self.flush(out);
        self.served = true;
    }

    /// Send what is held: nothing of its window follows.
    pub(super) fn flush(&mut self, out: &mut Vec<NumberedEvent>) {
        self.served = false;
        let mut held = [self.convergence.take(), self.incumbent.take()];
        held.sort_by_key(|event| event.as_ref().map(|event| event.id));
        out.extend(held.into_iter().flatten());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::document::{Convergence, Incumbent};
    use crate::job::Status;

    fn convergence(id: u64, elapsed_ms: f64) -> NumberedEvent {
        let event = Event::Convergence(Convergence {
            iteration: 0,
            evaluations: 0,
            elapsed_ms,
            best_cost: None,
            best_violation: 0.0,
            mean_cost: 0.0,
            feasible_fraction: 0.0,
        });
        NumberedEvent { id, event }
    }

    fn incumbent(id: u64, elapsed_ms: f64) -> NumberedEvent {
        let event = Event::Incumbent(Incumbent {
            iteration: 0,
            elapsed_ms,
            cost: 0.0,
            feasible: true,
            waypoints: Vec::new(),
        });
        NumberedEvent { id, event }
    }

    fn end(id: u64) -> NumberedEvent {
        let event = Event::End(Status::Succeeded);
        NumberedEvent { id, event }
    }

    fn check(rate_hz: f64, events: &[NumberedEvent], expected: &[u64]) {
        let mut throttle = Throttle::new(rate_hz);
        let mut out = Vec::new();
        for event in events {
            throttle.push(event.clone(), &mut out);
        }
        let ids: Vec<u64> = out.iter().map(|event| event.id).collect();
        assert_eq!(ids, expected, "at {rate_hz} Hz");
    }

    #[test]
    fn the_latest_event_of_each_kind_in_a_window_is_kept() {
        let events = [
            convergence(1, 0.0),
            incumbent(2, 10.0),
            convergence(3, 20.0),
            incumbent(4, 90.0),
            convergence(5, 99.0),
            convergence(6, 101.0),
            incumbent(7, 150.0),
            convergence(8, 160.0),
            convergence(9, 420.0),
            end(10),
        ];
        check(0.0, &events, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
        check(10.0, &events, &[4, 5, 7, 8, 9, 10]);
        check(2.0, &events, &[7, 9, 10]);
    }

    #[test]
    fn the_last_incumbent_is_never_dropped() {
        check(
            10.0,
            &[incumbent(1, 5.0), convergence(2, 6.0), end(3)],
            &[1, 2, 3],
        );
    }

    #[test]
    fn resuming_after_any_event_gives_the_same_windows() {
        let events: Vec<_> = (1..200)
            .map(|id| {
                let elapsed_ms = id as f64 * 7.3;
                if id % 5 == 0 {
                    incumbent(id, elapsed_ms)
                } else {
                    convergence(id, elapsed_ms)
                }
            })
            .chain([end(200)])
            .collect();
        let read = |after: usize| {
            let mut throttle = Throttle::new(10.0);
            let mut out = Vec::new();
            for event in &events[after..] {
                throttle.push(event.clone(), &mut out);
            }
            out.iter().map(|event| event.id).collect::<Vec<_>>()
        };
        let whole = read(0);
        for (position, id) in whole.iter().enumerate() {
            let rest = read(usize::try_from(*id).expect("small"));
            assert_eq!(rest, whole[position + 1..], "after {id}");
        }
    }

    #[test]
    fn what_comes_late_of_a_window_counts_for_the_next() {
        let mut throttle = Throttle::new(10.0);
        let mut ids = |release: bool, events: &[NumberedEvent]| {
            let mut out = Vec::new();
            for event in events {
                throttle.push(event.clone(), &mut out);
            }
            if release && throttle.may_release() {
                throttle.release(&mut out);
            }
            out.iter().map(|event| event.id).collect::<Vec<_>>()
        };
        assert_eq!(ids(true, &[convergence(1, 20.0)]), [1]);
        let late = [convergence(2, 30.0), incumbent(3, 80.0)];
        assert_eq!(ids(true, &late), [0; 0], "the window has been served");
        assert_eq!(ids(false, &[convergence(4, 110.0)]), [0; 0]);
        assert_eq!(ids(false, &[convergence(5, 210.0)]), [3, 4]);
        assert_eq!(ids(false, &[end(6)]), [5, 6]);
    }

    #[test]
    fn a_restarted_run_restarts_the_windows() {
        check(
            10.0,
            &[
                convergence(1, 950.0),
                convergence(2, 1.0),
                convergence(3, 120.0),
                end(4),
            ],
            &[1, 2, 3, 4],
        );
    }
}
