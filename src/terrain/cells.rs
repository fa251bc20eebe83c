//! The ground between nodes: one bilinear patch per cell. A leg is followed cell by cell.
//!
//! Positions are in columns and rows from the first node. Along a straight line the ground within one cell is
//! quadratic, so the least and greatest heights above it are exact.

use super::HeightRange;
use crate::geometry::{Point2, Quadratic, Rect};

/// Elevations at the nodes of a lattice, row by row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cells<'a, Z> {
    /// Nodes along a row, >= 2.
    pub(super) columns: usize,
    /// Nodes along a column, >= 2.
    pub(super) rows: usize,
    /// `rows * columns` metres.
    pub(super) elevations: &'a [Z],
}

/// Column, row and height of a point, the height in metres.
pub(super) type Place = [f64; 3];

/// The ground of one cell: `z00 + x zx + y zy + x y zxy`, `x` and `y` in cells from its corner.
struct Patch {
    column: f64,
    row: f64,
    z00: f64,
    zx: f64,
    zy: f64,
    zxy: f64,
}

impl<Z: Copy + Into<f64>> Cells<'_, Z> {
    /// Elevation of the ground at `place`; beyond an edge, the elevation at the edge.
    pub(super) fn elevation(&self, place: [f64; 2]) -> f64 {
        let [x, y] = self.nearest(place);
        let patch = self.patch(x, y);
        let (x, y) = (x - patch.column, y - patch.row);
        patch.z00 + x * patch.zx + y * (patch.zy + x * patch.zxy)
    }

    /// Least and greatest height above ground on the straight line `from` .. `to`, which must not cross an edge of
    /// the lattice: positions outside are moved to the nearest position on it.
    pub(super) fn height_range(&self, from: Place, to: Place) -> HeightRange {
        let ends = [from, to].map(|place| self.nearest([place[0], place[1]]));
        let mut column = Walk::new(ends[0][0], ends[1][0], self.columns);
        let mut row = Walk::new(ends[0][1], ends[1][1], self.rows);
        let mut range = HeightRange::EMPTY;
        let mut u = 0.0;
        // `u` runs from 0 to 1 along the line; each cell ends at the next grid line in either direction.
        loop {
            let next = column.leave.min(row.leave).min(1.0);
            if next > u || (next >= 1.0 && range == HeightRange::EMPTY) {
                let patch = self.patch_at(column.cell, row.cell);
                let height = patch.height_below(ends, [from[2], to[2]]);
                let (min, max) = height.extremes(u, next);
                range = range.join(HeightRange { min, max });
                u = next;
            }
            if next >= 1.0 {
                return range;
            }
            if column.leave <= row.leave {
                column.step();
            } else {
                row.step();
            }
        }
    }

    /// The position on the lattice nearest to the given one.
    fn nearest(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let onto = |value: f64, nodes: usize| value.clamp(0.0, (nodes - 1) as f64);
        [onto(x, self.columns), onto(y, self.rows)]
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "both coordinates lie on the lattice, between 0 and the number of nodes"
    )]
    fn patch(&self, x: f64, y: f64) -> Patch {
        self.patch_at(
            (x as usize).min(self.columns - 2),
            (y as usize).min(self.rows - 2),
        )
    }

    #[inline]
    fn patch_at(&self, column: usize, row: usize) -> Patch {
        let first = row * self.columns + column;
        let pair = |first: usize| {
            let [west, east] = *self.elevations[first..]
                .first_chunk::<2>()
                .expect("a cell lies between two nodes of a row");
            [west.into(), east.into()]
        };
        let ([z00, z10], [z01, z11]) = (pair(first), pair(first + self.columns));
        Patch {
            column: column as f64,
            row: row as f64,
            z00,
            zx: z10 - z00,
            zy: z01 - z00,
            zxy: z11 - z01 - z10 + z00,
        }
    }
}

/// The parts of `window` on a leg's ground track `a` .. `b` between the lines through the `sides` of a lattice. Beyond an
/// edge the elevation at the edge applies, so the track over the ground bends where it crosses one. At least one part,
/// in order; empty parts are left out unless the window is.
pub(super) fn straight_parts(
    [a, b]: [Point2; 2],
    sides: Rect,
    (t0, t1): (f64, f64),
) -> impl Iterator<Item = (f64, f64)> {
    let mut bends = [
        share_of_way(a.x, b.x, sides.min.x),
        share_of_way(a.x, b.x, sides.max.x),
        share_of_way(a.y, b.y, sides.min.y),
        share_of_way(a.y, b.y, sides.max.y),
        t1,
    ];
    bends.sort_by(f64::total_cmp);
    let (mut from, mut any) = (t0, false);
    bends.into_iter().filter_map(move |bend| {
        let to = bend.clamp(t0, t1);
        let part = (from, to);
        let counts = to > from || (to >= t1 && !any);
        if counts {
            (from, any) = (to, true);
        }
        counts.then_some(part)
    })
}

/// The `t` at which `a + (b - a) t` equals `value`; infinite if there is none.
fn share_of_way(a: f64, b: f64, value: f64) -> f64 {
    let t = (value - a) / (b - a);
    if t.is_nan() { f64::INFINITY } else { t }
}

/// Steps through the columns, or the rows, that a line from `a` to `b` crosses.
pub(super) struct Walk {
    /// The current cell.
    pub(super) cell: usize,
    /// The fraction of the line at which it leaves this cell for the next; infinite if it never does.
    pub(super) leave: f64,
    a: f64,
    /// `1 / (b - a)`.
    inverse: f64,
    last: usize,
}

impl Walk {
    /// `nodes` counts both ends.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the way lies on the lattice, between 0 and the number of nodes"
    )]
    #[inline]
    pub(super) fn new(a: f64, b: f64, nodes: usize) -> Self {
        let last = nodes - 2;
        let cell = (a as usize).min(last);
        // On a grid line, a decreasing walk starts in the cell before it.
        let before = b < a && cell > 0 && a <= cell as f64;
        let mut walk = Self {
            cell: if before { cell - 1 } else { cell },
            leave: f64::INFINITY,
            a,
            inverse: 1.0 / (b - a),
            last,
        };
        walk.look();
        walk
    }

    /// Move to the next cell.
    #[inline]
    pub(super) fn step(&mut self) {
        if self.inverse > 0.0 {
            self.cell += 1;
        } else {
            self.cell -= 1;
        }
        self.look();
    }

    /// Find where the line leaves the cell; it never leaves the outermost one.
    #[inline]
    fn look(&mut self) {
        let line = if self.inverse > 0.0 {
            self.cell + 1
        } else {
            self.cell
        };
        let open = self.inverse.is_finite() && 0 < line && line <= self.last;
        self.leave = if open {
            (line as f64 - self.a) * self.inverse
        } else {
            f64::INFINITY
        };
    }
}

impl Patch {
    /// Height above this patch's ground on the line between `ends`, whose altitudes are `z0` and `z1`.
    fn height_below(&self, [[x0, y0], [x1, y1]]: [[f64; 2]; 2], [z0, z1]: [f64; 2]) -> Quadratic {
        let (x, y) = (x0 - self.column, y0 - self.row);
        let (dx, dy) = (x1 - x0, y1 - y0);
        Quadratic {
            a: -self.zxy * dx * dy,
            b: (z1 - z0) - self.zx * dx - self.zy * dy - self.zxy * (x * dy + y * dx),
            c: z0 - self.z00 - self.zx * x - self.zy * y - self.zxy * x * y,
        }
    }
}
