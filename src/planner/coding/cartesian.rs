//! A route as its waypoints: three numbers each, as in most planners before the spherical vector.
//!
//! A position holds N waypoints: x and y within the area, and the height above ground within the band, or within what
//! the ends additionally allow. Nothing is assumed about how one waypoint lies relative to the next.

use crate::cost::Model;
use crate::cost::batch::{LANES, PointRow};
use crate::geometry::{Point2, Point3};
use crate::optimizer::Bounds;
use crate::scenario::Scenario;

/// The coding of routes of one scenario.
#[derive(Debug, Clone)]
pub(in crate::planner) struct Cartesian<'s> {
    scenario: &'s Scenario,
    bounds: Bounds,
}

/// Numbers of one waypoint.
pub(in crate::planner) const PER_WAYPOINT: usize = 3;

impl<'s> Cartesian<'s> {
    /// The coding for routes of `scenario` with `waypoints` free waypoints.
    #[must_use]
    pub(in crate::planner) fn new(scenario: &'s Scenario, waypoints: usize) -> Self {
        let band = scenario.altitude;
        Self::within(scenario, waypoints, (band.min, band.max))
    }

    /// Also allows heights that only start and target have: lower or higher than the band.
    #[must_use]
    pub(in crate::planner) fn with_ends(model: &Model<'s>, waypoints: usize) -> Self {
        Self::within(model.scenario, waypoints, model.heights_anywhere())
    }

    fn within(scenario: &'s Scenario, waypoints: usize, (floor, ceiling): (f64, f64)) -> Self {
        let area = &scenario.area;
        Self {
            scenario,
            bounds: Bounds {
                lower: [area.min.x, area.min.y, floor].repeat(waypoints),
                upper: [area.max.x, area.max.y, ceiling].repeat(waypoints),
            },
        }
    }

    /// The bounds of positions.
    #[must_use]
    pub(in crate::planner) fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Write the route of `position` into `route`: start, free waypoints, target.
    pub(in crate::planner) fn decode(&self, position: &[f64], route: &mut Vec<Point3>) {
        route.clear();
        route.push(self.scenario.start);
        for waypoint in position.chunks_exact(PER_WAYPOINT) {
            let &[x, y, height] = waypoint else {
                unreachable!("chunks are of PER_WAYPOINT numbers")
            };
            let ground = self.scenario.terrain.elevation(Point2::new(x, y));
            route.push(Point3::new(x, y, ground + height));
        }
        route.push(self.scenario.target);
    }

    /// As `decode`, for as many positions as there are lanes, but with free waypoints' heights above ground.
    pub(in crate::planner) fn decode_lanes(
        &self,
        positions: [&[f64]; LANES],
        points: &mut Vec<PointRow>,
    ) {
        let waypoints = positions[0].len() / PER_WAYPOINT;
        points.clear();
        points.push(PointRow::splat(self.scenario.start));
        for first in (0..PER_WAYPOINT * waypoints).step_by(PER_WAYPOINT) {
            let mut row = PointRow::splat(Point3::origin());
            for (lane, position) in positions.iter().enumerate() {
                let waypoint = &position[first..first + PER_WAYPOINT];
                (row.x[lane], row.y[lane], row.z[lane]) = (waypoint[0], waypoint[1], waypoint[2]);
            }
            points.push(row);
        }
        points.push(PointRow::splat(self.scenario.target));
    }

    /// Write the position of `route` into `position`; values outside the bounds are clamped.
    pub(in crate::planner) fn encode(&self, route: &[Point3], position: &mut [f64]) {
        for (waypoint, point) in position.chunks_exact_mut(PER_WAYPOINT).zip(&route[1..]) {
            let ground = self.scenario.terrain.elevation(point.xy());
            waypoint.copy_from_slice(&[point.x, point.y, point.z - ground]);
        }
        self.bounds.clamp(position);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::scenario;
    use crate::terrain::{Flat, Terrain};

    #[test]
    fn a_position_holds_its_waypoints_above_ground() {
        let mut scenario = scenario();
        scenario.terrain = Terrain::Flat(Flat { elevation: 40.0 });
        let coding = Cartesian::new(&scenario, 2);
        assert_eq!(coding.bounds().lower, [0.0; 6]);
        assert_eq!(
            coding.bounds().upper,
            [1000.0, 1000.0, 200.0, 1000.0, 1000.0, 200.0]
        );
        let mut route = Vec::new();
        let given = [10.0, 20.0, 30.0, 400.0, 500.0, 60.0];
        coding.decode(&given, &mut route);
        let expected = [
            scenario.start,
            Point3::new(10.0, 20.0, 70.0),
            Point3::new(400.0, 500.0, 100.0),
            scenario.target,
        ];
        assert_eq!(route, expected);
        let mut position = [0.0; 6];
        coding.encode(&route, &mut position);
        for (encoded, given) in position.iter().zip(given) {
            assert!((encoded - given).abs() < 1e-9, "{encoded} for {given}");
        }
    }

    /// Where a vehicle takes off below the band, waypoints may also lie below it.
    #[test]
    fn heights_allowed_only_near_the_ends_are_not_clamped() {
        let mut scenario = scenario();
        scenario.altitude.min = 100.0;
        let model = Model::new(&scenario);
        let low = scenario.start + (scenario.target - scenario.start) * 0.1;
        let route = [scenario.start, low, scenario.target];
        let (floor, ceiling) = model.heights_over(low.xy());
        assert!((floor..100.0).contains(&low.z), "{low}");
        let coding = Cartesian::with_ends(&model, 1);
        let bounds = coding.bounds();
        let heights = [bounds.lower[2], bounds.upper[2]].map(f64::to_bits);
        assert_eq!(heights, [floor, ceiling].map(f64::to_bits));
        let mut position = [0.0; 3];
        coding.encode(&route, &mut position);
        let mut decoded = Vec::new();
        coding.decode(&position, &mut decoded);
        assert_eq!(decoded, route);
    }
}
