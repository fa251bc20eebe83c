//! The cheapest chains of legs that climb: built from each end until they have climbed, and joined where they meet.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::super::direction;
use super::places::{ENDS, Leg, legs, places};
use super::{Climb, SLACK, steepest};
use crate::cost::{Model, metre};
use crate::geometry::{Point2, Point3, wrap_angle};
use crate::planner::same;

/// Maximum number of routes returned.
const ROUTES: usize = 5;

/// Maximum number of meetings examined for them.
const MEETINGS: usize = 400;

/// Chains to one place by one leg are kept side by side if they differ by at least one of this many parts of the climb.
const PARTS: usize = 10;

/// Bends are no nearer to each other than this share of the direct way for each leg, where the vehicle may fly shorter
/// legs: without any room between, they would be one turn.
const SHORT: f64 = 0.1;

/// What a bend must gain, as a share of the fuel for the climb.
const WORTH: f64 = 1e-3;

/// Ways of one scenario that climb.
pub(super) struct Ways<'m, 's> {
    model: &'m Model<'s>,
    climb: Climb,
    places: Vec<Point2>,
    /// For each place, the height at which the climb leads over it, metres in the frame.
    levels: Vec<f64>,
    /// From each place, row by row, to each.
    legs: Vec<Leg>,
    /// Tangent of the steepest climb.
    steepest: f64,
    /// Greatest turn, radians.
    max_turn: f64,
    /// Distance between two bends, metres.
    side: f64,
    /// What a bend must gain.
    worth: f64,
}

/// A chain of legs away from one end of the route.
#[derive(Clone, Copy)]
struct Chain {
    cost: f64,
    /// Length along the ground, metres; no more than the climb may take.
    length: f64,
    /// Waypoints needed for its turns.
    bends: usize,
    /// State before its last leg.
    before: Option<usize>,
}

/// For each state its cheapest chain. A state is a leg, and how much of the climb has been flown at its end.
type Search = Vec<Option<Chain>>;

/// Chains to be extended, the cheapest first: the bits of their cost, which have the same order, and the state.
type Open = BinaryHeap<Reverse<(u64, usize)>>;

impl<'m, 's> Ways<'m, 's> {
    /// With bends at least `room` times their radius away from the edge of the area.
    pub(super) fn new(model: &'m Model<'s>, climb: Climb, room: f64) -> Self {
        let scenario = model.scenario;
        let max_turn = scenario.vehicle.max_turn() * (1.0 - SLACK);
        let short = SHORT * scenario.direct() / (scenario.planner.waypoints + 1) as f64;
        let side = scenario.vehicle.min_leg.max(short) * (1.0 + SLACK);
        let places = places(scenario, climb, room * side / max_turn);
        let level = |&at: &Point2| scenario.terrain.elevation(at) + climb.height;
        let levels: Vec<f64> = places.iter().map(level).collect();
        let fuel = metre(scenario) * climb.length();
        Self {
            legs: legs(model, &places, &levels),
            steepest: steepest(scenario),
            worth: WORTH * fuel,
            model,
            climb,
            places,
            levels,
            max_turn,
            side,
        }
    }

    /// Routes that differ, the cheapest first, with the share `near` of the length that the climb takes.
    pub(super) fn routes(&self, near: f64) -> Vec<Vec<Point3>> {
        let searches = [0, 1].map(|end| self.search(end, near));
        let mut routes: Vec<Vec<Point3>> = Vec::new();
        for states in self.meetings(&searches) {
            let route = self.route(&searches, states);
            let is_known = |other: &Vec<Point3>| same(self.model.scenario, &route, other);
            if !routes.iter().any(is_known) {
                routes.push(route);
            }
            if routes.len() == ROUTES {
                break;
            }
        }
        routes
    }

    /// How many legs were priced: those of half the square, since a leg costs the same both ways.
    pub(super) fn legs_priced(&self) -> u64 {
        (self.places.len() * (self.places.len() - 1) / 2) as u64
    }

