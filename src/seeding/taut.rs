//! Taut strings: the shortest ways between two points round obstacles, one for each way of passing
//! them.
//!
//! A string pulled tight runs straight between obstacles and along their boundary. In each homotopy
//! class (left of this, right of that) there is exactly one, so that the k shortest different
//! strings are the best of k different classes. The search is A* over arrivals at circles; a straight
//! part is checked against the obstacles only when its turn comes, and far obstacles join only when
//! one of them is found in the way.

use std::cmp::{Ordering, Reverse};
use std::collections::{BinaryHeap, HashMap};

use super::arc::{Arc, Rounding, Sense, Tangent, crossing, tangent};
use super::obstacles::{Corner, Obstacles};
use crate::geometry::Point2;

/// A string pulled tight from start to target.
#[derive(Debug, Clone, PartialEq)]
pub struct TautString {
    /// Metres.
    pub length: f64,
    /// In order, each beginning where the one before ends; straight ones first and last.
    pub pieces: Vec<Piece>,
}

/// A part of a [`TautString`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Piece {
    /// Straight.
    Straight {
        /// Where it begins.
        from: Point2,
        /// Where it ends.
        to: Point2,
    },
    /// Along a circle, or, with radius 0, a bend at a point.
    Arc {
        /// Index of the outline that is rounded.
        outline: usize,
        /// Of the circle.
        center: Point2,
        /// Metres.
        radius: f64,
        /// Where it begins.
        from: Point2,
        /// Where it ends.
        to: Point2,
        /// Radians, positive counter-clockwise.
        turn: f64,
    },
}

/// What a search for taut strings found.
#[derive(Debug, Clone, PartialEq)]
pub struct TautStrings {
    /// Shortest first, of different homotopy classes.
    pub strings: Vec<TautString>,
    /// No string that is not listed is shorter, metres; infinite when there is none.
    pub beyond: f64,
    /// What the search took: ways looked at.
    pub ways: usize,
}

/// With so many corners or fewer, all take part from the beginning when several strings are wanted.
const FEW_CORNERS: usize = 64;

/// Ways looked at before the search gives up.
const MOST_WAYS: usize = 2_000_000;

/// So many corners are passed over in the time that one way takes.
const LOOKS_PER_WAY: usize = 16;

/// Strings nearer than this share of their length everywhere are one.
const SAME: f64 = 1e-7;

/// The `k` shortest taut strings between the ends of `obstacles`.
#[must_use]
pub fn taut_strings(obstacles: &Obstacles, k: usize) -> TautStrings {
    taut_strings_within(obstacles, k, MOST_WAYS)
}

/// As [`taut_strings`], with so many ways looked at at most.
pub(super) fn taut_strings_within(
    obstacles: &Obstacles,
    k: usize,
    most_ways: usize,
) -> TautStrings {
    Search::new(obstacles, k, most_ways).run()
}

/// Strings that are longer by more than this share of the way are looked at only when no shorter
/// one is left; the share doubles with each look.
const FIRST_REACH: f64 = 0.002;

/// An arrival at a corner: the string so far.
struct Step {
    place: Place,
    /// From which step, along which arc of its circle, then straight.
    before: Option<(usize, Arc, Tangent)>,
    length: f64,
    /// Where it is, for a first guess at what lies ahead.
    at: Point2,
    /// Ways on are known as far as strings up to this length are concerned.
    reach: f64,
    /// By how much the reach grows next.
    growth: f64,
}

/// A corner and the sense in which it is rounded, or an end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Place {
    Start,
    Corner(usize, bool),
    Target,
}

/// A way on from a step that has not been checked yet, ordered by the length of the shortest string
/// that it could become, then by age. Back to the start stands for all ways beyond the step's reach.
struct Way {
    least: f64,
    age: usize,
    step: usize,
    to: Place,
}

