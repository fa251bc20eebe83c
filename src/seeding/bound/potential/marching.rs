//! The approximate cost of reaching each node: fast marching over the parts of triangles, after Kimmel and Sethian
//! (1998), with the slopes of the cost carried along, so that it bends between two nodes as fronts do.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::mesh::{Mesh, PARTS, Triangle};
use crate::geometry::Vector2;

/// Maximum number of Newton steps to the cheapest place of a side.
const STEPS: usize = 3;

/// A step of less than this share of a side needs no successor.
const SMALL: f64 = 0.01;

/// Greatest distance of a cubic from its chord for each unit by which its slope at either end differs from that of the
/// chord: the maximum of `u (1 - u)^2`.
const BULGE: f64 = 4.0 / 27.0;

/// For each node of a triangle, the parts that have it, and which of their corners it is.
const PARTS_ROUND: [&[(usize, usize)]; 6] = [
    &[(0, 0)],
    &[(1, 1)],
    &[(2, 2)],
    &[(0, 1), (1, 0), (3, 2)],
    &[(1, 2), (2, 1), (3, 0)],
    &[(0, 2), (2, 0), (3, 1)],
];

/// A beginning of ways.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seed {
    pub(super) node: usize,
    /// Cost already paid there.
    pub(super) cost: f64,
    /// Gradient of that cost around it, per metre.
    pub(super) slope: Vector2,
}

impl Seed {
    /// Ways that begin in a node at this cost, and go straight to all others of the triangles that have it: there
    /// fronts are too strongly curved for a march.
    pub(super) fn about(mesh: &Mesh, prices: &[[f64; 6]], node: usize, cost: f64) -> Vec<Self> {
        let slope = Vector2::zeros();
        let mut seeds = vec![Self { node, cost, slope }];
        for &(triangle, here) in mesh.round(node) {
            let prices = &prices[triangle];
            for (other, price) in mesh.triangles[triangle].nodes.into_iter().zip(prices) {
                let way = mesh.nodes[other] - mesh.nodes[node];
                let length = way.norm();
                if length > 0.0 {
                    seeds.push(Self {
                        node: other,
                        cost: cost + 0.5 * (prices[here] + price) * length,
                        slope: way * (price / length),
                    });
                }
            }
        }
        seeds
    }
}

/// The cost of the cheapest ways from any of the `seeds` of each end to each node where a metre in the nodes of a
/// triangle costs `prices`; infinite where no way leads.
pub(super) fn march(mesh: &Mesh, prices: &[[f64; 6]], seeds: &[Vec<Seed>; 2]) -> [Vec<f64>; 2] {
    let triangles = mesh.triangles.iter();
    let shapes: Vec<Shape> = triangles
        .map(|triangle| Shape::of(mesh, triangle))
        .collect();
    seeds.each_ref().map(|seeds| {
        let mut front = Front {
            mesh,
            prices,
            shapes: &shapes,
            costs: vec![f64::INFINITY; mesh.nodes.len()],
            slopes: vec![Vector2::zeros(); mesh.nodes.len()],
            is_known: vec![false; mesh.nodes.len()],
            heap: BinaryHeap::new(),
        };
        for seed in seeds {
            front.offer(*seed);
        }
        front.march();
        front.costs
    })
}

/// The state of a march.
struct Front<'a> {
    mesh: &'a Mesh,
    prices: &'a [[f64; 6]],
    shapes: &'a [Shape],
    /// Cost of each node by the cheapest way so far.
    costs: Vec<f64>,
    /// Gradients of these costs, per metre; zero where ways begin and they are not known.
    slopes: Vec<Vector2>,
    /// Whether the cost is final.
    is_known: Vec<bool>,
    /// The nodes that are reached, the cheapest first, by the bits of their cost: the bits of positive numbers have the
    /// same order.
    heap: BinaryHeap<(Reverse<u64>, usize)>,
}

