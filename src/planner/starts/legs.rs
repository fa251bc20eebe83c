//! The legs between the places of a net: what each costs, and the cheapest chains of them. Over hills, whether a leg
//! keeps its heights is measured only when a chain is about to end with it.

use super::net::{self, Tree};
use super::vast::Watch;
use super::{few, may_turn};
use crate::cost::batch::{LANES, Pricer};
use crate::cost::{Model, metre};
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use crate::planner::price::{pricer, search_tolerance};
use crate::scenario::Scenario;

/// The net covers all points over which the way is at most this many times the direct one; the same limit holds for
/// legs.
pub(super) const DETOUR: f64 = 1.4;

/// What a waypoint must gain, as a share of the direct way's fuel.
const WORTH: f64 = 1e-4;

/// Maximum number of chains of few legs.
const FEW: usize = 4;

/// Maximum number of chains of few legs looked at.
const EFFORT: usize = 4_000;

/// The legs between places.
pub(super) struct Legs<'p, 's> {
    places: &'p [Point3],
    pricer: Pricer<'s>,
    /// The cost of each, row by row; infinite where it breaks a limit.
    costs: Vec<Vec<f64>>,
    /// Whether it is known to keep its heights; where those take long to measure, few legs are.
    measured: Vec<Vec<bool>>,
    pub(super) priced: u64,
    pub(super) watch: Watch<'p>,
    /// Cosine of the sharpest turn.
    pub(super) sharpest: f64,
}

impl<'p, 's> Legs<'p, 's> {
    /// All legs, or, where they take long, those that were priced before `is_over`.
    pub(super) fn new(
        model: &Model<'s>,
        places: &'p [Point3],
        known: f64,
        is_over: &'p dyn Fn() -> bool,
    ) -> Self {
        let scenario = model.scenario;
        let tolerance = search_tolerance(model);
        let pricer = pricer(model).verdicts();
        let count = places.len();
        let worth = WORTH * scenario.direct() * metre(scenario);
        // Half the cost of either end as a waypoint; the ends of the route cost nothing.
        let mut own: Vec<f64> = places
            .iter()
            .map(|&place| 0.5 * (model.waypoint(place, tolerance).1 + worth))
            .collect();
        (own[0], own[count - 1]) = (0.0, 0.0);
        let mut legs = Self {
            places,
            costs: vec![vec![f64::INFINITY; count]; count],
            measured: vec![vec![!pricer.is_hilly(); count]; count],
            pricer,
            priced: 0,
            watch: Watch::new(scenario, is_over),
            sharpest: scenario.vehicle.sharpest(),
        };
        for ends in worthwhile(scenario, places, known) {
            if !legs.price(&ends, &own) {
                break;
            }
        }
        legs
    }

    /// Price these legs, given half of each place's `own` cost; false where there is no time for all of them.
    fn price(&mut self, ends: &[(usize, usize)], own: &[f64]) -> bool {
        let hilly = self.pricer.is_hilly();
        for ends in ends.chunks(self.watch.most_unwatched) {
            if !self.watch.may_go_on(ends.len()) {
                return false;
            }
            let legs = net::priced(self.places, ends, |from, to, prices| {
                if hilly {
                    self.pricer.legs_at_best(from, to, prices);
                } else {
                    self.pricer.legs(from, to, prices);
                }
            });
            for (&(a, b), leg) in ends.iter().zip(&legs) {
                if leg.is_feasible() {
                    let cost = leg.cost + own[a] + own[b];
                    (self.costs[a][b], self.costs[b][a]) = (cost, cost);
                }
            }
            self.priced += ends.len() as u64;
        }
        true
    }

    /// The cheapest chains of at most `most` legs with turns that the vehicle can fly, no two alike.
    pub(super) fn few(&mut self, model: &Model, most: usize) -> Vec<Vec<Point3>> {
        let places = self.places;
        let mut found: Vec<Vec<Point3>> = Vec::new();
        few::chains(self, (most, EFFORT), |chain| {
            let chain: Vec<Point3> = chain.into_iter().map(|place| places[place]).collect();
            let is_like = |other: &Vec<Point3>| net::is_near(model, &chain, other, net::NEAR);
            if !found.iter().any(is_like) {
                found.push(chain);
            }
            found.len() == FEW
        });
        found
    }

