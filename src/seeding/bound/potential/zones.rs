//! The cost of a metre, and where no route can be.

use super::super::prices::Prices;
use super::super::wall::Wall;
use super::cells::Cells;
use super::mesh::{PARTS, SIDES};
use crate::geometry::{Point2, Rect, ring};
use crate::seeding::arc::{point_segment, segment_segment};
use crate::seeding::outline::OutlineShape;

/// Number of cells in which walls are looked up.
const CELLS: usize = 1024;

/// Maximum number of discs and ring corners in all cells; walls beyond are left out.
const MOST_ENTRIES: usize = 200_000;

/// Maximum number of walls in a cell.
const MOST_IN_CELL: usize = 100;

/// Walls with their soft zones, by place.
pub(super) struct Zones<'a> {
    walls: &'a [Wall],
    /// Whether each wall is in any cell.
    counts: Vec<bool>,
    prices: &'a Prices,
    cells: Cells,
    /// For each cell, the walls whose soft zones or cores overlap it.
    near: Vec<Vec<usize>>,
}

impl<'a> Zones<'a> {
    pub(super) fn new(walls: &'a [Wall], prices: &'a Prices, rect: Rect) -> Self {
        let cells = Cells::about(rect, CELLS);
        let mut near = vec![Vec::new(); cells.count()];
        let mut counts = vec![false; walls.len()];
        let mut entries = 0;
        for (idx, wall) in walls.iter().enumerate() {
            let (center, radius) = wall.circle();
            let reach = radius + wall.influence.max(wall.core);
            let more = cells.within(center, reach).count() * wall.centers().len();
            if rect.excess(center) > reach || entries + more > MOST_ENTRIES {
                continue;
            }
            entries += more;
            for cell in cells.within(center, reach) {
                if near[cell].len() < MOST_IN_CELL {
                    near[cell].push(idx);
                    counts[idx] = true;
                }
            }
        }
        Self {
            walls,
            counts,
            prices,
            cells,
            near,
        }
    }

    /// The rectangle in which they are looked up.
    pub(super) fn rect(&self) -> Rect {
        self.cells.rect
    }

    /// Metres by which a feasible route may miss a limit.
    pub(super) fn tolerance(&self) -> f64 {
        self.prices.tolerance
    }

    /// The walls that count.
    pub(super) fn counted(&self) -> impl Iterator<Item = &'a Wall> {
        let walls = self.walls.iter().zip(&self.counts);
        walls.filter_map(|(wall, counts)| counts.then_some(wall))
    }

    /// The walls that may have an effect at a place.
    pub(super) fn near(&self, place: Point2) -> impl Iterator<Item = &'a Wall> {
        self.near[self.cells.of(place)]
            .iter()
            .map(|wall| &self.walls[*wall])
    }

    /// In each node of a triangle an upper limit of the cost of a metre, chosen so that in each part of the triangle a
    /// metre costs no less than the linear interpolation between its nodes.
    pub(super) fn limits(&self, places: &[Point2; 6]) -> [f64; 6] {
        let middle = middle(places);
        let mut sums = [[self.prices.fuel; 3]; PARTS.len()];
        let mut cut = Vec::new();
        for wall in self.near(middle) {
            // The depth in the zone of a disc or of an edge is concave: nowhere less than its linear interpolation.
            let (a, b) = part(wall, middle);
            let depth = |place| wall.influence - point_segment(place, a, b) - self.prices.tolerance;
            let prices = places.map(|place| self.prices.exposure * depth(place));
            for (at, nodes) in PARTS.iter().enumerate() {
                let zone = nodes.map(|node| prices[node]);
                if zone.iter().all(|price| *price >= 0.0) {
                    sums[at] = with(&sums[at], &zone, 1.0);
                } else if zone.iter().any(|price| *price > 0.0) {
                    cut.push((at, zone));
                }
            }
        }
        for (at, zone) in cut {
            sums[at] = with_best_share(&sums[at], &zone);
        }
        let mut limits = [f64::INFINITY; 6];
        for (sums, nodes) in sums.iter().zip(PARTS) {
            for (sum, node) in sums.iter().zip(nodes) {
                limits[node] = limits[node].min(*sum);
            }
        }
        limits
    }

    /// Whether no route enters the triangle with these corners.
    pub(super) fn leave_out(&self, corners: &[Point2; 3]) -> bool {
        let tolerance = self.prices.tolerance;
        self.near(middle(corners)).any(|wall| match &wall.shape {
            OutlineShape::Disc(center) => corners
                .iter()
                .all(|corner| (corner - center).norm() <= wall.core),
            // A route may enter by the tolerance.
            OutlineShape::Ring(ring) => {
                corners.iter().all(|corner| ring::contains(ring, *corner))
                    && ring::edges(ring).all(|edge| {
                        ring::edges(corners)
                            .all(|side| segment_segment(edge, side) >= 1.5 * tolerance)
                    })
            }
        })
    }

    /// Whether a place is so deep in a core that no triangle with that corner matters.
    pub(super) fn is_deep(&self, place: Point2) -> bool {
        let least = 4.0 * self.prices.tolerance;
        self.near(place).any(|wall| match &wall.shape {
            OutlineShape::Disc(center) => (place - center).norm() < wall.core - least,
            OutlineShape::Ring(ring) => {
                ring::contains(ring, place) && ring::distance(ring, place) > least
            }
        })
    }
}

