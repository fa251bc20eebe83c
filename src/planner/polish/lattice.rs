//! All waypoints at once, each to one of a few places near it: dynamic programming over the legs.
//!
//! Every waypoint has [`CHOICES`] places, its own among them. Legs between places of neighbours are
//! priced alone; turns join two legs. The best combination of all places is found exactly, so that
//! waypoints that only gain together, such as those of one bend, move together.

use super::super::price::PRICED_FROM;
use crate::cost::batch::{LANES, PointRow, Price, Pricer};
use crate::cost::{Model, Tolerance};
use crate::geometry::{LEVEL, Point2, Point3, Vector2, wrap_angle};
use crate::optimizer::Fitness;

/// Places of a waypoint; eight new ones fill the lanes.
const CHOICES: usize = 9;

/// Pairs of places of two neighbours.
const PAIRS: usize = CHOICES * CHOICES;

/// The places, as shares of the step along the route, across it, and up.
const PATTERNS: [[[f64; 3]; CHOICES]; 2] = [pattern(0.7), pattern(-0.7)];

const fn pattern(diagonal: f64) -> [[f64; 3]; CHOICES] {
    [
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [0.7, diagonal, 0.0],
        [-0.7, diagonal, 0.0],
    ]
}

/// Prices legs and joins them.
pub(super) struct Lattice<'m, 's> {
    model: &'m Model<'s>,
    pricer: Pricer<'s>,
    tolerance: Tolerance,
    /// Tangent of the steepest climb.
    steepest: f64,
    cos_turn: f64,
    max_turn_deg: f64,
    pub(super) legs_priced: u64,
    places: Vec<[Point3; CHOICES]>,
    /// Of each waypoint's places.
    waypoints: Vec<[Fitness; CHOICES]>,
    legs: Vec<[Leg; PAIRS]>,
    reached: Vec<[Reached; PAIRS]>,
    from: Vec<PointRow>,
    to: Vec<PointRow>,
    prices: Vec<Price>,
}

/// From one place to another.
#[derive(Clone, Copy)]
struct Leg {
    price: Fitness,
    /// Horizontal unit vector; zero where the leg has no heading.
    way: Vector2,
}

/// The best way to the end of a leg.
#[derive(Clone, Copy)]
struct Reached {
    price: Fitness,
    /// Place of the waypoint before the leg's start.
    from: usize,
}

const NOWHERE: Reached = Reached {
    price: Fitness::WORST,
    from: 0,
};

impl<'m, 's> Lattice<'m, 's> {
    pub(super) fn new(model: &'m Model<'s>) -> Self {
        let vehicle = &model.scenario.vehicle;
        let tolerance = model.tolerance.scaled(PRICED_FROM);
        Self {
            model,
            pricer: Pricer::new(model, model.scenario.planner.quadrature, tolerance),
            tolerance,
            steepest: libm::tan(vehicle.max_climb_deg.to_radians()),
            cos_turn: libm::cos(vehicle.max_turn_deg.to_radians()),
            max_turn_deg: vehicle.max_turn_deg,
            legs_priced: 0,
            places: Vec::new(),
            waypoints: Vec::new(),
            legs: Vec::new(),
            reached: Vec::new(),
            from: Vec::new(),
            to: Vec::new(),
            prices: Vec::new(),
        }
    }

    /// Move the waypoints of `route` to the best combination of places one `step` away; `turn` tells
    /// one sweep from the next. Whether any moved.
    pub(super) fn sweep(&mut self, route: &mut [Point3], step: f64, turn: usize) -> bool {
        let last = route.len() - 1;
        self.places.clear();
        self.waypoints.clear();
        for idx in 0..=last {
            let places = self.places_of(route, idx, step, turn);
            self.places.push(places);
            self.waypoints.push(places.map(|place| {
                let (violation, cost) = if idx == 0 || idx == last {
                    (0.0, 0.0)
                } else {
                    self.model.waypoint(place, self.tolerance)
                };
                Fitness { violation, cost }
            }));
        }
        self.price_legs(last);
        self.reach(last);
        self.trace_back(route)
    }

    /// Places that waypoint `idx` of a route up to `last` has.
    fn count(idx: usize, last: usize) -> usize {
        if idx == 0 || idx == last { 1 } else { CHOICES }
    }

    fn price_legs(&mut self, last: usize) {
        self.from.clear();
        self.to.clear();
        let mut lane = LANES;
        for leg_idx in 0..last {
            for a in 0..Self::count(leg_idx, last) {
                for b in 0..Self::count(leg_idx + 1, last) {
                    let (from, to) = (self.places[leg_idx][a], self.places[leg_idx + 1][b]);
                    if lane == LANES {
                        // Lanes that are left over repeat a leg.
                        self.from.push(PointRow::splat(from));
                        self.to.push(PointRow::splat(to));
                        lane = 0;
                    }
                    let row = self.from.len() - 1;
                    self.from[row].set(lane, from);
                    self.to[row].set(lane, to);
                    lane += 1;
                    self.legs_priced += 1;
                }
            }
        }
        self.prices.clear();
        self.prices.resize(self.from.len(), Price::ZERO);
        self.pricer.legs(&self.from, &self.to, &mut self.prices);
        let nothing = Leg {
            price: Fitness::WORST,
            way: Vector2::zeros(),
        };
        self.legs.clear();
        self.legs.resize(last, [nothing; PAIRS]);
        let mut priced = 0;
        for leg_idx in 0..last {
            for a in 0..Self::count(leg_idx, last) {
                for b in 0..Self::count(leg_idx + 1, last) {
                    let (row, lane) = (priced / LANES, priced % LANES);
                    priced += 1;
                    let (from, to) = (self.places[leg_idx][a], self.places[leg_idx + 1][b]);
                    let own = self.waypoints[leg_idx + 1][b];
                    let way = to.xy() - from.xy();
                    let length = way.norm();
                    self.legs[leg_idx][a * CHOICES + b] = Leg {
                        price: Fitness {
                            violation: self.prices[row].violation[lane] + own.violation,
                            cost: self.prices[row].cost[lane] + own.cost,
                        },
                        way: if length < LEVEL {
                            Vector2::zeros()
                        } else {
                            way / length
                        },
                    };
                }
            }
        }
    }

