//! A chain of many short legs as a route of few waypoints.

use super::{MOST_COARSE, few, may_turn, may_turn_along, net};
use crate::cost::Model;
use crate::cost::batch::{LANES, Price, Pricer};
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use crate::planner::price::PRICED_FROM;

/// Routes along a chain looked at for one that can be turned along, at most.
const EFFORT: usize = 40_000;

/// Of the places of `chain`, those that make the best route of as many free waypoints as a coarse one may have, and how
/// many legs were priced to tell. Turns are looked at only where those of the best are too sharp.
pub(super) fn thin(model: &Model, pricer: &Pricer, chain: &[Point3]) -> (Vec<Point3>, u64) {
    let legs = Legs::new(model, pricer, chain);
    let points = |route: Vec<usize>| route.into_iter().map(|place| chain[place]).collect();
    let mut route: Vec<Point3> = points(legs.best());
    if !may_turn_along(&route, legs.sharpest)
        && let Some(softer) = legs.best_to_turn_along()
    {
        route = points(softer);
    }
    let priced = (chain.len() * (chain.len() - 1) / 2) as u64;
    (route, priced)
}

/// The legs from each place of a chain to each later one.
struct Legs<'c> {
    chain: &'c [Point3],
    /// By where they begin, then by how many places later they end, less one; with their ends as waypoints.
    worth: Vec<Vec<Fitness>>,
    /// As many legs a route may have.
    most: usize,
    /// Cosine of the sharpest turn.
    sharpest: f64,
}

impl<'c> Legs<'c> {
    fn new(model: &Model, pricer: &Pricer, chain: &'c [Point3]) -> Self {
        let last = chain.len() - 1;
        let ends: Vec<(usize, usize)> = (0..last)
            .flat_map(|a| (a + 1..=last).map(move |b| (a, b)))
            .collect();
        let [from, to] = net::rows(chain, &ends);
        let mut prices = vec![Price::ZERO; from.len()];
        pricer.first_legs(&from, &to, ends.len(), &mut prices);
        let tolerance = model.tolerance.scaled(PRICED_FROM);
        let mut own: Vec<(f64, f64)> = chain
            .iter()
            .map(|&place| model.waypoint(place, tolerance))
            .collect();
        own[last] = (0.0, 0.0);
        let mut worth = vec![Vec::new(); chain.len()];
        for (idx, &(a, b)) in ends.iter().enumerate() {
            let (price, lane) = (&prices[idx / LANES], idx % LANES);
            worth[a].push(Fitness {
                violation: price.violation[lane] + own[b].0,
                cost: price.cost[lane] + own[b].1,
            });
        }
        let scenario = model.scenario;
        let most = scenario.planner.waypoints.min(MOST_COARSE) + 1;
        Self {
            chain,
            worth,
            most: most.min(last),
            sharpest: libm::cos(scenario.vehicle.max_turn_deg.to_radians()),
        }
    }

    fn last(&self) -> usize {
        self.chain.len() - 1
    }

    /// The places of the best route, turns apart.
    fn best(&self) -> Vec<usize> {
        // The best way to each place, by so many legs.
        let mut best = vec![(Fitness::WORST, 0); self.chain.len()];
        best[0].0 = Fitness {
            violation: 0.0,
            cost: 0.0,
        };
        let mut ways = vec![best];
        for _ in 0..self.most {
            let known = &ways[ways.len() - 1];
            let mut best = vec![(Fitness::WORST, 0); self.chain.len()];
            for (a, legs) in self.worth.iter().enumerate() {
                if known[a].0.cost.is_infinite() {
                    continue;
                }
                for (leg, b) in legs.iter().zip(a + 1..) {
                    let way = Fitness {
                        violation: known[a].0.violation + leg.violation,
                        cost: known[a].0.cost + leg.cost,
                    };
                    if way.beats(&best[b].0) {
                        best[b] = (way, a);
                    }
                }
            }
            ways.push(best);
        }
        let last = self.last();
        let mut legs = 1;
        for count in 2..ways.len() {
            if ways[count][last].0.beats(&ways[legs][last].0) {
                legs = count;
            }
        }
        let mut route = vec![last];
        for way in ways[1..=legs].iter().rev() {
            route.push(way[route[route.len() - 1]].1);
        }
        route.reverse();
        route
    }

    /// The places of the cheapest route that breaks no limit, if it is found.
    fn best_to_turn_along(&self) -> Option<Vec<usize>> {
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
        few::chains(&mut legs, (self.most, EFFORT), |chain| {
            route = Some(chain);
            true
        });
        route
    }
}

/// Those that break no limit.
struct Feasible<'l, 'c> {
    legs: &'l Legs<'c>,
    /// From each place to each; infinite where there is none.
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
    use crate::planner::tests::scenario;
    use crate::scenario::Scenario;

    /// A chain that leaves the direct way at once, and what its legs cost by the way they are defined, turns apart.
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
        let tolerance = model.tolerance.scaled(PRICED_FROM);
        let mut sum = Fitness {
            violation: 0.0,
            cost: 0.0,
        };
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
        let tolerance = model.tolerance.scaled(PRICED_FROM);
        let pricer = Pricer::new(&model, scenario.planner.quadrature, tolerance).verdicts();
        let (thin, priced) = thin(&model, &pricer, &astray(scenario));
        assert_eq!(priced, 6 * 7 / 2);
        assert!((3..=4).contains(&thin.len()));
        (sum_of_legs(&model, &thin), thin)
    }

    /// Of a chain those places are kept that make the best route through them that the vehicle can turn along.
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
        // To turn softly costs more here.
        assert!(costs[1] > 1.001 * costs[0], "{costs:?}");
    }
}
