//! Newton's steps, damped so that each gains.

use super::equations::{Equations, advance};
use super::limits::Limits;
use super::merit::{Merit, Prices};
use super::{Newton, Place};

/// Steps at most.
const STEPS: usize = 12;

/// Tries to damp one step.
const TRIES: usize = 20;

/// A step that is expected to gain less than this share is none.
const NO_GAIN: f64 = 1e-10;

/// A step is taken if it gains this share of what was expected of it.
const TAKEN: f64 = 1e-3;

impl Newton<'_, '_> {
    /// Steps until none gains.
    pub(super) fn descend(
        &mut self,
        places: &mut Vec<Place>,
        limits: &Limits,
        prices: &Prices,
        damping: &mut f64,
    ) -> Merit {
        let mut merit = self.merit(places, limits, prices);
        let mut growth = 2.0;
        for _ in 0..STEPS {
            let Equations { matrix, down, .. } = self.equations(places, limits, prices);
            let mut gained = None;
            for _ in 0..TRIES {
                let Some(step) = matrix.solve(*damping, &down) else {
                    *damping *= growth;
                    growth *= 2.0;
                    continue;
                };
                let expected: f64 = step
                    .iter()
                    .zip(&down)
                    .map(|(step, down)| 0.5 * step * (*damping * step + down))
                    .sum();
                if expected < NO_GAIN * merit.value.abs() {
                    return merit;
                }
                let mut trial = places.clone();
                advance(&mut trial, &step);
                let next = self.merit(&trial, limits, prices);
                let ratio = (merit.value - next.value) / expected;
                if ratio > TAKEN {
                    gained = Some(ratio);
                    *places = trial;
                    merit = next;
                    break;
                }
                *damping *= growth;
                growth *= 2.0;
            }
            let Some(ratio) = gained else {
                break;
            };
            let cube = 2.0 * ratio - 1.0;
            *damping *= (1.0 - cube * cube * cube).clamp(0.2, 2.0);
            growth = 2.0;
        }
        merit
    }
}
