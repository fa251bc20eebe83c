//! A part of a leg over the cells of a raster, and what the blocks under it prove about its height.

use super::slabs::Level;
use crate::geometry::Point3;
use crate::terrain::HeightRange;
use crate::terrain::cells::{Place, Walk};

/// A straight line on the plane that is nearly straight over the cells.
pub(super) struct Way {
    pub(super) ends: [Point3; 2],
    pub(super) places: [Place; 2],
    /// Greatest difference between the ground under it and that under the straight line between `places`, metres.
    pub(super) slack: f64,
}

impl Way {
    /// A point on the straight line between the places.
    #[inline]
    pub(super) fn at(&self, share: f64) -> Place {
        let [from, to] = self.places;
        std::array::from_fn(|axis| from[axis] + (to[axis] - from[axis]) * share)
    }
    /// Visit the blocks of `level` under the part `[s0, s1]`: for each, the fraction `[u0, u1]` of that part and
    /// bounds of the height above it.
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
        // `u` runs from 0 to 1 over the part; each block ends at the next block edge in either direction.
        loop {
            let next = lesser(lesser(column.leave, row.leave), 1.0);
            if next > u {
                let slab = level.slab(column.cell, row.cell);
                // Along the line, height above the plane is linear.
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

/// The lesser of two numbers; faster than `f64::min`, which handles NaN.
#[inline]
pub(super) fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of two numbers.
#[inline]
pub(super) fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
