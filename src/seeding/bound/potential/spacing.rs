//! The distances between vertices of a mesh: close together where cheap routes may lead.

use super::cells::Cells;
use super::mesh::Mesh;
use super::zones::Zones;
use crate::geometry::{Point2, Rect};

/// A cost as a multiple of the cheapest route's, as far as known, and how much wider the vertices on such a route may
/// be spaced; beyond the last, by twice as much.
const WIDER: [(f64, f64); 3] = [(1.1, 1.0), (2.0, 2.0), (4.0, 4.0)];

/// Where prices are lowered, routes are assumed to cost at least this multiple of the cheapest.
const SPARE: f64 = 1.05;

/// The same once it was estimated from a finer mesh.
const SPARE_TOLD: f64 = 1.03;

/// Share of a price that always remains.
const LEAST_SHARE: f64 = 0.4;

/// Maximum number of cells in which routes are distinguished.
const MOST_CELLS: usize = 200_000;

/// Area per vertex as a share of the squared distance to the next: half of the square root of three.
const HEXAGON: f64 = 0.866_025_403_784_438_6;

/// The distances between vertices of a mesh.
pub(super) struct Spacing {
    pub(super) cells: Cells,
    /// For each cell, the least cost of routes through it as a multiple of the cheapest, as far as known.
    dearness: Vec<f64>,
    /// Distance between vertices where they are closest.
    pub(super) side: f64,
    /// Cost of the cheapest route, as far as known.
    cheapest: f64,
    /// The least multiple of that which routes are assumed to cost where prices are lowered.
    spare: f64,
}

impl Spacing {
    /// Equal distances, for `vertices` vertices in `rect`.
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

    /// For `vertices` vertices, where the ways from both ends to the nodes of a coarser mesh cost `costs`.
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
            // A node represents its surroundings, as far as the next one.
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

    /// The least distance that gives `vertices` vertices.
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

    /// The distance between vertices in a cell as a multiple of the least distance.
    pub(super) fn wider(&self, cell: usize) -> f64 {
        let dearness = self.dearness[cell];
        let class = WIDER.iter().find(|(dear, _)| dearness < *dear);
        class.map_or(2.0 * WIDER[2].1, |(_, wider)| *wider)
    }

    /// Distance to the next vertex around a place.
    pub(super) fn at(&self, place: Point2) -> f64 {
        self.side * self.wider(self.cells.of(place))
    }

    /// Raise the assumed multiple where the cheapest route turned out to cost so much that the lowered prices limit it;
    /// returns whether that is so.
    pub(super) fn raise(&mut self, cost: f64) -> bool {
        let times = cost / self.cheapest;
        let is_held_down = times > self.spare;
        if is_held_down {
            self.spare = SPARE_TOLD * times;
        }
        is_held_down
    }

    /// Share of the price at a place that is enough to make all routes through it more expensive than the cheapest:
    /// what is not required there need not be proven by the few large triangles.
    pub(super) fn share(&self, place: Point2) -> f64 {
        (self.spare / self.dearness[self.cells.of(place)]).clamp(LEAST_SHARE, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seeding::bound::potential::vertices;
    use crate::seeding::bound::prices::Prices;
    use crate::seeding::bound::widening;
    use crate::seeding::tests::scenario;

    /// The coarse mesh estimates the way through the middle as twice as expensive as the cheapest; a finer one
    /// shows that the cheapest costs a tenth more.
    #[test]
    fn prices_are_lowered_less_when_the_cheapest_route_proves_more_expensive() {
        let scenario = scenario(r#""threats": []"#);
        let prices = Prices::of(&scenario);
        let walls = widening::walls(&scenario, &prices);
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
