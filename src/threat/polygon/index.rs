//! Boxes around runs of consecutive edges of a ring with many vertices, so that a question does not visit all of them.
//!
//! Results are the same as without it: only edges that cannot affect a result are skipped. Consecutive edges lie together,
//! so halving their list is a tree as good as any, and answers come in the order of the ring.

use std::ops::Range;

use crate::geometry::{Point2, Rect, ring};

/// Rings with fewer vertices are searched linearly.
const MANY: usize = 64;

/// Edges in a box that is not divided further.
const FEW: usize = 4;

/// Added to the reach of a question, metres, as a margin for rounding.
const HAIR: f64 = 1e-6;

/// A tree of boxes: the whole ring's is number 1, and halves of the edges in box `n` lie in `2 n` and `2 n + 1`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Index(Vec<Rect>);

/// A box, and the edges in it.
type Run = (usize, Range<usize>);

impl Index {
    /// The index of the ring through `vertices`; `None` if they are too few for it to pay off.
    pub(super) fn of(vertices: &[Point2]) -> Option<Self> {
        if vertices.len() < MANY {
            return None;
        }
        let nowhere = Rect {
            min: vertices[0],
            max: vertices[0],
        };
        let mut boxes = vec![nowhere; 2 * vertices.len().div_ceil(FEW).next_power_of_two()];
        fill(&mut boxes, vertices, (1, 0..vertices.len()));
        Some(Self(boxes))
    }

    /// The edges, in order, that come within `reach` metres of the box around `a` and `b`, and possibly others.
    pub(super) fn near(&self, vertices: &[Point2], a: Point2, b: Point2, reach: f64) -> Vec<usize> {
        let asked = Rect {
            min: a.inf(&b),
            max: a.sup(&b),
        };
        let (asked, mut found) = (asked.grown(reach + HAIR), Vec::new());
        self.collect((1, 0..vertices.len()), vertices, &asked, &mut found);
        found
    }

    fn collect(&self, run: Run, vertices: &[Point2], asked: &Rect, found: &mut Vec<usize>) {
        if !self.0[run.0].meets(asked) {
            return;
        }
        if let Some(halves) = halves(&run) {
            for half in halves {
                self.collect(half, vertices, asked, found);
            }
        } else {
            found.extend(run.1.filter(|&edge| around(vertices, edge).meets(asked)));
        }
    }

    /// As [`ring::contains`].
    pub(super) fn contains(&self, vertices: &[Point2], point: Point2) -> bool {
        self.is_crossed((1, 0..vertices.len()), vertices, point)
    }

    /// Whether the ray from `point` to the right crosses an odd number of the edges of `run`.
    fn is_crossed(&self, run: Run, vertices: &[Point2], point: Point2) -> bool {
        let of = &self.0[run.0];
        let is_level = of.min.y <= point.y && point.y <= of.max.y;
        if !is_level || of.max.x < point.x - HAIR {
            return false;
        }
        if of.min.x > point.x + HAIR {
            // All of it lies to the right, so only on which side of the ray it begins and ends matters.
            let ends = [run.1.start, run.1.end % vertices.len()];
            let [begins_above, ends_above] = ends.map(|end| vertices[end].y > point.y);
            return begins_above != ends_above;
        }
        if let Some([one, other]) = halves(&run) {
            return self.is_crossed(one, vertices, point)
                != self.is_crossed(other, vertices, point);
        }
        let edges = run.1.map(|edge| edge_of(vertices, edge));
        edges.filter(|edge| ring::is_crossed(*edge, point)).count() % 2 == 1
    }

    /// As [`ring::distance`]: edges whose boxes are farther away than a known edge cannot be nearest.
    pub(super) fn distance(&self, vertices: &[Point2], point: Point2) -> f64 {
        let mut squared = f64::INFINITY;
        self.approach((1, 0..vertices.len()), vertices, point, &mut squared);
        squared.sqrt()
    }

    fn approach(&self, run: Run, vertices: &[Point2], point: Point2, squared: &mut f64) {
        if let Some(mut halves) = halves(&run) {
            let mut away = [0, 1].map(|half| self.0[halves[half].0].excess(point));
            if away[1] < away[0] {
                halves.reverse();
                away.reverse();
            }
            for (half, away) in halves.into_iter().zip(away) {
                if away <= squared.sqrt() + HAIR {
                    self.approach(half, vertices, point, squared);
                }
            }
        } else {
            for edge in run.1 {
                *squared = squared.min(ring::squared_distance(edge_of(vertices, edge), point));
            }
        }
    }
}

/// Set the box of `run` and those within it.
fn fill(boxes: &mut [Rect], vertices: &[Point2], run: Run) {
    let number = run.0;
    boxes[number] = if let Some(halves) = halves(&run) {
        let [one, other] = halves.map(|half| {
            let number = half.0;
            fill(boxes, vertices, half);
            boxes[number]
        });
        Rect {
            min: one.min.inf(&other.min),
            max: one.max.sup(&other.max),
        }
    } else {
        let corners = run
            .1
            .flat_map(|edge| <[Point2; 2]>::from(edge_of(vertices, edge)));
        Rect::around(corners).expect("a run has edges")
    };
}

/// The halves of a run, unless it has only a few edges.
fn halves((number, edges): &Run) -> Option<[Run; 2]> {
    let middle = edges.start + edges.len() / 2;
    (edges.len() > FEW).then_some([
        (2 * number, edges.start..middle),
        (2 * number + 1, middle..edges.end),
    ])
}

fn edge_of(vertices: &[Point2], edge: usize) -> (Point2, Point2) {
    let next = if edge + 1 == vertices.len() {
        0
    } else {
        edge + 1
    };
    (vertices[edge], vertices[next])
}

fn around(vertices: &[Point2], edge: usize) -> Rect {
    let (a, b) = edge_of(vertices, edge);
    Rect {
        min: a.inf(&b),
        max: a.sup(&b),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::Vector2;

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
                let (other, reach) = (point + Vector2::new(40.0, -7.0), 3.0);
                let asked = Rect { min: point.inf(&other), max: point.sup(&other) }.grown(reach + HAIR);
                let expected: Vec<usize> = (0..vertices.len()).filter(|&edge| around(&vertices, edge).meets(&asked)).collect();
                prop_assert_eq!(index.near(&vertices, point, other, reach), expected, "{}", point);
            }
        }
    }
}
