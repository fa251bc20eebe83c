//! The EGM96 geoid (mean sea level) over a region: computed at a few nodes, cubic between them.
//!
//! One value of its spherical harmonics takes about a millisecond, too long for each sample of a raster.

use super::geodesy::{LatLon, undulation_m};

/// Longest distance between nodes, metres. The shortest waves of EGM96 are 110 km long; with nodes twice as close as
/// this, values in the Himalayas, where it is roughest, differ by 3 cm at most, and by 2 mm with nodes four times as
/// close.
const SPACING_M: f64 = 20_000.0;

/// Least number of nodes along each side: those of one cubic.
const LEAST: usize = 4;

/// Heights of the geoid above the ellipsoid over a rectangle of coordinates of any kind, such as metres of a plane or
/// columns and rows of a raster.
#[derive(Debug, Clone, PartialEq)]
pub struct Geoid {
    min: [f64; 2],
    /// Distance between nodes.
    step: [f64; 2],
    /// Number of nodes along each side.
    counts: [usize; 2],
    /// At the nodes, row by row, metres.
    heights: Vec<f64>,
}

impl Geoid {
    /// Over the rectangle from `min` to `max`, whose `place`s on the earth are given.
    #[must_use]
    pub fn over(min: [f64; 2], max: [f64; 2], place: impl Fn([f64; 2]) -> LatLon) -> Self {
        let counts = counts(min, max, &place);
        Self::with_nodes(min, max, counts, place)
    }

    /// For the samples of a raster of two columns and two rows at least, at coordinates (column, row). Where they lie
    /// farther apart than nodes need to, the nodes are the samples: few samples may span continents.
    #[must_use]
    pub fn under_samples(size: [usize; 2], place: impl Fn([f64; 2]) -> LatLon) -> Self {
        let last = size.map(|count| (count - 1) as f64);
        let needed = counts([0.0; 2], last, &place);
        let counts = [0, 1].map(|axis| needed[axis].min(nodes_at_samples(size[axis])));
        Self::with_nodes([0.0; 2], last, counts, place)
    }

    fn with_nodes(
        min: [f64; 2],
        max: [f64; 2],
        counts: [usize; 2],
        place: impl Fn([f64; 2]) -> LatLon,
    ) -> Self {
        let step = [0, 1].map(|axis| (max[axis] - min[axis]) / (counts[axis] - 1) as f64);
        let node = |index: usize| {
            let (column, row) = (index % counts[0], index / counts[0]);
            place([
                min[0] + column as f64 * step[0],
                min[1] + row as f64 * step[1],
            ])
        };
        let heights = (0..counts[0] * counts[1]).map(|index| undulation_m(node(index)));
        Self {
            min,
            step,
            counts,
            heights: heights.collect(),
        }
    }

    /// Height of the geoid above the ellipsoid, metres. Outside the rectangle it is that of the nearest point inside.
    #[must_use]
    pub fn height_m(&self, at: [f64; 2]) -> f64 {
        let [(column, across), (row, along)] = [0, 1].map(|axis| self.weights(axis, at[axis]));
        let mut height = 0.0;
        for (row, weight) in (row..).zip(along) {
            let first = row * self.counts[0] + column;
            let nodes = &self.heights[first..first + LEAST];
            height += weight
                * nodes
                    .iter()
                    .zip(across)
                    .map(|(node, share)| node * share)
                    .sum::<f64>();
        }
        height
    }

    /// The first of four nodes along an axis, and their weights at `value` (Lagrange's formula).
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "it lies between 0 and the number of nodes"
    )]
    fn weights(&self, axis: usize, value: f64) -> (usize, [f64; LEAST]) {
        let last = self.counts[axis] - LEAST;
        let at = (value - self.min[axis]) / self.step[axis];
        // A rectangle without width has one value along it; a position that is no number has none.
        let at = if at > 0.0 {
            at.min((last + LEAST - 1) as f64)
        } else {
            0.0
        };
        let first = (at as usize).saturating_sub(1).min(last);
        let t = at - first as f64;
        let (a, b, c, d) = (t, t - 1.0, t - 2.0, t - 3.0);
        (
            first,
            [
                -b * c * d / 6.0,
                a * c * d / 2.0,
                -a * b * d / 2.0,
                a * b * c / 6.0,
            ],
        )
    }
}

