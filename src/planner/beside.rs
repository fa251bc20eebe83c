//! Runs two things at a time: the proven bound is computed beside the search.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use super::{Stop, StopReason, why_stop};
use crate::scenario::Scenario;
use crate::seeding;

/// Pause between two looks at the stop, which only this thread may ask, while the bound is waited for.
const LOOK: Duration = Duration::from_millis(1);

/// Run `search`, and compute the bound of `scenario` on a thread of its own meanwhile.
///
/// The bound is the same as when computed alone. Only when the run ends early, be it while only the bound is left to
/// wait for, is the bound taken as far as it was proven by then. Where no thread can be had, it is computed afterwards.
pub(super) fn bounded(
    scenario: &Scenario,
    stop: &dyn Stop,
    search: impl FnOnce() -> StopReason,
) -> (StopReason, f64) {
    let is_stopped = || why_stop(scenario, stop).is_some();
    beside(is_stopped, search, |is_over| {
        seeding::lower_bound_until(scenario, is_over)
    })
}

/// The results of `search` and of `bound`, which is told when it is no longer wanted.
fn beside(
    is_stopped: impl Fn() -> bool,
    search: impl FnOnce() -> StopReason,
    bound: impl Fn(&dyn Fn() -> bool) -> f64 + Sync,
) -> (StopReason, f64) {
    let is_over = AtomicBool::new(false);
    let (is_over, bound) = (&is_over, &bound);
    thread::scope(|scope| {
        let (ending, ended) = mpsc::channel::<()>();
        let beside = thread::Builder::new()
            .name("bound".to_owned())
            .spawn_scoped(scope, move || {
                // However the bound ends, it is noticed at once.
                let _ending = ending;
                bound(&|| is_over.load(Ordering::Relaxed))
            });
        // However the search ends, even by a panic, nobody waits for a bound that is no longer wanted.
        let give_up = OnDrop(is_over);
        let reason = search();
        let is_done = matches!(reason, StopReason::Iterations | StopReason::Converged);
        let is_wanted = || is_done && !is_stopped();
        while is_wanted() && ended.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {}
        drop(give_up);
        let lower = match beside {
            Ok(beside) => beside
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            Err(_) => bound(&|| !is_wanted()),
        };
        (reason, lower)
    })
}

/// Sets a flag when dropped.
struct OnDrop<'f>(&'f AtomicBool);

impl Drop for OnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::planner::Nobody;
    use crate::planner::tests::scenario;

    /// With a search that takes no time, and with one that takes longer than the bound.
    #[test]
    fn the_bound_computed_beside_a_search_is_the_same_as_alone() {
        let scenario = scenario();
        let alone = seeding::lower_bound(&scenario);
        assert!(alone > 0.0);
        let (reason, lower) = bounded(&scenario, &Nobody, || StopReason::Iterations);
        assert_eq!(
            (reason, lower.to_bits()),
            (StopReason::Iterations, alone.to_bits())
        );
        let (_, lower) = bounded(&scenario, &Nobody, || {
            assert!(seeding::lower_bound(&scenario) >= alone);
            assert!(seeding::lower_bound(&scenario) >= alone);
            StopReason::Iterations
        });
        assert_eq!(lower.to_bits(), alone.to_bits());
    }

    /// A bound that is given up early is lower, but still proven.
    #[test]
    fn a_bound_that_is_given_up_is_still_a_lower_bound() {
        let scenario = scenario();
        let alone = seeding::lower_bound(&scenario);
        let straight = seeding::lower_bound_until(&scenario, &|| true);
        assert!(straight > 0.0 && straight <= alone);
        let (reason, lower) = bounded(&scenario, &Nobody, || StopReason::Cancelled);
        assert_eq!(reason, StopReason::Cancelled);
        assert!((straight..=alone).contains(&lower));
    }

    /// The search was done in time, as its reason says.
    #[test]
    fn a_stop_is_heard_while_only_the_bound_is_waited_for() {
        let looks = Cell::new(0);
        let is_stopped = || looks.replace(looks.get() + 1) >= 3;
        let endless = |is_over: &dyn Fn() -> bool| {
            while !is_over() {
                thread::yield_now();
            }
            7.0_f64
        };
        let (reason, lower) = beside(is_stopped, || StopReason::Iterations, endless);
        assert_eq!(reason, StopReason::Iterations);
        assert_eq!(lower.to_bits(), 7.0_f64.to_bits());
        assert!(looks.get() > 3);
    }

    #[test]
    fn a_panic_of_the_bound_is_propagated() {
        let panics = || {
            beside(
                || false,
                || StopReason::Iterations,
                |_| panic!("on purpose"),
            )
        };
        assert!(std::panic::catch_unwind(panics).is_err());
    }

    #[test]
    fn a_panic_of_the_search_is_propagated() {
        let scenario = scenario();
        let panics =
            std::panic::AssertUnwindSafe(|| bounded(&scenario, &Nobody, || panic!("on purpose")));
        assert!(std::panic::catch_unwind(panics).is_err());
    }
}
