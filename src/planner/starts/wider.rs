//! Routes that a somewhat wider band of altitudes would allow.
//!
//! Over hills and between threats, a way can be open in a few headings alone, which no net of places meets: each of its
//! legs touches the top of the band over a valley, or its floor over a ridge. In a wider band a net meets such ways, and
//! most of the routes along them can be brought into the band.

use super::shapes::{HOPELESS_OVER_HILLS, OVERLAND, bends, priced};
use super::{known, refine, roadmap, with_waypoints};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::planner::price::{Priced, price};
use crate::planner::{Stop, why_stop};

/// How much wider the band is on either side, as a share of its height.
const WIDER: f64 = 0.3;

/// A chain of the net this many times as expensive as the best route in the band is not worth a look: pulling it into
/// place makes it cheaper by that much at most.
const PROMISING: f64 = 1.1;

/// A route that costs at least this share of the best one in a wider band gains nothing in the band.
const CHEAPER: f64 = 0.99;

/// Maximum number of routes taken.
const MOST: usize = 2;

/// Routes with the requested number of waypoints that break limits of the band, but would cost less in a wider one than
/// all that were `found` in it; and how many routes were priced to find them.
pub(super) fn routes(model: &Model, found: &[Priced], stop: &dyn Stop) -> (Vec<Vec<Point3>>, u64) {
    let flown = found.iter().filter(|(fitness, _)| fitness.is_feasible());
    let costs = flown.map(|(fitness, _)| fitness.cost);
    let best = costs.fold(f64::INFINITY, f64::min);
    let mut scenario = model.scenario.clone();
    let more = WIDER * (scenario.altitude.max - scenario.altitude.min);
    // Not below ground: a leg is priced by how deep it leads below its floor.
    scenario.altitude.min = (scenario.altitude.min - more).max(0.0);
    scenario.altitude.max += more;
    let wide = Model::new(&scenario);
    let is_over = || why_stop(model.scenario, stop).is_some();
    let net = roadmap::routes(&wide, OVERLAND, best, &is_over).0;
    let promising: Vec<Vec<Point3>> = priced(&wide, &net.routes)
        .filter(|(fitness, _)| fitness.cost < PROMISING * best)
        .map(|(_, route)| route.to_vec())
        .collect();
    let waypoints = scenario.planner.waypoints;
    let coarse = bends(&wide, &promising, HOPELESS_OVER_HILLS).min(waypoints);
    let mut evaluations = net.legs_priced / (coarse as u64 + 1);
    let mut pulled: Vec<_> = promising
        .into_iter()
        .map(|route| with_waypoints(&wide, route, coarse))
        .map(|route| (price(&wide, &route), route))
        .collect();
    refine(
        &wide,
        &mut pulled,
        HOPELESS_OVER_HILLS,
        stop,
        &mut evaluations,
    );
    let whole = pulled
        .into_iter()
        .filter(|(fitness, route)| {
            let is_cheaper = fitness.is_feasible() && fitness.cost < CHEAPER * best;
            is_cheaper && !price(model, route).is_feasible()
        })
        .take(MOST)
        .map(|(_, route)| {
            let inside = known::route(model, &route[1..route.len() - 1]);
            with_waypoints(model, inside, waypoints)
        })
        .collect();
    (whole, evaluations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point2;
    use crate::optimizer::Fitness;
    use crate::planner::tests::{disc, peaks, scenario};
    use crate::planner::{Nobody, plan};
    use crate::scenario::{AltitudeBand, Scenario, Seeding};
    use crate::terrain::{Grid, Terrain};

    /// Two mountains and five discs: the best route begins with a leg of 700 m that touches both limits of the band.
    fn between_mountains() -> Scenario {
        let discs = [
            [394.0, 306.0, 80.0, 111.0],
            [614.0, 875.0, 64.0, 86.0],
            [873.0, 688.0, 51.0, 79.0],
            [740.0, 891.0, 34.0, 65.0],
            [836.0, 832.0, 26.0, 58.0],
        ];
        let mut scenario = scenario();
        scenario.start = Point3::new(146.0, 256.0, 294.0);
        scenario.target = Point3::new(871.0, 745.0, 159.0);
        scenario.threats = discs.map(disc).to_vec();
        let mountains = [
            [810.0, 724.0, 207.0, 54.0, 133.0],
            [490.0, 260.0, 242.0, 113.0, 131.0],
        ];
        scenario.terrain = peaks(0.0, &mountains);
        scenario.altitude = AltitudeBand {
            min: 60.0,
            max: 260.0,
        };
        scenario.planner.waypoints = 29;
        (scenario.planner.population, scenario.planner.iterations) = (200, 200);
        (scenario.planner.seeding, scenario.planner.polish) = (Seeding::Tangent, true);
        scenario
    }

    /// The search alone ends at 624.
    #[test]
    fn a_way_that_is_open_in_few_headings_is_found() {
        let outcome = plan(&between_mountains(), &mut Nobody, &Nobody);
        assert!(outcome.feasible);
        assert!(outcome.cost.total < 600.0, "{}", outcome.cost.total);
    }

    /// Every route returned breaks a limit; none is returned where the known cost cannot be improved on.
    #[test]
    fn routes_of_a_wider_band_are_returned_only_where_they_may_be_cheaper() {
        let scenario = between_mountains();
        let model = Model::new(&scenario);
        let known = |cost: f64| Fitness {
            violation: 0.0,
            cost,
        };
        let beyond = |cost: f64| routes(&model, &[(known(cost), Vec::new())], &Nobody).0;
        let found = beyond(624.0);
        assert!((1..=MOST).contains(&found.len()));
        for route in &found {
            assert_eq!(route.len(), 31);
            assert!(!price(&model, route).is_feasible());
        }
        assert!(beyond(550.0).is_empty());
    }

    /// A band near the ground is not made to begin below it, where a grid's legs would all break a limit.
    #[test]
    fn a_band_near_the_ground_is_widened_too() {
        const NODES: usize = 101;
        let mut scenario = between_mountains();
        let node = |idx: usize| Point2::new((idx % NODES) as f64, (idx / NODES) as f64) * 10.0;
        let elevations = (0..NODES * NODES).map(|idx| scenario.terrain.elevation(node(idx)));
        scenario.terrain = Terrain::Grid(Grid {
            origin: Point2::origin(),
            cell: 10.0,
            columns: NODES,
            rows: NODES,
            elevations: elevations.collect(),
        });
        scenario.altitude.min = 40.0;
        let worst = Fitness {
            violation: 0.0,
            cost: 1e4,
        };
        let (found, _) = routes(&Model::new(&scenario), &[(worst, Vec::new())], &Nobody);
        assert!(!found.is_empty());
    }
}
