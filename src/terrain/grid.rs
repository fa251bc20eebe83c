//! Elevations at the nodes of a grid, bilinear between them.
//!
//! Along a leg the ground of one cell is a quadratic, so that a leg's least and greatest height
//! over it is exact.

use super::HeightRange;
use crate::geometry::{Point2, Quadratic, Rect, Segment};

/// Elevations at nodes, row-major from south to north; the ground between them is bilinear.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// The first (south-west) node.
    pub origin: Point2,
    /// Distance between nodes, metres, > 0.
    pub cell: f64,
    /// Nodes from west to east, >= 2.
    pub columns: usize,
    /// Nodes from south to north, >= 2.
    pub rows: usize,
    /// `rows * columns` metres.
    pub elevations: Vec<f64>,
}

/// The ground of one cell: `z00 + x zx + y zy + x y zxy`, `x` and `y` in cells from its corner.
struct Patch {
    column: f64,
    row: f64,
    z00: f64,
    zx: f64,
    zy: f64,
    zxy: f64,
}

impl Grid {
    /// The ground that the grid covers.
    #[must_use]
    pub fn extent(&self) -> Rect {
        let size =
            nalgebra::Vector2::new((self.columns - 1) as f64, (self.rows - 1) as f64) * self.cell;
        Rect {
            min: self.origin,
            max: self.origin + size,
        }
    }

    pub(super) fn elevation(&self, point: Point2) -> f64 {
        let (x, y) = self.onto_grid(self.in_cells(point));
        let patch = self.patch(x, y);
        let (x, y) = (x - patch.column, y - patch.row);
        patch.z00 + x * patch.zx + y * (patch.zy + x * patch.zxy)
    }

    pub(super) fn height_range(&self, leg: &Segment, (t0, t1): (f64, f64)) -> HeightRange {
        let (x0, y0) = self.in_cells(leg.a.xy());
        let (x1, y1) = self.in_cells(leg.b.xy());
        let (columns, rows) = ((self.columns - 1) as f64, (self.rows - 1) as f64);
        let inside = |x: f64, y: f64| 0.0 <= x && x <= columns && 0.0 <= y && y <= rows;
        if inside(x0, y0) && inside(x1, y1) {
            return self.height_range_straight(leg, (t0, t1));
        }
        // Beyond an edge its elevation goes on, so that the way over the ground bends there.
        let mut bends = [
            share_of_way(x0, x1, 0.0),
            share_of_way(x0, x1, columns),
            share_of_way(y0, y1, 0.0),
            share_of_way(y0, y1, rows),
            t1,
        ];
        bends.sort_by(f64::total_cmp);
        let mut range = HeightRange::EMPTY;
        let mut from = t0;
        for to in bends.map(|bend| bend.clamp(t0, t1)) {
            if to > from || (to >= t1 && range == HeightRange::EMPTY) {
                range = range.join(self.height_range_straight(leg, (from, to)));
                from = to;
            }
        }
        range
    }

