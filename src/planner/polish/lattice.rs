//! All waypoints at once, each to one of a few places near it: dynamic programming over the legs.
//!
//! Every waypoint has [`CHOICES`] places, its own among them. Legs between places of neighbours are
//! priced alone; turns join two legs. The best combination of all places is found exactly, so that
//! waypoints that only gain together, such as those of one bend, move together.

use super::super::price::PRICED_FROM;
use crate::cost::batch::{LANES, PointRow, Price, Pricer, Row};
use crate::cost::{Model, Tolerance};
use crate::geometry::{LEVEL, Point2, Point3, Vector2, wrap_angle};
use crate::optimizer::Fitness;

/// Places of a waypoint: its own, and eight new ones that fill the lanes.
const CHOICES: usize = LANES + 1;

/// A number for each place of a waypoint.
type Each = [f64; CHOICES];

/// A number for each pair of places of two neighbours, by the first one's place.
type Pairs = [Each; CHOICES];

/// The new places, as shares of the step along the route, across it, and up.
const PATTERNS: [[[f64; 3]; LANES]; 2] = [pattern(0.7), pattern(-0.7)];

const fn pattern(diagonal: f64) -> [[f64; 3]; LANES] {
    [
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

/// Cosines nearer than this to that of the greatest turn are not decided by it.
const NEAR_LIMIT: f64 = 1e-9;

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
    waypoints: Vec<Waypoint>,
    legs: Vec<Leg>,
    reached: Vec<Reached>,
    from: Vec<PointRow>,
    to: Vec<PointRow>,
    prices: Vec<Price>,
}

/// Where a waypoint may go; an end of the route stays, and none but its own place counts.
struct Waypoint {
    own: Point3,
    new: PointRow,
    /// What each place costs by itself, its own first.
    violation: Each,
    cost: Each,
}

/// From the places of one waypoint to those of the next, the latter's own prices included.
#[derive(Clone)]
struct Leg {
    violation: Pairs,
    cost: Pairs,
    /// Horizontal unit vectors; zero where a leg has no heading.
    east: Pairs,
    north: Pairs,
}

/// The best ways to the end of a leg.
#[derive(Clone)]
struct Reached {
    violation: Pairs,
    cost: Pairs,
    /// Place of the waypoint before the leg's start.
    from: [[u8; CHOICES]; CHOICES],
}

const EMPTY: Pairs = [[0.0; CHOICES]; CHOICES];

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
        self.waypoints.clear();
        for idx in 0..=last {
            let waypoint = self.waypoint(route, idx, step, turn);
            self.waypoints.push(waypoint);
        }
        self.price_legs(last);
        self.reach(last);
        self.trace_back(route)
    }

    fn waypoint(&self, route: &[Point3], idx: usize, step: f64, turn: usize) -> Waypoint {
        let own = route[idx];
        let mut waypoint = Waypoint {
            own,
            new: PointRow::splat(own),
            violation: [0.0; CHOICES],
            cost: [0.0; CHOICES],
        };
        if idx > 0 && idx + 1 < route.len() {
            waypoint.new = self.places(route, idx, step, turn);
            for place in 0..CHOICES {
                let (violation, cost) = self.model.waypoint(waypoint.place(place), self.tolerance);
                (waypoint.violation[place], waypoint.cost[place]) = (violation, cost);
            }
        }
        waypoint
    }

    /// Places that waypoint `idx` of a route up to `last` has.
    fn count(idx: usize, last: usize) -> usize {
        if idx == 0 || idx == last { 1 } else { CHOICES }
    }

    /// Price every leg between places of neighbours: those of the route itself last, the others in
    /// rows that lead to the eight new places of one waypoint, or come from them.
    fn price_legs(&mut self, last: usize) {
        self.from.clear();
        self.to.clear();
        for leg_idx in 0..last {
            let (a, b) = (&self.waypoints[leg_idx], &self.waypoints[leg_idx + 1]);
            if leg_idx + 1 < last {
                for place in 0..Self::count(leg_idx, last) {
                    self.from.push(PointRow::splat(a.place(place)));
                    self.to.push(b.new);
                }
            }
            if leg_idx > 0 {
                self.from.push(a.new);
                self.to.push(PointRow::splat(b.own));
            }
        }
        self.legs_priced += (self.from.len() * LANES + last) as u64;
        let own = self.from.len();
        for leg_idx in 0..last {
            let (a, b) = (self.waypoints[leg_idx].own, self.waypoints[leg_idx + 1].own);
            let lane = leg_idx % LANES;
            if lane == 0 {
                // Lanes that are left over repeat a leg.
                self.from.push(PointRow::splat(a));
                self.to.push(PointRow::splat(b));
            } else {
                let row = self.from.len() - 1;
                self.from[row].set(lane, a);
                self.to[row].set(lane, b);
            }
        }
        self.prices.clear();
        self.prices.resize(self.from.len(), Price::ZERO);
        self.pricer.legs(&self.from, &self.to, &mut self.prices);
        self.legs.clear();
        let mut rows = self.prices.iter();
        let mut next = || rows.next().expect("as many rows as were priced");
        for leg_idx in 0..last {
            let mut leg = Leg {
                violation: EMPTY,
                cost: EMPTY,
                east: EMPTY,
                north: EMPTY,
            };
            if leg_idx + 1 < last {
                for place in 0..Self::count(leg_idx, last) {
                    let price = next();
                    leg.violation[place][1..].copy_from_slice(&price.violation);
                    leg.cost[place][1..].copy_from_slice(&price.cost);
                }
            }
            if leg_idx > 0 {
                let price = next();
                for lane in 0..LANES {
                    leg.violation[lane + 1][0] = price.violation[lane];
                    leg.cost[lane + 1][0] = price.cost[lane];
                }
            }
            let (row, lane) = (own + leg_idx / LANES, leg_idx % LANES);
            leg.violation[0][0] = self.prices[row].violation[lane];
            leg.cost[0][0] = self.prices[row].cost[lane];
            let (a, b) = (&self.waypoints[leg_idx], &self.waypoints[leg_idx + 1]);
            leg.finish(a, b, Self::count(leg_idx, last));
            self.legs.push(leg);
        }
    }

    /// The best way to the end of every leg between places, from the start on.
    fn reach(&mut self, last: usize) {
        self.reached.clear();
        let first = &self.legs[0];
        self.reached.push(Reached {
            violation: first.violation,
            cost: first.cost,
            from: [[0; CHOICES]; CHOICES],
        });
        for leg_idx in 1..last {
            let (before, leg) = (&self.legs[leg_idx - 1], &self.legs[leg_idx]);
            let arrivals = &self.reached[leg_idx - 1];
            let mut reached = Reached {
                violation: leg.violation,
                cost: leg.cost,
                from: [[0; CHOICES]; CHOICES],
            };
            let sources = Self::count(leg_idx - 1, last);
            for b in 0..CHOICES {
                let price = |from: usize| Fitness {
                    violation: arrivals.violation[from][b],
                    cost: arrivals.cost[from][b],
                };
                let way = |from: usize| Vector2::new(before.east[from][b], before.north[from][b]);
                let best = (1..sources).fold(0, |best, from| {
                    if price(from).beats(&price(best)) {
                        from
                    } else {
                        best
                    }
                });
                for c in 0..Self::count(leg_idx + 1, last) {
                    let onto = Vector2::new(leg.east[b][c], leg.north[b][c]);
                    // Most departures need but one look.
                    let excess = self.excess_turn(way(best), onto);
                    let (mut arrival, mut from) = (price(best), best);
                    arrival.violation += excess;
                    if excess > 0.0 {
                        for other in 0..sources {
                            let mut turned = price(other);
                            if turned.violation > arrival.violation {
                                continue;
                            }
                            turned.violation += self.excess_turn(way(other), onto);
                            if turned.beats(&arrival) {
                                (arrival, from) = (turned, other);
                            }
                        }
                    }
                    reached.violation[b][c] += arrival.violation;
                    reached.cost[b][c] += arrival.cost;
                    reached.from[b][c] = u8::try_from(from).expect("there are nine places");
                }
            }
            self.reached.push(reached);
        }
    }

    /// From the target back along the best way.
    fn trace_back(&self, route: &mut [Point3]) -> bool {
        let last = route.len() - 1;
        let end = &self.reached[last - 1];
        let price = |place: usize| Fitness {
            violation: end.violation[place][0],
            cost: end.cost[place][0],
        };
        let (mut b, mut c) = (0, 0);
        for place in 1..Self::count(last - 1, last) {
            if price(place).beats(&price(b)) {
                b = place;
            }
        }
        let mut moved = false;
        for leg_idx in (0..last).rev() {
            route[leg_idx] = self.waypoints[leg_idx].place(b);
            moved |= b != 0;
            (b, c) = (usize::from(self.reached[leg_idx].from[b][c]), b);
        }
        moved
    }

    /// New places of waypoint `idx`. Frames follow the legs before, after and between by turns.
    fn places(&self, route: &[Point3], idx: usize, step: f64, turn: usize) -> PointRow {
        let here = route[idx];
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
        let mut places = PointRow::splat(here);
        for (lane, [a, c, rise]) in PATTERNS[turn % 2].into_iter().enumerate() {
            let at = scenario
                .area
                .nearest(here.xy() + along * (a * step) + across * (c * step));
            let mut raised = height + rise * step;
            // F3 has its kink at the middle of the band: no step may miss it.
            if (height - middle) * (raised - middle) < 0.0 {
                raised = middle;
            }
            let z = scenario.terrain.elevation(at) + raised.clamp(band.min, band.max);
            places.set(lane, self.reachable(at, z));
        }
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
        if dot > self.cos_turn + NEAR_LIMIT
            || before == Vector2::zeros()
            || after == Vector2::zeros()
        {
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

impl Waypoint {
    fn place(&self, place: usize) -> Point3 {
        if place == 0 {
            self.own
        } else {
            self.new.get(place - 1)
        }
    }

    /// One coordinate of each place.
    fn each(own: f64, new: &Row) -> Each {
        let mut each = [own; CHOICES];
        each[1..].copy_from_slice(new);
        each
    }
}

impl Leg {
    /// Add what the places of `b` cost, and the ways from those of `a`, of which so many count.
    fn finish(&mut self, a: &Waypoint, b: &Waypoint, count: usize) {
        let xs = Waypoint::each(b.own.x, &b.new.x);
        let ys = Waypoint::each(b.own.y, &b.new.y);
        for from in 0..count {
            let at = a.place(from);
            for to in 0..CHOICES {
                self.violation[from][to] += b.violation[to];
                self.cost[from][to] += b.cost[to];
                let (dx, dy) = (xs[to] - at.x, ys[to] - at.y);
                let length = (dx * dx + dy * dy).sqrt();
                let inverse = if length < LEVEL { 0.0 } else { 1.0 / length };
                (self.east[from][to], self.north[from][to]) = (dx * inverse, dy * inverse);
            }
        }
    }
}
