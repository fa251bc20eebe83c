//! A known route as one to start from.

use crate::cost::Model;
use crate::geometry::Point3;

/// From start to target through `points`, in which the ends may be named; points outside of the
/// area or the band are brought in.
pub(super) fn route(model: &Model, points: &[Point3]) -> Vec<Point3> {
    let scenario = model.scenario;
    let near =
        |point: &Point3, end: Point3| (point - end).norm() <= model.tolerance.length_m.max(1e-3);
    let mut free = points;
    if let Some((first, rest)) = free.split_first()
        && near(first, scenario.start)
    {
        free = rest;
    }
    if let Some((last, rest)) = free.split_last()
        && near(last, scenario.target)
    {
        free = rest;
    }
    let band = scenario.altitude;
    let inside = |point: &Point3| {
        let at = scenario.area.nearest(point.xy());
        let ground = scenario.terrain.elevation(at);
        Point3::new(
            at.x,
            at.y,
            point.z.clamp(ground + band.min, ground + band.max),
        )
    };
    std::iter::once(scenario.start)
        .chain(free.iter().map(inside))
        .chain(std::iter::once(scenario.target))
        .collect()
}
