//! Cheap ways from start to target, seen from above: what the march that a potential begins with tells besides. No bound
//! looks at them; searches begin with them.

use std::collections::HashSet;

use super::priced::Priced;
use super::spacing::Spacing;
use super::vertices;
use super::zones::Zones;
use super::{FREE, Plane, region};
use crate::geometry::{Point2, Vector2};
use crate::scenario::Scenario;
use crate::seeding::bound::prices::Prices;
use crate::seeding::bound::toll::Heights;
use crate::seeding::bound::wall::Wall;

/// A way so many times as dear as the cheapest is not worth a look.
const DEAREST: f64 = 1.25;

/// Ways that are traced, at most.
const MOST_TRACED: usize = 1000;

/// How closely ways are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaysSought {
    /// Vertices of the mesh that they lead over, about; where zones are many and fine, there are more.
    pub vertices: usize,
    /// Ways, at most.
    pub most: usize,
    /// What a way may cost at most.
    pub dearest: f64,
}

/// Ways for a route that flies at `height`, the cheapest first, at the prices of fuel and soft zones; each passes some
/// threat on another side than all before it. None where fuel costs nothing, start and target are not apart, or nothing
/// leads from one to the other.
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
        costs: priced.costs([0.0; 2]),
        priced,
    };
    let to_scenario = |at: Point2| at + plane.origin;
    ways.differing(&told_apart, &sought)
        .into_iter()
        .map(|way| way.into_iter().map(to_scenario).collect())
        .collect()
}

/// A mesh, and what reaching its nodes costs from either end.
struct Ways {
    priced: Priced,
    costs: [Vec<f64>; 2],
}

impl Ways {
    /// The cheapest way over each node that no way before comes near to, unless one of these passes all walls on the same sides.
    fn differing(&self, walls: &[&Wall], sought: &WaysSought) -> Vec<Vec<Point2>> {
        let mesh = &self.priced.mesh;
        let nodes = &mesh.nodes;
        let cost = |node: usize| self.costs[0][node] + self.costs[1][node];
        let dearest = sought.dearest.min(DEAREST * cost(0));
        let mut over: Vec<usize> = (0..nodes.len())
            .filter(|node| cost(*node) <= dearest && cost(*node).is_finite())
            .collect();
        over.sort_by(|&one, &other| cost(one).total_cmp(&cost(other)).then(one.cmp(&other)));
        let mut is_passed = vec![false; nodes.len()];
        let mut nexts = [vec![None; nodes.len()], vec![None; nodes.len()]];
        let mut traced = 0;
        let mut known = HashSet::new();
        let mut ways = Vec::new();
        for node in over {
            if ways.len() == sought.most || traced == MOST_TRACED {
                break;
            }
            if is_passed[node] {
                continue;
            }
            traced += 1;
            let Some(chain) = self.over(&mut nexts, node) else {
                continue;
            };
            for at in &chain {
                for (triangle, _) in mesh.round(*at) {
                    for node in mesh.triangles[*triangle].nodes {
                        is_passed[node] = true;
                    }
                }
            }
            let way: Vec<Point2> = chain.into_iter().map(|at| nodes[at]).collect();
            if known.insert(sides(&way, walls)) {
                ways.push(way);
            }
        }
        ways
    }

    /// From start to target over `node`.
    fn over(&self, nexts: &mut [Vec<Option<usize>>; 2], node: usize) -> Option<Vec<usize>> {
        let mut chain = self.trace(0, &mut nexts[0], node)?;
        chain.reverse();
        chain.extend(self.trace(1, &mut nexts[1], node)?.into_iter().skip(1));
        Some(chain)
    }

    /// From `node` to an end, from node to node of triangles that share them. `nexts` are those that are known.
    fn trace(&self, end: usize, nexts: &mut [Option<usize>], node: usize) -> Option<Vec<usize>> {
        let mut chain = vec![node];
        let mut at = node;
        while at != end {
            let next = match nexts[at] {
                Some(next) => next,
                None => self.next(end, at)?,
            };
            nexts[at] = Some(next);
            at = next;
            chain.push(at);
        }
        Some(chain)
    }

    /// Over which node it is cheapest from `at` to an end.
    fn next(&self, end: usize, at: usize) -> Option<usize> {
        let (mesh, costs) = (&self.priced.mesh, &self.costs[end]);
        let mut cheapest = (f64::INFINITY, None);
        for &(triangle, which) in mesh.round(at) {
            let limits = &self.priced.limits[triangle];
            let others = mesh.triangles[triangle].nodes.into_iter().enumerate();
            for (other, next) in others.filter(|(_, next)| costs[*next] < costs[at]) {
                let metre = 0.5 * (limits[which] + limits[other]);
                let way = (mesh.nodes[next] - mesh.nodes[at]).norm();
                let cost = costs[next] + metre * way;
                if cost < cheapest.0 {
                    cheapest = (cost, Some(next));
                }
            }
        }
        cheapest.1
    }
}

/// On which side a way passes each wall: how often it crosses a ray from there, those from its left counted against those
/// from its right.
fn sides(way: &[Point2], walls: &[&Wall]) -> Vec<i32> {
    let side = |wall: &&Wall| -> i32 {
        let from = wall.centers()[0];
        let crossing = |a: Vector2, b: Vector2| {
            let crosses = (a.x > 0.0) != (b.x > 0.0) && a.perp(&b) * (b.x - a.x) < 0.0;
            if !crosses {
                0
            } else if b.x > a.x {
                1
            } else {
                -1
            }
        };
        let pieces = way.windows(2);
        pieces
            .map(|ends| crossing(ends[0] - from, ends[1] - from))
            .sum()
    };
    walls.iter().map(side).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seeding::tests::scenario;

    fn sought(most: usize) -> WaysSought {
        WaysSought {
            vertices: 1000,
            most,
            dearest: f64::INFINITY,
        }
    }

    /// Two discs in the way, one after the other, whose soft zones overlap in gaps of ten metres beside a third and a fourth.
    #[test]
    fn each_way_passes_some_threat_on_another_side() {
        let discs = [
            (400.0, 333.0),
            (330.0, 420.0),
            (600.0, 566.0),
            (530.0, 650.0),
        ];
        let discs = discs.map(|(x, y)| {
            format!(
                r#"{{"kind": "cylinder", "center": {{"x": {x}, "y": {y}}}, "radius": 50, "influence": 80}}"#
            )
        });
        let scenario = scenario(&format!(r#""threats": [{}]"#, discs.join(", ")));
        let ways = cheap_ways(&scenario, 100.0, sought(12));
        assert!((3..=12).contains(&ways.len()), "{}", ways.len());
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
        // Nothing is twice the same.
        for (idx, one) in ways.iter().enumerate() {
            assert!(ways[idx + 1..].iter().all(|other| one != other));
        }
    }

    #[test]
    fn a_way_through_a_gap_of_ten_metres_is_found() {
        let discs: Vec<String> = (0..9)
            .map(|idx| {
                let y = 60.0 + 110.0 * f64::from(idx);
                format!(
                    r#"{{"kind": "cylinder", "center": {{"x": 500, "y": {y}}}, "radius": 50, "influence": 58}}"#
                )
            })
            .collect();
        let scenario = scenario(&format!(r#""threats": [{}]"#, discs.join(", ")));
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
