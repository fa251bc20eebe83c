//! Ways over ground so steep that few headings can be flown: over a fine grid, whose cells know the heights at which they
//! can be reached.
//!
//! A net has places at a few heights, and misses ways along a flank, where the next place is too high or too low in
//! nearly every direction. Here the heights are ranges: a step leads from a range to all heights that the vehicle can
//! climb or descend to meanwhile, as far as they are allowed halfway and at its end. Turns do not count.

mod grid;
mod ground;
mod tolls;

use super::steepest;
use crate::cost::Model;
use crate::geometry::Point3;
use crate::scenario::Scenario;
use grid::Grid;
use ground::Ground;
use tolls::Tolls;

/// How steep steps may be, as a share of the steepest climb, and what is kept free of the band below and above, as a
/// share of it. A route of few legs cuts corners, and needs some room.
const ROOM: [[f64; 2]; 3] = [[0.97, 0.0], [0.97, 0.2], [0.8, 0.2]];

/// Ways along ledges.
#[derive(Default)]
pub(in crate::planner) struct Ledges {
    /// From start to target, of many places, each with more room than the one before.
    pub(in crate::planner) ways: Vec<Vec<Point3>>,
    /// Legs priced to find them.
    pub(in crate::planner) legs_priced: u64,
}

/// The cheapest ways over the grid, of those that cost no more than `most`. Once `is_over`, those found so far.
pub(in crate::planner) fn ledges(model: &Model, most: f64, is_over: &dyn Fn() -> bool) -> Ledges {
    let scenario = model.scenario;
    let sought = || {
        let ground = Ground::new(model, is_over)?;
        let tolls = Tolls::new(model, &ground, is_over)?;
        let grids = grids(scenario, &ground, &tolls).into_iter();
        let ways = grids.filter_map(|grid| grid.cheapest(most, is_over));
        Some(Ledges {
            ways: ways.collect(),
            legs_priced: tolls.legs_priced,
        })
    };
    let is_flat = scenario.terrain.is_flat();
    (!is_flat).then(sought).flatten().unwrap_or_default()
}

/// The same grid with ever more room.
fn grids<'g>(scenario: &Scenario, ground: &'g Ground, tolls: &'g Tolls) -> [Grid<'g>; 3] {
    let band = scenario.altitude.max - scenario.altitude.min;
    ROOM.map(|[steep, margin]| Grid {
        ground,
        tolls,
        ends: [scenario.start, scenario.target],
        climb: steep * steepest(scenario),
        margin: margin * band,
    })
}

/// About `most` free places of a way, evenly.
pub(in crate::planner) fn thinned_out(way: &[Point3], most: usize) -> Vec<Point3> {
    let last = way.len() - 1;
    let legs = last.min(most + 1);
    (0..=legs).map(|idx| way[idx * last / legs]).collect()
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::planner::tests::{disc, hilly_scenario, mountain, scenario, wall};

    const ANY: f64 = f64::INFINITY;

    fn ways(scenario: &Scenario, examine: impl Fn(&Model, f64, Option<Vec<Point3>>)) {
        let model = Model::new(scenario);
        let ground = Ground::new(&model, &|| false).expect("few corners");
        let tolls = Tolls::new(&model, &ground, &|| false).expect("enough time");
        for grid in grids(scenario, &ground, &tolls) {
            examine(&model, grid.climb, grid.cheapest(ANY, &|| false));
        }
    }

    fn found(scenario: &Scenario, most: f64) -> Vec<Vec<Point3>> {
        ledges(&Model::new(scenario), most, &|| false).ways
    }

    #[test]
    fn ways_climb_as_steeply_as_they_may_and_stay_in_the_band() {
        for is_down in [true, false] {
            let scenario = mountain(250.0, is_down);
            let count = Cell::new(0);
            ways(&scenario, |model, climb, way| {
                // With much room there may be none.
                let Some(way) = way else { return };
                count.set(count.get() + 1);
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
                    let height = scenario.terrain.height_of(*place);
                    let (floor, ceiling) = model.heights_over(place.xy());
                    assert!((floor - 1e-6..=ceiling + 1e-6).contains(&height), "{place}");
                }
            });
            assert!(count.get() > 0);
            assert_eq!(found(&scenario, ANY).len(), count.get());
        }
    }

    #[test]
    fn no_way_leads_through_a_wall() {
        let mut scenario = mountain(250.0, true);
        let area = scenario.area;
        scenario.threats = vec![wall([600.0, 610.0], [area.min.y, area.max.y])];
        ways(&scenario, |_, _, way| assert_eq!(way, None));
    }

    /// Where it costs something, a way keeps clear of the whole soft zone; else it leads past the disc itself.
    #[test]
    fn ways_avoid_exposure_where_it_is_expensive() {
        let mut scenario = hilly_scenario();
        let way = scenario.target - scenario.start;
        let middle = (scenario.start + 0.5 * way).xy();
        scenario.threats = vec![disc([middle.x, middle.y, 60.0, 120.0])];
        let mut nearest = |weight: f64| {
            scenario.weights.threat = weight;
            let ways = found(&scenario, ANY);
            let away = ways[0].iter().map(|place| (place.xy() - middle).norm());
            away.fold(f64::INFINITY, f64::min)
        };
        let (free, dear) = (nearest(0.0), nearest(10.0));
        assert!((60.0..90.0).contains(&free), "{free}");
        assert!(dear > 110.0, "{dear}");
    }

    #[test]
    fn level_ground_has_no_ledges_a_stop_is_heard_and_what_costs_too_much_is_not_sought() {
        assert!(found(&scenario(), ANY).is_empty());
        let scenario = mountain(250.0, true);
        let model = Model::new(&scenario);
        assert!(ledges(&model, ANY, &|| true).ways.is_empty());
        let direct = crate::cost::metre(&scenario) * scenario.direct();
        assert!(found(&scenario, 0.9 * direct).is_empty());
    }
}