impl Front<'_> {
    /// Takes a way that is cheaper than those so far.
    fn offer(&mut self, seed: Seed) {
        if seed.cost < self.costs[seed.node] {
            self.costs[seed.node] = seed.cost;
            self.slopes[seed.node] = seed.slope;
            self.heap.push((Reverse(seed.cost.to_bits()), seed.node));
        }
    }

    fn march(&mut self) {
        let mesh = self.mesh;
        while let Some((_, node)) = self.heap.pop() {
            if std::mem::replace(&mut self.is_known[node], true) {
                continue;
            }
            for &(triangle, which) in mesh.round(node) {
                for &(part, here) in PARTS_ROUND[which] {
                    let [one, other] = [(here + 1) % 3, (here + 2) % 3];
                    for corners in [[here, one, other], [here, other, one]] {
                        if let Some(seed) = self.onward((triangle, part), corners) {
                            self.offer(seed);
                        }
                    }
                }
            }
        }
    }

    /// The cheapest way within a part of a triangle from the first of its corners, or from between it and the third, to
    /// the second; `None` where that is no cheaper than the known one.
    #[inline]
    fn onward(
        &self,
        (triangle, part): (usize, usize),
        [here, next, third]: [usize; 3],
    ) -> Option<Seed> {
        let nodes = PARTS[part].map(|corner| self.mesh.triangles[triangle].nodes[corner]);
        if self.is_known[nodes[next]] {
            return None;
        }
        let shape = &self.shapes[triangle];
        let prices = PARTS[part].map(|corner| self.prices[triangle][corner]);
        let place = |corner: usize| self.mesh.nodes[nodes[corner]];
        // A side between two corners is named for the third.
        let straight = 0.5 * (prices[here] + prices[next]) * shape.sides[third];
        let mut cheapest = (self.costs[nodes[here]] + straight, place(here));
        let known = self.costs[nodes[next]];
        if self.is_known[nodes[third]] {
            let ends = if here == (next + 1) % 3 {
                [here, third]
            } else {
                [third, here]
            };
            let way = place(ends[1]) - place(ends[0]);
            let side = self.side(nodes, prices, ends);
            if shape.least(next, prices[next], &side) < cheapest.0.min(known) {
                let (cost, at) = shape.over(next, prices[next], &side);
                if cost < cheapest.0 {
                    cheapest = (cost, place(ends[0]) + way * at);
                }
            }
        }
        let (cost, from) = cheapest;
        (cost < known).then(|| {
            let way = place(next) - from;
            Seed {
                node: nodes[next],
                cost,
                slope: way * (prices[next] / way.norm()),
            }
        })
    }

    fn side(&self, nodes: [usize; 3], prices: [f64; 3], ends: [usize; 2]) -> Side {
        let [from, to] = ends.map(|end| nodes[end]);
        let way = self.mesh.nodes[to] - self.mesh.nodes[from];
        let costs = [from, to].map(|node| self.costs[node]);
        let rise = |node: usize| {
            let slope = self.slopes[node];
            if slope == Vector2::zeros() {
                costs[1] - costs[0]
            } else {
                slope.dot(&way)
            }
        };
        Side {
            costs,
            rises: [from, to].map(rise),
            prices: ends.map(|end| prices[end]),
        }
    }
}

/// A side of a part, both of whose ends are reached.
#[derive(Debug)]
struct Side {
    /// Cost of reaching its ends.
    costs: [f64; 2],
    /// Rise of that cost along the whole side, if it rose as it does at each end.
    rises: [f64; 2],
    /// Price of a metre at its ends.
    prices: [f64; 2],
}

/// The geometry of the parts of a triangle.
struct Shape {
    /// Lengths of the sides opposite to each corner.
    sides: [f64; 3],
    /// For each corner, how far along the opposite side, from the next corner on, its foot is, and its height above it.
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

    /// A lower bound of what `over` finds, computed at once: at the least price, from a side that bulges down as far as
    /// possible.
    #[inline]
    fn least(&self, corner: usize, price: f64, side: &Side) -> f64 {
        let [along, above] = self.feet[corner];
        let [first, last] = side.costs;
        let price = price.min(side.prices[0]).min(side.prices[1]);
        let rise = (last - first) / self.sides[corner];
        let slant = price * price - rise * rise;
        let straight = if slant > 0.0 {
            first + rise * along + above * slant.sqrt()
        } else {
            first.min(last)
        };
        let bulge = side.rises.map(|rise| (rise - (last - first)).abs());
        straight - BULGE * (bulge[0] + bulge[1])
    }