/// Number of nodes along each side of the rectangle from `min` to `max` that are at most [`SPACING_M`] apart.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the sides of a rectangle on the earth have few nodes"
)]
fn counts(min: [f64; 2], max: [f64; 2], place: impl Fn([f64; 2]) -> LatLon) -> [usize; 2] {
    let middle = [0, 1].map(|axis| f64::midpoint(min[axis], max[axis]));
    let length_m = |axis: usize| {
        let end = |value: f64| {
            let mut end = middle;
            end[axis] = value;
            place(end)
        };
        let (first, last) = (end(min[axis]), end(max[axis]));
        let middle = place(middle);
        first.distance_m(middle) + middle.distance_m(last)
    };
    let counts = [0, 1].map(|axis| (length_m(axis) / SPACING_M).ceil() as usize + 1);
    counts.map(|count| count.max(LEAST))
}

/// The least number of evenly spaced nodes of which one lies at each of `samples`.
fn nodes_at_samples(samples: usize) -> usize {
    let between = samples - 1;
    between * (LEAST - 1).div_ceil(between) + 1
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// Degrees as coordinates.
    fn degrees([lon, lat]: [f64; 2]) -> LatLon {
        LatLon { lat, lon }
    }

    #[test]
    fn values_between_nodes_are_those_of_the_harmonics() {
        // The edge of the Himalayas, the Kurils, Tennessee; 200 km and 10 km wide.
        for (lat, lon) in [(27.5, 85.5), (46.0, 150.0), (36.5, -84.2)] {
            for (half, within) in [(0.9, 0.04), (0.05, 1e-4)] {
                let geoid =
                    Geoid::over([lon - half, lat - half], [lon + half, lat + half], degrees);
                let mut widest = 0.0_f64;
                for look in 0..9 {
                    let share = f64::from(look) / 8.0;
                    let at = [
                        lon - half + 2.0 * half * share,
                        lat + half * (0.9 - 1.7 * share),
                    ];
                    widest = widest.max((geoid.height_m(at) - undulation_m(degrees(at))).abs());
                }
                assert!(widest < within, "{lat} {lon} {half}: {widest}");
            }
        }
    }

    #[test]
    fn samples_far_apart_are_the_nodes() {
        // Columns and rows, degrees between them, the most places that are looked at: a millisecond for each.
        for (size, cell, most) in [
            ([5, 5], 10.0, 25),
            ([2, 3], 10.0, 20),
            ([3, 7], 1.0, 35),
            ([2, 400], 0.001, 16),
        ] {
            let looks = Cell::new(0);
            let place = |[column, row]: [f64; 2]| {
                looks.set(looks.get() + 1);
                degrees([5.0 + column * cell, 40.0 - row * cell])
            };
            let geoid = Geoid::under_samples(size, place);
            // The ends and the middles of two sides are looked at for their lengths.
            assert!(looks.get() <= most + 6, "{size:?}: {}", looks.get());
            for index in 0..size[0] * size[1] {
                let at = [(index % size[0]) as f64, (index / size[0]) as f64];
                let off = geoid.height_m(at) - undulation_m(place(at));
                assert!(off.abs() < 0.01, "{size:?} {at:?}: {off}");
            }
        }
    }

    #[test]
    fn samples_close_together_have_the_nodes_of_their_rectangle() {
        let place = |[column, row]: [f64; 2]| degrees([85.0 + column * 0.01, 28.0 - row * 0.01]);
        let geoid = Geoid::under_samples([120, 90], place);
        assert_eq!(geoid, Geoid::over([0.0; 2], [119.0, 89.0], place));
    }

    #[test]
    fn outside_it_is_as_at_the_edge() {
        let geoid = Geoid::over([85.0, 27.0], [86.0, 28.0], degrees);
        let edge = geoid.height_m([86.0, 27.4]);
        assert_eq!(geoid.height_m([90.0, 27.4]).to_bits(), edge.to_bits());
        let corner = undulation_m(degrees([85.0, 28.0]));
        assert!((geoid.height_m([-4.0, 80.0]) - corner).abs() < 1e-9);
    }

    #[test]
    fn a_rectangle_without_width_is_no_trouble() {
        let geoid = Geoid::over([85.0, 27.0], [85.0, 28.0], degrees);
        let exact = undulation_m(degrees([85.0, 27.0]));
        assert!((geoid.height_m([85.0, 27.0]) - exact).abs() < 1e-9);
    }
}
