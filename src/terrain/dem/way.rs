//! A part of a leg over the cells of a raster, and what blocks of them prove of it.

use super::slabs::Level;
use crate::geometry::Point3;
use crate::terrain::HeightRange;
use crate::terrain::cells::{Place, Walk};

/// A straight way over the plane that is all but straight over the cells.
pub(super) struct Way {
    pub(super) ends: [Point3; 2],
    pub(super) places: [Place; 2],
    /// What the ground under it may differ by from that under the straight way between `places`, metres.
    pub(super) slack: f64,
}

impl Way {
    /// On the straight way between the places.
    #[inline]
    fn at(&self, share: f64) -> Place {
        let [from, to] = self.places;
        std::array::from_fn(|axis| from[axis] + (to[axis] - from[axis]) * share)
    }
    /// The blocks of `level` under the part `[s0, s1]`, each by the share `[u0, u1]` of that part and
    /// what least and greatest height above it may be, at the utmost.
    #[inline]
    pub(super) fn blocks(
        &self,
        level: &Level,
        [s0, s1]: [f64; 2],
        mut visit: impl FnMut([f64; 2], HeightRange),
    ) {
        let [from, to] = [self.at(s0), self.at(s1)];
        let width = level.width as f64;
        let blocks = 1.0 / width;
        let mut column = Walk::new(from[0] * blocks, to[0] * blocks, level.columns + 1);
        let mut row = Walk::new(from[1] * blocks, to[1] * blocks, level.rows + 1);
        let mut u = 0.0;
        // u runs from 0 to 1 over the part; each block ends at the next line in either direction.
        loop {
            let next = column.leave.min(row.leave).min(1.0);
            if next > u {
                let slab = level.slab(column.cell, row.cell);
                let first = [column.cell as f64 * width, row.cell as f64 * width];
                let above = |u: f64| {
                    let [x, y, z]: Place =
                        std::array::from_fn(|axis| from[axis] + (to[axis] - from[axis]) * u);
                    z - slab.at([x - first[0], y - first[1]])
                };
                let (h0, h1) = (above(u), above(next));
                let [least, most] = slab.reach();
                let heights = HeightRange {
                    min: h0.min(h1) - most - self.slack,
                    max: h0.max(h1) - least + self.slack,
                };
                visit([u, next], heights);
                u = next;
            }
            if next >= 1.0 {
                return;
            }
            if column.leave <= row.leave {
                column.step();
            } else {
                row.step();
            }
        }
    }
}
