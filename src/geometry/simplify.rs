//! A ring with fewer corners that lies around another, or within it.
//!
//! Triangles are added to the ring, or taken from it, the flattest first: at a corner that turns the other way (which
//! leaves the corner out), or at an edge whose neighbours are drawn out until they meet (which leaves an edge out). A
//! triangle that any other part of the ring reaches into is left alone. So each ring holds the one before, or is held by
//! it, and stays simple.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::{Point2, Rect, ring};

/// On which side of a ring the simpler one lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// No point of the ring lies outside it.
    Around,
    /// No point of it lies outside the ring.
    Within,
}

/// Fewer corners than this are not left over.
const FEWEST: usize = 4;

/// Points nearer to a triangle than this, metres, count as inside: what is computed is off by less.
const HAIR: f64 = 1e-9;

/// What leaving out a corner would do.
#[derive(Debug, Clone, Copy)]
pub struct Change {
    /// How far the ring would be from the original one there at most, metres.
    pub off_m: f64,
    /// Where.
    pub at: Point2,
    /// How many corners there are so far.
    pub corners: usize,
}

/// The simple `ring` with fewer corners, on one `side` of it, rounding aside. Corners are left out by how far they are
/// off, as long as `allows` lets them; what it does not allow, it never allows later.
#[must_use]
pub fn simplified(ring: &[Point2], side: Side, allows: impl Fn(Change) -> bool) -> Vec<Point2> {
    let mut corners = ring.to_vec();
    corners.dedup();
    if corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    if corners.len() <= FEWEST {
        return corners;
    }
    let mut outline = Outline::new(corners, side);
    let mut steps = BinaryHeap::new();
    let push = |outline: &Outline, corner: usize, steps: &mut BinaryHeap<_>| {
        let version = outline.corners[corner].version;
        for step in outline.steps(corner).into_iter().flatten() {
            // By height; numbers that are not negative are in the order of their bits.
            steps.push(Reverse((
                step.height.to_bits(),
                corner,
                version,
                step.is_drawn_out,
            )));
        }
    };
    for corner in 0..outline.corners.len() {
        push(&outline, corner, &mut steps);
    }
    while let Some(Reverse((_, corner, version, is_drawn_out))) = steps.pop() {
        if outline.count == FEWEST {
            break;
        }
        let is_current = outline.corners[corner].version == version;
        let of_kind = |step: &Step| is_current && step.is_drawn_out == is_drawn_out;
        let step = outline.steps(corner).into_iter().flatten().find(of_kind);
        let is_allowed = |step: &Step| {
            allows(Change {
                off_m: step.height,
                at: step.at,
                corners: outline.count,
            })
        };
        if let Some(step) = step.filter(|step| is_allowed(step) && outline.is_free(step)) {
            for changed in outline.take(&step) {
                push(&outline, changed, &mut steps);
            }
        }
    }
    outline.ring()
}

/// A ring from which corners are taken.
struct Outline {
    corners: Vec<Corner>,
    /// Number of corners left.
    count: usize,
    /// 1 where a corner that turns left bulges to the side that the ring may move to, else -1.
    turning: f64,
    /// The boxes around the edges, each with the corner where it begins.
    edges: RTree<Entry>,
}

type Entry = GeomWithData<Rectangle<[f64; 2]>, usize>;

struct Corner {
    at: Point2,
    before: usize,
    after: usize,
    /// How far the edge that begins here may be from what it replaced, metres.
    off: f64,
    /// Steps of an earlier version no longer count.
    version: u32,
    is_left: bool,
}

/// A triangle that may be added or taken.
struct Step {
    /// How far the ring is from the original one after it at most, metres.
    height: f64,
    /// The corner left out, or the one where the edge left out begins.
    corner: usize,
    /// The corner left out, or where the neighbours of the edge meet.
    at: Point2,
    is_drawn_out: bool,
}

impl Outline {
    fn new(corners: Vec<Point2>, side: Side) -> Self {
        let count = corners.len();
        let turning = match side {
            Side::Around => 1.0,
            Side::Within => -1.0,
        } * ring::twice_area(&corners).signum();
        let edges = ring::edges(&corners).enumerate().map(entry).collect();
        let corner = |(idx, at)| Corner {
            at,
            before: (idx + count - 1) % count,
            after: (idx + 1) % count,
            off: 0.0,
            version: 0,
            is_left: true,
        };
        Self {
            corners: corners.into_iter().enumerate().map(corner).collect(),
            count,
            turning,
            edges: RTree::bulk_load(edges),
        }
    }

