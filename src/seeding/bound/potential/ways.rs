//! Cheap ways from start to target, seen from above: a by-product of the march that a potential begins with. No bound
//! uses them; searches start from them.

use std::collections::HashMap;

use super::priced::Priced;
use super::sides::Rays;
use super::spacing::Spacing;
use super::vertices;
use super::zones::Zones;
use super::{FREE, Plane, region};
use crate::geometry::Point2;
use crate::scenario::Scenario;
use crate::seeding::bound::prices::Prices;
use crate::seeding::bound::toll::Heights;
use crate::seeding::bound::wall::Wall;

/// A way this many times as expensive as the cheapest is not worth a look.
const DEAREST: f64 = 1.25;

/// How closely to look for ways.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaysSought {
    /// Approximate number of vertices of the mesh that they lead over; more where zones are many and fine.
    pub vertices: usize,
    /// Maximum number of ways.
    pub most: usize,
    /// Maximum cost of a way.
    pub dearest: f64,
}

/// Ways for a route that flies at `height`, the cheapest first, at the prices of fuel and soft zones; each passes some
/// threat on a different side from all before it. None where fuel costs nothing, start and target are not apart, or
/// nothing leads from one to the other.
#[must_use]
pub fn cheap_ways(scenario: &Scenario, height: f64, sought: WaysSought) -> Vec<Vec<Point2>> {
    let prices = Prices::of(scenario);
    if prices.fuel <= 0.0 {
        return Vec::new();
    }
    let heights = Heights::of(scenario);
    let threats = scenario.threats.iter();
    let walls = threats
        .filter(|threat| threat.reaches(height))
        .filter_map(|threat| Wall::new(threat, scenario, &prices, &heights));
    let plane = Plane::new(walls, &prices, &scenario.area);
    let (rect, _) = region(plane.ends, &plane.area, &prices, 0.0);
    let zones = Zones::new(&plane.walls, &prices, rect);
    let spacing = Spacing::even(rect, &zones, sought.vertices);
    let vertices = vertices::lay(plane.ends, &zones, &spacing);
    let Some(priced) = Priced::over(&vertices, &zones, &spacing, &FREE) else {
        return Vec::new();
    };
    let told_apart: Vec<&Wall> = zones.counted().collect();
    let ways = Ways {
        costs: priced.costs().0,
        priced,
    };
    let to_scenario = |at: Point2| at + plane.origin;
    ways.differing(&told_apart, &sought)
        .into_iter()
        .map(|way| way.into_iter().map(to_scenario).collect())
        .collect()
}

/// A mesh, and the cost of reaching its nodes from either end.
struct Ways {
    priced: Priced,
    costs: [Vec<f64>; 2],
}

/// A way from start to target: the cheapest to the first of two nodes, and the cheapest from the second on.
#[derive(Debug, Clone, Copy)]
struct Over {
    cost: f64,
    nodes: [usize; 2],
}

impl Ways {
    /// For each choice of sides on which walls are passed, the cheapest way over a node or a side of the mesh. Nodes
    /// alone are not enough: where passing one wall on either side costs the same, and passing another on either side
    /// too, all four choices meet within one triangle.
    fn differing(&self, walls: &[&Wall], sought: &WaysSought) -> Vec<Vec<Point2>> {
        let nodes = &self.priced.mesh.nodes;
        let rays = Rays::of(walls);
        let mut trees = [0, 1].map(|end| Tree::new(self, end));
        let mut cheapest: HashMap<u64, Over> = HashMap::new();
        for over in self.over_all(sought.dearest.min(DEAREST * self.costs[0][1])) {
            let ends = [0, 1].map(|end| trees[end].sides(over.nodes[end], &rays));
            let [Some(to_first), Some(to_last)] = ends else {
                continue;
            };
            let crossed = rays.crossed(over.nodes.map(|node| nodes[node]));
            let sides = to_first.wrapping_add(crossed).wrapping_sub(to_last);
            let known = cheapest.entry(sides).or_insert(over);
            if over.cost < known.cost {
                *known = over;
            }
        }
        let mut ways: Vec<Over> = cheapest.into_values().collect();
        ways.sort_by(|one, other| {
            let by_cost = one.cost.total_cmp(&other.cost);
            by_cost.then(one.nodes.cmp(&other.nodes))
        });
        ways.truncate(sought.most);
        let places = |over: Over| {
            let [mut chain, rest] = [0, 1].map(|end| trees[end].back(over.nodes[end]));
            chain.reverse();
            chain.extend(rest);
            chain.dedup();
            chain.into_iter().map(|node| nodes[node]).collect()
        };
        ways.into_iter().map(places).collect()
    }

    /// The ways over each node and each side that cost no more than the `dearest`.
    fn over_all(&self, dearest: f64) -> impl Iterator<Item = Over> {
        let nodes = (0..self.priced.mesh.nodes.len()).map(|node| ([node; 2], 0.0));
        let over = |(nodes, between): ([usize; 2], f64)| {
            let cost = self.costs[0][nodes[0]] + between + self.costs[1][nodes[1]];
            Over { cost, nodes }
        };
        let all = nodes.chain(self.priced.sides()).map(over);
        all.filter(move |over| over.cost <= dearest)
    }

