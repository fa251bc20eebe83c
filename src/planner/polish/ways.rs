//! The best combination of places, one of each waypoint's: dynamic programming over the legs.

use super::turns::Turns;
use crate::cost::batch::{LANES, PointRow, Row};
use crate::cost::{Model, Tolerance};
use crate::geometry::{LEVEL, Point3, Vector2};
use crate::optimizer::Fitness;

/// Places of a waypoint: its own, and eight new ones that fill the lanes.
pub(super) const CHOICES: usize = LANES + 1;

/// A number for each place of a waypoint.
pub(super) type Each = [f64; CHOICES];

/// A number for each pair of places of two neighbours, by the first one's place.
pub(super) type Pairs = [Each; CHOICES];

/// Where a waypoint may go; an end of the route stays, and only its own place counts.
pub(super) struct Waypoint {
    pub(super) own: Point3,
    pub(super) new: PointRow,
    /// What each place costs by itself, its own first.
    pub(super) violation: Each,
    pub(super) cost: Each,
}

/// From the places of one waypoint to those of the next, the latter's own prices included.
pub(super) struct Leg {
    pub(super) violation: Pairs,
    pub(super) cost: Pairs,
    /// Horizontal unit vectors; zero where a leg has no heading.
    pub(super) east: Pairs,
    pub(super) north: Pairs,
}

/// The best ways to the end of a leg.
struct Reached {
    violation: Pairs,
    cost: Pairs,
    /// Place of the waypoint before the leg's start.
    from: [[u8; CHOICES]; CHOICES],
}

const EMPTY: Pairs = [[0.0; CHOICES]; CHOICES];

/// Number of places of waypoint `idx` of a route up to `last`.
pub(super) fn count(idx: usize, last: usize) -> usize {
    if idx == 0 || idx == last { 1 } else { CHOICES }
}

/// `fitness` with each unit of violation replaced by a cost of `rate`, if that is finite.
pub(super) fn paid(fitness: Fitness, rate: f64) -> Fitness {
    if rate.is_finite() {
        Fitness {
            violation: 0.0,
            cost: fitness.cost + rate * fitness.violation,
        }
    } else {
        fitness
    }
}

/// Joins legs to ways.
pub(super) struct Ways {
    turns: Turns,
    /// Cost of a unit of violation; infinite where no cost makes up for it.
    rate: f64,
    /// By leg.
    reached: Vec<Reached>,
}

/// Places by how well they are reached, the best first; equals in their own order.
struct Order {
    places: [usize; CHOICES],
    count: usize,
    /// How many break limits as little as the first one.
    least: usize,
}

impl Ways {
    /// For routes of `model`, whose turns count beyond `tolerance`.
    pub(super) fn new(model: &Model, tolerance: Tolerance) -> Self {
        Self {
            turns: Turns::new(model, tolerance),
            rate: f64::INFINITY,
            reached: Vec::new(),
        }
    }

    /// Find the best way to the end of every one of `legs` between places, where a unit of violation costs `rate`.
    pub(super) fn reach(&mut self, legs: &mut [Leg], rate: f64) {
        self.rate = rate;
        self.reached.clear();
        for leg in legs.iter_mut() {
            leg.pay(rate);
        }
        for leg_idx in 0..legs.len() {
            let mut reached = Reached {
                violation: legs[leg_idx].violation,
                cost: legs[leg_idx].cost,
                from: [[0; CHOICES]; CHOICES],
            };
            if let Some(arrivals) = self.reached.last() {
                for b in 0..CHOICES {
                    self.join(legs, leg_idx, b, arrivals, &mut reached);
                }
            }
            self.reached.push(reached);
        }
    }

