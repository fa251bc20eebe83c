//! Ways over the ground: the cheapest routes through a net of places in the middle of the band, and just above or
//! below threats that can be passed so.
//!
//! Taut strings know threats, but neither mountains nor what crossing a soft zone costs. Here every
//! leg between two of some hundred places is priced as it is, those that break a limit left out, and
//! the cheapest chains from start to target are found; turns alone are not looked at.

use super::levels;
use super::net::{self, Found, Tree};
use crate::cost::batch::{LANES, Price, Pricer};
use crate::cost::{Model, metre};
use crate::geometry::Point3;
use crate::planner::price::PRICED_FROM;

/// Places of the net, besides both ends, on level ground.
const PLACES: usize = 160;

/// Over hills, where passes are narrow.
const PLACES_OVER_HILLS: usize = 320;

/// The net covers all points of which the way over them is at most so many times the direct one.
const DETOUR: f64 = 1.4;

/// A place has the height that clears a threat from so many steps of the net beside it on.
const NEAR: f64 = 1.5;

/// What a waypoint must gain, as a share of the direct way's fuel.
const WORTH: f64 = 1e-4;

/// Up to `count` routes that differ.
pub(super) fn routes(model: &Model, count: usize) -> Found {
    let places = places(model);
    let legs_priced = (places.len() * (places.len() - 1) / 2) as u64;
    let mut legs = Legs::new(model, &places);
    let trees = [0, places.len() - 1].map(|end| legs.cheapest(end));
    Found {
        routes: net::chains(model, &places, &trees, count),
        legs_priced,
    }
}

/// Start, a net of spots in the middle of the band, target.
fn places(model: &Model) -> Vec<Point3> {
    let scenario = model.scenario;
    let count = if scenario.terrain.is_flat() {
        PLACES
    } else {
        PLACES_OVER_HILLS
    };
    let spots = net::spots(scenario, count, DETOUR);
    let near = NEAR * spots.step;
    let over = |&spot| levels::over(scenario, spot, near);
    std::iter::once(scenario.start)
        .chain(spots.points.iter().flat_map(over))
        .chain(levels::about_ends(scenario, 0.5 * spots.step))
        .chain([scenario.target])
        .collect()
}

/// The legs between places.
struct Legs<'p, 's> {
    places: &'p [Point3],
    pricer: Pricer<'s>,
    /// What each costs, row by row; infinite where it breaks a limit.
    costs: Vec<Vec<f64>>,
    /// Whether it is known to keep its heights; where those take long to measure, few legs are asked.
    measured: Vec<Vec<bool>>,
}

impl<'p, 's> Legs<'p, 's> {
    fn new(model: &Model<'s>, places: &'p [Point3]) -> Self {
        let scenario = model.scenario;
        let tolerance = model.tolerance.scaled(PRICED_FROM);
        let pricer = Pricer::new(model, scenario.planner.quadrature, tolerance).verdicts();
        let count = places.len();
        let ends: Vec<(usize, usize)> = (0..count)
            .flat_map(|a| (a + 1..count).map(move |b| (a, b)))
            .collect();
        let [from, to] = net::rows(places, &ends);
        let mut prices = vec![Price::ZERO; from.len()];
        let hilly = pricer.is_hilly();
        if hilly {
            pricer.legs_at_best(&from, &to, &mut prices);
        } else {
            pricer.legs(&from, &to, &mut prices);
        }
        let own: Vec<(f64, f64)> = places
            .iter()
            .map(|&place| model.waypoint(place, tolerance))
            .collect();
        let direct = (scenario.target - scenario.start).norm();
        let worth = WORTH * direct * metre(scenario);
        let mut costs = vec![vec![f64::INFINITY; count]; count];
        for (idx, &(a, b)) in ends.iter().enumerate() {
            let (price, lane) = (&prices[idx / LANES], idx % LANES);
            if price.violation[lane] > 0.0 {
                continue;
            }
            // Half of what either end costs as a waypoint; the ends of the route cost nothing.
            let of = |place: usize| {
                if place == 0 || place == count - 1 {
                    0.0
                } else {
                    0.5 * (own[place].1 + worth)
                }
            };
            let cost = price.cost[lane] + of(a) + of(b);
            (costs[a][b], costs[b][a]) = (cost, cost);
        }
        Self {
            places,
            pricer,
            costs,
            measured: vec![vec![!hilly; count]; count],
        }
    }

