//! How high a route is over a place: in the band, and where the vehicle can climb to.

use crate::geometry::{Point2, Point3};
use crate::scenario::Scenario;

/// `point` at that `share` of the band's height, or as near to it as the vehicle can climb straight from the start and to
/// the target, where a straight way joins them.
pub(super) fn lifted(scenario: &Scenario, point: Point2, share: f64) -> Point3 {
    let point = scenario.area.nearest(point);
    if is_steep(scenario) {
        return winding(scenario, point, share);
    }
    let mut lifted = above(scenario, point, share);
    for end in [scenario.start, scenario.target] {
        let reach = (point - end.xy()).norm() * steepest(scenario);
        lifted.z = lifted.z.clamp(end.z - reach, end.z + reach);
    }
    lifted
}

/// As [`lifted`], where ways wind and nobody knows how far the farther end is: only a straight leg to the nearer end
/// counts, and only where it keeps the band.
pub(super) fn winding(scenario: &Scenario, point: Point2, share: f64) -> Point3 {
    let wanted = above(scenario, point, share);
    let away = |end: &Point3| (point - end.xy()).norm();
    let [start, target] = [scenario.start, scenario.target];
    let near = if away(&start) <= away(&target) {
        start
    } else {
        target
    };
    let reach = away(&near) * steepest(scenario);
    let ground = scenario.terrain.elevation(point);
    let reached = wanted.z.clamp(near.z - reach, near.z + reach).max(ground);
    if reached > ground + scenario.altitude.max {
        return wanted;
    }
    Point3::new(point.x, point.y, reached)
}

/// Above `point` at that `share` of the band's height.
fn above(scenario: &Scenario, point: Point2, share: f64) -> Point3 {
    let band = scenario.altitude;
    let height = band.min + share * (band.max - band.min);
    Point3::new(point.x, point.y, scenario.terrain.elevation(point) + height)
}

/// Whether one end is so far above the other that the straight way is too steep to fly.
pub(super) fn is_steep(scenario: &Scenario) -> bool {
    let way = scenario.target - scenario.start;
    way.z.abs() > way.xy().norm() * steepest(scenario)
}

/// Metres that the vehicle may climb per metre seen from above, less a hair.
pub(in crate::planner) fn steepest(scenario: &Scenario) -> f64 {
    scenario.vehicle.steepest() * (1.0 - 1e-9)
}
