//! Routes to start from.

mod count;
mod tangents;

pub use count::with_waypoints;
pub use tangents::Arc;

use crate::cost::Model;
use crate::geometry::{Point2, Point3};

/// The route with `waypoints` free waypoints along `arcs`, in the middle of the band where it can
/// be reached.
pub fn along(model: &Model, arcs: &[Arc], waypoints: usize) -> Vec<Point3> {
    let scenario = model.scenario;
    let corners = tangents::corners(scenario, arcs, waypoints);
    let mut route = vec![scenario.start];
    route.extend(corners.iter().map(|&corner| lifted(model, corner)));
    route.push(scenario.target);
    with_waypoints(model, route, waypoints)
}

/// `point` in the middle of the band, or as near to it as the vehicle can climb from the start and
/// to the target.
fn lifted(model: &Model, point: Point2) -> Point3 {
    let scenario = model.scenario;
    let rect = scenario.area;
    let point = Point2::new(
        point.x.clamp(rect.min.x, rect.max.x),
        point.y.clamp(rect.min.y, rect.max.y),
    );
    let steepest = libm::tan(scenario.vehicle.max_climb_deg.to_radians()) * (1.0 - 1e-9);
    let mut z =
        scenario.terrain.elevation(point) + 0.5 * (scenario.altitude.min + scenario.altitude.max);
    for end in [scenario.start, scenario.target] {
        let reach = (point - end.xy()).norm() * steepest;
        z = z.clamp(end.z - reach, end.z + reach);
    }
    Point3::new(point.x, point.y, z)
}

/// Where the search starts, best first, all with as many waypoints; empty for the plain algorithm.
pub fn routes(model: &Model) -> Vec<Vec<Point3>> {
    let settings = &model.scenario.planner;
    if settings.seeding == crate::scenario::Seeding::Random && settings.warm_start.is_none() {
        return Vec::new();
    }
    vec![along(model, &[], settings.waypoints.min(4))]
}