    fn leg(&self, from: usize, to: usize) -> Leg {
        self.legs[from * self.places.len() + to]
    }

    fn state(&self, from: usize, to: usize, part: usize) -> usize {
        (from * self.places.len() + to) * (PARTS + 1) + part
    }

    /// The leg of a state, from and to.
    fn ends(&self, state: usize) -> (usize, usize) {
        let leg = state / (PARTS + 1);
        (leg / self.places.len(), leg % self.places.len())
    }

    /// The cheapest chains from one end of the route to all states.
    fn search(&self, end: usize, near: f64) -> Search {
        let count = self.places.len();
        let mut search = vec![None; count * count * (PARTS + 1)];
        let mut open = Open::new();
        let nothing = Chain {
            cost: 0.0,
            length: 0.0,
            bends: 0,
            before: None,
        };
        let extend = |chain, leg, search: &mut Search, open: &mut Open| {
            let (state, chain) = self.extended(end, near, chain, leg)?;
            let is_better = |known: &Chain| chain.cost < known.cost;
            if search[state].as_ref().is_none_or(is_better) {
                search[state] = Some(chain);
                open.push(Reverse((chain.cost.to_bits(), state)));
            }
            Some(())
        };
        for to in ENDS..count {
            extend(nothing, (end, to), &mut search, &mut open);
        }
        while let Some(Reverse((cost, state))) = open.pop() {
            let Some(mut chain) = search[state].filter(|chain| chain.cost.to_bits() == cost) else {
                continue;
            };
            let (from, at) = self.ends(state);
            let low = self.model.scenario.weights.altitude * self.low(end, at, chain.length);
            chain.before = Some(state);
            for to in (ENDS..count).filter(|&to| to != at) {
                let bends = self.bends((from, at), (at, to));
                let mut next = chain;
                next.bends += bends;
                next.cost += bends as f64 * (low + self.worth);
                if next.bends <= self.model.scenario.planner.waypoints {
                    extend(next, (at, to), &mut search, &mut open);
                }
            }
        }
        search
    }

    /// `chain`, whose bends are paid, with one more leg, and its state; `None` if that cannot be flown.
    fn extended(
        &self,
        end: usize,
        near: f64,
        mut chain: Chain,
        (from, to): (usize, usize),
    ) -> Option<(usize, Chain)> {
        let leg = self.leg(from, to);
        let needed = self.climb.needed[end];
        let most = needed + self.climb.more;
        let rise = leg.length.min(most - chain.length) * self.steepest;
        let climbing = libm::hypot(leg.length, rise) - leg.length;
        chain.cost += leg.cost + metre(self.model.scenario) * climbing;
        chain.length = (chain.length + leg.length).min(most);
        let has_climbed =
            chain.length >= near * needed && self.low(end, to, chain.length / near) <= 0.0;
        let part = if has_climbed {
            PARTS
        } else {
            part(chain.length / most)
        };
        let can_be_flown = chain.cost.is_finite();
        can_be_flown.then(|| (self.state(from, to, part), chain))
    }

    /// How far a chain is from its level over place `at`, after this length.
    fn low(&self, end: usize, at: usize, length: f64) -> f64 {
        let ends = [self.model.scenario.start, self.model.scenario.target];
        let climb = (ends[end].z - self.levels[at]).abs();
        (climb - length * self.steepest).max(0.0)
    }

    /// Waypoints needed to turn from one leg to the next.
    fn bends(&self, one: (usize, usize), next: (usize, usize)) -> usize {
        let turn = self.leg(next.0, next.1).heading - self.leg(one.0, one.1).heading;
        bends(wrap_angle(turn), self.max_turn)
    }

