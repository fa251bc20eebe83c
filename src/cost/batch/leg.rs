//! A leg of each lane.

use pulp::Simd;

use super::PointRow;
use crate::geometry::lane::{Lane, Mask};
use crate::geometry::{LEVEL, Point2, Segment};

/// A point of each lane.
#[derive(Clone, Copy)]
pub(super) struct Point<S: Simd> {
    pub(super) x: Lane<S>,
    pub(super) y: Lane<S>,
    pub(super) z: Lane<S>,
}

impl<S: Simd> Point<S> {
    #[inline(always)]
    pub(super) fn load(simd: S, row: &PointRow, part: usize) -> Self {
        Self {
            x: Lane::load(simd, &row.x, part),
            y: Lane::load(simd, &row.y, part),
            z: Lane::load(simd, &row.z, part),
        }
    }
}

/// From `a` (t = 0) to `b` (t = 1) in each lane, with the values that are needed more than once.
#[derive(Clone, Copy)]
pub(super) struct Leg<'a, S: Simd> {
    pub(super) simd: S,
    pub(super) a: Point<S>,
    pub(super) b: Point<S>,
    pub(super) dx: Lane<S>,
    pub(super) dy: Lane<S>,
    pub(super) dz: Lane<S>,
    /// Horizontal length, metres.
    pub(super) level: Lane<S>,
    /// 1 / `level`; 0 for a leg that stands still or only climbs.
    pub(super) inverse: Lane<S>,
    /// The square of `inverse`.
    pub(super) inverse_square: Lane<S>,
    /// 3-D length, metres.
    pub(super) length: Lane<S>,
    /// Position of its middle.
    pub(super) middle: [Lane<S>; 2],
    /// Where it moves horizontally, so that it has a heading.
    pub(super) moves: Mask<S>,
    rows: [&'a PointRow; 2],
    part: usize,
}

impl<'a, S: Simd> Leg<'a, S> {
    #[inline(always)]
    pub(super) fn new(simd: S, part: usize, rows: [&'a PointRow; 2]) -> Self {
        let a = Point::load(simd, rows[0], part);
        let b = Point::load(simd, rows[1], part);
        let (dx, dy, dz) = (b.x - a.x, b.y - a.y, b.z - a.z);
        let square = dx * dx + dy * dy;
        let level = square.sqrt();
        let moves = dx.with(LEVEL).le(level);
        let inverse = moves.keep(dx.with(1.0) / level);
        Self {
            simd,
            a,
            b,
            dx,
            dy,
            dz,
            level,
            inverse,
            inverse_square: inverse * inverse,
            length: (square + dz * dz).sqrt(),
            middle: [(a.x + b.x) * 0.5, (a.y + b.y) * 0.5],
            moves,
            rows,
            part,
        }
    }

    /// The leg of one lane of this part.
    pub(super) fn segment(&self, lane: usize) -> Segment {
        let lane = self.part * S::F64_LANES + lane;
        Segment {
            a: self.rows[0].get(lane),
            b: self.rows[1].get(lane),
        }
    }

    /// Whether any lane's leg may come within `radius` of `center`: within half its length of that
    /// at its middle.
    #[inline(always)]
    pub(super) fn may_reach(&self, center: Point2, radius: f64) -> bool {
        self.near(center, radius).any()
    }

    /// Where it may do so.
    #[inline(always)]
    pub(super) fn near(&self, center: Point2, radius: f64) -> Mask<S> {
        let (x, y) = (self.middle[0] - center.x, self.middle[1] - center.y);
        // Slightly more than half, for rounding.
        let reach = self.level * (0.5 + 1e-9) + radius * (1.0 + 1e-9);
        (x * x + y * y).le(reach * reach)
    }

    /// How the leg lies to `center`.
    #[inline(always)]
    pub(super) fn seen_from(&self, center: Point2) -> Sight<S> {
        let (x, y) = (self.a.x - center.x, self.a.y - center.y);
        Sight {
            x,
            y,
            dx: self.dx,
            dy: self.dy,
            foot: -(x * self.dx + y * self.dy) * self.inverse_square,
        }
    }

    /// Where it is at `t`, seen from above.
    #[inline(always)]
    pub(super) fn at(&self, t: Lane<S>) -> [Lane<S>; 2] {
        [self.a.x + self.dx * t, self.a.y + self.dy * t]
    }

    /// `value` in every lane.
    #[inline(always)]
    pub(super) fn splat(&self, value: f64) -> Lane<S> {
        Lane::splat(self.simd, value)
    }
}

/// A leg as seen from a point of the plane.
#[derive(Clone, Copy)]
pub(super) struct Sight<S: Simd> {
    /// Where it begins.
    pub(super) x: Lane<S>,
    pub(super) y: Lane<S>,
    dx: Lane<S>,
    dy: Lane<S>,
    /// The `t` at which its line comes nearest; 0 for one that only climbs.
    pub(super) foot: Lane<S>,
}

impl<S: Simd> Sight<S> {
    /// Squared horizontal distance at `t`.
    #[inline(always)]
    pub(super) fn squared_distance(&self, t: Lane<S>) -> Lane<S> {
        let (x, y) = (self.x + self.dx * t, self.y + self.dy * t);
        x * x + y * y
    }

    /// The least squared distance over `[t0, t1]`.
    #[inline(always)]
    pub(super) fn least_squared_distance(&self, t0: Lane<S>, t1: Lane<S>) -> Lane<S> {
        self.squared_distance(self.foot.clamp(t0, t1))
    }
}
