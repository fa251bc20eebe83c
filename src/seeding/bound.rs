//! A cost that no route can undercut.

use crate::scenario::Scenario;

/// Covers the rounding of a sum of leg lengths, so that the bound holds in floating point too.
const ROUNDING: f64 = 1e-12;

/// A proven lower bound on the total cost of any route from start to target.
///
/// No route is shorter than the straight line, exposure and altitude cost are never negative, so
/// `w_fuel * fuel_per_km / 1000 * |ST|` bounds Eq. 1 from below.
#[must_use]
pub fn lower_bound(scenario: &Scenario) -> f64 {
    let straight = (scenario.target - scenario.start).norm();
    scenario.weights.fuel * scenario.vehicle.fuel_per_km / 1000.0 * straight * (1.0 - ROUNDING)
}