    fn at(&self, corner: usize) -> Point2 {
        self.corners[corner].at
    }

    /// The corners before and after `corner`.
    fn beside(&self, corner: usize) -> [usize; 2] {
        [self.corners[corner].before, self.corners[corner].after]
    }

    /// Above 0 where `corner` bulges to the side that the ring may move to.
    fn bulge(&self, corner: usize) -> f64 {
        let [before, after] = self.beside(corner).map(|other| self.at(other));
        let at = self.at(corner);
        (at - before).perp(&(after - at)) * self.turning
    }

    /// Those that leave out `corner` or the edge from it on.
    fn steps(&self, corner: usize) -> [Option<Step>; 2] {
        [self.leaving_out(corner), self.drawing_out(corner)]
    }

    /// The step that leaves out `corner`.
    fn leaving_out(&self, corner: usize) -> Option<Step> {
        let [before, after] = self.beside(corner);
        let off = self.corners[before].off.max(self.corners[corner].off);
        let at = self.at(corner);
        let away = ring::squared_distance((self.at(before), self.at(after)), at).sqrt();
        (self.bulge(corner) <= 0.0).then_some(Step {
            height: away + off,
            corner,
            at,
            is_drawn_out: false,
        })
    }

    /// The step that leaves out the edge from `corner` on.
    fn drawing_out(&self, corner: usize) -> Option<Step> {
        let [before, next] = self.beside(corner);
        let beyond = self.corners[next].after;
        let [a, b, c, d] = [before, corner, next, beyond].map(|corner| self.at(corner));
        let (one, other, edge) = (b - a, c - d, c - b);
        let across = one.perp(&other);
        let [from_b, from_c] = [edge.perp(&other), edge.perp(&one)].map(|part| part / across);
        let meet = self.bulge(corner) > 0.0
            && self.bulge(next) > 0.0
            && [from_b, from_c]
                .iter()
                .all(|part| part.is_finite() && *part > 0.0);
        let at = b + one * from_b;
        let height = ring::squared_distance((b, c), at).sqrt();
        let off = [before, corner, next].map(|corner| self.corners[corner].off);
        (meet && height.is_finite()).then_some(Step {
            height: off[0].max(height + off[1]).max(off[2]),
            corner,
            at,
            is_drawn_out: true,
        })
    }

    /// Whether no other part of the ring reaches into the triangle of `step`.
    fn is_free(&self, step: &Step) -> bool {
        let [before, after] = self.beside(step.corner);
        let own = [before, step.corner, after];
        let from = if step.is_drawn_out {
            step.corner
        } else {
            before
        };
        let [a, b] = [from, after].map(|corner| self.at(corner));
        let triangle = [a, step.at, b];
        let extent = Rect::around(triangle).expect("three points").grown(HAIR);
        let [low, high] = [extent.min, extent.max];
        let area = AABB::from_corners([low.x, low.y], [high.x, high.y]);
        let mut near = self.edges.locate_in_envelope_intersecting(area);
        near.all(|entry| {
            let begins = entry.data;
            let ends = self.corners[begins].after;
            let (from, to) = (self.at(begins), self.at(ends));
            let reaches_in =
                |corner: usize, at| !own.contains(&corner) && holds(triangle, &extent, at);
            let is_own = own.contains(&begins) || own.contains(&ends);
            let crosses = || {
                step.is_drawn_out
                    && !is_own
                    && [(a, step.at), (step.at, b)]
                        .into_iter()
                        .any(|side| meet(side, (from, to)))
            };
            !reaches_in(begins, from) && !reaches_in(ends, to) && !crosses()
        })
    }

    /// Take `step`; returns the corners whose steps are others now.
    fn take(&mut self, step: &Step) -> Vec<usize> {
        let [before, next] = self.beside(step.corner);
        for edge in [before, step.corner] {
            self.forget(edge);
        }
        let changed = if step.is_drawn_out {
            self.forget(next);
            let beyond = self.corners[next].after;
            let corner = &mut self.corners[step.corner];
            (corner.at, corner.off) = (step.at, step.height);
            self.leave_out(next);
            self.remember(step.corner);
            vec![before, step.corner, beyond]
        } else {
            self.leave_out(step.corner);
            vec![before, next]
        };
        self.corners[before].off = step.height;
        self.remember(before);
        self.count -= 1;
        let further = self.corners[before].before;
        let changed: Vec<usize> = std::iter::once(further).chain(changed).collect();
        for corner in &changed {
            self.corners[*corner].version += 1;
        }
        changed
    }

