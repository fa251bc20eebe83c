//! The best way that breaks no limit, where one is known already: the route itself.
//!
//! Whatever breaks a limit, or cannot become cheaper than the known way, is left out from the start, so that little is
//! left to join. Legs may be found to break a limit later; results that do not involve them stay.

use super::turns::Turns;
use super::ways::{CHOICES, Each, Leg, Pairs, count};
use crate::geometry::Vector2;

/// Costs are summed from either end; a way more expensive than the known one by more than this share really is more
/// expensive.
const ROUNDING: f64 = 1e-9;

/// Every place: a bit for each.
const ALL: u16 = (1 << CHOICES) - 1;

/// Joins legs to ways that break no limit.
pub(super) struct ClearWays {
    turns: Turns,
    /// Maximum cost of the way.
    limit: f64,
    legs: Vec<Joint>,
}

/// A leg between the places of neighbours.
struct Joint {
    /// What it costs; infinite where it breaks a limit.
    own: Pairs,
    /// Lower bound of the cost from its end to the target.
    rest: Each,
    /// What it costs to its end from the start, and from which place of the waypoint before.
    reached: Pairs,
    from: [[u8; CHOICES]; CHOICES],
    /// Places where it may begin, if the way over them is to cost no more than the known one.
    hopeful: u16,
    /// Places from which it is worse than last time.
    touched: u16,
}

impl ClearWays {
    pub(super) fn new(turns: Turns) -> Self {
        Self {
            turns,
            limit: 0.0,
            legs: Vec::new(),
        }
    }

    /// Look at other `legs`: the known way is that of the first place of each waypoint.
    pub(super) fn set(&mut self, legs: &[Leg]) {
        let last = legs.len();
        self.legs.clear();
        for (leg_idx, leg) in legs.iter().enumerate() {
            let mut own = [[f64::INFINITY; CHOICES]; CHOICES];
            let rows = own.iter_mut().zip(&leg.violation).zip(&leg.cost);
            for ((own, violation), cost) in rows.take(count(leg_idx, last)) {
                let legs = own.iter_mut().zip(violation).zip(cost);
                for ((own, violation), cost) in legs.take(count(leg_idx + 1, last)) {
                    if *violation <= 0.0 {
                        *own = *cost;
                    }
                }
            }
            self.legs.push(Joint {
                own,
                rest: [0.0; CHOICES],
                reached: [[f64::INFINITY; CHOICES]; CHOICES],
                from: [[0; CHOICES]; CHOICES],
                hopeful: 0,
                touched: ALL,
            });
        }
        let known: f64 = self.legs.iter().map(|leg| leg.own[0][0]).sum();
        self.limit = known + known.abs() * ROUNDING;
        for leg_idx in (1..last).rev() {
            let leg = &self.legs[leg_idx];
            let rest = std::array::from_fn(|a| {
                let ways = leg.own[a].iter().zip(&leg.rest);
                ways.fold(f64::INFINITY, |least, (own, rest)| least.min(own + rest))
            });
            self.legs[leg_idx - 1].rest = rest;
        }
        self.find_hopeful();
    }

    /// Look from the start, with turns of any size, which places are too expensive to reach.
    fn find_hopeful(&mut self) {
        // Lower bounds of the cost from the start, and from the place to the target.
        let mut reached = [f64::INFINITY; CHOICES];
        reached[0] = 0.0;
        let mut rest = [0.0; CHOICES];
        for leg in &mut self.legs {
            for (place, (reached, rest)) in reached.iter().zip(&rest).enumerate() {
                leg.hopeful |= u16::from(reached + rest <= self.limit) << place;
            }
            let mut next = [f64::INFINITY; CHOICES];
            for (reached, own) in reached.iter().zip(&leg.own) {
                for (next, own) in next.iter_mut().zip(own) {
                    *next = next.min(reached + own);
                }
            }
            (reached, rest) = (next, leg.rest);
        }
    }

