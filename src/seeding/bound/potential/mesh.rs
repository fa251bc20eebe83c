//! A triangulation of the plane between start and target, fine where a potential must be accurate.

use spade::{DelaunayTriangulation, Triangulation as _};

use crate::geometry::{Point2, Vector2};

/// The four parts of a triangle between its nodes, each of the same shape and with corners in the same order.
pub(super) const PARTS: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [4, 5, 3]];

/// The two corners whose midpoint is each of the last three nodes.
pub(super) const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// A triangle with a node in each corner and one in the middle of each side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangle {
    /// The corners, then the middles in the order of `SIDES`.
    pub(super) nodes: [usize; 6],
    /// The gradients of the barycentric coordinates, per metre.
    pub(super) rates: [Vector2; 3],
}

/// Triangles that share nodes.
#[derive(Debug)]
pub(super) struct Mesh {
    /// The vertices that it was made from, in their order, then the middles of edges.
    pub(super) nodes: Vec<Point2>,
    pub(super) triangles: Vec<Triangle>,
    /// Where `round` begins for each node.
    first: Vec<usize>,
    /// Triangles around each node, and which of their nodes it is.
    round: Vec<(usize, usize)>,
}

impl Mesh {
    /// The Delaunay triangles of `vertices` except those that are `left_out`, given their corners; `None` where
    /// vertices cannot be distinguished.
    pub(super) fn new(
        vertices: &[Point2],
        left_out: impl Fn(&[Point2; 3]) -> bool,
    ) -> Option<Self> {
        let points = vertices.iter().map(|at| spade::Point2::new(at.x, at.y));
        let delaunay: DelaunayTriangulation<spade::Point2<f64>> =
            DelaunayTriangulation::bulk_load_stable(points.collect()).ok()?;
        if delaunay.num_vertices() != vertices.len() {
            return None;
        }
        let mut nodes = vertices.to_vec();
        nodes.extend(delaunay.undirected_edges().map(|edge| {
            let [a, b] = edge.vertices().map(|vertex| vertices[vertex.index()]);
            nalgebra::center(&a, &b)
        }));
        let triangles: Vec<Triangle> = delaunay
            .inner_faces()
            .filter_map(|face| {
                let sides = face.adjacent_edges();
                let corners = sides.map(|side| side.from().index());
                let places = corners.map(|corner| vertices[corner]);
                if left_out(&places) {
                    return None;
                }
                let [a, b, c] = corners;
                let [d, e, f] = sides.map(|side| vertices.len() + side.as_undirected().index());
                Some(Triangle {
                    nodes: [a, b, c, d, e, f],
                    rates: rates(&places),
                })
            })
            .collect();
        let (first, round) = round(nodes.len(), &triangles);
        Some(Self {
            nodes,
            triangles,
            first,
            round,
        })
    }

    /// The triangles that have `node`, and which of their nodes it is.
    pub(super) fn round(&self, node: usize) -> &[(usize, usize)] {
        &self.round[self.first[node]..self.first[node + 1]]
    }

    /// Where the nodes of `triangle` are.
    pub(super) fn places(&self, triangle: &Triangle) -> [Point2; 6] {
        triangle.nodes.map(|node| self.nodes[node])
    }
}

impl Triangle {
    /// The values of a function in the nodes.
    pub(super) fn of(&self, values: &[f64]) -> [f64; 6] {
        self.nodes.map(|node| values[node])
    }
}

fn rates([a, b, c]: &[Point2; 3]) -> [Vector2; 3] {
    let area = (b - a).perp(&(c - a));
    [c - b, a - c, b - a].map(|side| Vector2::new(-side.y, side.x) / area)
}

fn round(nodes: usize, triangles: &[Triangle]) -> (Vec<usize>, Vec<(usize, usize)>) {
    let mut first = vec![0; nodes + 1];
    for node in triangles.iter().flat_map(|triangle| triangle.nodes) {
        first[node + 1] += 1;
    }
    for node in 0..nodes {
        first[node + 1] += first[node];
    }
    let mut next = first.clone();
    let mut round = vec![(0, 0); 6 * triangles.len()];
    for (idx, triangle) in triangles.iter().enumerate() {
        for (which, node) in triangle.nodes.into_iter().enumerate() {
            round[next[node]] = (idx, which);
            next[node] += 1;
        }
    }
    (first, round)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_omits_rejected_triangles_and_has_exact_midpoints_and_rates() {
        let vertices = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.1]].map(Point2::from);
        let mesh = Mesh::new(&vertices, |corners| corners.contains(&vertices[1]));
        let mesh = mesh.expect("they are apart");
        assert_eq!(mesh.nodes.len(), 4 + 5);
        let [triangle] = mesh.triangles.as_slice() else {
            panic!("one is left: {:?}", mesh.triangles);
        };
        for (which, node) in triangle.nodes.into_iter().enumerate() {
            assert_eq!(mesh.round(node), [(0, which)]);
        }
        let places = mesh.places(triangle);
        for (middle, [one, other]) in (3..).zip(SIDES) {
            let between = nalgebra::center(&places[one], &places[other]);
            assert!((places[middle] - between).norm() < 1e-15);
        }
        // Each corner's barycentric coordinate is 1 there and 0 at the others.
        for (corner, rate) in triangle.rates.iter().enumerate() {
            for (other, place) in places[..3].iter().enumerate() {
                let share = 1.0 + rate.dot(&(place - places[corner]));
                let expected = f64::from(u8::from(other == corner));
                assert!((share - expected).abs() < 1e-12);
            }
        }
        // All parts are similar to the whole at half size.
        let edges = |[a, b, c]: [Point2; 3]| [b - a, c - b, a - c].map(|edge| edge.norm());
        let whole = edges([places[0], places[1], places[2]]);
        for part in PARTS {
            let part = edges(part.map(|node| places[node]));
            assert!(
                part.iter()
                    .zip(whole)
                    .all(|(part, whole)| (2.0 * part - whole).abs() < 1e-12)
            );
        }
        assert!(Mesh::new(&[vertices[0], vertices[1], vertices[1]], |_| false).is_none());
    }
}
