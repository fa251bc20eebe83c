//! Whether a leg is clear of a grid, seen by the least and greatest elevations of a few blocks of it.

use crate::geometry::{Point2, Segment};
use crate::terrain::{Blocks, Grid};

/// A leg is cut in halves so often; one that is then not proven clear is left to the scalar code.
const CUTS: u32 = 1;

/// A hair on either side, cells, for rounding.
const HAIR: f64 = 1e-9;

/// A grid's elevations by blocks of cells.
#[derive(Debug, Clone)]
pub(super) struct Pyramid {
    origin: Point2,
    cells_a_metre: f64,
    blocks: Blocks<f64>,
}

/// A point of a leg: where it is in cells, and how high in the frame.
type Place = [f64; 3];

impl Pyramid {
    pub(super) fn of(grid: &Grid) -> Self {
        Self {
            origin: grid.origin,
            cells_a_metre: 1.0 / grid.cell,
            blocks: Blocks::of([grid.columns, grid.rows], &grid.elevations, 0),
        }
    }

    /// Whether the part `window` of `leg` is proven to keep between `floor` and `ceiling` above ground.
    pub(super) fn clears(
        &self,
        leg: &Segment,
        window: (f64, f64),
        (floor, ceiling): (f64, f64),
    ) -> bool {
        let place = |t: f64| {
            let point = leg.at(t);
            [
                (point.x - self.origin.x) * self.cells_a_metre,
                (point.y - self.origin.y) * self.cells_a_metre,
                point.z,
            ]
        };
        let ends = [place(window.0), place(window.1)];
        self.clears_part(ends, floor, ceiling, CUTS)
    }

    fn clears_part(&self, [a, b]: [Place; 2], floor: f64, ceiling: f64, cuts: u32) -> bool {
        let ground = self.blocks.below([a[0], a[1]], [b[0], b[1]], HAIR);
        if a[2].min(b[2]) - ground.max >= floor && a[2].max(b[2]) - ground.min <= ceiling {
            return true;
        }
        if cuts == 0 {
            return false;
        }
        let middle = std::array::from_fn(|axis| 0.5 * (a[axis] + b[axis]));
        self.clears_part([a, middle], floor, ceiling, cuts - 1)
            && self.clears_part([middle, b], floor, ceiling, cuts - 1)
    }
}
