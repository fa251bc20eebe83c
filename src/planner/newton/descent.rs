//! Newton's steps, damped so that each gains.

use super::equations::{Equations, advance};
use super::limits::Limits;
use super::merit::{Merit, Prices};
use super::{Newton, Place};

/// Maximum number of steps.
const STEPS: usize = 12;

/// Attempts to damp one step.
const TRIES: usize = 20;

/// A step that is expected to gain less than this share is not taken.
const NO_GAIN: f64 = 3e-7;

/// Least damping of a step.
const LEAST_DAMPING: f64 = 1e-4;

/// Extra curvature assumed for each coordinate, in metres flown over the hundredth of the way.
const SOFT: f64 = 1e-2;

/// A step that gains this many times what was expected is extended, for at most [`DOUBLINGS`] doublings.
const AHEAD: f64 = 1.2;
const DOUBLINGS: usize = 12;

/// A step is taken if it gains this share of what was expected.
const TAKEN: f64 = 1e-3;

impl Newton<'_, '_> {
    /// Take steps until none gains.
    pub(super) fn descend(
        &mut self,
        places: &mut Vec<Place>,
        limits: &Limits,
        prices: &Prices,
        damping: &mut f64,
    ) -> Merit {
        let mut merit = self.merit(places, limits, prices);
        for _ in 0..STEPS {
            if self.is_stopped() {
                break;
            }
            let equations = self.equations(places, limits, prices);
            let rules = (limits, prices);
            let Some(ratio) = self.step(&equations, places, &mut merit, rules, damping) else {
                break;
            };
            let cube = 2.0 * ratio - 1.0;
            *damping *= (1.0 - cube * cube * cube).clamp(0.2, 2.0);
            *damping = damping.max(LEAST_DAMPING);
        }
        merit
    }

    /// Damp a step until it gains, take it, and return its gain as a multiple of the expected one; `None` where too
    /// little is expected of any step.
    fn step(
        &mut self,
        equations: &Equations,
        places: &mut Vec<Place>,
        merit: &mut Merit,
        rules: (&Limits, &Prices),
        damping: &mut f64,
    ) -> Option<f64> {
        let soft = SOFT * self.dear();
        let mut growth = 2.0;
        for _ in 0..TRIES {
            if let Some((step, expected)) = equations.damped(*damping, soft) {
                if expected < NO_GAIN * merit.value.abs() {
                    return None;
                }
                let before = merit.value;
                if self.gains(&step, TAKEN * expected, places, merit, rules) {
                    let ratio = (before - merit.value) / expected;
                    if ratio > AHEAD {
                        self.go_on(step, places, merit, rules);
                    }
                    return Some(ratio);
                }
            }
            *damping *= growth;
            growth *= 2.0;
        }
        None
    }

    /// Go on along `step`, twice as far each time, for as long as that gains.
    fn go_on(
        &mut self,
        mut step: Vec<f64>,
        places: &mut Vec<Place>,
        merit: &mut Merit,
        rules: (&Limits, &Prices),
    ) {
        for _ in 0..DOUBLINGS {
            if !self.gains(&step, 0.0, places, merit, rules) {
                return;
            }
            for part in &mut step {
                *part *= 2.0;
            }
        }
    }

    /// Whether `step` gains more than `least`; if so it is taken.
    fn gains(
        &mut self,
        step: &[f64],
        least: f64,
        places: &mut Vec<Place>,
        merit: &mut Merit,
        (limits, prices): (&Limits, &Prices),
    ) -> bool {
        let mut trial = places.clone();
        advance(&mut trial, step);
        let next = self.merit(&trial, limits, prices);
        let gains = merit.value - next.value > least;
        if gains {
            (*places, *merit) = (trial, next);
        }
        gains
    }
}
