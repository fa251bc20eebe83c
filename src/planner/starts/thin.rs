//! A chain of many short legs as a route of few waypoints.

use super::{MOST_COARSE, net};
use crate::cost::Model;
use crate::cost::batch::{LANES, Price, Pricer};
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use crate::planner::price::PRICED_FROM;

/// Of the places of `chain`, those that make the best route of as many free waypoints as a coarse one may have, and how
/// many legs were priced to tell.
pub(super) fn thin(model: &Model, pricer: &Pricer, chain: &[Point3]) -> (Vec<Point3>, u64) {
    let last = chain.len() - 1;
    let ends: Vec<(usize, usize)> = (0..last)
        .flat_map(|a| (a + 1..=last).map(move |b| (a, b)))
        .collect();
    let [from, to] = net::rows(chain, &ends);
    let mut prices = vec![Price::ZERO; from.len()];
    pricer.first_legs(&from, &to, ends.len(), &mut prices);
    let tolerance = model.tolerance.scaled(PRICED_FROM);
    let own: Vec<(f64, f64)> = chain
        .iter()
        .map(|&place| model.waypoint(place, tolerance))
        .collect();
    // The best way to each place, by so many legs.
    let mut best = vec![(Fitness::WORST, 0); chain.len()];
    best[0] = (
        Fitness {
            violation: 0.0,
            cost: 0.0,
        },
        0,
    );
    let mut ways = vec![best];
    let most = model.scenario.planner.waypoints.min(MOST_COARSE);
    for _ in 0..=most.min(last - 1) {
        let known = &ways[ways.len() - 1];
        let mut best = vec![(Fitness::WORST, 0); chain.len()];
        for (idx, &(a, b)) in ends.iter().enumerate() {
            let (price, lane) = (&prices[idx / LANES], idx % LANES);
            let at_end = if b == last { (0.0, 0.0) } else { own[b] };
            let way = Fitness {
                violation: known[a].0.violation + price.violation[lane] + at_end.0,
                cost: known[a].0.cost + price.cost[lane] + at_end.1,
            };
            if known[a].0.cost.is_finite() && way.beats(&best[b].0) {
                best[b] = (way, a);
            }
        }
        ways.push(best);
    }
    let mut legs = 1;
    for count in 2..ways.len() {
        if ways[count][last].0.beats(&ways[legs][last].0) {
            legs = count;
        }
    }
    let mut route = vec![chain[last]];
    let mut at = last;
    for way in ways[1..=legs].iter().rev() {
        at = way[at].1;
        route.push(chain[at]);
    }
    route.reverse();
    (route, ends.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::scenario;

    /// Of a chain those places are kept that make the best route there is through them.
    #[test]
    fn a_chain_is_thinned_to_the_best_of_its_places() {
        let mut scenario = scenario();
        scenario.planner.waypoints = 2;
        let model = Model::new(&scenario);
        let place = |share: f64, aside: f64| {
            let way = scenario.target - scenario.start;
            scenario.start + way * share + nalgebra::Vector3::new(-aside, aside, 60.0)
        };
        let between = [
            place(0.15, 130.0),
            place(0.3, 170.0),
            place(0.5, 150.0),
            place(0.6, 140.0),
            place(0.8, 110.0),
        ];
        let mut chain = vec![scenario.start];
        chain.extend(between);
        chain.push(scenario.target);
        let tolerance = model.tolerance.scaled(PRICED_FROM);
        let pricer = Pricer::new(&model, scenario.planner.quadrature, tolerance).verdicts();
        let (thin, priced) = thin(&model, &pricer, &chain);
        assert_eq!(priced, 6 * 7 / 2);
        assert!((3..=4).contains(&thin.len()));
        // Turns apart, which join two legs.
        let legs = |route: &[Point3]| {
            let tolerance = model.tolerance.scaled(PRICED_FROM);
            let quadrature = scenario.planner.quadrature;
            let mut sum = Fitness {
                violation: 0.0,
                cost: 0.0,
            };
            for ends in route.windows(2) {
                let (violation, cost) = model.leg(ends[0], ends[1], quadrature, tolerance);
                let own = model.waypoint(ends[1], tolerance);
                let own = if ends[1] == scenario.target {
                    (0.0, 0.0)
                } else {
                    own
                };
                sum.violation += violation + own.0;
                sum.cost += cost + own.1;
            }
            sum
        };
        let found = legs(&thin);
        for a in 1..6 {
            assert!(!legs(&[chain[0], chain[a], chain[6]]).beats(&found));
            for b in a + 1..6 {
                let other = legs(&[chain[0], chain[a], chain[b], chain[6]]);
                assert!(other.cost >= found.cost - 1e-9 || other.violation >= found.violation);
            }
        }
    }
}