    /// Join the neighbours of `corner`.
    fn leave_out(&mut self, corner: usize) {
        let [before, after] = self.beside(corner);
        self.corners[before].after = after;
        self.corners[after].before = before;
        let corner = &mut self.corners[corner];
        corner.is_left = false;
        corner.version += 1;
    }

    fn forget(&mut self, edge: usize) {
        let entry = self.entry(edge);
        self.edges.remove(&entry);
    }

    fn remember(&mut self, edge: usize) {
        let entry = self.entry(edge);
        self.edges.insert(entry);
    }

    fn entry(&self, edge: usize) -> Entry {
        entry((edge, (self.at(edge), self.at(self.corners[edge].after))))
    }

    fn ring(&self) -> Vec<Point2> {
        let left = self.corners.iter().filter(|corner| corner.is_left);
        left.map(|corner| corner.at).collect()
    }
}

fn entry((edge, (a, b)): (usize, (Point2, Point2))) -> Entry {
    GeomWithData::new(Rectangle::from_corners([a.x, a.y], [b.x, b.y]), edge)
}

/// Whether `point` lies in a triangle, its border and a hair beyond it included.
fn holds(triangle: [Point2; 3], extent: &Rect, point: Point2) -> bool {
    let off = ring::edges(&triangle)
        .map(|(a, b)| (b - a).perp(&(point - a)) / (b - a).norm())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], off| {
            [low.min(off), high.max(off)]
        });
    extent.contains(point) && (off[0] >= -HAIR || off[1] <= HAIR)
}