    /// Where chains from both ends have climbed and meet, as pairs of states, the cheapest first.
    fn meetings(&self, searches: &[Search; 2]) -> Vec<[usize; 2]> {
        let mut meetings: Vec<(f64, [usize; 2])> = Vec::new();
        for at in ENDS..self.places.len() {
            let [up, down] = [0, 1].map(|end: usize| -> Vec<(usize, Chain)> {
                (0..self.places.len())
                    .map(|from| self.state(from, at, PARTS))
                    .filter_map(|state| Some((state, searches[end][state]?)))
                    .collect()
            });
            for &(one, up) in &up {
                for &(other, down) in &down {
                    let (from, to) = (self.ends(one).0, self.ends(other).0);
                    let bends = self.bends((from, at), (at, to));
                    let waypoints = up.bends + bends + down.bends;
                    if waypoints <= self.model.scenario.planner.waypoints {
                        let cost = up.cost + bends as f64 * self.worth + down.cost;
                        meetings.push((cost, [one, other]));
                    }
                }
            }
        }
        meetings.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        meetings.truncate(MEETINGS);
        meetings.into_iter().map(|(_, states)| states).collect()
    }

    /// The route of two chains that meet.
    fn route(&self, searches: &[Search; 2], states: [usize; 2]) -> Vec<Point3> {
        let [up, down] = [0, 1].map(|end: usize| {
            let before = move |&state: &usize| searches[end][state].and_then(|chain| chain.before);
            let chain = std::iter::successors(Some(states[end]), before);
            chain.map(|state| self.places[self.ends(state).1])
        });
        let mut corners: Vec<Point2> = up.chain([self.places[0]]).collect();
        corners.reverse();
        corners.extend(down.skip(1));
        corners.push(self.places[1]);
        self.lifted(&self.rounded(&corners))
    }

    /// The way over `corners`, with as many bends at each as its turn takes.
    fn rounded(&self, corners: &[Point2]) -> Vec<Point2> {
        let mut way = vec![corners[0]];
        for three in corners.windows(3) {
            let before = three[1] - way[way.len() - 1];
            let heading = libm::atan2(before.y, before.x);
            let mut bends = Vec::new();
            // Bends lead away from the corner, which changes the turn that they have to make.
            for _ in 0..4 {
                let after = three[2] - bends.last().unwrap_or(&three[1]);
                let turn = wrap_angle(libm::atan2(after.y, after.x) - heading);
                bends = self.around(three[1], heading, turn);
            }
            way.extend(bends);
        }
        way.push(corners[corners.len() - 1]);
        way
    }

    /// Bends from `corner` on that add up to `turn`, beginning with `heading`.
    fn around(&self, corner: Point2, heading: f64, turn: f64) -> Vec<Point2> {
        let count = bends(turn, self.max_turn);
        let mut at = corner;
        let bend = |bend: usize| {
            if bend > 0 {
                at += direction(heading + turn * bend as f64 / count as f64) * self.side;
            }
            at
        };
        (0..count).map(bend).collect()
    }

    /// The route over `way`: at the heights where it should lead, or as near as the way flown and the way left allow.
    fn lifted(&self, way: &[Point2]) -> Vec<Point3> {
        let scenario = self.model.scenario;
        let lengths = way.windows(2).map(|ends| (ends[1] - ends[0]).norm());
        let (mut flown, mut left) = (0.0, lengths.clone().sum::<f64>());
        let mut route = vec![scenario.start];
        for (&at, length) in way[1..way.len() - 1].iter().zip(lengths) {
            flown += length;
            left -= length;
            let mut z = scenario.terrain.elevation(at) + self.climb.height;
            for (end, way) in [(scenario.start, flown), (scenario.target, left)] {
                // What is left of a sum is not exactly 0 after its last part.
                let reach = way.max(0.0) * self.steepest;
                z = z.clamp(end.z - reach, end.z + reach);
            }
            route.push(Point3::new(at.x, at.y, z));
        }
        route.push(scenario.target);
        route
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a half circle at most over a turn limit of a degree at least"
)]
fn bends(turn: f64, max_turn: f64) -> usize {
    ((turn.abs() - SLACK).max(0.0) / max_turn).ceil() as usize
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a few"
)]
fn part(share: f64) -> usize {
    ((share * PARTS as f64) as usize).min(PARTS - 1)
}