    /// A leg from place `a` to place `b` breaks a limit.
    pub(super) fn break_off(&mut self, leg_idx: usize, a: usize, b: usize) {
        self.legs[leg_idx].own[a][b] = f64::INFINITY;
        self.legs[leg_idx].touched |= 1 << a;
    }

    /// Write the place of each waypoint on the best way into `chosen`; whether there is one.
    pub(super) fn find(&mut self, legs: &[Leg], chosen: &mut Vec<usize>) -> bool {
        let last = self.legs.len();
        // Places to which the best ways have changed.
        let mut changed = 0;
        for leg_idx in 0..last {
            let rows = changed | std::mem::take(&mut self.legs[leg_idx].touched);
            changed = 0;
            for b in places(rows & self.legs[leg_idx].hopeful) {
                changed |= self.reach(legs, leg_idx, b);
            }
        }
        let end = |place: usize| self.legs[last - 1].reached[place][0];
        let best =
            (0..count(last - 1, last)).fold(
                0,
                |best, place| {
                    if end(place) < end(best) { place } else { best }
                },
            );
        if end(best).is_infinite() {
            return false;
        }
        chosen.clear();
        chosen.resize(last + 1, 0);
        let (mut b, mut c) = (best, 0);
        for leg_idx in (0..last).rev() {
            chosen[leg_idx] = b;
            (b, c) = (usize::from(self.legs[leg_idx].from[b][c]), b);
        }
        true
    }

    /// The best ways over place `b` to the ends of leg number `leg_idx`; at which of those they have changed.
    fn reach(&mut self, legs: &[Leg], leg_idx: usize, b: usize) -> u16 {
        let last = self.legs.len();
        let (before, rest) = self.legs.split_at_mut(leg_idx);
        let (joint, after) = rest.split_first_mut().expect("there is such a leg");
        let ends = after.first().map_or(1, |next| next.hopeful);
        let mut changed = 0;
        let mut arrivals = Arrivals::default();
        if let Some(before) = before.last() {
            for from in 0..count(leg_idx - 1, last) {
                arrivals.push(from, before.reached[from][b]);
            }
        } else {
            arrivals.push(0, 0.0);
        }
        for c in places(ends) {
            let (own, rest) = (joint.own[b][c], joint.rest[c]);
            let mut best = (f64::INFINITY, 0);
            for &(cost, from) in arrivals.sorted() {
                if own + cost + rest > self.limit {
                    break;
                }
                let onto = Vector2::new(legs[leg_idx].east[b][c], legs[leg_idx].north[b][c]);
                let may_turn = leg_idx == 0 || {
                    let before = &legs[leg_idx - 1];
                    let way = Vector2::new(before.east[from][b], before.north[from][b]);
                    self.turns.allow(way, onto)
                };
                if may_turn {
                    best = (own + cost, from);
                    break;
                }
            }
            if best.0.to_bits() != joint.reached[b][c].to_bits() {
                changed |= 1 << c;
            }
            joint.reached[b][c] = best.0;
            joint.from[b][c] = u8::try_from(best.1).expect("there are nine places");
        }
        changed
    }
}

/// The places whose bits are set.
fn places(bits: u16) -> impl Iterator<Item = usize> {
    let mut left = bits;
    std::iter::from_fn(move || {
        let next = left.trailing_zeros() as usize;
        left &= left.wrapping_sub(1);
        (next < CHOICES).then_some(next)
    })
}

/// Places from which another is reached, the cheapest first; equals in their own order.
#[derive(Default)]
struct Arrivals {
    sorted: [(f64, usize); CHOICES],
    count: usize,
}

impl Arrivals {
    fn push(&mut self, from: usize, cost: f64) {
        if cost.is_infinite() {
            return;
        }
        let mut at = self.count;
        while at > 0 && cost < self.sorted[at - 1].0 {
            self.sorted[at] = self.sorted[at - 1];
            at -= 1;
        }
        self.sorted[at] = (cost, from);
        self.count += 1;
    }

    fn sorted(&self) -> &[(f64, usize)] {
        &self.sorted[..self.count]
    }
}