/// The limits in the nodes of a part whose edge a zone cuts, including the share of the zone's cost, negative where a
/// node lies outside, that maximises the least of them: any share is at most what the zone really costs.
fn with_best_share(limits: &[f64; 3], zone: &[f64; 3]) -> [f64; 3] {
    let least = |limits: &[f64; 3]| limits.iter().copied().fold(f64::INFINITY, f64::min);
    // The least is concave in the share: it is greatest with all of it, or where two nodes swap order.
    let meeting =
        |[one, other]: [usize; 2]| (limits[other] - limits[one]) / (zone[one] - zone[other]);
    let shares = [1.0].into_iter().chain(SIDES.map(meeting));
    shares
        .filter(|share| *share > 0.0 && *share <= 1.0)
        .map(|share| with(limits, zone, share))
        .fold(*limits, |best, other| {
            let better = least(&other) > least(&best);
            if better { other } else { best }
        })
}

fn with(limits: &[f64; 3], zone: &[f64; 3], share: f64) -> [f64; 3] {
    std::array::from_fn(|node| limits[node] + share * zone[node])
}

/// The part of `wall` nearest to a place: a point, as both ends of an edge, or an edge.
fn part(wall: &Wall, place: Point2) -> (Point2, Point2) {
    let edges = match &wall.shape {
        OutlineShape::Disc(center) => return (*center, *center),
        OutlineShape::Ring(ring) => ring::edges(ring),
    };
    let away = |(a, b): &(Point2, Point2)| point_segment(place, *a, *b);
    edges
        .min_by(|one, other| away(one).total_cmp(&away(other)))
        .expect("a ring has edges")
}

/// The middle of the first three.
fn middle(corners: &[Point2]) -> Point2 {
    Point2::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zone_whose_edge_cuts_a_part_counts_with_its_best_share() {
        let check = |limits: [f64; 3], zone: [f64; 3], expected: [f64; 3]| {
            let found = with_best_share(&limits, &zone);
            let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-12, "{found:?}");
        };
        // The third node lies outside this zone, but deeper in another.
        check([0.5, 0.5, 1.25], [0.5, 0.5, -0.25], [1.0, 1.0, 1.0]);
        check([0.5, 0.5, 1.0], [0.5, 0.5, -0.5], [0.75, 0.75, 0.75]);
        // No share of the zone would help.
        check([0.5, 0.5, 0.5], [0.5, 0.5, -0.25], [0.5, 0.5, 0.5]);
    }
}
