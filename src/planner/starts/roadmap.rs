//! Ways over the ground: the cheapest routes through a net of places in the middle of the band, and just above or
//! below threats that can be passed so.
//!
//! Taut strings take account of threats, but neither of mountains nor of the cost of crossing a soft zone. Here every
//! leg between two of some hundred places is priced as it is, those that break a limit left out, and the cheapest
//! chains from start to target are found; turns, and the allowed number of legs, are considered only where the cheapest
//! of all cannot be flown as it is (`few`).

use super::net::{self, Found, Tree};
use super::thin_band::is_thin_band;
use super::{few, levels, may_turn, may_turn_along};
use crate::cost::batch::{LANES, Price, Pricer};
use crate::cost::{Model, metre};
use crate::geometry::Point3;
use crate::planner::price::{pricer, search_tolerance};
use crate::scenario::Scenario;
use crate::terrain::Terrain;
use crate::threat::Threat;

/// Places of the net, apart from both ends, on level ground.
const PLACES: usize = 160;

/// The same over hills, where passes are narrow.
const PLACES_OVER_HILLS: usize = 320;

/// The same where the band is thin for the ground below it.
const PLACES_IN_A_THIN_BAND: usize = 640;

/// There, so many times as many routes are taken: more of them turn out to be the best once they are in place.
const MORE_IN_A_THIN_BAND: usize = 2;

/// The net covers all points over which the way is at most this many times the direct one; the same limit holds for
/// legs.
const DETOUR: f64 = 1.4;

/// Within this many steps of the net from a threat, a place also has the height that clears it.
const NEAR: f64 = 1.5;

/// What a waypoint must gain, as a share of the direct way's fuel.
const WORTH: f64 = 1e-4;

/// Maximum number of chains of few legs.
const FEW: usize = 4;

/// Chains of more legs than this are as good as those of any number.
const MOST_LEGS: usize = 12;

/// Maximum number of chains of few legs looked at.
const EFFORT: usize = 4_000;

/// With fewer legs than this between two checks, a scene is vast: that of 400 ring corners is, or of 4,000 peaks.
const VAST: usize = 1_000;

/// Number of threats, ring corners and peaks, counted for each leg priced, between two checks whether to stop: the net
/// of an ordinary scene takes so little time that it pays even where time is over.
const MET_UNWATCHED: usize = 4_000_000;

/// Up to `count` routes that differ, given that one costing about `known` is available without them; and where not even
/// the first of them can be flown as it is, some with few enough legs and gentle enough turns. None where it takes
/// long, once `is_over`.
pub(super) fn routes(
    model: &Model,
    count: usize,
    known: f64,
    is_over: &dyn Fn() -> bool,
) -> (Found, Vec<Vec<Point3>>) {
    let (spots, count) = fineness(model.scenario, count);
    let places = places(model, spots);
    let mut legs = Legs::new(model, &places, known, is_over);
    let trees = [0, places.len() - 1].map(|end| legs.cheapest(end));
    if legs.watch.is_broken_off {
        let found = Found {
            routes: Vec::new(),
            legs_priced: legs.priced,
        };
        return (found, Vec::new());
    }
    let routes = net::chains(model, &places, &trees, count);
    let most = model.scenario.planner.waypoints + 1;
    let can_be_flown =
        |chain: &Vec<Point3>| chain.len() <= most + 1 && may_turn_along(chain, legs.sharpest);
    let few = if routes.first().is_none_or(can_be_flown) {
        Vec::new()
    } else {
        legs.few(model, most.min(MOST_LEGS))
    };
    let legs_priced = legs.priced;
    let found = Found {
        routes,
        legs_priced,
    };
    (found, few)
}

/// Spots of the net, and the number of routes taken from it where `count` are wanted.
fn fineness(scenario: &Scenario, count: usize) -> (usize, usize) {
    if scenario.terrain.is_flat() {
        return (PLACES, count);
    }
    let spots = net::spots(scenario, PLACES_OVER_HILLS, DETOUR);
    if !is_vast(scenario) && is_thin_band(scenario, &spots) {
        (PLACES_IN_A_THIN_BAND, MORE_IN_A_THIN_BAND * count)
    } else {
        (PLACES_OVER_HILLS, count)
    }
}

/// Start, a net of about `count` spots in the middle of the band, target.
fn places(model: &Model, count: usize) -> Vec<Point3> {
    let scenario = model.scenario;
    let spots = net::spots(scenario, count, DETOUR);
    let near = NEAR * spots.step;
    let over = |&spot| levels::over(scenario, spot, near);
    std::iter::once(scenario.start)
        .chain(spots.points.iter().flat_map(over))
        .chain(levels::about_ends(scenario, 0.5 * spots.step))
        .chain([scenario.target])
        .collect()
}

/// Legs between two checks whether to stop.
fn legs_unwatched(scenario: &Scenario) -> usize {
    let peaks = match &scenario.terrain {
        Terrain::Peaks(peaks) => peaks.peaks.len(),
        Terrain::Flat(_) | Terrain::Grid(_) | Terrain::Dem(_) => 0,
    };
    let met = peaks + scenario.threats.iter().map(Threat::effort).sum::<usize>();
    (MET_UNWATCHED / met.max(1))
        .next_multiple_of(LANES)
        .max(LANES)
}

/// Whether so much may be met that even single routes take long to price.
pub(in crate::planner) fn is_vast(scenario: &Scenario) -> bool {
    legs_unwatched(scenario) < VAST
}

