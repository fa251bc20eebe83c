//! Routes as points in a box: what the numbers of a position mean.
//!
//! A coding says where positions may lie and computes the route of one. The table [`CODINGS`] says which algorithm
//! searches in which coding; the optimizers know none of them.

mod cartesian;
mod course;
mod lanes;
mod spherical;

pub(super) use cartesian::{Cartesian, PER_WAYPOINT};
pub(super) use course::Course;
pub(super) use spherical::Spherical;

use crate::cost::batch::{LANES, PointRow, Pricer, Row};
use crate::geometry::Point3;
use crate::optimizer::Bounds;
use crate::scenario::Scenario;

/// The coding of routes of one scenario.
#[derive(Debug, Clone)]
pub(super) enum Coding<'s> {
    /// Vectors relative to the course flown, closed onto the target; Eq. 16-22.
    Spherical(Spherical<'s>),
    /// The waypoints themselves.
    Cartesian(Cartesian<'s>),
    /// Vectors about the heading from start to target.
    Course(Course<'s>),
}

/// Makes the coding for a scenario and a number of free waypoints.
type Make = for<'s> fn(&'s Scenario, usize) -> Coding<'s>;

const SPHERICAL: Make =
    |scenario, waypoints| Coding::Spherical(Spherical::new(scenario, waypoints));
const CARTESIAN: Make =
    |scenario, waypoints| Coding::Cartesian(Cartesian::new(scenario, waypoints));
const COURSE: Make = |scenario, waypoints| Coding::Course(Course::new(scenario, waypoints));

/// The coding that each algorithm searches in, by the algorithm's name.
const CODINGS: &[(&str, Make)] = &[
    ("tms-sba", SPHERICAL),
    ("sba", SPHERICAL),
    ("spso", COURSE),
    ("ba", CARTESIAN),
    ("pso", CARTESIAN),
    ("abc", CARTESIAN),
];

impl<'s> Coding<'s> {
    /// The coding that the algorithm of `scenario` searches in, for routes with `waypoints` free waypoints.
    ///
    /// # Panics
    /// When that algorithm has no row in the table of codings.
    pub(super) fn of(scenario: &'s Scenario, waypoints: usize) -> Self {
        let named = |row: &&(&str, Make)| row.0 == scenario.planner.algorithm;
        let (_, make) = CODINGS
            .iter()
            .find(named)
            .expect("a test holds the table to have a row for every algorithm");
        make(scenario, waypoints)
    }

    /// The bounds of positions.
    pub(super) fn bounds(&self) -> &Bounds {
        match self {
            Self::Spherical(coding) => coding.bounds(),
            Self::Cartesian(coding) => coding.bounds(),
            Self::Course(coding) => coding.bounds(),
        }
    }

    /// Write the route of `position` into `route`: start, free waypoints, target.
    pub(super) fn decode(&self, position: &[f64], route: &mut Vec<Point3>) {
        match self {
            Self::Spherical(coding) => coding.decode(position, route),
            Self::Cartesian(coding) => coding.decode(position, route),
            Self::Course(coding) => coding.decode(position, route),
        }
    }

    /// As `decode`, for as many positions as there are lanes; the same within rounding. The elevation below free
    /// waypoints is written to `ground`.
    pub(super) fn decode_lanes(
        &self,
        positions: [&[f64]; LANES],
        pricer: &Pricer,
        points: &mut Vec<PointRow>,
        ground: &mut Vec<Row>,
    ) {
        match self {
            Self::Spherical(coding) => coding.decode_lanes(positions, points),
            Self::Cartesian(coding) => coding.decode_lanes(positions, points),
            Self::Course(coding) => {
                let mut route = Vec::new();
                points.resize(
                    positions[0].len() / 3 + 2,
                    PointRow::splat(Point3::origin()),
                );
                for (lane, position) in positions.into_iter().enumerate() {
                    coding.decode(position, &mut route);
                    for (row, point) in points.iter_mut().zip(&route) {
                        row.set(lane, *point);
                    }
                }
                let last = points.len() - 1;
                return pricer.ground(&points[1..last], ground);
            }
        }
        let last = points.len() - 1;
        pricer.raise(&mut points[1..last], ground);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Model;
    use crate::optimizer;
    use crate::planner::tests::scenario;
    use proptest::prelude::*;

    #[test]
    fn every_algorithm_has_one_coding() {
        for algorithm in optimizer::ALL {
            let rows = CODINGS.iter().filter(|row| row.0 == algorithm.name);
            assert_eq!(rows.count(), 1, "{}", algorithm.name);
        }
    }

    proptest! {
        /// For every coding and position: the ends are exact, the waypoint count is as requested, and all
        /// heights are within the band.
        #[test]
        fn every_position_decodes_to_a_route_within_the_band(
            shares in prop::collection::vec(0.0..=1.0f64, 3 * 13),
            waypoints in 1..=12_usize,
        ) {
            let mut scenario = scenario();
            scenario.planner.waypoints = waypoints;
            for (name, make) in CODINGS {
                let coding = make(&scenario, waypoints);
                let bounds = coding.bounds();
                let position: Vec<f64> = (0..bounds.dimension())
                    .map(|dim| bounds.lower[dim] + shares[dim] * bounds.range(dim))
                    .collect();
                let mut route = vec![scenario.target; 3];
                coding.decode(&position, &mut route);
                prop_assert_eq!(route.len(), waypoints + 2, "{}", name);
                prop_assert_eq!(route[0], scenario.start);
                prop_assert_eq!(route[waypoints + 1], scenario.target);
                let pricer = Pricer::new(
                    &Model::new(&scenario),
                    scenario.planner.quadrature,
                    Model::new(&scenario).tolerance,
                );
                let mut points = Vec::new();
                coding.decode_lanes([&position; LANES], &pricer, &mut points, &mut Vec::new());
                prop_assert_eq!(points.len(), route.len());
                for (row, point) in points.iter().zip(&route) {
                    for lane in 0..LANES {
                        let off = (row.get(lane) - point).norm();
                        prop_assert!(off <= 1e-8, "{}: {}", name, off);
                    }
                }
                for point in &route[1..=waypoints] {
                    let height = scenario.terrain.height_of(*point);
                    prop_assert!((-1e-9..=200.0 + 1e-9).contains(&height), "{}", name);
                }
            }
        }
    }
}
