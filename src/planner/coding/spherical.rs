//! Eq. 16-22: a route as a chain of spherical vectors.
//!
//! A position holds N + 1 vectors, three numbers each: the amplitude `r`, the heading change `phi`
//! from the vector before, and the polar angle `psi` from the vertical. Their chain is decoded from
//! the start and closed onto the target by a planar similarity transform, so that every turn, the
//! last one too, stays the one that is coded. Heights are above ground (Eq. 22) and kept within the
//! band. As `phi` is measured from the course flown, so is `psi` from the glide flown: the one that
//! leads back to the middle of the band, where F3 is least, as steeply as the vehicle may. Measured
//! from the level, one leg's climb would move all waypoints after it.

use pulp::Arch;

use super::lanes::Chains;
use crate::cost::batch::{LANES, PointRow};
use crate::geometry::{LEVEL, Point2, Point3};
use crate::optimizer::Bounds;
use crate::scenario::Scenario;

/// The coding of routes of one scenario.
#[derive(Debug, Clone)]
pub(in crate::planner) struct Spherical<'s> {
    pub(super) scenario: &'s Scenario,
    /// Heading from start to target, radians.
    course: f64,
    /// Its cosine and sine.
    pub(super) toward: [f64; 2],
    /// Horizontal distance from start to target, metres.
    pub(super) distance: f64,
    /// Height of the start above ground.
    pub(super) start_height: f64,
    /// Tangent of the steepest climb.
    pub(super) steepest: f64,
    bounds: Bounds,
}

/// Numbers of one spherical vector.
const PER_LEG: usize = 3;

impl<'s> Spherical<'s> {
    /// The coding for routes of `scenario` with `waypoints` free waypoints.
    #[must_use]
    pub(in crate::planner) fn new(scenario: &'s Scenario, waypoints: usize) -> Self {
        let legs = waypoints + 1;
        let way = scenario.target - scenario.start;
        let distance = (way.x * way.x + way.y * way.y).sqrt();
        // Twice the length of a leg of the straight route.
        let amplitude = 2.0 * way.norm() / legs as f64;
        let max_turn = scenario.vehicle.max_turn();
        let max_climb = scenario.vehicle.max_climb();
        let level = std::f64::consts::FRAC_PI_2;
        let lower = [0.0, -max_turn, level - max_climb];
        let upper = [amplitude, max_turn, level + max_climb];
        let course = libm::atan2(way.y, way.x);
        Self {
            scenario,
            course,
            toward: [libm::cos(course), libm::sin(course)],
            distance,
            start_height: scenario.terrain.height_of(scenario.start),
            steepest: scenario.vehicle.steepest(),
            bounds: Bounds {
                lower: lower.repeat(legs),
                upper: upper.repeat(legs),
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
        let (start, target) = (self.scenario.start, self.scenario.target);
        route.clear();
        route.push(start);
        let (mut x, mut y, mut height, mut heading) = (0.0, 0.0, self.start_height, 0.0);
        let band = self.scenario.altitude;
        let middle = band.middle();
        for vector in position.chunks_exact(PER_LEG) {
            let &[amplitude, turn, polar] = vector else {
                unreachable!("chunks are of PER_LEG numbers")
            };
            heading += turn;
            let level = amplitude * libm::sin(polar);
            x += level * libm::cos(heading);
            y += level * libm::sin(heading);
            let steepest = level * self.steepest;
            let glide = (middle - height).clamp(-steepest, steepest);
            height = (height + glide + amplitude * libm::cos(polar)).clamp(band.min, band.max);
            route.push(Point3::new(x, y, height));
        }
        // Turn and stretch the chain so that its end comes to lie on the target.
        let reach = (x * x + y * y).sqrt();
        let (scale, rotation) = if reach < LEVEL {
            (1.0, self.course)
        } else {
            (self.distance / reach, self.course - libm::atan2(y, x))
        };
        let (sin, cos) = (libm::sin(rotation) * scale, libm::cos(rotation) * scale);
        let last = route.len() - 1;
        for point in &mut route[1..last] {
            let (x, y) = (
                start.x + point.x * cos - point.y * sin,
                start.y + point.x * sin + point.y * cos,
            );
            let ground = self.scenario.terrain.elevation(Point2::new(x, y));
            *point = Point3::new(x, y, ground + point.z);
        }
        route[last] = target;
    }

    /// As `decode`, for as many positions as there are lanes, but with free waypoints' heights above ground; the same
    /// within rounding.
    pub(in crate::planner) fn decode_lanes(
        &self,
        positions: [&[f64]; LANES],
        points: &mut Vec<PointRow>,
    ) {
        let legs = positions[0].len() / PER_LEG;
        points.clear();
        points.resize(legs + 1, PointRow::splat(self.scenario.start));
        Arch::new().dispatch(Chains {
            coding: self,
            positions,
            points,
        });
        points[legs] = PointRow::splat(self.scenario.target);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::turns;
    use crate::planner::tests::scenario;
    use proptest::prelude::*;

    proptest! {
        /// For every position: the ends are exact, the turns within the limit (the first leg's own direction is
        /// free), and the heights within the band.
        #[test]
        fn every_position_decodes_to_a_route_within_turn_and_band(shares in prop::collection::vec(0.0..1.0f64, 33)) {
            let scenario = scenario();
            let coding = Spherical::new(&scenario, 10);
            let bounds = coding.bounds().clone();
            let position: Vec<f64> = shares
                .iter()
                .enumerate()
                .map(|(dim, share)| bounds.lower[dim] + share * bounds.range(dim))
                .collect();
            let mut route = Vec::new();
            coding.decode(&position, &mut route);
            prop_assert_eq!(route.len(), 12);
            prop_assert_eq!(route[0], scenario.start);
            prop_assert_eq!(route[11], scenario.target);
            // Very short legs lose digits of their heading in the closing transform.
            let short = route.windows(2).any(|ends| (ends[1] - ends[0]).norm() < 1e-3);
            for turn in turns(&route) {
                prop_assert!(short || turn.abs().to_degrees() <= scenario.vehicle.max_turn_deg + 1e-6);
            }
            for point in &route[1..11] {
                let height = scenario.terrain.height_of(*point);
                prop_assert!((-1e-9..=200.0 + 1e-9).contains(&height));
            }
        }
    }
}
