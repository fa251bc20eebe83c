//! What reaching each node costs, about: fast marching over the parts of triangles, after Kimmel and Sethian (1998).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::mesh::{Mesh, PARTS, Triangle};

/// Of each node of a triangle, the parts that have it, and which of their corners it is.
const PARTS_ROUND: [&[(usize, usize)]; 6] = [
    &[(0, 0)],
    &[(1, 1)],
    &[(2, 2)],
    &[(0, 1), (1, 0), (3, 2)],
    &[(1, 2), (2, 1), (3, 0)],
    &[(0, 2), (2, 0), (3, 1)],
];

/// What the cheapest ways from the first node and from the second to each node cost where a metre in the parts of a
/// triangle costs `prices`; infinite where none leads.
pub(super) fn march(mesh: &Mesh, prices: &[[f64; 4]]) -> [Vec<f64>; 2] {
    let triangles = mesh.triangles.iter();
    let shapes: Vec<Shape> = triangles
        .map(|triangle| Shape::of(mesh, triangle))
        .collect();
    [0, 1].map(|end| march_from(end, mesh, &shapes, prices))
}

fn march_from(from: usize, mesh: &Mesh, shapes: &[Shape], prices: &[[f64; 4]]) -> Vec<f64> {
    let mut costs = vec![f64::INFINITY; mesh.nodes.len()];
    let mut is_known = vec![false; mesh.nodes.len()];
    let mut heap = BinaryHeap::new();
    costs[from] = 0.0;
    heap.push((Reverse(0_u64), from));
    while let Some((_, node)) = heap.pop() {
        if is_known[node] {
            continue;
        }
        is_known[node] = true;
        for &(triangle, which) in mesh.round(node) {
            let (nodes, shape) = (&mesh.triangles[triangle].nodes, &shapes[triangle]);
            for &(part, here) in PARTS_ROUND[which] {
                let (part, price) = (PARTS[part], prices[triangle][part]);
                for (next, third) in [
                    ((here + 1) % 3, (here + 2) % 3),
                    ((here + 2) % 3, (here + 1) % 3),
                ] {
                    let (reached, beside) = (nodes[part[next]], nodes[part[third]]);
                    if is_known[reached] {
                        continue;
                    }
                    // A side between two corners is named for the third.
                    let straight = costs[node] + price * shape.sides[third];
                    let least = costs[node].min(costs[beside]) + price * shape.feet[next][1];
                    let cost = if is_known[beside] && least < costs[reached] {
                        let side = if here == (next + 1) % 3 {
                            [node, beside]
                        } else {
                            [beside, node]
                        };
                        let over = shape.over(next, price, side.map(|node| costs[node]));
                        straight.min(over)
                    } else {
                        straight
                    };
                    if cost < costs[reached] {
                        costs[reached] = cost;
                        // Bits of positive numbers are ordered as they are.
                        heap.push((Reverse(cost.to_bits()), reached));
                    }
                }
            }
        }
    }
    costs
}

/// Of the parts of a triangle.
struct Shape {
    /// Lengths of the sides opposite to each corner.
    sides: [f64; 3],
    /// Of each corner, how far along the opposite side, from the next corner on, it lies, and how far above it.
    feet: [[f64; 2]; 3],
}

impl Shape {
    fn of(mesh: &Mesh, triangle: &Triangle) -> Self {
        let [a, b, c, ..] = mesh.places(triangle).map(|place| place * 0.5);
        let sides = [c - b, a - c, b - a].map(|side| side.norm());
        let twice_area = (b - a).perp(&(c - a));
        let foot = |corner: usize| {
            let (side, to_begin, to_end) = (
                sides[corner],
                sides[(corner + 2) % 3],
                sides[(corner + 1) % 3],
            );
            let along = (to_begin * to_begin + side * side - to_end * to_end) / (2.0 * side);
            [along, twice_area / side]
        };
        Self {
            sides,
            feet: [0, 1, 2].map(foot),
        }
    }

    /// What a corner costs that is reached over the side opposite to it, which begins in the next corner, where
    /// reaching its ends costs `costs` and what lies between them is linear; infinite where the way would miss it.
    #[inline]
    fn over(&self, corner: usize, price: f64, costs: [f64; 2]) -> f64 {
        let side = self.sides[corner];
        let [along, above] = self.feet[corner];
        // The cheapest way crosses the side at an angle of which this is the cosine.
        let rise = (costs[1] - costs[0]) / (price * side);
        if rise.abs() >= 1.0 {
            return f64::INFINITY;
        }
        let slant = (1.0 - rise * rise).sqrt();
        let aside = above * rise;
        if along * slant < aside || (along - side) * slant > aside {
            return f64::INFINITY;
        }
        costs[0] + price * (rise * along + above * slant)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point2;

    /// A square of `n` by `n` steps of a metre, cut along its diagonals, without the squares that are `left_out`.
    fn square(n: u32, left_out: impl Fn(Point2) -> bool) -> Mesh {
        let at = |i: u32, j: u32| Point2::new(f64::from(i), f64::from(j));
        let vertices: Vec<Point2> = (0..=n)
            .flat_map(|j| (0..=n).map(move |i| at(i, j)))
            .collect();
        let middle = |[a, b, c]: &[Point2; 3]| Point2::from((a.coords + b.coords + c.coords) / 3.0);
        Mesh::new(&vertices, |corners| left_out(middle(corners))).expect("they are apart")
    }

    #[test]
    fn every_part_is_round_each_of_its_corners() {
        for (part, nodes) in PARTS.iter().enumerate() {
            for (corner, node) in nodes.iter().enumerate() {
                assert!(PARTS_ROUND[*node].contains(&(part, corner)));
            }
        }
        assert_eq!(PARTS_ROUND.map(<[_]>::len).iter().sum::<usize>(), 12);
    }

    #[test]
    fn as_far_as_the_straight_line() {
        let mesh = square(20, |_| false);
        let [costs, _] = march(&mesh, &vec![[3.0; 4]; mesh.triangles.len()]);
        for (node, cost) in mesh.nodes.iter().zip(&costs) {
            let straight = 3.0 * node.coords.norm();
            assert!(
                (straight - 1e-9..1.05 * straight + 1.0).contains(cost),
                "{cost} to {node}"
            );
        }
    }

    #[test]
    fn round_what_is_left_out() {
        // A wall with a way round its upper end.
        let mesh = square(20, |at| (10.0..11.0).contains(&at.x) && at.y < 15.0);
        let [costs, _] = march(&mesh, &vec![[1.0; 4]; mesh.triangles.len()]);
        let to = mesh
            .nodes
            .iter()
            .position(|node| *node == Point2::new(20.0, 0.0));
        let cost = costs[to.expect("it is a corner")];
        let round = 2.0 * Point2::new(9.7, 15.0).coords.norm();
        assert!((round..1.06 * round).contains(&cost), "{cost} {round}");
        // Nothing leads into what is walled in.
        let mesh = square(20, |at| (10.0..11.0).contains(&at.x));
        let [costs, _] = march(&mesh, &vec![[1.0; 4]; mesh.triangles.len()]);
        assert!(costs.iter().any(|cost| cost.is_infinite()));
    }
}