impl PartialEq for Way {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Way {}
impl PartialOrd for Way {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Way {
    fn cmp(&self, other: &Self) -> Ordering {
        self.least
            .total_cmp(&other.least)
            .then(self.age.cmp(&other.age))
    }
}

struct Search<'o> {
    obstacles: &'o Obstacles,
    k: usize,
    steps: Vec<Step>,
    open: BinaryHeap<Reverse<Way>>,
    ways: usize,
    most_ways: usize,
    /// Corners that take part, and by outline whether its corners do.
    active: Vec<usize>,
    is_active: Vec<bool>,
    /// What is in the way of the straight part between two places; looked up, never walked through.
    blocked: HashMap<(Place, Place), Option<usize>>,
    /// Arrivals at each place.
    arrivals: HashMap<Place, Vec<usize>>,
    strings: Vec<TautString>,
}

impl<'o> Search<'o> {
    fn new(obstacles: &'o Obstacles, k: usize, most_ways: usize) -> Self {
        let mut search = Self {
            obstacles,
            k,
            steps: Vec::new(),
            open: BinaryHeap::new(),
            ways: 0,
            most_ways,
            active: Vec::new(),
            is_active: vec![false; obstacles.corners_of.len()],
            blocked: HashMap::new(),
            arrivals: HashMap::new(),
            strings: Vec::new(),
        };
        if k > 1 && obstacles.corners.len() <= FEW_CORNERS {
            search.active = (0..obstacles.corners.len()).collect();
            search.is_active.fill(true);
        }
        search.add_step(Place::Start, None, 0.0, obstacles.ends[0]);
        search
    }

