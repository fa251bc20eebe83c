//! The search for taut strings: A* over arrivals at circles.
//!
//! A straight part is checked against the obstacles only when its turn comes, and distant obstacles join only when one
//! of them is found in the way.

mod check;
mod place;
mod way;

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::hash::BuildHasherDefault;

use super::{Limits, Piece, TautString, TautStrings, same};
use crate::geometry::Point2;
use crate::seeding::arc::{Arc, Tangent};
use crate::seeding::obstacles::{Corner, Obstacles};
use place::{Mix, Place};
use way::{Step, Way};

/// With this many corners or fewer, all take part from the beginning when several strings are wanted.
const FEW_CORNERS: usize = 64;

/// Number of corners that can be skipped in the time that one way takes.
const LOOKS_PER_WAY: usize = 16;

/// Strings longer than the way by more than this share are examined only when no shorter one is left; the share doubles
/// each time.
const FIRST_REACH: f64 = 0.002;

/// The same with few corners, when each pass costs little.
const FIRST_REACH_OF_FEW: f64 = 0.02;

/// Room for the steps and the open ways of a short search: many strings are pulled, most of them short.
const ROOM: usize = 32;

/// Number of ways examined between two checks whether to stop.
const WAYS_UNWATCHED: usize = 1_000;

/// A search for the shortest few strings of one scene.
pub(super) struct Search<'o> {
    obstacles: &'o Obstacles,
    k: usize,
    steps: Vec<Step>,
    open: BinaryHeap<Reverse<Way>>,
    ways: usize,
    limits: Limits<'o>,
    /// Number of ways at which to check next whether to stop.
    next_look: usize,
    /// Corners that take part, and, by outline, whether its corners do.
    active: Vec<usize>,
    is_active: Vec<bool>,
    /// What blocks the straight part between two places; only looked up, never iterated.
    blocked: HashMap<(Place, Place), Option<usize>, BuildHasherDefault<Mix>>,
    /// Arrivals at each place.
    arrivals: HashMap<Place, Vec<usize>, BuildHasherDefault<Mix>>,
    strings: Vec<TautString>,
}

impl<'o> Search<'o> {
    pub(super) fn new(obstacles: &'o Obstacles, k: usize, limits: Limits<'o>) -> Self {
        let mut search = Self {
            obstacles,
            k,
            steps: Vec::with_capacity(ROOM),
            open: BinaryHeap::with_capacity(ROOM),
            ways: 0,
            limits,
            next_look: WAYS_UNWATCHED,
            active: Vec::with_capacity(obstacles.corners_of.len()),
            is_active: vec![false; obstacles.corners_of.len()],
            blocked: HashMap::default(),
            arrivals: HashMap::default(),
            strings: Vec::new(),
        };
        if k > 1 && obstacles.corners.len() <= FEW_CORNERS {
            search.active = (0..obstacles.corners.len()).collect();
            search.is_active.fill(true);
        }
        search.add_step(Place::Start, None, 0.0, obstacles.ends[0]);
        search
    }

    /// Run until there are enough strings, or a limit is reached.
    pub(super) fn run(mut self) -> TautStrings {
        let mut beyond = f64::INFINITY;
        while let Some(Reverse(way)) = self.open.pop() {
            if self.strings.len() >= self.k || way.least >= self.limits.enough || self.must_end() {
                beyond = way.least;
                break;
            }
            if way.to == Place::Start {
                self.widen(way.step);
            } else {
                self.follow(&way);
            }
        }
        self.strings
            .sort_by(|one, other| one.length.total_cmp(&other.length));
        TautStrings {
            strings: self.strings,
            beyond,
            ways: self.ways,
        }
    }

    /// Whether too many ways were examined, or the search was asked to stop.
    fn must_end(&mut self) -> bool {
        if self.ways >= self.next_look {
            self.next_look = self.ways + WAYS_UNWATCHED;
            if (self.limits.stop)() {
                return true;
            }
        }
        self.ways > self.limits.most_ways
    }

    fn add_step(
        &mut self,
        place: Place,
        before: Option<(usize, Arc, Tangent)>,
        length: f64,
        at: Point2,
    ) {
        let [start, target] = self.obstacles.ends;
        let share = if self.active.len() <= FEW_CORNERS {
            FIRST_REACH_OF_FEW
        } else {
            FIRST_REACH
        };
        let growth = share * (target - start).norm();
        self.steps.push(Step {
            place,
            before,
            length,
            at,
            reach: f64::NEG_INFINITY,
            growth,
        });
        self.widen(self.steps.len() - 1);
    }

