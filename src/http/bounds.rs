//! The bounds of plans whose partial results are asked for: each mostly takes up to a fifth of a second to compute and a
//! second at most, and callers ask again and again.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use crate::job::PlanId;
use crate::scenario::Scenario;
use crate::seeding::lower_bound_until;

/// What is not proven within this, among many threats and corners, is left to the plan's end.
const LONGEST: Duration = Duration::from_secs(1);

/// For so many plans a bound is remembered.
const MOST: usize = 256;

/// The bounds that were computed last.
#[derive(Debug, Clone, Default)]
pub struct Bounds(Arc<Mutex<VecDeque<(PlanId, f64)>>>);

impl Bounds {
    /// The bound of a plan of `scenario`, which is computed if it is not known.
    pub(super) fn of_plan(&self, id: PlanId, scenario: &Scenario) -> f64 {
        self.of(id, || {
            let began = Instant::now();
            lower_bound_until(scenario, &|| began.elapsed() >= LONGEST)
        })
    }

    fn of(&self, id: PlanId, compute: impl FnOnce() -> f64) -> f64 {
        if let Some(known) = self.known(id) {
            return known;
        }
        // Not under the lock. Two callers may compute the same.
        let bound = compute();
        let mut known = self.0.lock();
        if known.len() == MOST {
            known.pop_front();
        }
        known.push_back((id, bound));
        bound
    }

    fn known(&self, id: PlanId) -> Option<f64> {
        let known = self.0.lock();
        known
            .iter()
            .find(|(other, _)| *other == id)
            .map(|(_, bound)| *bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_computed_once_and_the_oldest_are_forgotten() {
        let bounds = Bounds::default();
        let ids: Vec<PlanId> = (0..=MOST as u128).map(PlanId::from_u128).collect();
        for (bound, id) in (0_u32..).zip(&ids) {
            assert!((bounds.of(*id, || f64::from(bound)) - f64::from(bound)).abs() < 1e-9);
        }
        let mut computed = 0;
        for id in [ids[MOST], ids[1], ids[0], ids[0]] {
            bounds.of(id, || {
                computed += 1;
                0.0
            });
        }
        assert_eq!(computed, 1);
    }
}