    fn run(mut self) -> TautStrings {
        let mut beyond = f64::INFINITY;
        while let Some(Reverse(way)) = self.open.pop() {
            if self.strings.len() >= self.k || self.ways > self.most_ways {
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

    fn rounding(&self, place: Place) -> Rounding {
        let end = |center| Rounding {
            center,
            radius: 0.0,
            sense: Sense::Left,
        };
        match place {
            Place::Start => end(self.obstacles.ends[0]),
            Place::Target => end(self.obstacles.ends[1]),
            Place::Corner(corner, left) => Rounding {
                center: self.obstacles.corners[corner].center,
                radius: self.obstacles.corners[corner].radius,
                sense: if left { Sense::Left } else { Sense::Right },
            },
        }
    }

    fn corner(&self, place: Place) -> Option<&Corner> {
        match place {
            Place::Corner(corner, _) => Some(&self.obstacles.corners[corner]),
            Place::Start | Place::Target => None,
        }
    }

    /// The arc along the circle of `step` and the straight part to `to`, where geometry allows.
    fn leave(&self, step: &Step, to: Place) -> Option<(Arc, Tangent)> {
        let on = self.rounding(step.place);
        let straight = tangent(&on, &self.rounding(to))?;
        for place in [step.place, to] {
            if let (Some(corner), Place::Corner(_, left)) = (self.corner(place), place)
                && let Some(edges) = corner.edges
            {
                // The edges must lie on the side that the string bends to.
                let side = if left { 1.0 } else { -1.0 };
                if edges
                    .iter()
                    .any(|edge| straight.along.perp(edge) * side < -1e-9)
                {
                    return None;
                }
            }
        }
        let arc = match &step.before {
            None => {
                let away = outward(&on, &straight);
                Arc::new(on, away, away)
            }
            Some((_, _, before)) => Arc::new(on, outward(&on, before), outward(&on, &straight)),
        };
        // Nor does a string turn back at the corner of a ring.
        let turns_back = self.corner(step.place).is_some_and(|c| c.edges.is_some())
            && arc.turn > std::f64::consts::PI + 1e-9;
        (!turns_back).then_some((arc, straight))
    }

    fn add_step(
        &mut self,
        place: Place,
        before: Option<(usize, Arc, Tangent)>,
        length: f64,
        at: Point2,
    ) {
        let [start, target] = self.obstacles.ends;
        let growth = FIRST_REACH * (target - start).norm();
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

    /// Look further from `step`: at the ways on that strings longer than before may take.
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
        // Beyond the longest way there is nothing more to widen to.
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

    /// Note the way from `step` to `to` if it may become a string longer than `known` and no longer
    /// than the step's reach.
    fn push(&mut self, step: usize, to: Place, known: f64) {
        let reach = self.steps[step].reach;
        let Some((arc, straight)) = self.leave(&self.steps[step], to) else {
            return;
        };
        let length = self.steps[step].length + arc.length() + straight.length;
        let remaining = match to {
            Place::Target => 0.0,
            _ => (self.obstacles.ends[1] - straight.to).norm(),
        };
        let least = length + remaining;
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
        // However the corner is reached from here, the string is at least so long.
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

    /// Check a way; where it is free, go on from its end.
    fn follow(&mut self, way: &Way) {
        self.ways += 1;
        let from = &self.steps[way.step];
        let Some((arc, straight)) = self.leave(from, way.to) else {
            return;
        };
        if self.k > 1 && self.crosses_itself(way, &straight) {
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

    fn in_the_way_of(&mut self, from: Place, arc: &Arc, to: Place, way: &Tangent) -> Option<usize> {
        let own = |place| self.corner(place).map_or(&[][..], |corner| &corner.bodies);
        if let Some(outline) = self.obstacles.blocks_arc(arc, own(from)) {
            return Some(outline);
        }
        if let Some(known) = self.blocked.get(&(from, to)) {
            return *known;
        }
        let both: Vec<usize> = own(from).iter().chain(own(to)).copied().collect();
        let found = self.obstacles.blocks_segment(way.from, way.to, &both);
        self.blocked.insert((from, to), found);
        found
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

    /// Whether a string comes back to a corner in the same sense, or crosses an earlier part of
    /// itself: it winds round something for nothing.
    fn crosses_itself(&self, way: &Way, straight: &Tangent) -> bool {
        let mut step = way.step;
        loop {
            if self.steps[step].place == way.to {
                return true;
            }
            let Some((before, _, earlier)) = &self.steps[step].before else {
                return false;
            };
            if crossing((earlier.from, earlier.to), (straight.from, straight.to)).is_some() {
                return true;
            }
            step = *before;
        }
    }

    /// Whether `k` earlier arrivals at `place` reach this one's point along the circle without
    /// being longer, so that whatever it becomes, they become something better.
    fn is_dominated(&self, place: Place, straight: &Tangent, length: f64) -> bool {
        let Some(earlier) = self.arrivals.get(&place) else {
            return false;
        };
        let on = self.rounding(place);
        let here = outward(&on, straight);
        let own = self.corner(place).map_or(&[][..], |corner| &corner.bodies);
        let better = earlier.iter().filter(|&&step| {
            let Some((_, _, before)) = &self.steps[step].before else {
                return false;
            };
            let arc = Arc::new(on, outward(&on, before), here);
            self.steps[step].length + arc.length() <= length
                && self.obstacles.blocks_arc(&arc, own).is_none()
                && !self.obstacles.leaves_area(&arc)
        });
        better.take(self.k).count() >= self.k
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

/// From the centre of the circle to where the tangent touches it.
fn outward(on: &Rounding, tangent: &Tangent) -> nalgebra::Vector2<f64> {
    nalgebra::Vector2::new(tangent.along.y, -tangent.along.x) * on.sense.sign()
}

impl TautString {
    /// The point `share` of the length along the string, 0 to 1.
    #[must_use]
    pub fn at(&self, share: f64) -> Point2 {
        let mut remaining = share * self.length;
        for piece in &self.pieces {
            let length = piece.length();
            if remaining <= length {
                return piece.at(remaining);
            }
            remaining -= length;
        }
        match self.pieces.last() {
            Some(Piece::Straight { to, .. } | Piece::Arc { to, .. }) => *to,
            None => Point2::origin(),
        }
    }
}

impl Piece {
    /// Metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        match self {
            Self::Straight { from, to } => (to - from).norm(),
            Self::Arc { radius, turn, .. } => radius * turn.abs(),
        }
    }

    /// The point `way` metres from its beginning.
    fn at(&self, way: f64) -> Point2 {
        match *self {
            Self::Straight { from, to } => {
                let length = (to - from).norm();
                from + (to - from) * if length > 0.0 { way / length } else { 0.0 }
            }
            Self::Arc {
                center,
                radius,
                from,
                turn,
                ..
            } => {
                let angle = if radius > 0.0 {
                    turn.signum() * way / radius
                } else {
                    0.0
                };
                let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                let out = from - center;
                center
                    + nalgebra::Vector2::new(out.x * cos - out.y * sin, out.x * sin + out.y * cos)
            }
        }
    }
}

/// Whether two strings are the same line, found twice round obstacles that touch or coincide.
fn same(one: &TautString, other: &TautString) -> bool {
    let near = SAME * one.length.max(1.0);
    (one.length - other.length).abs() <= near
        && (1..16).all(|i| {
            let share = f64::from(i) / 16.0;
            (one.at(share) - other.at(share)).norm() <= 10.0 * near
        })
}

#[cfg(test)]
mod tests {
    use super::super::{Outline, OutlineShape};
    use super::*;
    use crate::geometry::Rect;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn disc(x: f64, y: f64, radius: f64) -> Outline {
        Outline {
            shape: OutlineShape::Disc(Point2::new(x, y)),
            radius,
            core: radius,
        }
    }

    fn ring(vertices: &[[f64; 2]], radius: f64) -> Outline {
        Outline {
            shape: OutlineShape::Ring(vertices.iter().map(|&v| Point2::from(v)).collect()),
            radius,
            core: 0.0,
        }
    }

    fn strings(outlines: &[Outline], ends: [[f64; 2]; 2], k: usize) -> Vec<TautString> {
        let scene = Obstacles::new(
            outlines.iter().cloned().map(Some),
            ends.map(Point2::from),
            None,
        );
        taut_strings(&scene, k).strings
    }

    fn lengths(outlines: &[Outline], ends: [[f64; 2]; 2], k: usize) -> Vec<f64> {
        let strings = strings(outlines, ends, k);
        for string in &strings {
            let sum: f64 = string.pieces.iter().map(Piece::length).sum();
            assert!(
                (sum - string.length).abs() < 1e-9 * (1.0 + sum),
                "{string:?}"
            );
        }
        strings.iter().map(|string| string.length).collect()
    }

    #[track_caller]
    fn check(outlines: &[Outline], ends: [[f64; 2]; 2], expected: &[f64]) {
        let found = lengths(outlines, ends, expected.len().max(1));
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found - expected).abs() < 1e-7 * expected,
                "{found} {expected}"
            );
        }
    }

    /// Two tangents of sqrt(10^2 - 5^2) and an arc of 180 - 2 * 60 degrees.
    fn round_a_disc() -> f64 {
        2.0 * 75.0_f64.sqrt() + 5.0 * PI / 3.0
    }

    #[test]
    fn worked_by_hand() {
        let west_east = [[-10.0, 0.0], [10.0, 0.0]];
        check(&[], west_east, &[20.0]);
        check(&[disc(0.0, 20.0, 5.0)], west_east, &[20.0]);
        check(&[disc(0.0, 5.0, 5.0)], west_east, &[20.0]);
        check(&[disc(0.0, 0.0, 5.0)], west_east, &[round_a_disc(); 2]);
        // The same disc twice makes no second way of passing it.
        check(
            &[disc(0.0, 0.0, 5.0), disc(0.0, 0.0, 5.0)],
            west_east,
            &[round_a_disc(); 2],
        );
        // One within the other, touching it from inside.
        check(
            &[disc(0.0, 0.0, 5.0), disc(0.0, 3.0, 2.0)],
            west_east,
            &[round_a_disc(); 2],
        );
        // Two discs side by side, tangents along both.
        let side_by_side = 2.0 * 75.0_f64.sqrt() + 5.0 * PI / 3.0 + 8.0;
        check(
            &[disc(0.0, 0.0, 5.0), disc(8.0, 0.0, 5.0)],
            [[-10.0, 0.0], [18.0, 0.0]],
            &[side_by_side; 2],
        );
        // Above one and below the other: the inner tangent crosses at 30 degrees, cos 60 = 2 * 5 / 20.
        let slalom = 2.0 * (400.0_f64 - 25.0).sqrt() + 300.0_f64.sqrt();
        let s_shaped = strings(
            &[disc(0.0, 0.0, 5.0), disc(20.0, 0.0, 5.0)],
            [[-20.0, 0.0], [40.0, 0.0]],
            4,
        );
        let turn = |share: f64| libm::acos(share);
        let arcs = 2.0 * 5.0 * (PI - turn(0.25) - turn(0.5));
        assert!(
            (s_shaped[2].length - slalom - arcs).abs() < 1e-9,
            "{s_shaped:?}"
        );
        assert_eq!(s_shaped.len(), 4);
    }

    #[test]
    fn corners_of_rings() {
        let square = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]];
        let west_east = [[-10.0, 0.0], [10.0, 0.0]];
        check(
            &[ring(&square, 0.0)],
            west_east,
            &[2.0 * 50.0_f64.sqrt() + 10.0; 2],
        );
        // Widened by 1, a quarter of a circle is shared by the two corners.
        let to_corner = (25.0_f64 + 25.0 - 1.0).sqrt();
        let slope = libm::atan2(5.0, 5.0) + libm::asin(1.0 / 50.0_f64.sqrt());
        check(
            &[ring(&square, 1.0)],
            west_east,
            &[2.0 * to_corner + 10.0 + 2.0 * slope; 2],
        );
        // Along the diagonal, through two of its corners.
        check(
            &[ring(&square, 0.0)],
            [[-10.0, -10.0], [10.0, 10.0]],
            &[2.0 * (25.0_f64 + 225.0).sqrt(); 2],
        );
        // Two squares with a side in common leave a way between them that is no wider than a line.
        let next = [[5.0, -5.0], [15.0, -5.0], [15.0, 5.0], [5.0, 5.0]];
        check(
            &[ring(&square, 0.0), ring(&next, 0.0)],
            [[-10.0, 0.0], [20.0, 0.0]],
            &[2.0 * 50.0_f64.sqrt() + 20.0; 2],
        );
    }

    #[test]
    fn a_u_opens_to_one_side() {
        let u = [
            [-20.0, -20.0],
            [20.0, -20.0],
            [20.0, 20.0],
            [18.0, 20.0],
            [18.0, -18.0],
            [-18.0, -18.0],
            [-18.0, 20.0],
            [-20.0, 20.0],
        ];
        // To the inner corner, over the wall, down its outside, below it.
        let length = (18.0_f64 * 18.0 + 20.0 * 20.0).sqrt() + 2.0 + 40.0 + 800.0_f64.sqrt();
        check(&[ring(&u, 0.0)], [[0.0, 0.0], [0.0, -40.0]], &[length; 2]);
    }

    #[test]
    fn a_ring_of_discs_has_one_opening() {
        let mut discs = Vec::new();
        for i in 1..24 {
            let angle = PI * f64::from(i) / 12.0;
            discs.push(disc(
                100.0 * libm::cos(angle),
                100.0 * libm::sin(angle),
                15.0,
            ));
        }
        let found = strings(&discs, [[-300.0, 0.0], [0.0, 0.0]], 4);
        assert!(found.len() >= 2, "{}", found.len());
        // The only way in is past (100, 0).
        for string in &found {
            let at_gap = (0..=2000)
                .map(|i| (string.at(f64::from(i) / 2000.0) - Point2::new(100.0, 0.0)).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(at_gap < 15.0, "{at_gap}");
        }
        let mut closed = discs.clone();
        closed.push(disc(100.0, 0.0, 15.0));
        assert!(strings(&closed, [[-300.0, 0.0], [0.0, 0.0]], 4).is_empty());
    }

    #[test]
    fn an_end_on_or_in_the_soft_zone_of_an_obstacle() {
        let soft = Outline {
            core: 2.0,
            ..disc(0.0, 0.0, 5.0)
        };
        // From a circle's own edge to the point opposite.
        check(
            std::slice::from_ref(&soft),
            [[-5.0, 0.0], [5.0, 0.0]],
            &[5.0 * PI; 2],
        );
        // Made smaller, to the distance of the nearer end.
        let tangent = 91.0_f64.sqrt();
        let arc = 3.0 * (PI - libm::acos(0.3));
        check(
            std::slice::from_ref(&soft),
            [[-3.0, 0.0], [10.0, 0.0]],
            &[tangent + arc; 2],
        );
        // In the core: above it, for all that is known here.
        check(
            std::slice::from_ref(&soft),
            [[-1.0, 0.0], [10.0, 0.0]],
            &[11.0],
        );
        check(
            &[disc(0.0, 0.0, 5.0)],
            [[0.0, -5.0], [5.0, 0.0]],
            &[5.0 * FRAC_PI_2, 5.0 * 1.5 * PI],
        );
    }

    #[test]
    fn strings_keep_to_the_area() {
        let area = Rect {
            min: Point2::new(-20.0, -3.0),
            max: Point2::new(20.0, 20.0),
        };
        let scene = Obstacles::new(
            [Some(disc(0.0, 0.0, 5.0))],
            [Point2::new(-10.0, 0.0), Point2::new(10.0, 0.0)],
            Some(area),
        );
        let found = taut_strings(&scene, 3).strings;
        assert_eq!(found.len(), 1);
        assert!(found[0].at(0.5).y > 4.9);
    }

    /// Shortest path among points sampled on the circles, by brute force; its ways are a hair
    /// outside, so that it is never shorter than the taut string.
    fn sampled(discs: &[(f64, f64, f64)], ends: [[f64; 2]; 2]) -> f64 {
        const SAMPLES: i32 = 48;
        let step = PI / f64::from(SAMPLES);
        let mut points = ends.map(Point2::from).to_vec();
        for &(x, y, radius) in discs {
            for i in 0..SAMPLES {
                let (angle, away) = (2.0 * step * f64::from(i), radius / libm::cos(step));
                points.push(Point2::new(
                    x + away * libm::cos(angle),
                    y + away * libm::sin(angle),
                ));
            }
        }
        let free = |a: Point2, b: Point2| {
            discs.iter().all(|&(x, y, radius)| {
                super::super::arc::point_segment(Point2::new(x, y), a, b) >= radius - 1e-9
            })
        };
        let mut best = vec![f64::INFINITY; points.len()];
        let mut done = vec![false; points.len()];
        best[0] = 0.0;
        while let Some(at) = (0..points.len())
            .filter(|&i| !done[i] && best[i].is_finite())
            .min_by(|&i, &j| best[i].total_cmp(&best[j]))
        {
            done[at] = true;
            if at == 1 {
                break;
            }
            for to in 0..points.len() {
                let length = best[at] + (points[to] - points[at]).norm();
                if !done[to] && length < best[to] && free(points[at], points[to]) {
                    best[to] = length;
                }
            }
        }
        best[1]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn as_short_as_brute_force(
            discs in prop::collection::vec((10.0..90.0f64, -40.0..40.0f64, 3.0..16.0f64), 1..7),
        ) {
            let ends = [[0.0, 0.0], [100.0, 0.0]];
            let free: Vec<_> = discs
                .iter()
                .filter(|(x, y, r)| (x * x + y * y).sqrt() > *r && ((100.0 - x) * (100.0 - x) + y * y).sqrt() > *r)
                .copied()
                .collect();
            let outlines: Vec<Outline> = free.iter().map(|&(x, y, r)| disc(x, y, r)).collect();
            let found = lengths(&outlines, ends, 1);
            let brute = sampled(&free, ends);
            if let Some(&found) = found.first() {
                prop_assert!(found <= brute + 1e-6, "{found} {brute}");
                prop_assert!(brute - found < 0.02 * found || brute.is_infinite(), "{found} {brute}");
            } else {
                prop_assert!(brute.is_infinite(), "{brute}");
            }
            // Asking for more changes nothing about the first, and every further one is longer.
            let several = lengths(&outlines, ends, 5);
            if let Some(first) = found.first() {
                prop_assert!((several[0] - first).abs() < 1e-9);
                prop_assert!(several.windows(2).all(|pair| pair[0] <= pair[1]));
            }
        }
    }
}
