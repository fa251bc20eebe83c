//! A ring from which corners are taken, each by a triangle that is added to it or taken from it.

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::Side;
use crate::geometry::{Point2, Rect, ring};

/// Points nearer to a triangle than this, metres, count as inside: what is computed is off by less.
const HAIR: f64 = 1e-9;

/// A ring from which corners are taken.
pub(super) struct Outline {
    corners: Vec<Corner>,
    /// Number of corners left.
    pub(super) count: usize,
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
pub(super) struct Step {
    /// How far the ring is from the original one after it at most, metres.
    pub(super) height: f64,
    /// The corner left out, or the one where the edge left out begins.
    corner: usize,
    /// The corner left out, or where the neighbours of the edge meet.
    pub(super) at: Point2,
    pub(super) is_drawn_out: bool,
}

impl Outline {
    pub(super) fn new(corners: Vec<Point2>, side: Side) -> Self {
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

    /// Number of corners, those left out among them.
    pub(super) fn len(&self) -> usize {
        self.corners.len()
    }

    /// Steps of `corner` that were found at another version no longer count.
    pub(super) fn version(&self, corner: usize) -> u32 {
        self.corners[corner].version
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
    pub(super) fn steps(&self, corner: usize) -> [Option<Step>; 2] {
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
    pub(super) fn is_free(&self, step: &Step) -> bool {
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
    pub(super) fn take(&mut self, step: &Step) -> Vec<usize> {
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

    pub(super) fn ring(&self) -> Vec<Point2> {
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
pub(super) fn meet((a, b): (Point2, Point2), (c, d): (Point2, Point2)) -> bool {
    let (one, other) = (b - a, d - c);
    let apart = |p: f64, q: f64| (p > 0.0 && q > 0.0) || (p < 0.0 && q < 0.0);
    !apart(other.perp(&(a - c)), other.perp(&(b - c)))
        && !apart(one.perp(&(c - a)), one.perp(&(d - a)))
}
