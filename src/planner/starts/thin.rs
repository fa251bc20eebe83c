//! Turns a chain of many short legs into a route of few waypoints.

use std::cell::LazyCell;

use super::shapes::MOST_COARSE;
use super::{few, may_turn, may_turn_along, net};
use crate::cost::Model;
use crate::cost::batch::Pricer;
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use crate::planner::price::search_tolerance;

/// Maximum number of routes along a chain examined for one that can be flown with the allowed turns.
const EFFORT: usize = 40_000;

/// For a chain of no more places than this, all legs are priced at once.
const SHORT: usize = 64;

/// For a longer chain this many legs from each place are priced at once, the shortest first, until all of them break
/// limits: a long leg through thousands of threats is expensive to price, and hardly ever one to keep.
const AT_ONCE: usize = 16;

/// If the best route with a coarse route's number of legs costs this share more than one of any number, it is too
/// coarse.
const FAR_FROM: f64 = 0.02;

/// The places of `chain` that make the best route with as many free waypoints as a coarse one may have, and how many
/// legs were priced to find it. Turns are considered only where those of the best route are too sharp.
pub(super) fn thin(model: &Model, pricer: &Pricer, chain: &[Point3]) -> (Vec<Point3>, u64) {
    let all = chain.len();
    let at_once = if all > SHORT { AT_ONCE } else { all };
    let mut legs = Legs::new(model, pricer, chain, at_once);
    let mut priced = legs.count();
    let best = legs.best().unwrap_or_else(|| {
        legs = Legs::new(model, pricer, chain, all);
        priced += legs.count();
        legs.best().expect("one leg leads from start to target")
    });
    let points = |route: Vec<usize>| route.into_iter().map(|place| chain[place]).collect();
    let mut route: Vec<Point3> = points(best);
    if !may_turn_along(&route, legs.sharpest)
        && let Some(softer) = legs.best_to_turn_along(route.len() - 1)
    {
        route = points(softer);
    }
    (route, priced)
}

/// The legs from each place of a chain to later ones.
struct Legs<'c> {
    chain: &'c [Point3],
    /// Indexed by where they begin, then by how many places later they end, less one; including the cost of their ends
    /// as waypoints.
    worth: Vec<Vec<Fitness>>,
    /// Maximum number of legs of a whole route.
    most: usize,
    /// Cosine of the sharpest turn.
    sharpest: f64,
}

impl<'c> Legs<'c> {
    /// From each place `at_once` legs, and as many more while any of these breaks no limit.
    fn new(model: &Model, pricer: &Pricer, chain: &'c [Point3], at_once: usize) -> Self {
        let last = chain.len() - 1;
        let tolerance = search_tolerance(model);
        let mut own: Vec<(f64, f64)> = chain
            .iter()
            .map(|&place| model.waypoint(place, tolerance))
            .collect();
        own[last] = (0.0, 0.0);
        let mut worth = vec![Vec::new(); chain.len()];
        let mut open: Vec<usize> = (0..last).collect();
        for first in (1..=last).step_by(at_once) {
            if open.is_empty() {
                break;
            }
            let onward = |&a: &usize| {
                let next = a + first..(a + first + at_once).min(last + 1);
                next.map(move |b| (a, b))
            };
            let ends: Vec<(usize, usize)> = open.iter().flat_map(onward).collect();
            let legs = net::priced(chain, &ends, |from, to, prices| {
                pricer.first_legs(from, to, ends.len(), prices);
            });
            for (&(a, b), leg) in ends.iter().zip(&legs) {
                worth[a].push(Fitness {
                    violation: leg.violation + own[b].0,
                    cost: leg.cost + own[b].1,
                });
            }
            open.retain(|&a| {
                let latest = worth[a].get(first - 1..).unwrap_or_default();
                latest.iter().any(Fitness::is_feasible)
            });
        }
        let scenario = model.scenario;
        let most = scenario.planner.waypoints + 1;
        Self {
            chain,
            worth,
            most: most.min(last),
            sharpest: scenario.vehicle.sharpest(),
        }
    }

    fn last(&self) -> usize {
        self.chain.len() - 1
    }

    /// How many legs are known.
    fn count(&self) -> u64 {
        self.worth.iter().map(|legs| legs.len() as u64).sum()
    }

