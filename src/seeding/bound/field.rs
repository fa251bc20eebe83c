//! What is proven about routes that use some of the events.

use std::cell::Cell;

use super::MOST_WAYS_IN_ALL;
use super::ends::{self, Legs};
use super::event::{Event, Kind};
use super::prices::Prices;
use super::string;
use super::wall::Wall;
use crate::scenario::Scenario;

/// Effort allowed for distinguishing first and last legs.
const EFFORT: usize = 40_000;

/// Maximum number of events examined one by one.
const MOST_ALLOWED: usize = 40;

/// Cost of the first event that is not allowed at `level`.
pub(super) fn cost_of(events: &[Event], level: usize) -> f64 {
    events.get(level).map_or(f64::INFINITY, |event| event.cost)
}

/// How often more of them are allowed for the climb into the band.
const MOST_RISING: usize = 4;

/// A scenario as used by a bound.
pub(super) struct Field<'a> {
    pub(super) scenario: &'a Scenario,
    pub(super) prices: &'a Prices,
    pub(super) walls: &'a [Wall],
    /// Ways looked at so far.
    pub(super) ways: Cell<usize>,
    pub(super) stop: &'a dyn Fn() -> bool,
}

impl Field<'_> {
    /// A lower bound for routes that use at most the `allowed` events; `enough` or more where that is reached.
    pub(super) fn level(&self, allowed: &[Event], enough: f64) -> f64 {
        let enough_across = self.prices.across(enough);
        let across = |radii: &[Option<f64>], spent: &[usize]| {
            let limits = (enough_across, self.stop);
            let (cost, ways) = string::cost((self.walls, radii), self.prices, spent, limits);
            self.ways.set(self.ways.get() + ways);
            cost
        };
        let cost = |radii: &[Option<f64>]| self.prices.climbing_at(across(radii, &[]));
        let tame = cost(&self.radii(allowed));
        if allowed.is_empty() || tame >= enough {
            return tame;
        }
        // Either no event happens, or one does: then its price is added, but what it is made of must not be counted
        // twice.
        let extra = allowed
            .iter()
            .map(|event| event.extra)
            .fold(f64::INFINITY, f64::min);
        if extra <= 0.0 || self.ways.get() > MOST_WAYS_IN_ALL {
            return tame;
        }
        let touched: Vec<usize> = allowed.iter().flat_map(Event::walls).collect();
        let with = self.with_one(allowed, across(&self.bare(allowed), &touched));
        tame.max(with.min(cost(&self.radii(&[]))))
    }

    /// A lower bound for routes that use at least one of the `allowed` events and cost at least `across` seen from above
    /// beside what these are made of.
    fn with_one(&self, allowed: &[Event], across: f64) -> f64 {
        let climbing = self.prices.climbing_at(across);
        let with = |event: &Event| match event.kind {
            // Its waypoint is one of those that the climb to the middle of the band counts.
            Kind::Pass { .. } => climbing.max(self.prices.level_at(across) + event.extra),
            Kind::Slip { .. } | Kind::Dip { .. } => climbing + event.extra,
        };
        allowed.iter().map(with).fold(f64::INFINITY, f64::min)
    }

    /// A lower bound for all routes, event by event, and by the legs that begin at the start and end at the target;
    /// none costs less than `dense` seen from above.
    pub(super) fn one_by_one(&self, events: &[Event], dense: f64) -> f64 {
        let radii = self.radii(&[]);
        let least = dense.max(self.across(&radii, &[]));
        // The bound for routes that use no event.
        let mut effort = EFFORT;
        let mut legs = self.legs(&radii, least, effort / 2);
        let without = legs.bound(least, f64::INFINITY);
        effort -= effort / 2 - legs.effort;
        let affordable = events.partition_point(|event| event.cost < without);
        let count = affordable.min(MOST_ALLOWED);
        let proven = without.min(cost_of(events, count));
        let mut allowed = events[..count].to_vec();
        // Events that no route uses for less than that leave more of the walls for the others.
        while !allowed.is_empty() {
            let radii = self.radii(&allowed);
            let least = dense.max(self.across(&radii, &[]));
            let across = |event: &Event| least.max(self.using(event, &radii));
            let used: Vec<(Event, f64)> = allowed
                .iter()
                .map(|event| (*event, across(event)))
                .collect();
            let mut legs = self.legs(&radii, least, effort);
            let cost =
                |legs: &Legs, (event, across): &(Event, f64)| legs.known(*across).max(event.cost);
            let cheap = |legs: &Legs| -> Vec<Event> {
                let cheap = used.iter().filter(|used| cost(legs, used) < proven);
                cheap.map(|(event, _)| *event).collect()
            };
            let mut left = cheap(&legs);
            if left.len() == used.len() {
                let cheapest = used
                    .iter()
                    .fold(f64::INFINITY, |least, (_, across)| least.min(*across));
                legs.bound(cheapest, proven);
                effort = legs.effort;
                left = cheap(&legs);
                if left.len() == used.len() || effort == 0 {
                    return used
                        .iter()
                        .map(|used| cost(&legs, used))
                        .fold(proven, f64::min);
                }
            }
            allowed = left;
        }
        proven
    }

    /// A lower bound for all routes from what it takes to enter the band from ends outside it, where routes that use
    /// more than the first `count` of `events` may be cheaper.
    pub(super) fn rising(&self, events: &[Event], mut count: usize) -> f64 {
        let mut proven = 0.0_f64;
        for _ in 0..MOST_RISING {
            let radii = self.radii(&events[..count]);
            let field = (self.walls, &radii[..]);
            let rising = ends::rising(self.scenario, self.prices, field, self.stop);
            proven = proven.max(rising.min(cost_of(events, count)));
            let cheaper = events.partition_point(|event| event.cost < rising);
            if cheaper <= count {
                break;
            }
            count = cheaper;
        }
        proven
    }

    fn legs<'a>(&'a self, radii: &'a [Option<f64>], least: f64, effort: usize) -> Legs<'a> {
        let field = (self.walls, radii);
        Legs::new(
            self.scenario,
            self.prices,
            field,
            least,
            (effort, self.stop),
        )
    }

    /// A lower bound, seen from above, for routes that use `event`, where each wall counts as hard at one of these
    /// `radii` whatever else the route uses.
    fn using(&self, event: &Event, radii: &[Option<f64>]) -> f64 {
        let spent: Vec<usize> = event.walls().collect();
        match event.kind {
            // The toll may coincide with what a first or last leg pays.
            Kind::Pass { .. } => 0.0,
            Kind::Dip { wall } => {
                let mut bare = radii.to_vec();
                bare[wall] = bare[wall].map(|_| self.walls[wall].core);
                self.across(&bare, &spent) + event.extra
            }
            Kind::Slip { walls, between } => {
                let cores = walls.map(|wall| self.walls[wall].core);
                let gap = string::Gap::new(between, cores);
                let field = (self.walls, radii);
                string::through(field, self.prices, &spent, gap, self.stop) + event.extra
            }
        }
    }

    /// A lower bound, seen from above, for routes round the walls widened to `radii`.
    fn across(&self, radii: &[Option<f64>], spent: &[usize]) -> f64 {
        let limits = (f64::INFINITY, self.stop);
        let (cost, ways) = string::cost((self.walls, radii), self.prices, spent, limits);
        self.ways.set(self.ways.get() + ways);
        cost
    }

    /// How far each wall may be widened so that it counts as hard whatever `allowed` events happen.
    pub(super) fn radii(&self, allowed: &[Event]) -> Vec<Option<f64>> {
        let mut radii: Vec<Option<f64>> = self.walls.iter().map(|wall| Some(wall.wide)).collect();
        for event in allowed {
            match event.kind {
                Kind::Pass { wall } => radii[wall] = None,
                Kind::Dip { wall } => {
                    radii[wall] = radii[wall].map(|radius| radius.min(self.walls[wall].safe));
                }
                Kind::Slip { .. } => {}
            }
        }
        for event in allowed {
            if let Kind::Slip {
                walls,
                between: [p, q],
            } = event.kind
                && let apart = (q - p).norm()
                && let [Some(one), Some(other)] = walls.map(|wall| radii[wall])
                && one + other > apart
            {
                let [core, next] = self.bare_radii(walls, apart);
                if self.is_hardly_open(walls, apart) {
                    radii[walls[0]] = Some(one.min(core));
                    radii[walls[1]] = Some(other.min(next));
                    continue;
                }
                // Both shrink alike, but not below their cores.
                let shrunk = (one - 0.5 * (one + other - apart))
                    .max(core)
                    .min(apart - next);
                radii[walls[0]] = Some(shrunk);
                radii[walls[1]] = Some(other.min(apart - shrunk).min(if walls[0] == walls[1] {
                    shrunk
                } else {
                    other
                }));
            }
        }
        radii
    }

    /// The walls without those soft zones that `allowed` events touch.
    fn bare(&self, allowed: &[Event]) -> Vec<Option<f64>> {
        let mut radii = self.radii(&[]);
        for event in allowed {
            match event.kind {
                Kind::Pass { wall } => radii[wall] = None,
                Kind::Dip { wall } => radii[wall] = radii[wall].map(|_| self.walls[wall].core),
                Kind::Slip {
                    walls,
                    between: [p, q],
                } => {
                    for (wall, bare) in walls
                        .into_iter()
                        .zip(self.bare_radii(walls, (q - p).norm()))
                    {
                        radii[wall] = radii[wall].map(|radius| radius.min(bare));
                    }
                }
            }
        }
        radii
    }

    /// Radii of two walls `apart` that leave a string way between them: those of their cores, or a little less where
    /// the way is no wider than what routes may enter.
    fn bare_radii(&self, walls: [usize; 2], apart: f64) -> [f64; 2] {
        let cores = walls.map(|wall| self.walls[wall].core);
        if self.is_hardly_open(walls, apart) {
            cores.map(|core| (core - 2.0 * self.prices.tolerance).max(0.0))
        } else {
            cores
        }
    }

    /// Whether the way between two walls `apart` is no wider than what routes may enter.
    fn is_hardly_open(&self, walls: [usize; 2], apart: f64) -> bool {
        let hard: f64 = walls.iter().map(|wall| self.walls[*wall].core).sum();
        apart <= hard + self.prices.tolerance
    }
}
