//! Whether a polygon's vertices form a simple ring, and the convex hull of those that do not.
//!
//! A sweep over the vertices (Shamos and Hoey, "Geometric intersection problems", FOCS 1976) with exact orientation
//! predicates: O(n log n) comparisons for any shape.

use std::cmp::Ordering;

use robust::{Coord, orient2d};
use spade::{DelaunayTriangulation, Triangulation as _};

use super::Point2;

/// Why vertices form no simple ring. Numbers are vertex indices; an edge has the index of its first vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RingFault {
    /// Fewer than three.
    TooFew,
    /// All on one line.
    Flat,
    /// Two vertices at the same place.
    Repeated(usize, usize),
    /// Two edges that share more than the vertex between neighbours.
    Crossing(usize, usize),
}

/// Check that the closed ring has an area and does not touch itself.
///
/// # Errors
/// All pairs of repeated vertices, each with the one before at the same place, or the first other [`RingFault`] found;
/// indices are in ascending order.
pub fn check(vertices: &[Point2]) -> Result<(), Vec<RingFault>> {
    if vertices.len() < 3 {
        return Err(vec![RingFault::TooFew]);
    }
    let mut order: Vec<usize> = (0..vertices.len()).collect();
    order.sort_by(|a, b| along(vertices[*a], vertices[*b]).then(a.cmp(b)));
    let repeated = repeated(vertices, &order);
    if !repeated.is_empty() {
        return Err(repeated);
    }
    let (first, last) = (vertices[order[0]], vertices[order[order.len() - 1]]);
    if vertices
        .iter()
        .all(|vertex| turn(first, last, *vertex).is_eq())
    {
        return Err(vec![RingFault::Flat]);
    }
    let mut sweep = Sweep {
        vertices,
        status: Vec::new(),
    };
    order
        .into_iter()
        .try_for_each(|vertex| sweep.pass(vertex))
        .map_err(|fault| vec![fault])
}

/// The corners of the convex hull of `points`, in order; fewer than three where all lie on one line.
#[must_use]
pub fn hull(points: &[Point2]) -> Vec<Point2> {
    let points = points.iter().map(|at| spade::Point2::new(at.x, at.y));
    let Ok(delaunay) = DelaunayTriangulation::<spade::Point2<f64>>::bulk_load(points.collect())
    else {
        return Vec::new();
    };
    let corners = delaunay.convex_hull().map(|edge| edge.from().position());
    corners.map(|at| Point2::new(at.x, at.y)).collect()
}

/// All vertices that are at the place of an earlier one, given the order in which the sweep passes them.
fn repeated(vertices: &[Point2], order: &[usize]) -> Vec<RingFault> {
    let pairs = order.windows(2).map(|pair| [pair[0], pair[1]]);
    let mut repeated: Vec<[usize; 2]> = pairs
        .filter(|[one, other]| along(vertices[*one], vertices[*other]).is_eq())
        .collect();
    repeated.sort_unstable();
    repeated
        .into_iter()
        .map(|[earlier, later]| RingFault::Repeated(earlier, later))
        .collect()
}

/// The order in which the sweep passes points: by x, then by y.
fn along(a: Point2, b: Point2) -> Ordering {
    a.x.partial_cmp(&b.x)
        .and_then(|x| Some(x.then(a.y.partial_cmp(&b.y)?)))
        .unwrap_or(Ordering::Equal)
}

/// The side of `c` seen along a to b: `Greater` left, `Less` right, `Equal` on the line; exact.
fn turn(a: Point2, b: Point2, c: Point2) -> Ordering {
    let coord = |point: Point2| Coord {
        x: point.x,
        y: point.y,
    };
    orient2d(coord(a), coord(b), coord(c))
        .partial_cmp(&0.0)
        .unwrap_or(Ordering::Equal)
}

/// The edges that cross the sweep line, from lowest to highest.
struct Sweep<'a> {
    vertices: &'a [Point2],
    status: Vec<usize>,
}

