//! Ways over the ground: the cheapest routes through a net of places in the middle of the band.
//!
//! Taut strings know threats, but neither mountains nor what crossing a soft zone costs. Here every
//! leg between two of some hundred places is priced as it is, those that break a limit left out, and
//! the cheapest chains from start to target are found; turns alone are not looked at.

use super::lifted;
use crate::cost::Model;
use crate::cost::batch::{LANES, PointRow, Price, Pricer};
use crate::geometry::{Point2, Point3, Vector2};
use crate::planner::price::PRICED_FROM;
use crate::terrain::Terrain;

/// Places of the net, besides both ends, on level ground.
const PLACES: usize = 160;

/// Over hills, where passes are narrow.
const PLACES_OVER_HILLS: usize = 320;

/// The net covers all points of which the way over them is at most so many times the direct one.
const DETOUR: f64 = 1.4;

/// What a waypoint must gain, as a share of the direct way's fuel.
const WORTH: f64 = 1e-4;

/// What the net gave.
pub(super) struct Net {
    /// Routes that differ, the cheapest first.
    pub(super) routes: Vec<Vec<Point3>>,
    /// Legs priced for it.
    pub(super) legs_priced: u64,
}

/// Up to `count` routes that differ.
pub(super) fn routes(model: &Model, count: usize) -> Net {
    let places = places(model);
    let legs_priced = (places.len() * (places.len() - 1) / 2) as u64;
    let mut legs = Legs::new(model, &places);
    let target = places.len() - 1;
    let (from_start, before) = cheapest(&mut legs, 0);
    let (to_target, after) = cheapest(&mut legs, target);
    // The cheapest route over each place; neighbours of a route's own places give it again.
    let mut over: Vec<(f64, usize)> = (0..places.len())
        .map(|place| (from_start[place] + to_target[place], place))
        .filter(|(cost, _)| cost.is_finite())
        .collect();
    over.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    let mut routes: Vec<Vec<Point3>> = Vec::new();
    for (_, place) in over {
        let mut chain = trace(&before, place);
        chain.reverse();
        chain.extend(trace(&after, place).into_iter().skip(1));
        let route: Vec<Point3> = chain.into_iter().map(|idx| places[idx]).collect();
        if !routes.iter().any(|other| near(model, &route, other)) {
            routes.push(route);
        }
        if routes.len() == count {
            break;
        }
    }
    Net {
        routes,
        legs_priced,
    }
}

/// Start, a hexagonal net, target.
fn places(model: &Model) -> Vec<Point3> {
    let scenario = model.scenario;
    let (start, target) = (scenario.start.xy(), scenario.target.xy());
    let way = target - start;
    let direct = way.norm();
    let along = way / direct;
    let across = Vector2::new(-along.y, along.x);
    // An ellipse with both ends as its foci.
    let (long, wide) = (
        0.5 * DETOUR * direct,
        0.5 * direct * (DETOUR * DETOUR - 1.0).sqrt(),
    );
    let count = match scenario.terrain {
        Terrain::Flat(_) => PLACES,
        Terrain::Peaks(_) | Terrain::Grid(_) | Terrain::Dem(_) => PLACES_OVER_HILLS,
    };
    let step = (std::f64::consts::PI * long * wide / (0.866 * count as f64)).sqrt();
    let middle = nalgebra::center(&start, &target);
    let mut places = vec![scenario.start];
    let (rows, columns) = ((wide / (0.866 * step)).floor(), (long / step).ceil());
    let mut row = -rows;
    while row <= rows {
        let shift = if row.rem_euclid(2.0) < 0.5 { 0.0 } else { 0.5 };
        let mut column = -columns;
        while column <= columns {
            let (x, y) = ((column + shift) * step, row * 0.866 * step);
            let at: Point2 = middle + along * x + across * y;
            let inside = (x / long) * (x / long) + (y / wide) * (y / wide) <= 1.0;
            if inside && scenario.area.contains(at) {
                places.push(lifted(scenario, at));
            }
            column += 1.0;
        }
        row += 1.0;
    }
    places.push(scenario.target);
    places
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
        let mut pairs = Pairs::default();
        for a in 0..count {
            for b in a + 1..count {
                pairs.push(places, (a, b));
            }
        }
        let mut prices = vec![Price::ZERO; pairs.from.len()];
        let hilly = !matches!(scenario.terrain, Terrain::Flat(_));
        if hilly {
            pricer.legs_at_best(&pairs.from, &pairs.to, &mut prices);
        } else {
            pricer.legs(&pairs.from, &pairs.to, &mut prices);
        }
        let own: Vec<(f64, f64)> = places
            .iter()
            .map(|&place| model.waypoint(place, tolerance))
            .collect();
        let direct = (scenario.target - scenario.start).norm();
        let worth = WORTH * direct * scenario.weights.fuel * scenario.vehicle.fuel_per_km / 1000.0;
        let mut costs = vec![vec![f64::INFINITY; count]; count];
        for (idx, &(a, b)) in pairs.ends.iter().enumerate() {
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
        let mut pairs = Pairs::default();
        for &other in before {
            pairs.push(self.places, (other.min(place), other.max(place)));
        }
        let mut prices = vec![Price::ZERO; pairs.from.len()];
        self.pricer
            .heights_of_legs(&pairs.from, &pairs.to, pairs.ends.len(), &mut prices);
        for (idx, &(a, b)) in pairs.ends.iter().enumerate() {
            (self.measured[a][b], self.measured[b][a]) = (true, true);
            if prices[idx / LANES].violation[idx % LANES] > 0.0 {
                (self.costs[a][b], self.costs[b][a]) = (f64::INFINITY, f64::INFINITY);
            }
        }
    }
}

