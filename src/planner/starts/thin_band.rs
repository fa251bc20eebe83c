//! Whether the band is thin for the ground below it, as for a vehicle that hides in the terrain or surveys it from nearby:
//! legs of a coarse net cut the ground there, and most of the ways that the band leaves are missed.

use super::net::Spots;
use crate::geometry::{Point2, Vector2};
use crate::scenario::Scenario;

/// A band is thin if the ground halfway along a leg lies off the straight line between the ground at its ends by more
/// than this share of what is beneath the middle of the band, on average.
const THIN: f64 = 0.3;

/// Whether the band of `scenario` is thin for legs between neighbouring `spots`.
pub(super) fn is_thin_band(scenario: &Scenario, spots: &Spots) -> bool {
    let half = 0.5 * spots.step;
    let ways = [Vector2::new(half, 0.0), Vector2::new(0.0, half)];
    let ground = |point: Point2| {
        let within = scenario.area.nearest(point);
        scenario.terrain.elevation(within)
    };
    let off_line = |&spot: &Point2| -> f64 {
        let off = |way: Vector2| ground(spot) - 0.5 * (ground(spot - way) + ground(spot + way));
        ways.map(|way| off(way).abs()).iter().sum()
    };
    let legs = (ways.len() * spots.points.len()) as f64;
    let off_line = spots.points.iter().map(off_line).sum::<f64>();
    let beneath = 0.5 * (scenario.altitude.max - scenario.altitude.min);
    off_line > THIN * beneath * legs
}

#[cfg(test)]
mod tests {
    use super::super::net;
    use super::*;
    use crate::geometry::Point3;
    use crate::planner::tests::scenario;
    use crate::planner::{Nobody, plan};
    use crate::scenario::{AltitudeBand, Seeding};
    use crate::terrain::{Grid, Terrain};

    /// A square kilometre with such ground.
    fn over(elevation: impl Fn(f64, f64) -> f64) -> Scenario {
        const NODES: usize = 51;
        let mut scenario = scenario();
        scenario.threats.clear();
        let place = |node: usize| 20.0 * node as f64;
        let node = |idx: usize| elevation(place(idx % NODES), place(idx / NODES));
        scenario.terrain = Terrain::Grid(Grid {
            origin: Point2::origin(),
            cell: 20.0,
            columns: NODES,
            rows: NODES,
            elevations: (0..NODES * NODES).map(node).collect(),
        });
        scenario.altitude = AltitudeBand {
            min: 10.0,
            max: 30.0,
        };
        let ends = [[100.0, 200.0], [900.0, 800.0]].map(|[x, y]| {
            let ground = scenario.terrain.elevation(Point2::new(x, y));
            Point3::new(x, y, ground + 20.0)
        });
        [scenario.start, scenario.target] = ends;
        scenario
    }

    /// Hills some 150 m apart, in rows that are not quite straight.
    fn rows_of_hills() -> Scenario {
        over(|x, y| {
            let one = 26.3 * libm::sin(x / 48.26 + y / 43.61);
            100.0 + one + 33.0 * libm::cos(x / 53.86 - y / 45.42)
        })
    }

    #[test]
    fn a_band_is_thin_over_rough_ground_and_not_over_a_slope() {
        let is_thin = |scenario: &Scenario| {
            let spots = net::spots(scenario, 320, 1.4);
            is_thin_band(scenario, &spots)
        };
        let mut hills = rows_of_hills();
        assert!(is_thin(&hills));
        hills.altitude.max = 200.0;
        assert!(!is_thin(&hills));
        assert!(!is_thin(&over(|x, y| 0.3 * x + 0.2 * y)));
    }

    /// With a net as coarse as for other bands, the best found costs 1,078.
    #[test]
    fn ways_through_a_thin_band_are_found() {
        let mut scenario = rows_of_hills();
        scenario.planner.seeding = Seeding::Tangent;
        scenario.planner.polish = true;
        scenario.planner.waypoints = 15;
        scenario.weights.fuel = 1.0;
        (scenario.planner.population, scenario.planner.iterations) = (30, 30);
        let outcome = plan(&scenario, &mut Nobody, &Nobody);
        assert!(outcome.feasible);
        assert!(outcome.cost.total < 1_060.0, "{}", outcome.cost.total);
    }
}
