//! Routes with exactly the requested number of waypoints.

use super::{spare, surplus};
use crate::cost::Model;
use crate::geometry::Point3;

/// `route` with exactly `waypoints` free waypoints.
pub(in crate::planner) fn with_waypoints(
    model: &Model,
    mut route: Vec<Point3>,
    waypoints: usize,
) -> Vec<Point3> {
    surplus::leave_out(model, &mut route, waypoints);
    spare::fill(model, route, waypoints)
}
