//! The value of a route to the search.

use crate::cost::batch::Pricer;
use crate::cost::{Model, Tolerance};
use crate::geometry::Point3;
use crate::optimizer::Fitness;

/// Violations count from this share of the tolerance on, so that a delivered route is also feasible with others'
/// rounding.
const PRICED_FROM: f64 = 0.5;

/// A route and its price.
pub(super) type Priced = (Fitness, Vec<Point3>);

/// What the search tolerates.
pub(super) fn search_tolerance(model: &Model) -> Tolerance {
    model.tolerance.scaled(PRICED_FROM)
}

/// What prices many routes or legs as [`price`] does one.
pub(super) fn pricer<'s>(model: &Model<'s>) -> Pricer<'s> {
    let quadrature = model.scenario.planner.quadrature;
    Pricer::new(model, quadrature, search_tolerance(model))
}

/// The fitness of `route`, which may be a part of one: its ends are not free waypoints.
pub(super) fn price(model: &Model, route: &[Point3]) -> Fitness {
    let mut violation = 0.0;
    let quadrature = model.scenario.planner.quadrature;
    let figures = model.assess(route, quadrature, search_tolerance(model), |breach| {
        violation += breach.amount;
    });
    Fitness {
        violation,
        cost: figures.total,
    }
}

/// The change in fitness when the part `new` of a route is flown in place of the part `old`. Turns count that have both
/// their legs in the part: where these lead to and from what changes, none is missed.
pub(super) fn change(model: &Model, old: &[Point3], new: &[Point3]) -> Fitness {
    let (old, new) = (price(model, old), price(model, new));
    Fitness {
        violation: new.violation - old.violation,
        cost: new.cost - old.cost,
    }
}