    /// The places of the best route, ignoring turns; `None` where there is none with so few legs. It has no more legs
    /// than a coarse one unless that is far from as good as any number.
    fn best(&self) -> Option<Vec<usize>> {
        let last = self.last();
        let any = LazyCell::new(|| self.of_any_number());
        let is_near = |way: &Fitness| {
            way.violation <= any.violation && way.cost <= any.cost * (1.0 + FAR_FROM)
        };
        // The best way to each place, by number of legs.
        let mut ways = vec![vec![(Fitness::WORST, 0); self.chain.len()]];
        ways[0][0].0 = Fitness::ZERO;
        let mut legs = 1;
        for count in 1..=self.most {
            let best = self.one_more(&ways[count - 1]);
            let is_better = count == 1 || best[last].0.beats(&ways[legs][last].0);
            ways.push(best);
            if is_better {
                legs = count;
            }
            if count > MOST_COARSE && is_near(&ways[legs][last].0) {
                break;
            }
        }
        if ways[legs][last].0.cost.is_infinite() {
            return None;
        }
        let mut route = vec![last];
        for way in ways[1..=legs].iter().rev() {
            route.push(way[route[route.len() - 1]].1);
        }
        route.reverse();
        Some(route)
    }

    /// The best way to each place by one leg more than `known`, and where that leg begins.
    fn one_more(&self, known: &[(Fitness, usize)]) -> Vec<(Fitness, usize)> {
        let mut best = vec![(Fitness::WORST, 0); known.len()];
        for (a, legs) in self.worth.iter().enumerate() {
            if known[a].0.cost.is_infinite() {
                continue;
            }
            for (leg, b) in legs.iter().zip(a + 1..) {
                let way = further(known[a].0, leg);
                if way.beats(&best[b].0) {
                    best[b] = (way, a);
                }
            }
        }
        best
    }

    /// The cost of the best way of any number of legs.
    fn of_any_number(&self) -> Fitness {
        let mut best = vec![Fitness::WORST; self.chain.len()];
        best[0] = Fitness::ZERO;
        for (a, legs) in self.worth.iter().enumerate() {
            for (leg, b) in legs.iter().zip(a + 1..) {
                let way = further(best[a], leg);
                if way.beats(&best[b]) {
                    best[b] = way;
                }
            }
        }
        best[self.last()]
    }

    /// The places of the cheapest route that breaks no limit, if it is found: of `about` that many legs, or as few as a
    /// coarse one has.
    fn best_to_turn_along(&self, about: usize) -> Option<Vec<usize>> {
        let count = self.chain.len();
        let mut legs = Feasible {
            legs: self,
            costs: vec![vec![f64::INFINITY; count]; count],
        };
        for (costs, (a, worth)) in legs.costs.iter_mut().zip(self.worth.iter().enumerate()) {
            for (cost, leg) in costs[(a + 1).min(count)..].iter_mut().zip(worth) {
                if leg.is_feasible() {
                    *cost = leg.cost;
                }
            }
        }
        let mut route = None;
        let most = self.most.min(about.max(MOST_COARSE + 1));
        few::chains(&mut legs, (most, EFFORT), |chain| {
            route = Some(chain);
            true
        });
        route
    }
}

/// The fitness of a way with one more `leg`.
fn further(way: Fitness, leg: &Fitness) -> Fitness {
    Fitness {
        violation: way.violation + leg.violation,
        cost: way.cost + leg.cost,
    }
}

/// The legs that break no limit.
struct Feasible<'l, 'c> {
    legs: &'l Legs<'c>,
    /// From each place to each; infinite where there is no leg.
    costs: Vec<Vec<f64>>,
}

impl few::Legs for Feasible<'_, '_> {
    fn places(&self) -> usize {
        self.costs.len()
    }

    fn onward(&self, from: usize) -> &[f64] {
        &self.costs[from]
    }