    /// The node over which it is cheapest to get from `at` to an end.
    fn next(&self, end: usize, at: usize) -> Option<usize> {
        let (mesh, costs) = (&self.priced.mesh, &self.costs[end]);
        let mut cheapest = (f64::INFINITY, None);
        for &(triangle, which) in mesh.round(at) {
            let others = mesh.triangles[triangle].nodes.into_iter().enumerate();
            for (other, next) in others.filter(|(_, next)| costs[*next] < costs[at]) {
                let cost = costs[next] + self.priced.straight(triangle, [which, other]);
                if cost < cheapest.0 {
                    cheapest = (cost, Some(next));
                }
            }
        }
        cheapest.1
    }
}

/// The cheapest ways from an end to nodes.
struct Tree<'a> {
    ways: &'a Ways,
    end: usize,
    /// For each node that was asked for, the one before it, and on which sides the way to it passes walls.
    known: Vec<Option<(usize, u64)>>,
}

impl<'a> Tree<'a> {
    fn new(ways: &'a Ways, end: usize) -> Self {
        let mut known = vec![None; ways.priced.mesh.nodes.len()];
        known[end] = Some((end, 0));
        Self { ways, end, known }
    }

    /// On which sides the way to `node` passes walls, according to `rays`; `None` where no way leads there.
    fn sides(&mut self, node: usize, rays: &Rays) -> Option<u64> {
        let nodes = &self.ways.priced.mesh.nodes;
        let (mut at, mut ahead) = (node, Vec::new());
        while self.known[at].is_none() {
            let before = self.ways.next(self.end, at)?;
            ahead.push([before, at]);
            at = before;
        }
        for side in ahead.into_iter().rev() {
            let (_, sides) = self.known[side[0]]?;
            let crossed = rays.crossed(side.map(|node| nodes[node]));
            self.known[side[1]] = Some((side[0], sides.wrapping_add(crossed)));
        }
        self.known[node].map(|(_, sides)| sides)
    }

    /// From `node` back to the end.
    fn back(&self, node: usize) -> Vec<usize> {
        let before = |node: &usize| {
            let (before, _) = self.known[*node]?;
            (before != *node).then_some(before)
        };
        std::iter::successors(Some(node), before).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::geometry::wrap_angle;
    use crate::seeding::tests::among;

    fn sought(most: usize) -> WaysSought {
        WaysSought {
            vertices: 1000,
            most,
            dearest: f64::INFINITY,
        }
    }

    /// Two discs in the way, one after the other, whose soft zones overlap with those of a third and a fourth
    /// beside them in gaps of ten metres.
    #[test]
    fn one_way_is_found_for_each_combination_of_sides() {
        let discs = [
            (400.0, 333.0),
            (330.0, 420.0),
            (600.0, 566.0),
            (530.0, 650.0),
        ];
        let scenario = among(discs.map(|(x, y)| [x, y, 50.0, 80.0]));
        let ways = cheap_ways(&scenario, 100.0, sought(12));
        // Each of the two pairs can be passed on either side.
        assert_eq!(ways.len(), 4);
        let (start, target) = (scenario.start.xy(), scenario.target.xy());
        let mut lengths = Vec::new();
        for way in &ways {
            let length: f64 = way.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum();
            assert!((way[0] - start).norm() < 1e-9);
            assert!((way[way.len() - 1] - target).norm() < 1e-9);
            for threat in &scenario.threats {
                assert!(way.iter().all(|at| threat.distance(*at) > -1.0));
            }
            lengths.push(length);
        }
        let direct = (target - start).norm();
        assert!(
            lengths.iter().all(|length| *length < 1.6 * direct),
            "{lengths:?}"
        );
        // No two ways pass all discs on the same sides.
        let passed = |way: &Vec<Point2>| {
            discs.map(|(x, y)| {
                let heading = |at: &Point2| libm::atan2(at.y - y, at.x - x);
                let turns = way.windows(2);
                let turned: f64 = turns
                    .map(|ends| wrap_angle(heading(&ends[1]) - heading(&ends[0])))
                    .sum();
                turned > 0.0
            })
        };
        let sides: BTreeSet<[bool; 4]> = ways.iter().map(passed).collect();
        assert_eq!(sides.len(), ways.len(), "{sides:?}");
    }

    #[test]
    fn a_way_through_a_gap_of_ten_metres_is_found() {
        let wall = |idx| [500.0, 60.0 + 110.0 * f64::from(idx), 50.0, 58.0];
        let scenario = among((0..9).map(wall));
        let ways = cheap_ways(&scenario, 100.0, sought(3));
        let first = ways.first().expect("there are gaps");
        let length: f64 = first
            .windows(2)
            .map(|ends| (ends[1] - ends[0]).norm())
            .sum();
        let direct = (scenario.target.xy() - scenario.start.xy()).norm();
        assert!(length < 1.1 * direct, "{length} {direct}");
    }
}
