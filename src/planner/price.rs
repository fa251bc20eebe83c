//! The value of a route to the search.

use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Fitness;

/// Violations count from this share of the tolerance on, so that a delivered route is also feasible with others'
/// rounding.
pub(super) const PRICED_FROM: f64 = 0.5;

/// The fitness of `route`, which may be a part of one: its ends are not free waypoints.
pub(super) fn price(model: &Model, route: &[Point3]) -> Fitness {
    let mut violation = 0.0;
    let quadrature = model.scenario.planner.quadrature;
    let figures = model.assess(
        route,
        quadrature,
        model.tolerance.scaled(PRICED_FROM),
        |breach| {
            violation += breach.amount;
        },
    );
    Fitness {
        violation,
        cost: figures.total,
    }
}
