//! Ways over ground so steep that few headings can be flown: over a fine grid, whose cells know the heights at which they
//! can be reached.
//!
//! A net has places at a few heights, and misses ways along a flank, where the next place is too high or too low in
//! nearly every direction. Here the heights are ranges: a step leads from a range to all heights that the vehicle can
//! climb or descend to meanwhile, as far as they are allowed halfway and at its end. Turns do not count.

mod grid;
mod ground;

use super::net::Found;
use super::steepest;
use super::thin::thin;
use crate::cost::Model;
use crate::geometry::Point3;
use crate::planner::price::pricer;
use crate::scenario::Scenario;
use grid::Grid;
use ground::Ground;

/// How steep steps may be, as a share of the steepest climb, and what is kept free of the band below and above, as a
/// share of it. A route of few legs cuts corners, and needs some room.
const ROOM: [[f64; 2]; 3] = [[0.97, 0.0], [0.97, 0.2], [0.8, 0.2]];

/// Maximum number of places kept of a way.
const PLACES: usize = 120;

/// Routes along the shortest ways over the grid. Once `is_over`, those found so far.
pub(super) fn routes(model: &Model, is_over: &dyn Fn() -> bool) -> Found {
    let scenario = model.scenario;
    let mut found = Found::default();
    if scenario.terrain.is_flat() {
        return found;
    }
    let Some(ground) = Ground::new(model, is_over) else {
        return found;
    };
    let pricer = pricer(model).verdicts();
    for grid in grids(scenario, &ground) {
        if is_over() {
            break;
        }
        if let Some(way) = grid.shortest(is_over) {
            let places = thinned_out(&way, PLACES);
            let (route, legs_priced) = thin(model, &pricer, &places);
            let even = thinned_out(&way, scenario.planner.waypoints);
            found.routes.extend([route, even]);
            found.legs_priced += legs_priced;
        }
    }
    found
}

/// The same grid with ever more room.
fn grids<'g>(scenario: &Scenario, ground: &'g Ground) -> [Grid<'g>; 3] {
    let band = scenario.altitude.max - scenario.altitude.min;
    ROOM.map(|[steep, margin]| Grid {
        ground,
        ends: [scenario.start, scenario.target],
        climb: steep * steepest(scenario),
        margin: margin * band,
    })
}

/// About `most` places of a way, evenly.
fn thinned_out(way: &[Point3], most: usize) -> Vec<Point3> {
    let last = way.len() - 1;
    let legs = last.min(most + 1);
    (0..=legs).map(|idx| way[idx * last / legs]).collect()
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::planner::tests::{mountain, scenario, wall};

    fn ways(scenario: &Scenario, examine: impl Fn(&Model, f64, Option<Vec<Point3>>)) {
        let model = Model::new(scenario);
        let ground = Ground::new(&model, &|| false).expect("few corners");
        for grid in grids(scenario, &ground) {
            examine(&model, grid.climb, grid.shortest(&|| false));
        }
    }

    #[test]
    fn ways_climb_as_steeply_as_they_may_and_stay_in_the_band() {
        for is_down in [true, false] {
            let scenario = mountain(250.0, is_down);
            let found = Cell::new(0);
            ways(&scenario, |model, climb, way| {
                // With much room there may be none.
                let Some(way) = way else { return };
                found.set(found.get() + 1);
                assert_eq!(
                    [way[0], way[way.len() - 1]],
                    [scenario.start, scenario.target]
                );
                for leg in way.windows(2) {
                    let along = (leg[1] - leg[0]).xy().norm();
                    assert!(
                        (leg[1].z - leg[0].z).abs() <= climb * along + 1e-6,
                        "{leg:?}"
                    );
                }
                for place in &way[1..way.len() - 1] {
                    let height = place.z - scenario.terrain.elevation(place.xy());
                    let (floor, ceiling) = model.heights_over(place.xy());
                    assert!((floor - 1e-6..=ceiling + 1e-6).contains(&height), "{place}");
                }
            });
            assert!(found.get() > 0);
            let routes = routes(&Model::new(&scenario), &|| false).routes;
            assert_eq!(routes.len(), 2 * found.get());
        }
    }

    #[test]
    fn no_way_leads_through_a_wall() {
        let mut scenario = mountain(250.0, true);
        let area = scenario.area;
        scenario.threats = vec![wall([600.0, 610.0], [area.min.y, area.max.y])];
        ways(&scenario, |_, _, way| assert_eq!(way, None));
    }

    #[test]
    fn level_ground_has_no_ledges_and_a_stop_is_heard() {
        assert!(
            routes(&Model::new(&scenario()), &|| false)
                .routes
                .is_empty()
        );
        let scenario = mountain(250.0, true);
        assert!(routes(&Model::new(&scenario), &|| true).routes.is_empty());
    }
}