    /// Measure the heights of the legs from `before` to `place`.
    fn measure(&mut self, before: &[usize], place: usize) {
        let ends: Vec<(usize, usize)> = before
            .iter()
            .map(|&other| (other.min(place), other.max(place)))
            .collect();
        // Where there is no time for them, none is used.
        let legs = if self.watch.may_go_on(ends.len()) {
            net::priced(self.places, &ends, |from, to, prices| {
                self.pricer.heights_of_legs(from, to, ends.len(), prices);
            })
        } else {
            vec![Fitness::WORST; ends.len()]
        };
        for (&(a, b), leg) in ends.iter().zip(&legs) {
            (self.measured[a][b], self.measured[b][a]) = (true, true);
            if !leg.is_feasible() {
                (self.costs[a][b], self.costs[b][a]) = (f64::INFINITY, f64::INFINITY);
            }
        }
    }

    /// The cheapest chains from `source`.
    ///
    /// A leg is measured when the cheapest chain to a place is about to end with it: others are part of none. If it
    /// breaks a limit, the place waits for its next best chain.
    pub(super) fn cheapest(&mut self, source: usize) -> Tree {
        let count = self.places.len();
        let mut tree = Tree::from(source, count);
        let (costs, before) = (&mut tree.costs, &mut tree.before);
        let mut open: Vec<usize> = (0..count).collect();
        let mut closed = Vec::with_capacity(count);
        while !self.watch.is_broken_off
            && let Some(nearest) =
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

    /// Of the places that are `closed`, those few from which an unmeasured leg reaches `place` most cheaply: as many as
    /// are measured at once.
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

/// From each place the legs to later ones that need be priced: a longer one is part of no route that is worth its fuel.
/// Place by place, as the prices of all at once would fill megabytes.
fn worthwhile(
    scenario: &Scenario,
    places: &[Point3],
    known: f64,
) -> impl Iterator<Item = Vec<(usize, usize)>> {
    let direct = scenario.direct();
    let away = [scenario.start, scenario.target]
        .map(|end| -> Vec<f64> { places.iter().map(|place| (place - end).norm()).collect() });
    let ways = away[0].iter().zip(&away[1]).map(|(one, other)| one + other);
    let worthwhile = known / metre(scenario);
    let farthest = ways.fold(worthwhile.max(DETOUR * direct), f64::max);
    (0..places.len()).map(move |a| {
        let is_near = |b: &usize| {
            let about = (away[0][a] + away[1][*b]).min(away[0][*b] + away[1][a]);
            about + (places[*b] - places[a]).norm() <= farthest
        };
        let near = (a + 1..places.len()).filter(is_near);
        near.map(|b| (a, b)).collect()
    })
}

impl few::Legs for Legs<'_, '_> {
    fn places(&self) -> usize {
        self.places.len()
    }

    fn onward(&self, from: usize) -> &[f64] {
        &self.costs[from]
    }

    fn cost(&mut self, from: usize, to: usize) -> f64 {
        if !self.measured[from][to] {
            self.measure(&[from], to);
        }
        self.costs[from][to]
    }

    fn may_turn(&self, corner: [usize; 3]) -> bool {
        may_turn(corner.map(|place| self.places[place]), self.sharpest)
    }
}

#[cfg(test)]
mod tests {
    use super::super::levels;
    use super::*;
    use crate::planner::tests::hilly_scenario;

    /// Chains are the same whether legs are measured on demand or all beforehand.
    #[test]
    fn measuring_legs_on_demand_changes_no_chain() {
        let scenario = hilly_scenario();
        let model = Model::new(&scenario);
        let spots = net::spots(&scenario, 320, DETOUR);
        let over = |&spot| levels::over(&scenario, spot, 1.5 * spots.step);
        let places: Vec<Point3> = std::iter::once(scenario.start)
            .chain(spots.points.iter().flat_map(over))
            .chain([scenario.target])
            .collect();
        let (mut late, mut early) = (
            Legs::new(&model, &places, 0.0, &|| false),
            Legs::new(&model, &places, 0.0, &|| false),
        );
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
