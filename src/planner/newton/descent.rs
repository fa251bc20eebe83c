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
const NO_GAIN: f64 = 3e-7;

/// No step is damped less,
const LEAST_DAMPING: f64 = 1e-4;

/// and the cost counts as bending with each coordinate by this much more, in metres flown over the hundredth of the way.
const SOFT: f64 = 1e-2;

/// A step that gains this many times what was expected of it is gone on along, for so many doublings at most.
const AHEAD: f64 = 1.2;
const DOUBLINGS: usize = 12;

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
        let soft = SOFT * self.dear();
        for _ in 0..STEPS {
            let Equations {
                matrix,
                down,
                stiffness,
                ..
            } = self.equations(places, limits, prices);
            let shifts = |damping: f64| stiffness.iter().map(move |stiff| damping * (stiff + soft));
            let mut gained = None;
            for _ in 0..TRIES {
                let Some(step) = matrix.solve(shifts(*damping), &down) else {
                    *damping *= growth;
                    growth *= 2.0;
                    continue;
                };
                let expected: f64 = step
                    .iter()
                    .zip(&down)
                    .zip(shifts(*damping))
                    .map(|((step, down), shift)| 0.5 * step * (shift * step + down))
                    .sum();
                if expected < NO_GAIN * merit.value.abs() {
                    return merit;
                }
                let mut trial = places.clone();
                advance(&mut trial, &step);
                let next = self.merit(&trial, limits, prices);
                let ratio = (merit.value - next.value) / expected;
                if ratio > TAKEN {
                    (*places, merit) = (trial, next);
                    if ratio > AHEAD {
                        self.go_on(places, &mut merit, &step, limits, prices);
                    }
                    gained = Some(ratio);
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
            *damping = damping.max(LEAST_DAMPING);
            growth = 2.0;
        }
        merit
    }

    /// Go on along `step`, twice as far each time, for as long as that gains.
    fn go_on(
        &mut self,
        places: &mut Vec<Place>,
        merit: &mut Merit,
        step: &[f64],
        limits: &Limits,
        prices: &Prices,
    ) {
        let mut step = step.to_vec();
        for _ in 0..DOUBLINGS {
            let mut trial = places.clone();
            advance(&mut trial, &step);
            let next = self.merit(&trial, limits, prices);
            if next.value >= merit.value {
                return;
            }
            (*places, *merit) = (trial, next);
            for part in &mut step {
                *part *= 2.0;
            }
        }
    }
}