    /// The best way to the end of every leg between places, from the start on.
    fn reach(&mut self, last: usize) {
        self.reached.clear();
        self.reached.resize(last, [NOWHERE; PAIRS]);
        for b in 0..Self::count(1, last) {
            self.reached[0][b].price = self.legs[0][b].price;
        }
        for leg_idx in 1..last {
            let before = &self.legs[leg_idx - 1];
            for b in 0..Self::count(leg_idx, last) {
                let mut arrivals = [(NOWHERE, Vector2::zeros()); CHOICES];
                let arrivals = &mut arrivals[..Self::count(leg_idx - 1, last)];
                for (from, arrival) in arrivals.iter_mut().enumerate() {
                    let pair = from * CHOICES + b;
                    let price = self.reached[leg_idx - 1][pair].price;
                    *arrival = (Reached { price, from }, before[pair].way);
                }
                // With the best first, most departures need but one look.
                arrivals.sort_unstable_by(|one, other| {
                    let rank = one.0.price.rank(&other.0.price);
                    rank.then(one.0.from.cmp(&other.0.from))
                });
                for c in 0..Self::count(leg_idx + 1, last) {
                    let next = self.legs[leg_idx][b * CHOICES + c];
                    let mut best = self.best_arrival(arrivals, next.way);
                    best.price.violation += next.price.violation;
                    best.price.cost += next.price.cost;
                    self.reached[leg_idx][b * CHOICES + c] = best;
                }
            }
        }
    }

    /// The arrival, best first, that is still the best with the turn onto `way`.
    fn best_arrival(&self, arrivals: &[(Reached, Vector2)], way: Vector2) -> Reached {
        let mut best = NOWHERE;
        for &(arrival, before) in arrivals {
            if arrival.price.violation > best.price.violation {
                break;
            }
            let excess = self.excess_turn(before, way);
            let mut turned = arrival;
            turned.price.violation += excess;
            if turned.price.beats(&best.price) {
                best = turned;
            }
            if excess == 0.0 {
                break;
            }
        }
        best
    }

    /// From the target back along the best way.
    fn trace_back(&self, route: &mut [Point3]) -> bool {
        let last = route.len() - 1;
        let end = &self.reached[last - 1];
        let (mut b, mut c) = (0, 0);
        for place in 1..Self::count(last - 1, last) {
            if end[place * CHOICES].price.beats(&end[b * CHOICES].price) {
                b = place;
            }
        }
        let mut moved = false;
        for leg_idx in (0..last).rev() {
            route[leg_idx] = self.places[leg_idx][b];
            moved |= b != 0;
            (b, c) = (self.reached[leg_idx][b * CHOICES + c].from, b);
        }
        moved
    }

    /// The waypoint's own place first. Frames follow the legs before, after and between by turns.
    fn places_of(&self, route: &[Point3], idx: usize, step: f64, turn: usize) -> [Point3; CHOICES] {
        let here = route[idx];
        if idx == 0 || idx == route.len() - 1 {
            return [here; CHOICES];
        }
        let (before, after) = (route[idx - 1].xy(), route[idx + 1].xy());
        let way = match turn % 3 {
            0 => after - before,
            1 => here.xy() - before,
            _ => after - here.xy(),
        };
        let length = way.norm();
        let along = if length < LEVEL {
            Vector2::x()
        } else {
            way / length
        };
        let across = Vector2::new(-along.y, along.x);
        let scenario = self.model.scenario;
        let band = scenario.altitude;
        let middle = 0.5 * (band.min + band.max);
        let height = here.z - scenario.terrain.elevation(here.xy());
        let mut places = PATTERNS[turn % 2].map(|[a, c, rise]| {
            let at = scenario
                .area
                .nearest(here.xy() + along * (a * step) + across * (c * step));
            let mut raised = height + rise * step;
            // F3 has its kink at the middle of the band: no step may miss it.
            if (height - middle) * (raised - middle) < 0.0 {
                raised = middle;
            }
            let z = scenario.terrain.elevation(at) + raised.clamp(band.min, band.max);
            self.reachable(at, z)
        });
        places[0] = here;
        places
    }

    /// `z`, or the height nearest to it that can be climbed to from the start and from the target.
    fn reachable(&self, at: Point2, mut z: f64) -> Point3 {
        for end in [self.model.scenario.start, self.model.scenario.target] {
            let reach = (at - end.xy()).norm() * self.steepest * (1.0 - 1e-9);
            z = z.clamp(end.z - reach, end.z + reach);
        }
        Point3::new(at.x, at.y, z)
    }

    /// Degrees beyond the turn limit from one unit vector to the next.
    fn excess_turn(&self, before: Vector2, after: Vector2) -> f64 {
        let dot = before.dot(&after);
        // Most turns are well within; a leg without heading does not turn.
        if dot > self.cos_turn + 1e-9 || before == Vector2::zeros() || after == Vector2::zeros() {
            return 0.0;
        }
        let turn = wrap_angle(libm::atan2(before.perp(&after), dot)).abs();
        let amount = turn.to_degrees() - self.max_turn_deg;
        if amount > self.tolerance.angle_deg {
            amount
        } else {
            0.0
        }
    }
}
