//! Ways between threats that are near to each other.
//!
//! A ten-metre gap falls between the places of a net with steps of thirty, and strings treat overlapping soft zones as
//! closed. Cheap ways over a mesh with vertices along the edges of all zones pass such gaps; of each, those places are
//! kept that make the best route of N waypoints.

use super::lifted;
use super::net::Found;
use super::thin::thin;
use crate::cost::Model;
use crate::geometry::Point3;
use crate::planner::price::pricer;
use crate::seeding::{WaysSought, cheap_ways, cheapest_slip};

/// From this many threats on they are a crowd, in which one gap follows another.
const CROWD: usize = 16;

/// In a crowd, all ways found are used.
const IN_CROWDS: WaysSought = WaysSought {
    vertices: 1000,
    most: 24,
    dearest: f64::INFINITY,
};

/// Outside crowds: strings and nets find most of the ways.
const AMONG_FEW: WaysSought = WaysSought {
    vertices: 800,
    most: 8,
    dearest: f64::INFINITY,
};

/// Outside crowds, a way this many times as expensive as the best known is not worth a look. In steps over a mesh it
/// may be a little more expensive than the resulting route.
const DEAREST: f64 = 1.1;

/// How closely to look for such ways, if they are worth a look: in a crowd, and where one through a gap may cost less
/// than what is `known`.
pub(super) fn sought(
    model: &Model,
    known: Option<f64>,
    is_over: &dyn Fn() -> bool,
) -> Option<WaysSought> {
    let scenario = model.scenario;
    if scenario.threats.len() >= CROWD {
        return Some(IN_CROWDS);
    }
    let known = known.unwrap_or(f64::INFINITY);
    (cheapest_slip(scenario, is_over) < known).then_some(WaysSought {
        dearest: DEAREST * known,
        ..AMONG_FEW
    })
}

/// Routes of at most as many free waypoints as `model` asks for, each along a different way; fewer once `is_over`.
pub(super) fn routes(model: &Model, sought: WaysSought, is_over: &dyn Fn() -> bool) -> Found {
    let scenario = model.scenario;
    let pricer = pricer(model).verdicts();
    let ground = scenario.terrain.elevation(scenario.start.xy());
    let height = ground + scenario.altitude.middle();
    let mut found = Found::default();
    for way in cheap_ways(scenario, height, sought) {
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
    use crate::planner::starts::roadmap;
    use crate::planner::starts::shapes::along_strings;
    use crate::planner::tests::{disc, peaks, radar, scenario};
    use crate::planner::{Nobody, plan};
    use crate::scenario::{Scenario, Seeding};

    /// Sixty random discs with gaps of at least ten metres.
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

    /// Fourteen discs, two of whose soft zones overlap by four metres: a route costs 588 through that gap and
    /// 699 around it. The same holds with a distant hill.
    #[test]
    fn a_cheap_gap_between_few_threats_is_found() {
        let discs = [
            [472.0, 577.0, 73.0, 103.0],
            [829.0, 433.0, 53.0, 93.0],
            [695.0, 532.0, 68.0, 98.0],
            [161.0, 833.0, 69.0, 99.0],
            [605.0, 665.0, 36.0, 66.0],
            [456.0, 363.0, 52.0, 72.0],
            [575.0, 792.0, 56.0, 86.0],
            [353.0, 724.0, 63.0, 93.0],
            [258.0, 366.0, 40.0, 70.0],
            [678.0, 370.0, 54.0, 94.0],
            [796.0, 694.0, 78.0, 108.0],
            [411.0, 807.0, 31.0, 61.0],
            [831.0, 251.0, 51.0, 81.0],
            [561.0, 255.0, 56.0, 76.0],
        ];
        let mut scenario = scenario();
        scenario.threats = discs.map(disc).to_vec();
        (scenario.start.x, scenario.start.y, scenario.start.z) = (132.0, 65.0, 50.0);
        (scenario.target.x, scenario.target.y) = (886.0, 839.0);
        (scenario.altitude.min, scenario.altitude.max) = (60.0, 260.0);
        (scenario.planner.seeding, scenario.planner.polish) = (Seeding::Tangent, true);
        let hill = peaks(0.0, &[[900.0, 100.0, 60.0, 60.0, 60.0]]);
        for terrain in [scenario.terrain.clone(), hill] {
            scenario.terrain = terrain;
            let outcome = plan(&scenario, &mut Nobody, &Nobody);
            assert!(outcome.feasible);
            assert!(outcome.cost.total < 590.0, "{}", outcome.cost.total);
        }
    }

    /// Among few threats, ways are sought only where a gap may be no more expensive than the known route.
    #[test]
    fn ways_among_few_threats_are_sought_where_a_gap_may_be_cheaper() {
        let mut scenario = scenario();
        let of =
            |scenario: &Scenario, known: f64| sought(&Model::new(scenario), Some(known), &|| false);
        scenario.threats = vec![radar(400.0, 500.0, 60.0), radar(700.0, 500.0, 60.0)];
        assert_eq!(of(&scenario, 1e6), None);
        scenario.threats = vec![radar(415.0, 500.0, 60.0), radar(585.0, 500.0, 60.0)];
        let direct = 0.5 * scenario.direct();
        let sought = of(&scenario, 2.0 * direct).expect("through the gap is not dearer");
        assert_eq!(sought.most, AMONG_FEW.most);
        assert!(sought.dearest < 2.3 * direct);
        assert_eq!(of(&scenario, direct), None);
        scenario.weights.fuel = 0.0;
        assert_eq!(of(&scenario, 1e6), None);
    }

    /// By more than a twentieth in at least half of the fields, before any search.
    #[test]
    fn ways_through_minefields_are_cheaper_than_strings_and_nets() {
        let mut far_better = 0;
        for seed in 1..=8 {
            let scenario = minefield(seed);
            let model = Model::new(&scenario);
            let sought = sought(&model, None, &|| false).expect("it is a crowd");
            let best = |routes: &[Vec<Point3>]| {
                let flown = routes.iter().filter(|route| route.len() <= 22);
                let prices = flown.map(|route| price(&model, route));
                prices.min_by(Fitness::rank).unwrap_or(Fitness::WORST)
            };
            let ways = best(&routes(&model, sought, &|| false).routes);
            let others = best(
                &roadmap::routes(&model, 8, f64::INFINITY, &|| false)
                    .0
                    .routes,
            );
            let others = [others, best(&along_strings(&model, &|| false).routes)];
            assert!(ways.is_feasible());
            let is_far_better =
                |other: &Fitness| !other.is_feasible() || ways.cost < 0.95 * other.cost;
            far_better += u32::from(others.iter().all(is_far_better));
        }
        assert!(far_better >= 4, "{far_better}");
    }
}