    /// As [`Grid::height_range`], of a part that crosses no edge of the grid.
    fn height_range_straight(&self, leg: &Segment, (t0, t1): (f64, f64)) -> HeightRange {
        let (from, to) = (leg.at(t0), leg.at(t1));
        let (x0, y0) = self.onto_grid(self.in_cells(from.xy()));
        let (x1, y1) = self.onto_grid(self.in_cells(to.xy()));
        let mut column = Walk::new(x0, x1, self.columns);
        let mut row = Walk::new(y0, y1, self.rows);
        let mut range = HeightRange::EMPTY;
        let mut u = 0.0;
        // u runs from 0 to 1 over the window; each cell ends at the next grid line in either direction.
        loop {
            let next = column.leave.min(row.leave).min(1.0);
            if next > u || (next >= 1.0 && range == HeightRange::EMPTY) {
                let patch = self.patch_at(column.cell, row.cell);
                let height = patch.height_below((x0, y0), (x1, y1), (from.z, to.z));
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

    /// `point` in cells from the first node.
    fn in_cells(&self, point: Point2) -> (f64, f64) {
        let offset = (point - self.origin) / self.cell;
        (offset.x, offset.y)
    }

    /// The place on the grid nearest to `(x, y)`, all in cells.
    fn onto_grid(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let onto = |value: f64, nodes: usize| value.clamp(0.0, (nodes - 1) as f64);
        (onto(x, self.columns), onto(y, self.rows))
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "both coordinates lie on the grid, between 0 and the number of nodes"
    )]
    fn patch(&self, x: f64, y: f64) -> Patch {
        self.patch_at(
            (x as usize).min(self.columns - 2),
            (y as usize).min(self.rows - 2),
        )
    }

    fn patch_at(&self, column: usize, row: usize) -> Patch {
        let south = row * self.columns + column;
        let north = south + self.columns;
        let z = &self.elevations;
        Patch {
            column: column as f64,
            row: row as f64,
            z00: z[south],
            zx: z[south + 1] - z[south],
            zy: z[north] - z[south],
            zxy: z[north + 1] - z[north] - z[south + 1] + z[south],
        }
    }
}

/// The `t` at which `a + (b - a) t` is `value`; infinite when nowhere.
fn share_of_way(a: f64, b: f64, value: f64) -> f64 {
    let t = (value - a) / (b - a);
    if t.is_nan() { f64::INFINITY } else { t }
}

/// The columns, or the rows, that a way from `a` to `b` crosses.
struct Walk {
    /// The one where it is.
    cell: usize,
    /// The share of the way at which it leaves this for the next; infinite when never.
    leave: f64,
    a: f64,
    /// 1 over the way.
    inverse: f64,
    last: usize,
}

impl Walk {
    /// Over so many nodes, both ends among them.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the way lies on the grid, between 0 and the number of nodes"
    )]
    fn new(a: f64, b: f64, nodes: usize) -> Self {
        let last = nodes - 2;
        let cell = (a as usize).min(last);
        // On a line, a way down begins in the cell before it.
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

    /// Into the next.
    fn step(&mut self) {
        if self.inverse > 0.0 {
            self.cell += 1;
        } else {
            self.cell -= 1;
        }
        self.look();
    }

    /// Where the cell ends; the first and the last have no end.
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
    /// Height above this patch's ground along the way from `(x0, y0)` to `(x1, y1)` at `z0` to `z1`.
    fn height_below(
        &self,
        (x0, y0): (f64, f64),
        (x1, y1): (f64, f64),
        (z0, z1): (f64, f64),
    ) -> Quadratic {
        let (x, y) = (x0 - self.column, y0 - self.row);
        let (dx, dy) = (x1 - x0, y1 - y0);
        Quadratic {
            a: -self.zxy * dx * dy,
            b: (z1 - z0) - self.zx * dx - self.zy * dy - self.zxy * (x * dy + y * dx),
            c: z0 - self.z00 - self.zx * x - self.zy * y - self.zxy * x * y,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;
    use proptest::prelude::*;

    fn hills() -> Grid {
        let elevations = (0..35).map(|i| f64::from(i * i * 37 % 23)).collect();
        Grid {
            origin: Point2::new(-10.0, 5.0),
            cell: 10.0,
            columns: 7,
            rows: 5,
            elevations,
        }
    }

    #[test]
    fn nodes_and_the_middle_of_a_cell() {
        let grid = hills();
        assert!((grid.elevation(Point2::new(-10.0, 5.0)) - grid.elevations[0]).abs() < 1e-12);
        assert!((grid.elevation(Point2::new(50.0, 45.0)) - grid.elevations[34]).abs() < 1e-12);
        let mean =
            (grid.elevations[0] + grid.elevations[1] + grid.elevations[7] + grid.elevations[8])
                / 4.0;
        assert!((grid.elevation(Point2::new(-5.0, 10.0)) - mean).abs() < 1e-12);
    }

    #[test]
    fn a_vertical_leg_has_a_range() {
        let leg = Segment {
            a: Point3::new(0.0, 10.0, 50.0),
            b: Point3::new(0.0, 10.0, 80.0),
        };
        let ground = hills().elevation(Point2::new(0.0, 10.0));
        assert_eq!(
            hills().height_range(&leg, (0.0, 1.0)),
            HeightRange {
                min: 50.0 - ground,
                max: 80.0 - ground
            }
        );
    }

    proptest! {
        #[test]
        fn the_range_holds_every_sample_and_is_reached(
            // The grid reaches from (-10, 5) to (50, 45).
            x0 in -25.0..65.0f64, y0 in -10.0..60.0f64, x1 in -25.0..65.0f64, y1 in -10.0..60.0f64,
            z0 in 0.0..40.0f64, z1 in 0.0..40.0f64, t0 in 0.0..0.5f64, t1 in 0.5..1.0f64,
        ) {
            let grid = hills();
            let leg = Segment { a: Point3::new(x0, y0, z0), b: Point3::new(x1, y1, z1) };
            let range = grid.height_range(&leg, (t0, t1));
            let mut seen = HeightRange::EMPTY;
            for i in 0..=4000 {
                let point = leg.at(t0 + (t1 - t0) * f64::from(i) / 4000.0);
                let height = point.z - grid.elevation(point.xy());
                seen = seen.join(HeightRange { min: height, max: height });
            }
            prop_assert!(range.min <= seen.min + 1e-9 && range.max >= seen.max - 1e-9, "{range:?} {seen:?}");
            prop_assert!(seen.min - range.min < 0.1 && range.max - seen.max < 0.1, "{range:?} {seen:?}");
        }
    }
}
