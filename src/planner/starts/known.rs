//! A known route as a start.

use crate::cost::Model;
use crate::geometry::Point3;
use crate::scenario::WarmStart;

/// The route that the request gives to start from, if it gives one.
pub(in crate::planner) fn given(model: &Model) -> Option<Vec<Point3>> {
    match &model.scenario.planner.warm_start {
        Some(WarmStart::Waypoints(points)) => Some(route(model, points)),
        Some(WarmStart::Plan(_)) | None => None,
    }
}

/// From start to target through `points`, which may include the ends; points outside the area or the allowed heights
/// are brought inside.
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
    let inside = |point: &Point3| {
        let at = scenario.area.nearest(point.xy());
        let ground = scenario.terrain.elevation(at);
        let (floor, ceiling) = model.heights_over(at);
        Point3::new(at.x, at.y, point.z.clamp(ground + floor, ground + ceiling))
    };
    std::iter::once(scenario.start)
        .chain(free.iter().map(inside))
        .chain(std::iter::once(scenario.target))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::scenario;
    use crate::scenario::AltitudeBand;

    /// A climb from the ground to a band that starts at 100 m, and a point far from the start that is too low.
    #[test]
    fn a_known_climb_to_the_band_is_kept() {
        let mut scenario = scenario();
        scenario.start.z = 0.0;
        scenario.altitude = AltitudeBand {
            min: 100.0,
            max: 200.0,
        };
        let model = Model::new(&scenario);
        let way = (scenario.target - scenario.start).xy().normalize();
        let at = |metres: f64, z: f64| {
            let at = scenario.start.xy() + way * metres;
            Point3::new(at.x, at.y, z)
        };
        let route = route(&model, &[at(30.0, 30.0), at(400.0, 30.0)]);
        assert!((route[1].z - 30.0).abs() < 1e-9 && (route[2].z - 100.0).abs() < 1e-9);
    }
}