    fn may_turn(&self, corner: [usize; 3]) -> bool {
        let legs = self.legs;
        may_turn(corner.map(|place| legs.chain[place]), legs.sharpest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::price::pricer;
    use crate::planner::tests::{radar, scenario};
    use crate::scenario::Scenario;

    /// A chain that leaves the direct way immediately.
    fn astray(scenario: &Scenario) -> Vec<Point3> {
        let between = [
            (0.15, 130.0),
            (0.3, 170.0),
            (0.5, 150.0),
            (0.6, 140.0),
            (0.8, 110.0),
        ];
        let way = scenario.target - scenario.start;
        let place = |(share, aside): (f64, f64)| {
            scenario.start + way * share + nalgebra::Vector3::new(-aside, aside, 60.0)
        };
        std::iter::once(scenario.start)
            .chain(between.map(place))
            .chain([scenario.target])
            .collect()
    }

    fn sum_of_legs(model: &Model, route: &[Point3]) -> Fitness {
        let scenario = model.scenario;
        let tolerance = search_tolerance(model);
        let mut sum = Fitness::ZERO;
        for ends in route.windows(2) {
            let (violation, cost) =
                model.leg(ends[0], ends[1], scenario.planner.quadrature, tolerance);
            let own = if ends[1] == scenario.target {
                (0.0, 0.0)
            } else {
                model.waypoint(ends[1], tolerance)
            };
            sum.violation += violation + own.0;
            sum.cost += cost + own.1;
        }
        sum
    }

    fn thinned(scenario: &Scenario) -> (Fitness, Vec<Point3>) {
        let model = Model::new(scenario);
        let pricer = pricer(&model).verdicts();
        let (thin, priced) = thin(&model, &pricer, &astray(scenario));
        assert_eq!(priced, 6 * 7 / 2);
        assert!((3..=4).contains(&thin.len()));
        (sum_of_legs(&model, &thin), thin)
    }

    /// The places kept make the best route through the chain's places that the vehicle can turn along.
    #[test]
    fn a_chain_is_thinned_to_the_best_of_its_places() {
        let mut scenario = scenario();
        scenario.planner.waypoints = 2;
        let mut costs = Vec::new();
        for sharpest in [180.0_f64, 60.0] {
            scenario.vehicle.max_turn_deg = sharpest;
            let model = Model::new(&scenario);
            let chain = astray(&scenario);
            let sharpest = libm::cos(sharpest.to_radians());
            let turns_along = |route: &[Point3]| may_turn_along(route, sharpest);
            let (found, thin) = thinned(&scenario);
            assert!(found.is_feasible() && turns_along(&thin));
            for a in 1..6 {
                let one = [chain[0], chain[a], chain[6]];
                let two = (a + 1..6).map(|b| vec![chain[0], chain[a], chain[b], chain[6]]);
                for other in std::iter::once(one.to_vec()).chain(two) {
                    let sum = sum_of_legs(&model, &other);
                    let is_cheaper = sum.is_feasible() && sum.cost < found.cost - 1e-9;
                    assert!(!(is_cheaper && turns_along(&other)));
                }
            }
            costs.push(found.cost);
        }
        // Turning gently costs more here.
        assert!(costs[1] > 1.001 * costs[0], "{costs:?}");
    }

    /// Half way around a disc in steps of a few metres, which no leg may cut across; and a route of one
    /// waypoint, which needs longer legs than those tried first.
    #[test]
    fn long_infeasible_legs_of_a_long_chain_are_not_priced() {
        let mut scenario = scenario();
        scenario.start = Point3::new(200.0, 500.0, 100.0);
        scenario.target = Point3::new(800.0, 500.0, 100.0);
        scenario.threats = vec![radar(500.0, 500.0, 290.0)];
        let places: u32 = 120;
        let chain: Vec<Point3> = (0..=places)
            .map(|place| {
                let angle = std::f64::consts::PI * (1.0 - f64::from(place) / f64::from(places));
                Point3::new(
                    500.0 + 300.0 * libm::cos(angle),
                    500.0 + 300.0 * libm::sin(angle),
                    100.0,
                )
            })
            .collect();
        let all = u64::from(places * (places + 1) / 2);
        for (waypoints, most) in [(20, 2 * all / 3), (1, 2 * all)] {
            scenario.planner.waypoints = waypoints;
            let model = Model::new(&scenario);
            let pricer = pricer(&model).verdicts();
            let (route, priced) = thin(&model, &pricer, &chain);
            let best = Legs::new(&model, &pricer, &chain, chain.len()).best();
            let best: Vec<Point3> = best
                .expect("one leg is one")
                .iter()
                .map(|at| chain[*at])
                .collect();
            assert_eq!(route, best);
            assert!(priced < most, "{priced} of {all}");
        }
    }
}
