//! Whether a route may turn from one leg into the next.

use crate::cost::{Model, Tolerance};
use crate::geometry::{Vector2, wrap_angle};

/// Turns whose cosine is within this of the greatest turn's are not decided by the cosine.
const NEAR_LIMIT: f64 = 1e-9;

/// Cosines farther than this below it are those of turns that count as too far: no angle is nearer to
/// another than their cosines, and a tolerance is far less.
const SURELY_BEYOND: f64 = 1e-6;

/// The limit of turning.
#[derive(Clone, Copy)]
pub(super) struct Turns {
    tolerance: Tolerance,
    cos_turn: f64,
    max_turn_deg: f64,
}

impl Turns {
    /// For `model`, where turns count beyond `tolerance`.
    pub(super) fn new(model: &Model, tolerance: Tolerance) -> Self {
        let max_turn_deg = model.scenario.vehicle.max_turn_deg;
        Self {
            tolerance,
            cos_turn: model.scenario.vehicle.sharpest(),
            max_turn_deg,
        }
    }

    /// Whether a turn is surely within the limit.
    pub(super) fn allow(&self, before: Vector2, after: Vector2) -> bool {
        let dot = before.dot(&after);
        // Most turns are well within or far beyond.
        dot > self.cos_turn + NEAR_LIMIT
            || (dot > self.cos_turn - SURELY_BEYOND
                || before == Vector2::zeros()
                || after == Vector2::zeros())
                && self.excess(before, after) <= 0.0
    }

    /// Degrees beyond the turn limit from one unit vector to the next.
    pub(super) fn excess(&self, before: Vector2, after: Vector2) -> f64 {
        let dot = before.dot(&after);
        // Most turns are well within; a leg without heading does not turn.
        if dot > self.cos_turn + NEAR_LIMIT
            || before == Vector2::zeros()
            || after == Vector2::zeros()
        {
            return 0.0;
        }
        let turn = wrap_angle(libm::atan2(before.perp(&after), dot)).abs();
        let amount = turn.to_degrees() - self.max_turn_deg;
        if amount > self.tolerance.angle_deg {
            amount
        } else {
            0.0
        }
    }
}
