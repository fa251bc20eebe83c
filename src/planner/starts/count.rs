//! Routes with exactly the requested number of waypoints.

use super::{spare, surplus};
use crate::cost::Model;
use crate::geometry::Point3;

/// `route` with exactly `waypoints` free waypoints.
pub(in crate::planner) fn with_waypoints(
    model: &Model,
    route: Vec<Point3>,
    waypoints: usize,
) -> Vec<Point3> {
    with_waypoints_until(model, route, waypoints, &|| false)
}

/// The same, where even a few legs take long to price: once `is_over`, those it lacks halve its longest legs.
pub(in crate::planner) fn with_waypoints_until(
    model: &Model,
    mut route: Vec<Point3>,
    waypoints: usize,
    is_over: &dyn Fn() -> bool,
) -> Vec<Point3> {
    surplus::leave_out(model, &mut route, waypoints);
    spare::fill(model, route, waypoints, is_over)
}
