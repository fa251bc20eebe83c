//! Elevations at the nodes of a grid, bilinear between them.
//!
//! The least and greatest heights of a leg above it are exact.

use std::sync::Arc;

use super::HeightRange;
use super::cells::{Cells, straight_parts};
use crate::geometry::{Point2, Rect, Segment};

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
    pub elevations: Arc<[f64]>,
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
        let place = self.in_cells(point);
        self.cells().elevation([place.x, place.y])
    }

    pub(super) fn height_range(&self, leg: &Segment, window: (f64, f64)) -> HeightRange {
        let track = [leg.a, leg.b].map(|end| self.in_cells(end.xy()));
        let lattice = Rect {
            min: Point2::origin(),
            max: Point2::new((self.columns - 1) as f64, (self.rows - 1) as f64),
        };
        if track.iter().all(|end| lattice.contains(*end)) {
            return self.height_range_straight(leg, window);
        }
        straight_parts(track, lattice, window)
            .map(|part| self.height_range_straight(leg, part))
            .fold(HeightRange::EMPTY, HeightRange::join)
    }

    /// As [`Grid::height_range`], for a part that crosses no edge of the grid.
    fn height_range_straight(&self, leg: &Segment, (t0, t1): (f64, f64)) -> HeightRange {
        let place = |t: f64| {
            let point = leg.at(t);
            let place = self.in_cells(point.xy());
            [place.x, place.y, point.z]
        };
        self.cells().height_range(place(t0), place(t1))
    }

    fn cells(&self) -> Cells<'_, f64> {
        Cells {
            columns: self.columns,
            rows: self.rows,
            elevations: &self.elevations,
        }
    }

    /// `point` in cells from the first node.
    fn in_cells(&self, point: Point2) -> Point2 {
        Point2::from((point - self.origin) / self.cell)
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
            // The grid covers (-10, 5) to (50, 45).
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
