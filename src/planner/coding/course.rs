//! The spherical vectors of SPSO: legs about the heading from start to target.
//!
//! M. D. Phung and Q. P. Ha, *Safety-enhanced UAV path planning with spherical vector-based particle
//! swarm optimization*, Applied Soft Computing 107, 2021.
//!
//! A position holds N vectors, three numbers each: the amplitude `r` in [0, 2 |ST| / N], the
//! elevation `psi` from the level and the azimuth `phi` from the heading start to target, both
//! within 45 degrees. Angles are absolute: a leg does not know the one before it. The chain ends at
//! the N-th waypoint, and the last leg, which no vector codes, goes straight from there to the
//! target; its length and turn are left to the search. Waypoints are held to the area and the band
//! as the chain is laid, and the next vector starts from there, as in the published code.
//!
//! Deviation: the published code lays `x` along the sine and `y` along the cosine of an azimuth
//! measured by `atan2(y, x)`, which mirrors the sector about 45 degrees and leaves a target due east
//! outside of it. Here the sector lies about the heading that the text gives. Heights are above ground
//! there too.

use crate::geometry::{Point2, Point3};
use crate::optimizer::Bounds;
use crate::scenario::Scenario;

/// The coding of routes of one scenario.
#[derive(Debug, Clone)]
pub(in crate::planner) struct Course<'s> {
    scenario: &'s Scenario,
    /// Heading from start to target, radians.
    towards_target: f64,
    /// Height of the start above ground.
    start_height: f64,
    bounds: Bounds,
}

/// Numbers of one vector.
const PER_LEG: usize = 3;

/// How far a leg may point from the level, and from the course.
const SECTOR: f64 = std::f64::consts::FRAC_PI_4;

impl<'s> Course<'s> {
    /// The coding for routes of `scenario` with so many `legs`, each a vector.
    #[must_use]
    pub(in crate::planner) fn new(scenario: &'s Scenario, legs: usize) -> Self {
        let way = scenario.target - scenario.start;
        let amplitude = 2.0 * way.norm() / legs as f64;
        Self {
            scenario,
            towards_target: libm::atan2(way.y, way.x),
            start_height: scenario.terrain.height_of(scenario.start),
            bounds: Bounds {
                lower: [0.0, -SECTOR, -SECTOR].repeat(legs),
                upper: [amplitude, SECTOR, SECTOR].repeat(legs),
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
        let (area, band) = (&self.scenario.area, self.scenario.altitude);
        let start = self.scenario.start;
        let (mut x, mut y, mut height) = (start.x, start.y, self.start_height);
        route.clear();
        route.push(start);
        for vector in position.chunks_exact(PER_LEG) {
            let &[amplitude, elevation, azimuth] = vector else {
                unreachable!("chunks are of PER_LEG numbers")
            };
            let level = amplitude * libm::cos(elevation);
            let heading = self.towards_target + azimuth;
            x = (x + level * libm::cos(heading)).clamp(area.min.x, area.max.x);
            y = (y + level * libm::sin(heading)).clamp(area.min.y, area.max.y);
            height = (height + amplitude * libm::sin(elevation)).clamp(band.min, band.max);
            let ground = self.scenario.terrain.elevation(Point2::new(x, y));
            route.push(Point3::new(x, y, ground + height));
        }
        route.push(self.scenario.target);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::scenario;

    fn decode(coding: &Course, position: &[f64]) -> Vec<Point3> {
        let mut route = Vec::new();
        coding.decode(position, &mut route);
        route
    }

    /// A target due east: outside the mirrored sector, in the middle of this coding's sector.
    #[test]
    fn zero_angles_lead_straight_to_the_target() {
        let mut scenario = scenario();
        scenario.start = Point3::new(100.0, 500.0, 50.0);
        scenario.target = Point3::new(900.0, 500.0, 50.0);
        let coding = Course::new(&scenario, 3);
        assert!((coding.bounds().upper[0] - 2.0 * 800.0 / 3.0).abs() < 1e-9);
        let route = decode(&coding, &[200.0, 0.0, 0.0].repeat(3));
        for (idx, point) in route.iter().enumerate() {
            let expected = Point3::new(100.0 + 200.0 * idx as f64, 500.0, 50.0);
            assert!((point - expected).norm() < 1e-9, "{point}");
        }
        // Left of the course is north, and up is up.
        let route = decode(&coding, &[100.0, 0.3, SECTOR].repeat(3));
        let level = 100.0 * libm::cos(0.3) * libm::cos(SECTOR);
        let first = Point3::new(100.0 + level, 500.0 + level, 50.0 + 100.0 * libm::sin(0.3));
        assert!((route[1] - first).norm() < 1e-9, "{}", route[1]);
    }

    #[test]
    fn the_chain_is_kept_within_area_and_band() {
        let scenario = scenario();
        let coding = Course::new(&scenario, 2);
        let longest = coding.bounds().upper[0];
        let route = decode(&coding, &[longest, SECTOR, SECTOR].repeat(2));
        for point in &route[1..3] {
            assert!(point.y <= 1000.0 && point.z <= 200.0, "{point}");
        }
        assert!((route[2].y - 1000.0).abs() < 1e-9);
    }
}