    /// Measure the heights of the legs from `before` to `place`.
    fn measure(&mut self, before: &[usize], place: usize) {
        let ends: Vec<(usize, usize)> = before
            .iter()
            .map(|&other| (other.min(place), other.max(place)))
            .collect();
        let [from, to] = net::rows(self.places, &ends);
        let mut prices = vec![Price::ZERO; from.len()];
        self.pricer
            .heights_of_legs(&from, &to, ends.len(), &mut prices);
        for (idx, &(a, b)) in ends.iter().enumerate() {
            (self.measured[a][b], self.measured[b][a]) = (true, true);
            if prices[idx / LANES].violation[idx % LANES] > 0.0 {
                (self.costs[a][b], self.costs[b][a]) = (f64::INFINITY, f64::INFINITY);
            }
        }
    }

    /// The cheapest chains from `source`.
    ///
    /// A leg is measured when the cheapest chain to a place is about to end with it: others are no part of
    /// any. If it breaks a limit, the place waits for its next best chain.
    fn cheapest(&mut self, source: usize) -> Tree {
        let count = self.places.len();
        let mut tree = Tree::from(source, count);
        let (costs, before) = (&mut tree.costs, &mut tree.before);
        let mut open: Vec<usize> = (0..count).collect();
        let mut closed = Vec::with_capacity(count);
        while let Some(nearest) =
            (0..open.len()).min_by(|&a, &b| costs[open[a]].total_cmp(&costs[open[b]]))
        {
            let place = open[nearest];
            let last = before[place];
            if last != place && !self.measured[last][place] {
                self.measure(&self.likeliest(&closed, costs, place), place);
                if self.costs[last][place].is_infinite() {
                    (costs[place], before[place]) = (f64::INFINITY, place);
                    for &other in &closed {
                        let cost = costs[other] + self.costs[other][place];
                        if cost < costs[place] {
                            (costs[place], before[place]) = (cost, other);
                        }
                    }
                    continue;
                }
            }
            open.remove(nearest);
            closed.push(place);
            let row = &self.costs[place];
            for &next in &open {
                let cost = costs[place] + row[next];
                if cost < costs[next] {
                    costs[next] = cost;
                    before[next] = place;
                }
            }
        }
        tree
    }

    /// Of the places that are `closed`, the few by which `place` is reached cheapest by a leg not yet
    /// measured: as many as are measured at once.
    fn likeliest(&self, closed: &[usize], costs: &[f64], place: usize) -> Vec<usize> {
        let mut few: Vec<(f64, usize)> = Vec::with_capacity(LANES + 1);
        let (legs, measured) = (&self.costs[place], &self.measured[place]);
        let mut worst = f64::INFINITY;
        for &other in closed {
            let cost = costs[other] + legs[other];
            if cost >= worst || measured[other] {
                continue;
            }
            let at = few.partition_point(|(less, _)| *less <= cost);
            few.insert(at, (cost, other));
            few.truncate(LANES);
            if let Some(last) = few.get(LANES - 1) {
                worst = last.0;
            }
        }
        few.into_iter().map(|(_, other)| other).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::hilly_scenario;

    /// Chains are the same whether legs are measured when their turn comes or all of them before.
    #[test]
    fn legs_measured_late_change_no_chain() {
        let scenario = hilly_scenario();
        let model = Model::new(&scenario);
        let places = places(&model);
        let (mut late, mut early) = (Legs::new(&model, &places), Legs::new(&model, &places));
        let all: Vec<usize> = (0..places.len()).collect();
        for place in 0..places.len() {
            early.measure(&all[..place], place);
        }
        for source in [0, places.len() - 1] {
            let (found, expected) = (late.cheapest(source), early.cheapest(source));
            let bits = |tree: &Tree| {
                let costs = tree.costs.iter();
                costs.map(|cost| cost.to_bits()).collect::<Vec<_>>()
            };
            assert_eq!(bits(&found), bits(&expected));
            assert_eq!(found.before, expected.before);
        }
        let measured = late
            .measured
            .iter()
            .flatten()
            .filter(|&&known| known)
            .count();
        assert!(measured < places.len() * places.len() / 2, "{measured}");
    }
}
