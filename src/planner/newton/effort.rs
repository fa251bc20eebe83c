//! How much is tried to improve a route where limits shape it.

use super::{LOW, USUAL};
use crate::cost::Model;

/// How much is tried.
pub(super) struct Effort {
    /// Initial prices of breaches that a route is improved with.
    pub(super) rates: &'static [f64],
    /// Routes priced at most, in budgets of the bats.
    pub(super) budgets: u64,
    /// Rounds that a route may be too expensive in before it is given up.
    pub(super) patience: usize,
    /// Number of waypoints that may be put elsewhere.
    pub(super) spares: usize,
    /// Number of legs that each of them is tried on.
    pub(super) places: usize,
}

/// On level ground, where a turn limit alone can make a route too dear by a tenth.
const ON_LEVEL_GROUND: Effort = Effort {
    rates: &[USUAL, LOW],
    budgets: 3,
    patience: 1,
    spares: 2,
    places: 8,
};

/// Over hills, where all of that takes twice the time of a search and gains little.
const OVER_HILLS: Effort = Effort {
    rates: &[USUAL],
    budgets: 1,
    patience: 2,
    spares: 1,
    places: 4,
};

impl Effort {
    pub(super) fn of(model: &Model) -> &'static Self {
        if model.scenario.terrain.is_flat() {
            &ON_LEVEL_GROUND
        } else {
            &OVER_HILLS
        }
    }
}