/// Whether two segments have a point in common.
fn meet((a, b): (Point2, Point2), (c, d): (Point2, Point2)) -> bool {
    let (one, other) = (b - a, d - c);
    let apart = |p: f64, q: f64| (p > 0.0 && q > 0.0) || (p < 0.0 && q < 0.0);
    !apart(other.perp(&(a - c)), other.perp(&(b - c)))
        && !apart(one.perp(&(c - a)), one.perp(&(d - a)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Corners evenly round the origin, this far from it.
    fn round(away: &[f64]) -> Vec<Point2> {
        let step = std::f64::consts::TAU / away.len() as f64;
        let corner = |(idx, away): (usize, &f64)| {
            let (sin, cos) = libm::sincos(step * idx as f64);
            Point2::new(away * cos, away * sin)
        };
        away.iter().enumerate().map(corner).collect()
    }

    fn within(most_m: f64) -> impl Fn(Change) -> bool {
        move |change| change.off_m <= most_m
    }

    fn ring_of(corners: &[[f64; 2]]) -> Vec<Point2> {
        corners.iter().copied().map(Point2::from).collect()
    }

    #[test]
    fn a_circle_of_many_corners_needs_few() {
        let circle = round(&[1000.0; 360]);
        for side in [Side::Around, Side::Within] {
            let simple = simplified(&circle, side, within(5.0));
            // The sides of a regular ring of 32 are 4.8 m off; what is left out step by step is added up.
            assert!(
                (24..=64).contains(&simple.len()),
                "{side:?} {}",
                simple.len()
            );
            let away: Vec<f64> = simple.iter().map(|corner| corner.coords.norm()).collect();
            let expected = match side {
                Side::Around => 999.9..1010.0,
                Side::Within => 995.0..1000.001,
            };
            assert!(away.iter().all(|away| expected.contains(away)), "{away:?}");
        }
    }

    #[test]
    fn a_dent_is_filled_from_without_and_a_bump_is_cut_from_within() {
        let square = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]];
        let [dent, bump] = [[50.0, 2.0], [50.0, -2.0]].map(|corner| {
            let mut corners = square.to_vec();
            corners.insert(1, corner);
            ring_of(&corners)
        });
        let square = ring_of(&square);
        let check = |ring: &Vec<Point2>, side, most_m, expected: &Vec<Point2>| {
            for is_reversed in [false, true] {
                let (mut ring, mut expected) = (ring.clone(), expected.clone());
                if is_reversed {
                    ring.reverse();
                    expected.reverse();
                }
                let simple = simplified(&ring, side, within(most_m));
                assert_eq!(simple, expected, "{side:?} {most_m} {is_reversed}");
            }
        };
        check(&dent, Side::Around, 2.1, &square);
        check(&dent, Side::Around, 1.9, &dent);
        check(&bump, Side::Within, 2.1, &square);
        check(&bump, Side::Within, 1.9, &bump);
    }

    #[test]
    fn corners_on_a_straight_line_and_repeated_ones_cost_nothing() {
        let ring = ring_of(&[
            [0.0, 0.0],
            [30.0, 0.0],
            [30.0, 0.0],
            [70.0, 0.0],
            [100.0, 0.0],
            [100.0, 100.0],
            [0.0, 100.0],
            [0.0, 0.0],
        ]);
        for side in [Side::Around, Side::Within] {
            let simple = simplified(&ring, side, within(0.0));
            assert_eq!(simple.len(), 4, "{side:?} {simple:?}");
        }
    }

    /// The tip of a spike lies in a dent of the ring's other arm, or before it.
    #[test]
    fn a_dent_into_which_another_part_reaches_stays() {
        let with_tip = |height: f64| {
            ring_of(&[
                [0.0, 0.0],
                [100.0, 0.0],
                [100.0, 20.0],
                [50.0, 15.0],
                [20.0, 20.0],
                [20.0, 60.0],
                [49.0, 60.0],
                [50.0, height],
                [51.0, 60.0],
                [100.0, 60.0],
                [100.0, 80.0],
                [0.0, 80.0],
            ])
        };
        let check = |height, expected: usize| {
            let ring = with_tip(height);
            let simple = simplified(&ring, Side::Around, within(6.0));
            assert_eq!(simple.len(), expected, "{height} {simple:?}");
        };
        check(17.0, 12);
        check(30.0, 11);
    }

    #[test]
    fn what_is_asked_for_each_change_is_where_and_how_far_and_how_many_are_left() {
        let circle = round(&[1000.0; 90]);
        let is_east = |change: &Change| change.at.x > 0.0;
        let simple = simplified(&circle, Side::Within, |change| {
            is_east(&change) && change.corners > 60
        });
        assert_eq!(simple.len(), 60);
        assert_eq!(simple.iter().filter(|corner| corner.x < 0.0).count(), 45);
    }

    /// Points along the edges of `ring`, its corners among them.
    fn along(ring: &[Point2]) -> impl Iterator<Item = Point2> {
        let parts = |(a, b): (Point2, Point2)| {
            (0..7).map(move |part| a + (b - a) * (f64::from(part) / 7.0))
        };
        ring::edges(ring).flat_map(parts)
    }

    fn is_simple(ring: &[Point2]) -> bool {
        let edges: Vec<_> = ring::edges(ring).collect();
        let count = edges.len();
        (0..count).all(|one| {
            (one + 2..count)
                .filter(|other| (other + 1) % count != one)
                .all(|other| !meet(edges[one], edges[other]))
        })
    }

    proptest! {
        #[test]
        fn a_simpler_ring_is_simple_on_its_side_and_near(
            away in prop::collection::vec(300.0..400.0f64, 5..120),
            flat in prop_oneof![Just(1.0), Just(0.1), Just(0.0)],
            most in prop_oneof![0.5..5.0f64, 5.0..80.0f64],
            is_around in any::<bool>(),
            is_clockwise in any::<bool>(),
        ) {
            let away: Vec<f64> = away.iter().map(|away| 350.0 + flat * (away - 350.0)).collect();
            let mut ring = round(&away);
            if is_clockwise {
                ring.reverse();
            }
            let side = if is_around { Side::Around } else { Side::Within };
            let simple = simplified(&ring, side, within(most));
            prop_assert!(simple.len() <= ring.len() && is_simple(&simple));
            let [outer, inner] = if is_around { [&simple, &ring] } else { [&ring, &simple] };
            for point in along(inner) {
                let is_inside = ring::contains(outer, point) || ring::distance(outer, point) < 1e-9;
                prop_assert!(is_inside, "{point} is outside {outer:?}");
                prop_assert!(ring::distance(outer, point) <= most + 1e-9);
            }
            for point in along(outer) {
                prop_assert!(ring::distance(inner, point) <= most + 1e-9, "{point} is far from {inner:?}");
            }
        }
    }
}
