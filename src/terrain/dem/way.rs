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
    pub(super) fn at(&self, share: f64) -> Place {
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
        let way: Place = std::array::from_fn(|axis| to[axis] - from[axis]);
        let width = level.width as f64;
        let blocks = 1.0 / width;
        let mut column = Walk::new(from[0] * blocks, to[0] * blocks, level.columns + 1);
        let mut row = Walk::new(from[1] * blocks, to[1] * blocks, level.rows + 1);
        let mut u = 0.0;
        // u runs from 0 to 1 over the part; each block ends at the next line in either direction.
        loop {
            let next = lesser(lesser(column.leave, row.leave), 1.0);
            if next > u {
                let slab = level.slab(column.cell, row.cell);
                // Along the way, height above the plane is a line.
                let first = [column.cell as f64 * width, row.cell as f64 * width];
                let h = from[2] - slab.at([from[0] - first[0], from[1] - first[1]]);
                let rise = way[2] - slab.rise([way[0], way[1]]);
                let (h0, h1) = (h + rise * u, h + rise * next);
                let [least, most] = slab.reach();
                let heights = HeightRange {
                    min: lesser(h0, h1) - most - self.slack,
                    max: greater(h0, h1) - least + self.slack,
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

/// Of two numbers, the lesser one; faster than where one may not be a number.
#[inline]
pub(super) fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Of two numbers, the greater one.
#[inline]
pub(super) fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