    /// Add the best of the `arrivals` at place `b` to what is `reached` from there by leg number `leg_idx`.
    fn join(
        &self,
        legs: &[Leg],
        leg_idx: usize,
        b: usize,
        arrivals: &Reached,
        reached: &mut Reached,
    ) {
        let (turns, last) = (&self.turns, legs.len());
        let (before, leg) = (&legs[leg_idx - 1], &legs[leg_idx]);
        let sources = count(leg_idx - 1, last);
        let price = |from: usize| Fitness {
            violation: arrivals.violation[from][b],
            cost: arrivals.cost[from][b],
        };
        let way = |from: usize| Vector2::new(before.east[from][b], before.north[from][b]);
        let order = Order::of(sources, price);
        for c in 0..count(leg_idx + 1, last) {
            let onto = Vector2::new(leg.east[b][c], leg.north[b][c]);
            // Among those that break limits no more than the best, the first that does not require too sharp a turn.
            let straight = order.least().find(|&from| turns.allow(way(from), onto));
            let (arrival, from) = if let Some(from) = straight {
                (price(from), from)
            } else {
                let mut best = (Fitness::WORST, 0);
                for from in order.all() {
                    let mut turned = price(from);
                    if !turned.beats(&best.0) {
                        break;
                    }
                    turned.violation += turns.excess(way(from), onto);
                    turned = paid(turned, self.rate);
                    if turned.beats(&best.0) {
                        best = (turned, from);
                    }
                }
                best
            };
            reached.violation[b][c] += arrival.violation;
            reached.cost[b][c] += arrival.cost;
            reached.from[b][c] = u8::try_from(from).expect("there are nine places");
        }
    }

    /// The place of each waypoint on the best way to the target.
    pub(super) fn trace_back(&self, chosen: &mut Vec<usize>) {
        let last = self.reached.len();
        let end = &self.reached[last - 1];
        let price = |place: usize| Fitness {
            violation: end.violation[place][0],
            cost: end.cost[place][0],
        };
        let (mut b, mut c) = (0, 0);
        for place in 1..count(last - 1, last) {
            if price(place).beats(&price(b)) {
                b = place;
            }
        }
        chosen.clear();
        chosen.resize(last + 1, 0);
        for leg_idx in (0..last).rev() {
            chosen[leg_idx] = b;
            (b, c) = (usize::from(self.reached[leg_idx].from[b][c]), b);
        }
    }
}

impl Order {
    fn of(count: usize, price: impl Fn(usize) -> Fitness) -> Self {
        let mut places = [0; CHOICES];
        for place in 0..count {
            let own = price(place);
            let mut at = place;
            while at > 0 && own.beats(&price(places[at - 1])) {
                places[at] = places[at - 1];
                at -= 1;
            }
            places[at] = place;
        }
        let least = price(places[0]).violation;
        let as_little = |&&place: &&usize| price(place).violation <= least;
        Self {
            least: places[..count].iter().take_while(as_little).count(),
            places,
            count,
        }
    }

    fn least(&self) -> impl Iterator<Item = usize> + '_ {
        self.places[..self.least].iter().copied()
    }

    fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.places[..self.count].iter().copied()
    }
}

impl Waypoint {
    pub(super) fn place(&self, place: usize) -> Point3 {
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
    /// Not yet priced.
    pub(super) const EMPTY: Self = Self {
        violation: EMPTY,
        cost: EMPTY,
        east: EMPTY,
        north: EMPTY,
    };

    /// Replace each unit of violation by a cost of `rate`, if that is finite.
    fn pay(&mut self, rate: f64) {
        let violations = self.violation.iter_mut().flatten();
        for (violation, cost) in violations.zip(self.cost.iter_mut().flatten()) {
            let own = Fitness {
                violation: *violation,
                cost: *cost,
            };
            (*violation, *cost) = (paid(own, rate).violation, paid(own, rate).cost);
        }
    }

    /// Add the cost of the places of `b`, and of the ways from those of `a`, the first `count` of which are valid.
    pub(super) fn finish(&mut self, a: &Waypoint, b: &Waypoint, count: usize) {
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