/// Looks now and then whether there is time left.
struct Watch<'p> {
    is_over: &'p dyn Fn() -> bool,
    most_unwatched: usize,
    /// Legs since it looked last.
    unwatched: usize,
    /// Whether there was no time for all of them.
    is_broken_off: bool,
}

impl Watch<'_> {
    /// Whether so many legs more may be looked at.
    fn may_go_on(&mut self, legs: usize) -> bool {
        self.unwatched += legs;
        if self.unwatched > self.most_unwatched {
            self.is_broken_off |= (self.is_over)();
            self.unwatched = legs;
        }
        !self.is_broken_off
    }
}

/// The legs between places.
struct Legs<'p, 's> {
    places: &'p [Point3],
    pricer: Pricer<'s>,
    /// The cost of each, row by row; infinite where it breaks a limit.
    costs: Vec<Vec<f64>>,
    /// Whether it is known to keep its heights; where those take long to measure, few legs are.
    measured: Vec<Vec<bool>>,
    priced: u64,
    watch: Watch<'p>,
    /// Cosine of the sharpest turn.
    sharpest: f64,
}

impl<'p, 's> Legs<'p, 's> {
    /// All legs, or, where they take long, those that were priced before `is_over`.
    fn new(
        model: &Model<'s>,
        places: &'p [Point3],
        known: f64,
        is_over: &'p dyn Fn() -> bool,
    ) -> Self {
        let scenario = model.scenario;
        let tolerance = search_tolerance(model);
        let pricer = pricer(model).verdicts();
        let count = places.len();
        let worth = WORTH * (scenario.target - scenario.start).norm() * metre(scenario);
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
            watch: Watch {
                is_over,
                most_unwatched: legs_unwatched(scenario),
                unwatched: 0,
                is_broken_off: false,
            },
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
            let [from, to] = net::rows(self.places, ends);
            let mut prices = vec![Price::ZERO; from.len()];
            if hilly {
                self.pricer.legs_at_best(&from, &to, &mut prices);
            } else {
                self.pricer.legs(&from, &to, &mut prices);
            }
            for (idx, &(a, b)) in ends.iter().enumerate() {
                let (price, lane) = (&prices[idx / LANES], idx % LANES);
                if price.violation[lane] <= 0.0 {
                    let cost = price.cost[lane] + own[a] + own[b];
                    (self.costs[a][b], self.costs[b][a]) = (cost, cost);
                }
            }
            self.priced += ends.len() as u64;
        }
        true
    }

    /// The cheapest chains of at most `most` legs with turns that the vehicle can fly, no two alike.
    fn few(&mut self, model: &Model, most: usize) -> Vec<Vec<Point3>> {
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
        let [from, to] = net::rows(self.places, &ends);
        let mut prices = vec![Price::ZERO; from.len()];
        if self.watch.may_go_on(ends.len()) {
            self.pricer
                .heights_of_legs(&from, &to, ends.len(), &mut prices);
        } else {
            // None of them is used.
            prices.fill(Price {
                violation: [f64::INFINITY; LANES],
                ..Price::ZERO
            });
        }
        for (idx, &(a, b)) in ends.iter().enumerate() {
            (self.measured[a][b], self.measured[b][a]) = (true, true);
            if prices[idx / LANES].violation[idx % LANES] > 0.0 {
                (self.costs[a][b], self.costs[b][a]) = (f64::INFINITY, f64::INFINITY);
            }
        }
    }

    /// The cheapest chains from `source`.
    ///
    /// A leg is measured when the cheapest chain to a place is about to end with it: others are part of none. If it
    /// breaks a limit, the place waits for its next best chain.
    fn cheapest(&mut self, source: usize) -> Tree {
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
    let direct = (scenario.target - scenario.start).norm();
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
    use super::*;
    use crate::geometry::Point2;
    use crate::planner::tests::{hilly_scenario, scenario};
    use crate::threat::{Polygon, Shape};

    /// Around a coast of thousands of corners legs take long to price, so a stop is checked after few of them.
    #[test]
    fn a_stop_is_noticed_while_legs_take_long_to_price() {
        let mut scenario = scenario();
        assert!(!is_vast(&scenario));
        let priced = |scenario: &Scenario, looks: u32| {
            let looked = std::cell::Cell::new(0);
            let is_over = || {
                looked.set(looked.get() + 1);
                looked.get() > looks
            };
            let found = routes(&Model::new(scenario), 8, f64::INFINITY, &is_over).0;
            (found.legs_priced, found.routes.is_empty())
        };
        let (all, is_empty) = priced(&scenario, 0);
        assert!(!is_empty);
        let coast = (0..8_000).map(|corner| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU / 8e3 * f64::from(corner));
            Point2::new(850.0 + 50.0 * cos, 150.0 + 50.0 * sin)
        });
        scenario.threats.push(Threat {
            name: None,
            shape: Shape::Polygon(Polygon::new(coast.collect(), 0.0)),
            base: None,
            top: None,
        });
        assert!(is_vast(&scenario));
        let most = legs_unwatched(&scenario) as u64;
        let (few, is_empty) = priced(&scenario, 2);
        assert!(is_empty);
        assert!(0 < few && few <= 3 * most && 3 * most < all, "{few} {all}");
        // However much there is, some legs are priced before the next check.
        let coast = scenario.threats.pop().expect("pushed");
        scenario.threats = vec![coast; 51];
        assert_eq!(legs_unwatched(&scenario), LANES);
    }

    /// Chains are the same whether legs are measured on demand or all beforehand.
    #[test]
    fn measuring_legs_on_demand_changes_no_chain() {
        let scenario = hilly_scenario();
        let model = Model::new(&scenario);
        let places = places(&model, PLACES_OVER_HILLS);
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