    /// The cost of a corner where a metre costs `price`, when it is reached over the opposite side, which begins in the
    /// next corner; and at which share of the side the way crosses it. The cost of reaching the side is a cubic along
    /// it, and the price is linear.
    #[inline]
    fn over(&self, corner: usize, price: f64, side: &Side) -> (f64, f64) {
        let length = self.sides[corner];
        let [along, above] = self.feet[corner];
        let change = side.costs[1] - side.costs[0];
        let [first, last] = side.rises;
        let (square, cube) = (
            3.0 * change - 2.0 * first - last,
            first + last - 2.0 * change,
        );
        // The mean price of the way from the beginning of the side, and how it changes along it.
        let begin = 0.5 * (price + side.prices[0]);
        let dearer = 0.5 * (side.prices[1] - side.prices[0]);
        let way = |at: f64| {
            let aside = along - at * length;
            (aside, (aside * aside + above * above).sqrt())
        };
        // If all of it were linear, the way would cross the side at an angle with this cosine.
        let rise = change / ((begin + 0.5 * dearer) * length);
        let mut at = if rise.abs() < 1.0 {
            (along - above * rise / (1.0 - rise * rise).sqrt()) / length
        } else {
            -rise
        };
        at = at.clamp(0.0, 1.0);
        for _ in 0..STEPS {
            let (aside, flown) = way(at);
            let (price, nearer) = (begin + dearer * at, -aside * length / flown);
            let turned = length * above / flown;
            let turning = turned * turned / flown;
            let slope =
                first + at * (2.0 * square + 3.0 * cube * at) + nearer * price + flown * dearer;
            let curvature =
                2.0 * square + 6.0 * cube * at + turning * price + 2.0 * nearer * dearer;
            if curvature <= 0.0 {
                break;
            }
            let before = at;
            at = (at - slope / curvature).clamp(0.0, 1.0);
            if (at - before).abs() < SMALL {
                break;
            }
        }
        let paid = side.costs[0] + at * (first + at * (square + at * cube));
        let cost = paid + way(at).1 * (begin + dearer * at);
        // A cubic with slopes that do not match may dip, but a front never comes back.
        (cost.max(side.costs[0].min(side.costs[1])), at)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::Point2;

    /// A square of `n` by `n` one-metre steps, cut along diagonals, without the squares that are `left_out`.
    fn square(n: u32, left_out: impl Fn(Point2) -> bool) -> Mesh {
        let at = |i: u32, j: u32| Point2::new(f64::from(i), f64::from(j));
        let vertices: Vec<Point2> = (0..=n)
            .flat_map(|j| (0..=n).map(move |i| at(i, j)))
            .collect();
        let middle = |[a, b, c]: &[Point2; 3]| Point2::from((a.coords + b.coords + c.coords) / 3.0);
        Mesh::new(&vertices, |corners| left_out(middle(corners))).expect("they are apart")
    }

    /// The costs of all nodes from the first one.
    fn from_first(mesh: &Mesh, prices: &[[f64; 6]]) -> Vec<f64> {
        let [costs, _] = march(mesh, prices, &[Seed::about(mesh, prices, 0, 0.0), vec![]]);
        costs
    }

    #[test]
    fn every_part_is_listed_at_each_of_its_corners() {
        for (part, nodes) in PARTS.iter().enumerate() {
            for (corner, node) in nodes.iter().enumerate() {
                assert!(PARTS_ROUND[*node].contains(&(part, corner)));
            }
        }
        assert_eq!(PARTS_ROUND.map(<[_]>::len).iter().sum::<usize>(), 12);
    }

    #[test]
    fn at_a_uniform_price_costs_are_those_of_the_straight_line() {
        let mesh = square(20, |_| false);
        let costs = from_first(&mesh, &vec![[3.0; 6]; mesh.triangles.len()]);
        for (node, cost) in mesh.nodes.iter().zip(&costs) {
            let straight = 3.0 * node.coords.norm();
            assert!(
                (0.999 * straight..=1.002 * straight).contains(cost),
                "{cost} to {node}"
            );
        }
    }

    /// The price per metre grows with the distance from the first node: the ways are straight and the cost is
    /// quadratic.
    #[test]
    fn at_a_growing_price_costs_are_those_of_the_way() {
        let mesh = square(20, |_| false);
        let price = |at: Point2| 1.0 + 0.2 * at.coords.norm();
        let triangles = mesh.triangles.iter();
        let prices: Vec<_> = triangles
            .map(|triangle| mesh.places(triangle).map(price))
            .collect();
        let costs = from_first(&mesh, &prices);
        for (node, cost) in mesh.nodes.iter().zip(&costs) {
            let away = node.coords.norm();
            let expected = away + 0.1 * away * away;
            assert!(
                (cost - expected).abs() <= 0.004 * expected,
                "{cost} {expected} to {node}"
            );
        }
    }

    /// A straight front, ahead of which a cheaper seed has been placed.
    #[test]
    fn costs_come_from_the_cheapest_seed() {
        let mesh = square(20, |_| false);
        let mut seeds: Vec<Seed> = (0..mesh.nodes.len())
            .filter(|node| mesh.nodes[*node].x < 1e-9)
            .map(|node| Seed {
                node,
                cost: 7.0,
                slope: Vector2::new(1.0, 0.0),
            })
            .collect();
        let ahead = Point2::new(12.0, 10.0);
        let node = mesh.nodes.iter().position(|node| *node == ahead);
        let prices = vec![[1.0; 6]; mesh.triangles.len()];
        let node = node.expect("it is a corner");
        seeds.extend(Seed::about(&mesh, &prices, node, 9.0));
        let [costs, none] = march(&mesh, &prices, &[seeds, vec![]]);
        for (node, cost) in mesh.nodes.iter().zip(&costs) {
            let expected = (7.0 + node.x).min(9.0 + (node - ahead).norm());
            assert!(
                (cost - expected).abs() <= 0.05,
                "{cost} {expected} to {node}"
            );
        }
        assert!(none.iter().all(|cost| cost.is_infinite()));
    }

    proptest! {
        /// Whatever the costs along the side and the prices.
        #[test]
        fn the_quick_bound_of_a_side_is_never_above_its_cost(
            (x, y) in (-2.0..3.0f64, 0.05..3.0f64),
            (first, last) in (0.0..5.0f64, 0.0..5.0f64),
            rises in prop::array::uniform2(-6.0..6.0f64),
            prices in prop::array::uniform3(0.1..4.0f64),
        ) {
            let places = [[0.0, 0.0], [2.0, 0.0], [2.0 * x, 2.0 * y]].map(Point2::from);
            let mesh = Mesh::new(&places, |_| false).expect("they are apart");
            let triangle = &mesh.triangles[0];
            let corner = (0..3).find(|corner| triangle.nodes[*corner] == 2).expect("it is one");
            let shape = Shape::of(&mesh, triangle);
            let side = Side { costs: [first, last], rises, prices: [prices[0], prices[1]] };
            let least = shape.least(corner, prices[2], &side);
            let (cost, at) = shape.over(corner, prices[2], &side);
            prop_assert!(least <= cost + 1e-9, "{least} {cost}");
            prop_assert!((0.0..=1.0).contains(&at));
        }
    }

    #[test]
    fn the_front_goes_around_missing_triangles() {
        // A wall with a way around its upper end.
        let mesh = square(20, |at| (10.0..11.0).contains(&at.x) && at.y < 15.0);
        let costs = from_first(&mesh, &vec![[1.0; 6]; mesh.triangles.len()]);
        let to = mesh
            .nodes
            .iter()
            .position(|node| *node == Point2::new(20.0, 0.0));
        let cost = costs[to.expect("it is a corner")];
        let round = 2.0 * Point2::new(9.7, 15.0).coords.norm();
        assert!((round..1.06 * round).contains(&cost), "{cost} {round}");
        // No way leads past a complete wall.
        let mesh = square(20, |at| (10.0..11.0).contains(&at.x));
        let costs = from_first(&mesh, &vec![[1.0; 6]; mesh.triangles.len()]);
        assert!(costs.iter().any(|cost| cost.is_infinite()));
    }
}
