//! How far apart the vertices of a mesh are: close together where cheap routes may lead.

use super::cells::Cells;
use super::mesh::Mesh;
use super::zones::Zones;
use crate::geometry::{Point2, Rect};

/// A route as many times as dear as the cheapest, as far as known, and by how much wider the vertices may stand that
/// it passes; beyond the last, by twice as much.
const WIDER: [(f64, f64); 3] = [(1.1, 1.0), (2.0, 2.0), (4.0, 4.0)];

/// How many times as dear as the cheapest a route is expected to be taken for at least where prices are lowered.
const SPARE: f64 = 1.05;

/// The same once it has been told from a mesh that is finer.
const SPARE_TOLD: f64 = 1.03;

/// Share of a price that is always left.
const LEAST_SHARE: f64 = 0.4;

/// Cells in which routes are told apart, at most.
const MOST_CELLS: usize = 200_000;

/// Area of a vertex for each square of the distance to the next: half of the square root of three.
const HEXAGON: f64 = 0.866_025_403_784_438_6;

/// How far apart the vertices of a mesh are.
pub(super) struct Spacing {
    pub(super) cells: Cells,
    /// How many times as dear as the cheapest the routes through each cell are at least, as far as known.
    dearness: Vec<f64>,
    /// Distance between vertices where they are closest.
    pub(super) side: f64,
    /// What the cheapest route costs, as far as known.
    cheapest: f64,
    /// How many times as dear as that routes are taken for at least where prices are lowered.
    spare: f64,
}

impl Spacing {
    /// The same everywhere, for so many vertices in `rect`.
    pub(super) fn even(rect: Rect, zones: &Zones, vertices: usize) -> Self {
        let cells = Cells::about(rect, vertices);
        let mut even = Self {
            cells,
            dearness: vec![1.0; cells.count()],
            side: 0.0,
            cheapest: f64::INFINITY,
            spare: SPARE,
        };
        even.side = even.fitting(zones, vertices);
        even
    }

    /// For so many vertices, where the ways from both ends to the nodes of a coarser mesh cost `costs`.
    pub(super) fn finer(
        &self,
        mesh: &Mesh,
        costs: &[Vec<f64>; 2],
        zones: &Zones,
        vertices: usize,
    ) -> Self {
        let [first, last] = [0, 1].map(|end| costs[0][end] + costs[1][end]);
        let cheapest = first.min(last);
        let rect = self.cells.rect;
        let cells = Cells::new(rect, self.side.max(Cells::about(rect, MOST_CELLS).side));
        let mut dearness = vec![f64::INFINITY; cells.count()];
        for (node, place) in mesh.nodes.iter().enumerate() {
            let sum = (costs[0][node] + costs[1][node]) / cheapest;
            // A node stands for what lies about it, as far as the next one.
            for cell in cells.within(*place, self.at(*place)) {
                dearness[cell] = dearness[cell].min(sum);
            }
        }
        let mut finer = Self {
            cells,
            dearness,
            side: 0.0,
            cheapest,
            spare: SPARE,
        };
        finer.side = finer.fitting(zones, vertices).min(self.side);
        finer
    }

    /// The least distance with which there are so many vertices.
    fn fitting(&self, zones: &Zones, vertices: usize) -> f64 {
        let is_free = |cell: &usize| {
            let square = self.cells.square(*cell);
            !zones.is_deep(nalgebra::center(&square.min, &square.max))
        };
        let needed: f64 = (0..self.cells.count())
            .filter(is_free)
            .map(|cell| (self.wider(cell) * self.wider(cell)).recip())
            .sum();
        (needed.max(1.0) / (HEXAGON * vertices as f64)).sqrt() * self.cells.side
    }

    /// How many times the least distance vertices are apart in a cell.
    pub(super) fn wider(&self, cell: usize) -> f64 {
        let dearness = self.dearness[cell];
        let class = WIDER.iter().find(|(dear, _)| dearness < *dear);
        class.map_or(2.0 * WIDER[2].1, |(_, wider)| *wider)
    }

    /// Distance to the next vertex about a place.
    pub(super) fn at(&self, place: Point2) -> f64 {
        self.side * self.wider(self.cells.of(place))
    }

    /// Ask for more where the cheapest route turned out to cost so much that what is left of prices holds it down; whether
    /// that is so.
    pub(super) fn raise(&mut self, cost: f64) -> bool {
        let times = cost / self.cheapest;
        let is_held_down = times > self.spare;
        if is_held_down {
            self.spare = SPARE_TOLD * times;
        }
        is_held_down
    }

    /// Share of its price that is enough at a place to make all routes that pass it dearer than the cheapest: what is
    /// not asked for there need not be proven by triangles that are few and large.
    pub(super) fn share(&self, place: Point2) -> f64 {
        (self.spare / self.dearness[self.cells.of(place)]).clamp(LEAST_SHARE, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seeding::bound::around;
    use crate::seeding::bound::potential::vertices;
    use crate::seeding::bound::prices::Prices;
    use crate::seeding::tests::scenario;

    /// A coarse mesh takes the way past the middle for twice as dear as the cheapest; a finer one shows that the cheapest costs
    /// a tenth more.
    #[test]
    fn prices_are_lowered_less_where_the_cheapest_route_turns_out_dearer() {
        let scenario = scenario(r#""threats": []"#);
        let prices = Prices::of(&scenario);
        let walls = around::walls(&scenario, &prices);
        let (rect, ends) = (scenario.area, prices.ends.map(|end| end.xy()));
        let zones = Zones::new(&walls, &prices, rect);
        let even = Spacing::even(rect, &zones, 500);
        let mesh = Mesh::new(&vertices::lay(ends, &zones, &even), |_| false);
        let mesh = mesh.expect("they are apart");
        let middle = Point2::new(500.0, 500.0);
        let sum = |at: &Point2| {
            if (at - middle).norm() < 200.0 {
                200.0
            } else {
                100.0
            }
        };
        let costs = [
            mesh.nodes.iter().map(sum).collect(),
            vec![0.0; mesh.nodes.len()],
        ];
        let mut finer = even.finer(&mesh, &costs, &zones, 1000);
        assert!((finer.share(middle) - 0.5 * SPARE).abs() < 1e-12);
        assert!(!finer.raise(104.0) && finer.raise(110.0));
        assert!((finer.share(middle) - 0.5 * 1.1 * SPARE_TOLD).abs() < 1e-12);
        assert!((finer.share(ends[0]) - 1.0).abs() < 1e-12);
    }
}