    /// Extend the reach of `step`: to the ways on that longer strings than before may take.
    fn widen(&mut self, step: usize) {
        let known = self.steps[step].reach;
        let here = &self.steps[step];
        let direct = here.length + (self.obstacles.ends[1] - here.at).norm();
        let reach = known.max(direct) + here.growth;
        self.steps[step].growth *= 2.0;
        self.steps[step].reach = reach;
        self.push(step, Place::Target, known);
        for at in 0..self.active.len() {
            self.push_corner(step, self.active[at], known);
        }
        self.ways += self.active.len() / LOOKS_PER_WAY;
        // Beyond the longest way there is nothing more to reach.
        if reach - self.steps[step].length <= self.obstacles.longest_way {
            self.ways += 1;
            self.open.push(Reverse(Way {
                least: reach,
                age: self.ways,
                step,
                to: Place::Start,
            }));
        }
    }

    /// Record the way from `step` to `to` if it may become a string longer than `known` and no longer than the step's
    /// reach.
    fn push(&mut self, step: usize, to: Place, known: f64) {
        let reach = self.steps[step].reach;
        let here = &self.steps[step];
        let Some(straight) = self.straight(here.place, to) else {
            return;
        };
        let remaining = match to {
            Place::Target => 0.0,
            _ => (self.obstacles.ends[1] - straight.to).norm(),
        };
        if here.length + straight.length + remaining > reach {
            return;
        }
        let Some(arc) = self.arc(here, &straight) else {
            return;
        };
        let least = here.length + arc.length() + straight.length + remaining;
        if least > known && least <= reach {
            self.ways += 1;
            self.open.push(Reverse(Way {
                least,
                age: self.ways,
                step,
                to,
            }));
        }
    }

    fn push_corner(&mut self, step: usize, corner: usize, known: f64) {
        let here = &self.steps[step];
        if matches!(here.place, Place::Corner(at, _) if at == corner) {
            return;
        }
        // However the corner is reached from here, the string is at least this long.
        let Corner { center, radius, .. } = self.obstacles.corners[corner];
        let least = here.length + (center - here.at).norm() - radius
            + (self.obstacles.ends[1] - center).norm()
            - radius;
        if least > here.reach {
            return;
        }
        for left in [true, false] {
            self.push(step, Place::Corner(corner, left), known);
        }
    }

    /// Check a way; if it is free, continue from its end.
    fn follow(&mut self, way: &Way) {
        self.ways += 1;
        let from = &self.steps[way.step];
        let Some(straight) = self.straight(from.place, way.to) else {
            return;
        };
        let Some(arc) = self.arc(from, &straight) else {
            return;
        };
        if self.k > 1 && self.crosses_itself(way, &arc, &straight) {
            return;
        }
        let (place, length) = (from.place, from.length + arc.length() + straight.length);
        if self.obstacles.leaves_area(&arc) {
            return;
        }
        if let Some(outline) = self.in_the_way_of(place, &arc, way.to, &straight) {
            self.activate(outline);
            return;
        }
        if way.to == Place::Target {
            let string = self.string(way.step, &arc, &straight, length);
            if !self.strings.iter().any(|known| same(known, &string)) {
                self.strings.push(string);
            }
            return;
        }
        if self.is_dominated(way.to, &straight, length) {
            return;
        }
        self.arrivals
            .entry(way.to)
            .or_default()
            .push(self.steps.len());
        let before = Some((way.step, arc, straight));
        self.add_step(way.to, before, length, straight.to);
    }

    /// Let the corners of `outline` take part, as if they always had.
    fn activate(&mut self, outline: usize) {
        if self.is_active[outline] {
            return;
        }
        self.is_active[outline] = true;
        self.ways += self.steps.len() * self.obstacles.corners_of[outline].len() / LOOKS_PER_WAY;
        for corner in self.obstacles.corners_of[outline].clone() {
            self.active.push(corner);
            for step in 0..self.steps.len() {
                self.push_corner(step, corner, f64::NEG_INFINITY);
            }
        }
    }

    fn string(&self, last: usize, arc: &Arc, straight: &Tangent, length: f64) -> TautString {
        let mut pieces = Vec::new();
        let (mut step, mut arc, mut straight) = (last, arc, straight);
        loop {
            pieces.push(Piece::Straight {
                from: straight.from,
                to: straight.to,
            });
            let at = &self.steps[step];
            let (Some(corner), Some((before, earlier_arc, earlier))) =
                (self.corner(at.place), &at.before)
            else {
                break;
            };
            pieces.push(Piece::Arc {
                outline: corner.outline,
                center: corner.center,
                radius: corner.radius,
                from: earlier.to,
                to: straight.from,
                turn: arc.on.sense.sign() * arc.turn,
            });
            (step, arc, straight) = (*before, earlier_arc, earlier);
        }
        pieces.reverse();
        TautString { length, pieces }
    }
}
