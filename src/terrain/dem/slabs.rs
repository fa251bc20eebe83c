//! A raster in blocks, each a plane and how far the ground is above and below it. A leg that is well above or below
//! these planes is so everywhere, whatever the hills and slopes within a block.

use super::Raster;

/// Cells along the sides of the blocks of each level.
const WIDTHS: [usize; 3] = [4, 16, 64];

/// Allowance for single-precision rounding of a height below 12 km, metres.
const ROUNDING: f64 = 4e-3;

/// All levels, finest first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Slabs {
    pub(super) levels: Vec<Level>,
}

/// Blocks of one width.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Level {
    /// Cells along a side.
    pub(super) width: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
    slabs: Vec<Slab>,
}

/// One block: the plane `base + slope . (cells from its first node)`, and the least and greatest height of the ground
/// above it, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slab {
    base: f32,
    slope: [f32; 2],
    reach: [f32; 2],
}

impl Slabs {
    pub(super) fn of(raster: &Raster) -> Self {
        Self {
            levels: WIDTHS
                .into_iter()
                .map(|width| Level::of(raster, width))
                .collect(),
        }
    }

    /// The level at which a line over `cells` cells crosses a few blocks.
    pub(super) fn level(&self, cells: f64) -> usize {
        let few = |level: &Level| 4.0 * level.width as f64 <= cells;
        self.levels.iter().rposition(few).unwrap_or(0)
    }
}

impl Level {
    fn of(raster: &Raster, width: usize) -> Self {
        let cells = [raster.lattice.columns - 1, raster.lattice.rows - 1];
        let [columns, rows] = cells.map(|count| count.div_ceil(width));
        let slab = |idx: usize| {
            let first = [idx % columns * width, idx / columns * width];
            let last = [0, 1].map(|axis| (first[axis] + width).min(cells[axis]));
            Slab::of(raster, first, last)
        };
        Self {
            width,
            columns,
            rows,
            slabs: (0..columns * rows).map(slab).collect(),
        }
    }

    pub(super) fn slab(&self, column: usize, row: usize) -> &Slab {
        &self.slabs[row * self.columns + column]
    }
}

impl Slab {
    /// The slab over the nodes from `first` to `last`, both included.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "what rounding to single precision takes is added again"
    )]
    fn of(raster: &Raster, first: [usize; 2], last: [usize; 2]) -> Self {
        let columns = raster.lattice.columns;
        let at = |column: usize, row: usize| f64::from(raster.elevations[row * columns + column]);
        let corners = [
            at(first[0], first[1]),
            at(last[0], first[1]),
            at(first[0], last[1]),
            at(last[0], last[1]),
        ];
        let [width, height] = [0, 1].map(|axis| (last[axis] - first[axis]) as f64);
        let mut slab = Self {
            base: 0.0,
            slope: [0.0; 2],
            reach: [0.0; 2],
        };
        // Any plane is valid; this one follows the corners. Next to holes it is level.
        if corners.iter().all(|corner| !corner.is_nan()) {
            let [a, b, c, d] = corners;
            slab.slope = [
                (0.5 * (b - a + d - c) / width) as f32,
                (0.5 * (c - a + d - b) / height) as f32,
            ];
            slab.base = (0.25 * (3.0 * a + b + c - d)) as f32;
        }
        let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
        for row in first[1]..=last[1] {
            for column in first[0]..=last[0] {
                let plane = slab.at([(column - first[0]) as f64, (row - first[1]) as f64]);
                let off = at(column, row) - plane;
                reach = [reach[0].min(off), reach[1].max(off)];
            }
        }
        slab.reach = [(reach[0] - ROUNDING) as f32, (reach[1] + ROUNDING) as f32];
        slab
    }

    /// Height of the plane at `place`, in cells from the first node.
    #[inline]
    pub(super) fn at(&self, place: [f64; 2]) -> f64 {
        f64::from(self.base) + self.rise(place)
    }

    /// Rise of the plane over `[x, y]` cells.
    #[inline]
    pub(super) fn rise(&self, [x, y]: [f64; 2]) -> f64 {
        f64::from(self.slope[0]) * x + f64::from(self.slope[1]) * y
    }

    /// Least and greatest height of the ground above the plane, metres.
    #[inline]
    pub(super) fn reach(&self) -> [f64; 2] {
        self.reach.map(f64::from)
    }
}