/// Legs side by side.
#[derive(Default)]
struct Pairs {
    from: Vec<PointRow>,
    to: Vec<PointRow>,
    /// Numbers of the places of each.
    ends: Vec<(usize, usize)>,
}

impl Pairs {
    fn push(&mut self, places: &[Point3], (a, b): (usize, usize)) {
        let lane = self.ends.len() % LANES;
        if lane == 0 {
            self.from.push(PointRow::splat(places[a]));
            self.to.push(PointRow::splat(places[b]));
        }
        let row = self.from.len() - 1;
        self.from[row].set(lane, places[a]);
        self.to[row].set(lane, places[b]);
        self.ends.push((a, b));
    }
}

/// Of the cheapest chains of `legs` from `source`: what each costs, and the place before its last.
///
/// A leg is measured when the cheapest chain to a place is about to end with it: others are no part of
/// any. If it breaks a limit, the place waits for its next best chain.
fn cheapest(legs: &mut Legs, source: usize) -> (Vec<f64>, Vec<usize>) {
    let count = legs.places.len();
    let mut costs = vec![f64::INFINITY; count];
    let mut before: Vec<usize> = (0..count).collect();
    let mut open = vec![true; count];
    let mut closed = Vec::with_capacity(count);
    costs[source] = 0.0;
    while closed.len() < count {
        let nearest = (0..count).filter(|&place| open[place]);
        let Some(place) = nearest.min_by(|&a, &b| costs[a].total_cmp(&costs[b])) else {
            break;
        };
        let last = before[place];
        if last != place && !legs.measured[last][place] {
            legs.measure(&likeliest(legs, &closed, &costs, place), place);
            if legs.costs[last][place].is_infinite() {
                (costs[place], before[place]) = (f64::INFINITY, place);
                for &other in &closed {
                    let cost = costs[other] + legs.costs[other][place];
                    if cost < costs[place] {
                        (costs[place], before[place]) = (cost, other);
                    }
                }
                continue;
            }
        }
        open[place] = false;
        closed.push(place);
        for next in 0..count {
            let cost = costs[place] + legs.costs[place][next];
            if cost < costs[next] {
                costs[next] = cost;
                before[next] = place;
            }
        }
    }
    (costs, before)
}

/// Of the places that are `closed`, the few by which `place` is reached cheapest by a leg not yet measured:
/// as many as are measured at once.
fn likeliest(legs: &Legs, closed: &[usize], costs: &[f64], place: usize) -> Vec<usize> {
    let mut few: Vec<(f64, usize)> = Vec::with_capacity(LANES + 1);
    for &other in closed {
        let cost = costs[other] + legs.costs[other][place];
        let worst = few.last().map_or(f64::INFINITY, |last| last.0);
        if legs.measured[other][place]
            || cost.is_infinite()
            || (few.len() == LANES && cost >= worst)
        {
            continue;
        }
        let at = few.partition_point(|(less, _)| *less <= cost);
        few.insert(at, (cost, other));
        few.truncate(LANES);
    }
    few.into_iter().map(|(_, other)| other).collect()
}

/// From `place` back to where all chains begin.
fn trace(before: &[usize], mut place: usize) -> Vec<usize> {
    let mut chain = vec![place];
    while before[place] != place {
        place = before[place];
        chain.push(place);
    }
    chain
}

/// Whether every waypoint of `route` lies near to a leg of `other`.
fn near(model: &Model, route: &[Point3], other: &[Point3]) -> bool {
    let reach = 2.0 * super::super::SAME * (model.scenario.target - model.scenario.start).norm();
    route.iter().all(|point| {
        other.windows(2).any(|ends| {
            let way = ends[1] - ends[0];
            let share = ((point - ends[0]).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
            (ends[0] + way * share - point).norm() <= reach
        })
    })
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
            let (costs, before) = cheapest(&mut late, source);
            let (expected, expected_before) = cheapest(&mut early, source);
            let bits = |costs: &[f64]| costs.iter().map(|cost| cost.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&costs), bits(&expected));
            assert_eq!(before, expected_before);
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
