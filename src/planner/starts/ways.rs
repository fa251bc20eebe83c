//! Ways through crowds.
//!
//! A gap of ten metres lies between the places of a net whose steps are thirty, and strings see soft zones that overlap as
//! closed. Cheap ways over a mesh that has vertices along the edges of all zones pass such gaps; of each, those places are
//! kept that make the best route of N waypoints.

use super::lifted;
use super::net::Found;
use super::thin::thin;
use crate::cost::Model;
use crate::cost::batch::Pricer;
use crate::geometry::Point3;
use crate::planner::price::PRICED_FROM;
use crate::seeding::cheap_ways;

/// With fewer threats strings and nets find all ways.
const CROWD: usize = 16;

/// Ways, at most.
const MOST: usize = 24;

/// Whether there are so many threats over level ground that such ways are looked for.
pub(super) fn are_worth_a_look(model: &Model) -> bool {
    model.scenario.terrain.is_flat() && model.scenario.threats.len() >= CROWD
}

/// Routes of at most as many free waypoints as `model` asks for, each along another way; fewer once `is_over`.
pub(super) fn routes(model: &Model, is_over: &dyn Fn() -> bool) -> Found {
    let scenario = model.scenario;
    let tolerance = model.tolerance.scaled(PRICED_FROM);
    let pricer = Pricer::new(model, scenario.planner.quadrature, tolerance).verdicts();
    let band = scenario.altitude;
    let ground = scenario.terrain.elevation(scenario.start.xy());
    let height = ground + 0.5 * (band.min + band.max);
    let mut found = Found::default();
    for way in cheap_ways(scenario, height, MOST) {
        if is_over() {
            break;
        }
        let places = way.iter().map(|at| lifted(scenario, *at, 0.5));
        let mut chain: Vec<Point3> = places.collect();
        let last = chain.len() - 1;
        (chain[0], chain[last]) = (scenario.start, scenario.target);
        let (route, legs_priced) = thin(model, &pricer, &chain);
        found.routes.push(route);
        found.legs_priced += legs_priced;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimizer::{Fitness, Random};
    use crate::planner::price::price;
    use crate::planner::starts::{along_strings, roadmap};
    use crate::planner::tests::{radar, scenario};
    use crate::scenario::Scenario;

    /// Sixty discs at random, in gaps of ten metres and more.
    fn minefield(seed: u64) -> Scenario {
        let mut scenario = scenario();
        scenario.threats.clear();
        (scenario.start.z, scenario.target.z) = (100.0, 100.0);
        scenario.planner.waypoints = 20;
        let mut random = Random::new(seed);
        let mut discs: Vec<[f64; 3]> = vec![
            [scenario.start.x, scenario.start.y, 0.0],
            [scenario.target.x, scenario.target.y, 0.0],
        ];
        while discs.len() < 62 {
            let [x, y, radius] = [(50.0, 950.0), (50.0, 950.0), (15.0, 40.0)]
                .map(|(low, high)| random.between(low, high));
            let is_free =
                |[a, b, other]: &[f64; 3]| libm::hypot(a - x, b - y) > radius + other + 10.0;
            if discs.iter().all(is_free) {
                discs.push([x, y, radius]);
            }
        }
        let threats = discs[2..]
            .iter()
            .map(|[x, y, radius]| radar(*x, *y, *radius));
        scenario.threats = threats.collect();
        scenario
    }

    /// By more than a twentieth in every second field, before any search.
    #[test]
    fn ways_through_minefields_are_cheaper_than_strings_and_nets() {
        let mut far_better = 0;
        for seed in 1..=8 {
            let scenario = minefield(seed);
            let model = Model::new(&scenario);
            assert!(are_worth_a_look(&model));
            let best = |routes: &[Vec<Point3>]| {
                let flown = routes.iter().filter(|route| route.len() <= 22);
                let prices = flown.map(|route| price(&model, route));
                prices.min_by(Fitness::rank).unwrap_or(Fitness::WORST)
            };
            let ways = best(&routes(&model, &|| false).routes);
            let others = best(
                &roadmap::routes(&model, 8, f64::INFINITY, &|| false)
                    .0
                    .routes,
            );
            let others = [others, best(&along_strings(&model, &|| false))];
            assert!(ways.is_feasible());
            let is_far_better =
                |other: &Fitness| !other.is_feasible() || ways.cost < 0.95 * other.cost;
            far_better += u32::from(others.iter().all(is_far_better));
        }
        assert!(far_better >= 4, "{far_better}");
    }
}
