//! Spatial index of the edges of a ring with many vertices, so that a query does not visit all of them.
//!
//! Results are the same as without it: only edges that cannot affect a result are skipped.

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use crate::geometry::{Point2, ring};

/// Rings with fewer vertices are searched linearly.
const MANY: usize = 64;

/// Added to the extent of a tree query, metres, as a margin for rounding.
const HAIR: f64 = 1e-6;

/// The boxes around the edges of a ring.
#[derive(Debug, Clone)]
pub(super) struct Index(RTree<Entry>);

/// The box around an edge, and the index of the edge.
type Entry = GeomWithData<Rectangle<[f64; 2]>, usize>;

/// Two indexes compare equal: they are derived from the ring, which is compared itself.
impl PartialEq for Index {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Index {
    /// The index of the ring through `vertices`; `None` if they are too few for it to pay off.
    pub(super) fn of(vertices: &[Point2]) -> Option<Self> {
        if vertices.len() < MANY {
            return None;
        }
        let entries = ring::edges(vertices).enumerate().map(|(idx, (a, b))| {
            GeomWithData::new(Rectangle::from_corners([a.x, a.y], [b.x, b.y]), idx)
        });
        Some(Self(RTree::bulk_load(entries.collect())))
    }

    /// The edges, in order, that come within `reach` metres of the box around `a` and `b`, and possibly others.
    pub(super) fn near(&self, a: Point2, b: Point2, reach: f64) -> Vec<usize> {
        let reach = reach + HAIR;
        let (low, high) = (a.inf(&b), a.sup(&b));
        let mut edges = self.between(
            [low.x - reach, low.y - reach],
            [high.x + reach, high.y + reach],
        );
        edges.sort_unstable();
        edges
    }

    /// As [`ring::contains`]: only edges at the height of `point` and to its right can be crossed.
    pub(super) fn contains(&self, vertices: &[Point2], point: Point2) -> bool {
        let right = self.0.root().envelope().upper()[0].max(point.x);
        let edges = self.between([point.x - HAIR, point.y], [right + HAIR, point.y]);
        let crossed = edges
            .into_iter()
            .filter(|edge| ring::is_crossed(edge_of(vertices, *edge), point));
        crossed.count() % 2 == 1
    }

    /// As [`ring::distance`]: edges whose boxes are farther away than a known edge cannot be nearest.
    pub(super) fn distance(&self, vertices: &[Point2], point: Point2) -> f64 {
        let mut least = f64::INFINITY;
        for (entry, away) in self
            .0
            .nearest_neighbor_iter_with_distance_2([point.x, point.y])
        {
            if away.sqrt() > least.sqrt() + HAIR {
                break;
            }
            least = least.min(ring::squared_distance(edge_of(vertices, entry.data), point));
        }
        least.sqrt()
    }

    /// The edges whose boxes intersect a box.
    fn between(&self, low: [f64; 2], high: [f64; 2]) -> Vec<usize> {
        self.0
            .locate_in_envelope_intersecting(AABB::from_corners(low, high))
            .map(|entry| entry.data)
            .collect()
    }
}

fn edge_of(vertices: &[Point2], edge: usize) -> (Point2, Point2) {
    (vertices[edge], vertices[(edge + 1) % vertices.len()])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A star, partly far from the origin, whose vertices lie on a lattice, so that points beside them are common.
    fn star(corners: &[f64], offset: f64) -> Vec<Point2> {
        let step = std::f64::consts::TAU / corners.len() as f64;
        let corner = |(idx, away): (usize, &f64)| {
            let (sin, cos) = libm::sincos(step * idx as f64);
            Point2::new(
                offset + (away * cos).round(),
                offset + 0.25 * (away * sin).round(),
            )
        };
        corners.iter().enumerate().map(corner).collect()
    }

    proptest! {
        #[test]
        fn the_answers_are_those_of_asking_all_edges(
            corners in prop::collection::vec(100.0..400.0f64, MANY..200),
            offset in prop_oneof![Just(0.0), Just(-3e6)],
            points in prop::collection::vec((-450..450i32, -450..450i32, prop_oneof![Just(1.0), Just(0.37)]), 40),
        ) {
            let vertices = star(&corners, offset);
            let index = Index::of(&vertices).expect("many corners");
            let corners = vertices.iter().copied();
            let points = points.into_iter().map(|(x, y, step)| {
                Point2::new(offset + f64::from(x) * step, offset + f64::from(y) * 0.25 * step)
            });
            for point in points.chain(corners) {
                prop_assert_eq!(index.contains(&vertices, point), ring::contains(&vertices, point), "{}", point);
                let (found, expected) = (index.distance(&vertices, point), ring::distance(&vertices, point));
                prop_assert_eq!(found.to_bits(), expected.to_bits(), "{}", point);
            }
        }
    }
}