impl Sweep<'_> {
    /// Move the sweep line over one vertex.
    fn pass(&mut self, vertex: usize) -> Result<(), RingFault> {
        let n = self.vertices.len();
        let (incoming, outgoing) = ((vertex + n - 1) % n, vertex);
        let here = self.vertices[vertex];
        let starts = |edge: usize| along(self.ends(edge).0, here).is_eq();
        let (incoming_starts, outgoing_starts) = (starts(incoming), starts(outgoing));
        let at = self
            .status
            .partition_point(|edge| self.side(*edge, here).is_gt());
        match (incoming_starts, outgoing_starts) {
            (true, true) => self.open(at, incoming, outgoing, here),
            (false, false) => self.close(at, incoming, outgoing),
            (false, true) => self.replace(at, incoming, outgoing, here),
            (true, false) => self.replace(at, outgoing, incoming, here),
        }
    }

    /// Both edges begin at `here`.
    fn open(&mut self, at: usize, a: usize, b: usize, here: Point2) -> Result<(), RingFault> {
        if let Some(edge) = self.status.get(at)
            && self.side(*edge, here).is_eq()
        {
            return Err(crossing(*edge, a));
        }
        let (lower, upper) = match turn(here, self.ends(a).1, self.ends(b).1) {
            Ordering::Greater => (a, b),
            Ordering::Less => (b, a),
            Ordering::Equal => return Err(crossing(a, b)),
        };
        self.status.splice(at..at, [lower, upper]);
        self.neighbours(at.wrapping_sub(1), at)?;
        self.neighbours(at + 1, at + 2)
    }

    /// Both edges end here.
    fn close(&mut self, at: usize, a: usize, b: usize) -> Result<(), RingFault> {
        for slot in [at, at + 1] {
            match self.status.get(slot) {
                Some(edge) if *edge == a || *edge == b => {}
                Some(edge) => return Err(crossing(*edge, a)),
                None => return Err(crossing(a, b)),
            }
        }
        self.status.drain(at..at + 2);
        self.neighbours(at.wrapping_sub(1), at)
    }

    /// One edge ends at `here` and the next one begins.
    fn replace(
        &mut self,
        at: usize,
        ending: usize,
        starting: usize,
        here: Point2,
    ) -> Result<(), RingFault> {
        match self.status.get(at) {
            Some(edge) if *edge == ending => {}
            Some(edge) => return Err(crossing(*edge, ending)),
            None => return Err(crossing(ending, starting)),
        }
        if let Some(above) = self.status.get(at + 1)
            && self.side(*above, here).is_eq()
        {
            return Err(crossing(*above, ending));
        }
        self.status[at] = starting;
        self.neighbours(at.wrapping_sub(1), at)?;
        self.neighbours(at, at + 1)
    }

    /// Two edges that have become neighbours on the sweep line must not meet.
    fn neighbours(&self, lower: usize, upper: usize) -> Result<(), RingFault> {
        match (self.status.get(lower), self.status.get(upper)) {
            (Some(a), Some(b)) if self.meet(*a, *b) => Err(crossing(*a, *b)),
            _ => Ok(()),
        }
    }

    /// The ends of an edge, in the order in which the sweep passes them.
    fn ends(&self, edge: usize) -> (Point2, Point2) {
        let (a, b) = (
            self.vertices[edge],
            self.vertices[(edge + 1) % self.vertices.len()],
        );
        if along(a, b).is_le() { (a, b) } else { (b, a) }
    }

    /// `Greater` if the point is above the edge.
    fn side(&self, edge: usize, point: Point2) -> Ordering {
        let (left, right) = self.ends(edge);
        turn(left, right, point)
    }

    /// Whether two edges share a point other than the vertex between neighbours.
    fn meet(&self, a: usize, b: usize) -> bool {
        let n = self.vertices.len();
        if (a + 1) % n == b || (b + 1) % n == a {
            let (before, after) = if (a + 1) % n == b { (a, b) } else { (b, a) };
            let (p, shared, q) = (
                self.vertices[before],
                self.vertices[after],
                self.vertices[(after + 1) % n],
            );
            // Neighbours meet again only if the second runs back over the first.
            return turn(p, shared, q).is_eq() && along(p, shared) == along(q, shared);
        }
        let ((a0, a1), (b0, b1)) = (self.ends(a), self.ends(b));
        let (b0_side, b1_side) = (self.side(a, b0), self.side(a, b1));
        let (a0_side, a1_side) = (self.side(b, a0), self.side(b, a1));
        let on = |side: Ordering, point: Point2, (left, right): (Point2, Point2)| {
            side.is_eq() && along(left, point).is_le() && along(point, right).is_le()
        };
        let apart = |one: Ordering, other: Ordering| one.is_ne() && one == other.reverse();
        apart(b0_side, b1_side) && apart(a0_side, a1_side)
            || on(b0_side, b0, (a0, a1))
            || on(b1_side, b1, (a0, a1))
            || on(a0_side, a0, (b0, b1))
            || on(a1_side, a1, (b0, b1))
    }
}

