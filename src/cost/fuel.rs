//! Eq. 2: fuel in proportion to the length flown.

use crate::scenario::{Scenario, Vehicle};

/// F1 of a route of `length` metres; at 1000 per kilometre, a metre costs 1.
pub(super) fn fuel(vehicle: &Vehicle, length: f64) -> f64 {
    vehicle.fuel_per_km / 1000.0 * length
}

/// What a metre flown adds to the cost, w1 F1.
#[must_use]
pub fn metre(scenario: &Scenario) -> f64 {
    scenario.weights.fuel * fuel(&scenario.vehicle, 1.0)
}
