//! Least and greatest elevations of a lattice's cells by blocks, each twice as wide as those below it:
//! what is well above the ground is seen to be by a few of them.

use super::HeightRange;

/// An elevation as it is kept.
pub(crate) trait Elevation: Copy + Into<f64> {
    /// Above every other.
    const HIGHEST: Self;
    /// Below every other.
    const LOWEST: Self;
    /// The lower one; what is not a number is not looked at.
    fn lower(self, other: Self) -> Self;
    /// The higher one, likewise.
    fn higher(self, other: Self) -> Self;
}

macro_rules! elevation {
    ($type:ty) => {
        impl Elevation for $type {
            const HIGHEST: Self = Self::INFINITY;
            const LOWEST: Self = Self::NEG_INFINITY;
            fn lower(self, other: Self) -> Self {
                self.min(other)
            }
            fn higher(self, other: Self) -> Self {
                self.max(other)
            }
        }
    };
}
elevation!(f32);
elevation!(f64);

/// A lattice's elevations by blocks of cells.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Blocks<Z> {
    /// Cells along a row, and along a column.
    cells: [usize; 2],
    /// The finest blocks are `2^finest` cells wide.
    finest: u32,
    levels: Vec<Level<Z>>,
}

#[derive(Debug, Clone, PartialEq)]
struct Level<Z> {
    columns: usize,
    rows: usize,
    /// Least and greatest.
    ranges: Vec<[Z; 2]>,
}

impl<Z: Elevation> Blocks<Z> {
    /// Over so many nodes; the finest blocks are `2^finest` cells wide.
    pub(crate) fn of([columns, rows]: [usize; 2], elevations: &[Z], finest: u32) -> Self {
        let cells = [columns - 1, rows - 1];
        let side = 1 << finest;
        let node = |column: usize, row: usize| [elevations[row * columns + column]; 2];
        // A block has one node more than cells along each side.
        let blocks = cells.map(|count| count.div_ceil(side));
        let mut levels = vec![Level::of(blocks, [columns, rows], [side, side + 1], node)];
        while let Some(last) = levels.last().filter(|last| last.ranges.len() > 1) {
            let size = [last.columns, last.rows];
            let range = |column: usize, row: usize| last.ranges[row * last.columns + column];
            let next = Level::of(size.map(|count| count.div_ceil(2)), size, [2, 2], range);
            levels.push(next);
        }
        Self {
            cells,
            finest,
            levels,
        }
    }

    /// Elevations of the blocks round `a` and `b` (columns and rows) and all between them, `grown`
    /// cells farther; beyond an edge the edge's go on.
    pub(crate) fn below(&self, a: [f64; 2], b: [f64; 2], grown: f64) -> HeightRange {
        let [columns, rows] = [0, 1].map(|axis| {
            let reach = [a[axis].min(b[axis]) - grown, a[axis].max(b[axis]) + grown];
            reach.map(|cell| onto(cell, self.cells[axis]) >> self.finest)
        });
        let span = (columns[1] - columns[0]).max(rows[1] - rows[0]);
        // Blocks at least as wide as the span: it meets two at most in either direction.
        let level_idx = (usize::BITS - span.leading_zeros()) as usize;
        let level_idx = level_idx.min(self.levels.len() - 1);
        let level = &self.levels[level_idx];
        let mut range = [Z::HIGHEST, Z::LOWEST];
        for row in rows[0] >> level_idx..=rows[1] >> level_idx {
            for column in columns[0] >> level_idx..=columns[1] >> level_idx {
                range = joined(range, level.ranges[row * level.columns + column]);
            }
        }
        HeightRange {
            min: range[0].into(),
            max: range[1].into(),
        }
    }
}

impl<Z: Elevation> Level<Z> {
    /// So many columns and rows of blocks out of `size` parts: each block begins `stride` parts after
    /// the last and is `reach` wide.
    fn of(
        [columns, rows]: [usize; 2],
        size: [usize; 2],
        [stride, reach]: [usize; 2],
        part: impl Fn(usize, usize) -> [Z; 2],
    ) -> Self {
        let mut ranges = Vec::with_capacity(columns * rows);
        for row in (0..rows).map(|row| row * stride) {
            for column in (0..columns).map(|column| column * stride) {
                let mut range = [Z::HIGHEST, Z::LOWEST];
                for row in row..(row + reach).min(size[1]) {
                    for column in column..(column + reach).min(size[0]) {
                        range = joined(range, part(column, row));
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

fn joined<Z: Elevation>(a: [Z; 2], b: [Z; 2]) -> [Z; 2] {
    [a[0].lower(b[0]), a[1].higher(b[1])]
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the cells first; what is not a number becomes 0"
)]
fn onto(cell: f64, count: usize) -> usize {
    cell.clamp(0.0, (count - 1) as f64) as usize
}
