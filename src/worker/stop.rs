//! How a run's thread learns that it must stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::planner::Stop;

/// How often a waiting thread checks whether it must stop.
const LOOK: Duration = Duration::from_millis(50);

/// Why a run must stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Reason {
    /// Somebody requested the end of the plan, and wants the best route so far.
    Cancelled = 1,
    /// Nobody wants its outcome: the plan will be run again, or is no longer this worker's.
    Abandoned = 2,
}

/// Shared by a run's thread and the code that may stop it.
#[derive(Debug, Default)]
pub(super) struct StopFlag(AtomicU8);

impl StopFlag {
    /// The first reason wins.
    pub(super) fn raise(&self, reason: Reason) {
        let _ = self
            .0
            .compare_exchange(0, reason as u8, Ordering::Relaxed, Ordering::Relaxed);
    }

    pub(super) fn is_abandoned(&self) -> bool {
        self.0.load(Ordering::Relaxed) == Reason::Abandoned as u8
    }

    fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed) != 0
    }

    /// Wait, but only until a stop; returns whether there is one.
    pub(super) fn is_raised_within(&self, pause: Duration) -> bool {
        let began = Instant::now();
        while !self.is_raised() {
            let left = pause.saturating_sub(began.elapsed());
            if left.is_zero() {
                return false;
            }
            thread::sleep(left.min(LOOK));
        }
        true
    }
}

/// What the planner asks whether it must stop, and how long it has been searching.
pub(super) struct Watch {
    pub(super) began: Instant,
    pub(super) stop: Arc<StopFlag>,
}

impl Stop for Watch {
    fn requested(&self) -> bool {
        self.stop.is_raised()
    }

    fn elapsed_ms(&self) -> f64 {
        self.began.elapsed().as_secs_f64() * 1_000.0
    }
}