fn crossing(a: usize, b: usize) -> RingFault {
    RingFault::Crossing(a.min(b), a.max(b))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn ring(vertices: &[(f64, f64)]) -> Vec<Point2> {
        vertices.iter().map(|(x, y)| Point2::new(*x, *y)).collect()
    }

    #[track_caller]
    fn check_ring(vertices: &[(f64, f64)], expected: Result<(), RingFault>) {
        let expected = expected.map_err(|fault| vec![fault]);
        assert_eq!(check(&ring(vertices)), expected, "{vertices:?}");
    }

    #[test]
    fn every_repeated_vertex_is_named() {
        let (a, b, c, d) = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0));
        let found = check(&ring(&[a, d, a, c, b, b, a]));
        let expected = [(0, 2), (2, 6), (4, 5)].map(|(one, other)| RingFault::Repeated(one, other));
        assert_eq!(found, Err(expected.to_vec()));
    }

    #[test]
    fn simple_rings_pass_and_others_are_named() {
        use RingFault::{Crossing, Flat, Repeated, TooFew};
        let square = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];
        check_ring(&square, Ok(()));
        let clockwise: Vec<_> = square.into_iter().rev().collect();
        check_ring(&clockwise, Ok(()));
        check_ring(
            &[(0.0, 0.0), (4.0, 0.0), (2.0, 1.0), (4.0, 4.0), (0.0, 4.0)],
            Ok(()),
        );
        check_ring(&[(0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (4.0, 4.0)], Ok(()));
        check_ring(&[(0.0, 0.0), (4.0, 0.0)], Err(TooFew));
        check_ring(&[(0.0, 0.0), (4.0, 4.0), (2.0, 2.0)], Err(Flat));
        check_ring(&[(0.0, 0.0), (0.0, 4.0), (0.0, 2.0)], Err(Flat));
        check_ring(
            &[(0.0, 0.0), (4.0, 0.0), (4.0, 0.0), (0.0, 4.0)],
            Err(Repeated(1, 2)),
        );
        // A bow tie.
        check_ring(
            &[(0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0)],
            Err(Crossing(0, 2)),
        );
        // A vertex on an edge that it does not belong to.
        check_ring(
            &[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 0.0), (0.0, 4.0)],
            Err(Crossing(0, 3)),
        );
        // A spike: the second edge runs back over the first.
        check_ring(
            &[(0.0, 0.0), (4.0, 0.0), (2.0, 0.0), (2.0, 4.0)],
            Err(Crossing(0, 1)),
        );
    }

    #[test]
    fn a_comb_of_twenty_thousand_vertices_is_quick() {
        let teeth = 5_000;
        let mut comb = Vec::new();
        for tooth in 0..teeth {
            let y = f64::from(tooth) * 2.0;
            comb.extend([(0.0, y), (1e6, y + 0.5), (1e6, y + 1.0), (0.0, y + 1.5)]);
        }
        comb.extend([(-5.0, 2.0 * f64::from(teeth)), (-5.0, -1.0)]);
        check_ring(&comb, Ok(()));
        let middle = comb.len() / 2;
        comb[middle].1 += 5.0;
        assert!(check(&ring(&comb)).is_err());
    }

    /// Checks every pair of edges, directly by the definition.
    fn simple_by_definition(vertices: &[Point2]) -> bool {
        let all = Sweep {
            vertices,
            status: Vec::new(),
        };
        (0..vertices.len()).all(|a| (0..a).all(|b| !all.meet(a, b)))
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases * 8, ..ProptestConfig::default() })]

        /// Coordinates on a small lattice, where contact, overlap and repetition are frequent.
        #[test]
        fn the_sweep_agrees_with_the_definition(points in prop::collection::vec((0i8..6, 0i8..6), 3..9)) {
            let points: Vec<_> = points.into_iter().map(|(x, y)| (f64::from(x), f64::from(y))).collect();
            let vertices = ring(&points);
            match check(&vertices).as_ref().map_err(Vec::as_slice) {
                Ok(()) => prop_assert!(simple_by_definition(&vertices)),
                Err([RingFault::Crossing(a, b)]) => {
                    prop_assert!(!simple_by_definition(&vertices), "edges {} and {}", a, b);
                }
                Err([RingFault::Flat | RingFault::TooFew]) => {}
                Err(repeated) => for fault in repeated {
                    let RingFault::Repeated(a, b) = fault else {
                        panic!("only repeated vertices are named together: {repeated:?}");
                    };
                    prop_assert_eq!(vertices[*a], vertices[*b]);
                },
            }
        }
    }
}
