//! Least and greatest elevations of a grid's cells, of blocks of two by two, of four by four, and
//! so on: most legs are proven clear of a grid by a few of them.

use crate::geometry::{Point2, Segment};
use crate::terrain::{Grid, HeightRange};

/// How often a leg is halved; one that is then not proven clear is left to the scalar code.
const CUTS: u32 = 1;

/// A grid's elevations by blocks of cells.
#[derive(Debug)]
pub(super) struct Pyramid {
    origin: Point2,
    cells_a_metre: f64,
    /// Each with blocks twice as wide as the one before; the first with single cells.
    levels: Vec<Level>,
}

#[derive(Debug)]
struct Level {
    columns: usize,
    rows: usize,
    ranges: Vec<HeightRange>,
}

/// A point of a leg: where it is in cells, and how high in the frame.
type Place = [f64; 3];

impl Pyramid {
    pub(super) fn of(grid: &Grid) -> Self {
        let nodes = Level {
            columns: grid.columns,
            rows: grid.rows,
            ranges: grid
                .elevations
                .iter()
                .map(|&z| HeightRange { min: z, max: z })
                .collect(),
        };
        let mut levels = vec![nodes.joined(1, grid.columns - 1, grid.rows - 1)];
        while let Some(last) = levels.last().filter(|last| last.ranges.len() > 1) {
            levels.push(last.joined(2, last.columns.div_ceil(2), last.rows.div_ceil(2)));
        }
        Self {
            origin: grid.origin,
            cells_a_metre: 1.0 / grid.cell,
            levels,
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
        let ground = self.below(a, b);
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

    /// Elevation range of the blocks round `a` and `b`; beyond an edge the edge's values continue.
    fn below(&self, a: Place, b: Place) -> HeightRange {
        let cells = &self.levels[0];
        // A hair on either side, for rounding.
        let columns = [0, 1].map(|end| onto(edge(a[0], b[0], end), cells.columns));
        let rows = [0, 1].map(|end| onto(edge(a[1], b[1], end), cells.rows));
        let span = (columns[1] - columns[0]).max(rows[1] - rows[0]);
        // Blocks at least as wide as the span: it meets two at most in either direction.
        let level_idx = (usize::BITS - span.leading_zeros()) as usize;
        let level_idx = level_idx.min(self.levels.len() - 1);
        let level = &self.levels[level_idx];
        let mut range = HeightRange::EMPTY;
        for row in rows[0] >> level_idx..=rows[1] >> level_idx {
            for column in columns[0] >> level_idx..=columns[1] >> level_idx {
                range = range.join(level.ranges[row * level.columns + column]);
            }
        }
        range
    }
}

impl Level {
    /// Blocks of this level's, each of two by two of them, the next one `stride` farther.
    fn joined(&self, stride: usize, columns: usize, rows: usize) -> Self {
        let mut ranges = Vec::with_capacity(columns * rows);
        for row in (0..rows).map(|row| row * stride) {
            for column in (0..columns).map(|column| column * stride) {
                let mut range = HeightRange::EMPTY;
                for row in row..(row + 2).min(self.rows) {
                    for column in column..(column + 2).min(self.columns) {
                        range = range.join(self.ranges[row * self.columns + column]);
                    }
                }
                ranges.push(range);
            }
        }
        Self {
            columns,
            rows,
            ranges,
        }
    }
}

/// The lesser or the greater of two coordinates, a hair farther out.
fn edge(a: f64, b: f64, end: usize) -> f64 {
    if end == 0 {
        a.min(b) - 1e-9
    } else {
        a.max(b) + 1e-9
    }
}

/// The cell of a coordinate in cells; beyond an edge, that of the edge.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the cells first; what is not a number becomes 0"
)]
fn onto(cells: f64, count: usize) -> usize {
    cells.clamp(0.0, (count - 1) as f64) as usize
}
