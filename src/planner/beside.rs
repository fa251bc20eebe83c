//! Runs two things at a time: the proven bound is computed beside the search.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use super::StopReason;
use crate::scenario::Scenario;
use crate::seeding;

/// Run `search`, and compute the bound of `scenario` on a thread of its own meanwhile.
///
/// The bound is the same as when computed alone. Only when a search ends early, as its reason shows, is the bound taken
/// as far as it was proven by then. Where no thread can be had, it is computed afterwards.
pub(super) fn bounded(
    scenario: &Scenario,
    search: impl FnOnce() -> StopReason,
) -> (StopReason, f64) {
    let is_over = AtomicBool::new(false);
    let bound = || seeding::lower_bound_until(scenario, &|| is_over.load(Ordering::Relaxed));
    thread::scope(|scope| {
        let beside = thread::Builder::new()
            .name("bound".to_owned())
            .spawn_scoped(scope, bound);
        // However the search ends, even by a panic, nobody waits for a bound that is no longer wanted.
        let give_up = OnDrop(&is_over);
        let reason = search();
        if matches!(reason, StopReason::Iterations | StopReason::Converged) {
            std::mem::forget(give_up);
        } else {
            drop(give_up);
        }
        let lower = match beside {
            Ok(beside) => beside
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            Err(_) => bound(),
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
    use super::*;
    use crate::planner::tests::scenario;

    /// With a search that takes no time, and with one that takes longer than the bound.
    #[test]
    fn the_bound_computed_beside_a_search_is_the_same_as_alone() {
        let scenario = scenario();
        let alone = seeding::lower_bound(&scenario);
        assert!(alone > 0.0);
        let (reason, lower) = bounded(&scenario, || StopReason::Iterations);
        assert_eq!(
            (reason, lower.to_bits()),
            (StopReason::Iterations, alone.to_bits())
        );
        let (_, lower) = bounded(&scenario, || {
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
        let (reason, lower) = bounded(&scenario, || StopReason::Cancelled);
        assert_eq!(reason, StopReason::Cancelled);
        assert!((straight..=alone).contains(&lower));
    }

    #[test]
    fn a_panic_of_the_search_is_propagated() {
        let scenario = scenario();
        let panics = std::panic::AssertUnwindSafe(|| bounded(&scenario, || panic!("on purpose")));
        assert!(std::panic::catch_unwind(panics).is_err());
    }
}
