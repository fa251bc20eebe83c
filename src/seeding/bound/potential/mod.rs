//! A lower bound for routes that must cross soft zones: a potential that nowhere rises faster than
//! what a metre costs. The argument is section 6 of docs/BOUND.md.

mod cells;
mod easing;
mod levels;
mod marching;
mod mesh;
mod proof;
mod slopes;
mod spacing;
mod vertices;
mod zones;

use super::WORTHWHILE;
use super::prices::Prices;
use super::wall::Wall;
use crate::geometry::{Point2, Rect};
use levels::Levels;
use mesh::{Mesh, PARTS};
pub(super) use proof::Proof;
use slopes::steepness;
use spacing::Spacing;
use zones::Zones;

/// Vertices of a mesh that tells where the cheapest routes are, about.
const FIRST: usize = 1000;

/// Meshes of that kind, at most.
const MOST_MESHES: usize = 4;

/// Vertices that stand closest from start to target, one after the other, in the last of them at least.
const STEPS: f64 = 10.0;

/// Vertices of the first mesh that proves something, about.
const FINE: usize = 2500;

/// Vertices of any mesh, at most, but for those of the first.
const MOST_VERTICES: usize = 6000;

/// Times that vertices are added, at most.
const MOST_ROUNDS: usize = 2;

/// How many times as steep as its limits a triangle is that is cut up.
const TOO_STEEP: f64 = 1.02;

/// Share of what a potential rises by that is worth no more vertices.
const NEARLY: f64 = 0.985;

/// How many times what a string costs a route costs that is not looked at.
const BEYOND: f64 = 1.05;

/// A string this many times as dear as what is known promises more, whatever is estimated.
const FAR: f64 = 1.5;

/// Share of the direct way by which a string may leave the area: a way within it is about as long.
const OUTSIDE: f64 = 0.01;

/// Points on a string at which soft zones are looked up.
const SAMPLES: u32 = 256;

/// Whether there are soft zones, at prices and between ends for which a potential can prove something.
pub(super) fn applies(walls: &[Wall], prices: &Prices) -> bool {
    prices.exposure > 0.0
        && prices.direct() > 1e5 * prices.tolerance
        && whole(walls).any(|wall| wall.influence > wall.core)
}

/// Those that reach over all heights.
fn whole(walls: &[Wall]) -> impl Iterator<Item = &Wall> {
    walls.iter().filter(|wall| wall.toll.is_none())
}

/// What proves what no route undercuts at the prices of fuel and soft zones, seen from above, where it `applies`; `None`
/// where that is not expected to exceed `known`, which no route undercuts either. A string costs what is `promised`.
pub(super) fn prove(
    walls: &[Wall],
    prices: &Prices,
    area: &Rect,
    (known, promised): (f64, f64),
    stop: &dyn Fn() -> bool,
) -> Option<Proof> {
    if promised <= WORTHWHILE * known {
        return None;
    }
    // From the start on, where places are rounded least.
    let origin = prices.ends[0].xy().coords;
    let walls: Vec<Wall> = whole(walls).map(|wall| wall.moved(-origin)).collect();
    let ends = prices.ends.map(|end| end.xy() - origin);
    let area = Rect {
        min: area.min - origin,
        max: area.max - origin,
    };
    let (rect, cap) = region(ends, &area.grown(2.0 * prices.tolerance), prices, promised);
    let zones = Zones::new(&walls, prices, rect);
    let mut spacing = Spacing::even(rect, &zones, FIRST);
    for level in 1..=MOST_MESHES {
        let vertices = vertices::lay(ends, &zones, &spacing);
        let priced = Priced::over(&vertices, &zones, &spacing)?;
        let costs = priced.costs();
        let estimate = costs[0][1];
        // The first mesh is too coarse for narrow gaps, through which an estimate leaks.
        let is_near = prices.climbing_at(estimate) < WORTHWHILE * known && promised < FAR * known;
        // Nothing leads to the target, or nothing is to be gained.
        if !estimate.is_finite() || (level == 1 && is_near) || stop() {
            return None;
        }
        let is_enough = prices.direct() > STEPS * spacing.side;
        let next = if is_enough { FINE } else { FIRST };
        spacing = spacing.finer(&priced.mesh, &costs, &zones, next);
        if is_enough {
            break;
        }
    }
    let vertices = vertices::lay(ends, &zones, &spacing);
    let steep = steepest(vertices, &zones, &spacing, stop)?;
    Some(Proof::new(steep, cap, (origin, rect)))
}

/// The potential over the first two of `vertices` that rises the most, with more of them where the triangles are too
/// large for what they must rise by.
fn steepest(
    mut vertices: Vec<Point2>,
    zones: &Zones,
    spacing: &Spacing,
    stop: &dyn Fn() -> bool,
) -> Option<(Mesh, Vec<f64>, Levels)> {
    let mut best: Option<(Mesh, Vec<f64>, Levels)> = None;
    for round in 0..=MOST_ROUNDS {
        let Some(priced) = Priced::over(&vertices, zones, spacing) else {
            break;
        };
        let potential = priced.potential();
        let rise = potential[1] - potential[0];
        // Nothing leads to the target.
        if !(rise > 0.0 && rise.is_finite()) {
            break;
        }
        let levels = Levels::new(&priced.mesh, &priced.limits, &potential);
        let proven = levels.total();
        let room = MOST_VERTICES.saturating_sub(vertices.len());
        let is_last = round == MOST_ROUNDS || room == 0 || proven >= NEARLY * rise || stop();
        if !is_last {
            vertices.extend(priced.between(&potential).into_iter().take(room));
        }
        if best
            .as_ref()
            .is_none_or(|(_, _, other)| proven > other.total())
        {
            best = Some((priced.mesh, potential, levels));
        }
        if is_last {
            break;
        }
    }
    best
}

/// Where routes are looked at, and what one costs at least that leaves it: all of the area, or the part of it with
/// all ways that are not longer than what costs more in fuel alone than is `promised`.
fn region(ends: [Point2; 2], area: &Rect, prices: &Prices, promised: f64) -> (Rect, f64) {
    let direct = prices.direct();
    let longest = (BEYOND * promised / prices.fuel).max(1.5 * direct);
    if !longest.is_finite() {
        return (*area, f64::INFINITY);
    }
    // Half of the rectangle round the ellipse whose foci are the ends.
    let across_squared = longest * longest - direct * direct;
    let along = ends[1] - ends[0];
    let half = [along.x, along.y].map(|extent| 0.5 * (across_squared + extent * extent).sqrt());
    let middle = nalgebra::center(&ends[0], &ends[1]);
    let rect = Rect {
        min: Point2::new(
            area.min.x.max(middle.x - half[0]),
            area.min.y.max(middle.y - half[1]),
        ),
        max: Point2::new(
            area.max.x.min(middle.x + half[0]),
            area.max.y.min(middle.y + half[1]),
        ),
    };
    (rect, prices.fuel * longest)
}

/// A mesh with what its triangles may rise by.
struct Priced {
    mesh: Mesh,
    /// In the nodes of each triangle, a metre.
    limits: Vec<[f64; 6]>,
    /// In the parts of each triangle, a metre: what is made use of.
    prices: Vec<[f64; 4]>,
}

impl Priced {
    fn over(vertices: &[Point2], zones: &Zones, spacing: &Spacing) -> Option<Self> {
        let mesh = Mesh::new(vertices, |corners| zones.leave_out(corners))?;
        let triangles = mesh.triangles.iter();
        let limits: Vec<[f64; 6]> = triangles
            .map(|triangle| zones.limits(&mesh.places(triangle)))
            .collect();
        let shares: Vec<f64> = mesh.nodes.iter().map(|at| spacing.share(*at)).collect();
        let of_part = |nodes: &[usize; 6], limits: &[f64; 6], part: [usize; 3]| {
            let prices = part.map(|node| limits[node] * shares[nodes[node]]);
            prices.iter().sum::<f64>() / 3.0
        };
        let triangles = mesh.triangles.iter().zip(&limits);
        let prices = triangles
            .map(|(triangle, limits)| PARTS.map(|part| of_part(&triangle.nodes, limits, part)))
            .collect();
        Some(Self {
            mesh,
            limits,
            prices,
        })
    }

    /// What the cheapest ways to each node cost from either end, about.
    fn costs(&self) -> [Vec<f64>; 2] {
        [0, 1].map(|end| marching::march(&self.mesh, &self.prices, end))
    }

    /// A potential that is hardly anywhere steeper than the limits.
    fn potential(&self) -> Vec<f64> {
        let [from, to] = self.costs();
        // Away from the cheapest way the two do not rise in the same direction: their mean is less steep there.
        let mean = |(from, to): (&f64, &f64)| 0.5 * (from - to);
        let mut potential: Vec<f64> = from.iter().zip(&to).map(mean).collect();
        easing::ease(&self.mesh, &self.limits, &mut potential, 2);
        potential
    }

    /// The middles of the sides of all triangles that are too steep nevertheless.
    fn between(&self, potential: &[f64]) -> Vec<Point2> {
        let triangles = self.mesh.triangles.iter().zip(&self.limits);
        let steep = triangles.filter(|(triangle, limits)| {
            let values = triangle.of(potential);
            steepness(triangle, limits, &values) > TOO_STEEP
                && values.iter().any(|value| *value > potential[0])
                && values.iter().any(|value| *value < potential[1])
        });
        let mut nodes: Vec<usize> = steep
            .flat_map(|(triangle, _)| triangle.nodes[3..].to_vec())
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
            .into_iter()
            .map(|node| self.mesh.nodes[node])
            .collect()
    }
}

/// What a way costs seen from above, about, that is at places told by their shares of its length; infinite where it
/// leaves the area, of which strings know nothing.
pub(super) fn price(
    walls: &[Wall],
    prices: &Prices,
    area: &Rect,
    (length, at): (f64, &dyn Fn(f64) -> Point2),
) -> f64 {
    let depth = |at: Point2| -> f64 {
        whole(walls)
            .map(|wall| (wall.influence - wall.distance(at)).max(0.0))
            .sum()
    };
    let middle = |part| at((f64::from(part) + 0.5) / f64::from(SAMPLES));
    let outside = OUTSIDE * prices.direct();
    if (0..SAMPLES).any(|part| area.excess(middle(part)) > outside) {
        return f64::INFINITY;
    }
    let depths: f64 = (0..SAMPLES).map(|part| depth(middle(part))).sum();
    length * (prices.fuel + prices.exposure * depths / f64::from(SAMPLES))
}

#[cfg(test)]
mod tests {
    use super::super::super::outline::OutlineShape;
    use super::super::super::tests::read;
    use super::super::around;
    use super::*;
    use crate::geometry::{Vector2, ring};
    use crate::scenario::Scenario;

    /// From (200, 500) to (800, 500), `fuel` a metre, in a square of a kilometre.
    fn scenario(fuel: f64, threats: &str) -> Scenario {
        read(&format!(
            r#"{{ "frame": "local",
                "start": {{ "x": 200, "y": 500, "z": 100 }}, "target": {{ "x": 800, "y": 500, "z": 100 }},
                "area": {{ "min": {{ "x": 0, "y": 0 }}, "max": {{ "x": 1000, "y": 1000 }} }},
                "altitude": {{ "min": 0, "max": 200 }},
                "vehicle": {{ "max_turn_deg": 60, "max_climb_deg": 45, "fuel_per_km": 1000 }},
                "weights": {{ "fuel": {fuel}, "threat": 1, "altitude": 1 }},
                "planner": {{ "algorithm": "tms-sba" }}, "threats": [{threats}] }}"#
        ))
    }

    fn disc(x: f64, y: f64, radius: f64, influence: f64) -> String {
        format!(
            r#"{{"kind": "cylinder", "center": {{"x": {x}, "y": {y}}}, "radius": {radius}, "influence": {influence}}}"#
        )
    }

    fn proof(scenario: &Scenario, known: (f64, f64), stop: bool) -> Option<Proof> {
        let prices = Prices::of(scenario);
        let walls = around::walls(scenario, &prices);
        prove(&walls, &prices, &scenario.area, known, &|| stop)
    }

    fn proven(scenario: &Scenario) -> f64 {
        let proof = proof(scenario, (0.0, f64::INFINITY), false);
        proof.expect("there is a way").total()
    }

    /// The cheapest way over a lattice of `NODES` nodes a side with legs in 32 directions, each
    /// summed up in its middle parts: dearer than the cheapest way of all, but for that sum.
    fn over_lattice(scenario: &Scenario) -> f64 {
        const NODES: i32 = 51;
        let spacing = 20.0;
        let prices = Prices::of(scenario);
        let walls = around::walls(scenario, &prices);
        let price = |a: Point2, b: Point2| {
            let parts = 8;
            let sum: f64 = (0..parts)
                .map(|part| {
                    let at = a + (b - a) * ((f64::from(part) + 0.5) / f64::from(parts));
                    let depths = walls.iter().map(|wall| {
                        let away = wall.distance(at);
                        if away < wall.core {
                            f64::INFINITY
                        } else {
                            (wall.influence - away).max(0.0)
                        }
                    });
                    prices.fuel + prices.exposure * depths.sum::<f64>()
                })
                .sum();
            sum / f64::from(parts) * (b - a).norm()
        };
        let at = |[i, j]: [i32; 2]| Point2::new(f64::from(i) * spacing, f64::from(j) * spacing);
        let index =
            |[i, j]: [i32; 2]| usize::try_from(j * NODES + i).expect("it lies in the lattice");
        let mut best = vec![f64::INFINITY; usize::try_from(NODES * NODES).expect("positive")];
        let mut heap = std::collections::BinaryHeap::new();
        best[index([10, 25])] = 0.0;
        heap.push((std::cmp::Reverse(0_u64), [10, 25]));
        while let Some((std::cmp::Reverse(key), [i, j])) = heap.pop() {
            if key != best[index([i, j])].to_bits() {
                continue;
            }
            for di in -4..=4_i32 {
                for dj in -4..=4_i32 {
                    let next = [i + di, j + dj];
                    if next.iter().all(|place| (0..NODES).contains(place)) {
                        let cost = best[index([i, j])] + price(at([i, j]), at(next));
                        if cost < best[index(next)] {
                            best[index(next)] = cost;
                            heap.push((std::cmp::Reverse(cost.to_bits()), next));
                        }
                    }
                }
            }
        }
        best[index([40, 25])]
    }

    #[test]
    fn a_soft_zone_far_from_the_way_leaves_the_fuel_of_the_straight_line() {
        let scenario = scenario(1.0, &disc(500.0, 930.0, 10.0, 20.0));
        let proven = proven(&scenario);
        assert!(proven <= 600.0 && proven > 0.98 * 600.0, "{proven}");
    }

    #[test]
    fn a_little_below_the_cheapest_way() {
        let check = |fuel: f64, threats: &[String], share: f64| {
            let scenario = scenario(fuel, &threats.join(", "));
            let (proven, found) = (proven(&scenario), over_lattice(&scenario));
            assert!(proven <= found * (1.0 + 1e-3), "{proven} {found}");
            assert!(proven >= share * found, "{proven} {found}");
        };
        // One soft zone over both ends, without and with a core in the way.
        check(1.0, &[disc(500.0, 560.0, 1.0, 600.0)], 0.95);
        check(1.0, &[disc(500.0, 510.0, 80.0, 400.0)], 0.95);
        // Ends in zones of their own.
        let ends = [
            disc(230.0, 500.0, 20.0, 150.0),
            disc(800.0, 460.0, 25.0, 120.0),
        ];
        check(0.5, &ends, 0.95);
        // A wall of zones that overlap.
        let wall: Vec<String> = (0..9)
            .map(|i| disc(500.0, 60.0 + 110.0 * f64::from(i), 30.0, 110.0))
            .collect();
        check(0.5, &wall, 0.90);
    }

    /// A potential that is nowhere steeper than prices leaves nothing to be taken off.
    #[test]
    fn what_a_march_finds_is_proven_but_for_little() {
        let scenario = scenario(0.2, &zones());
        let prices = Prices::of(&scenario);
        let walls = around::walls(&scenario, &prices);
        let ends = prices.ends.map(|end| end.xy());
        let zones = Zones::new(&walls, &prices, scenario.area);
        let spacing = Spacing::even(scenario.area, &zones, 4000);
        let vertices = vertices::lay(ends, &zones, &spacing);
        let priced = Priced::over(&vertices, &zones, &spacing).expect("they are apart");
        let costs = priced.costs();
        let steepest = steepest(vertices, &zones, &spacing, &|| false);
        let proven = steepest.expect("there is a way").2.total();
        for cost in [costs[0][1], costs[1][0]] {
            assert!(
                proven <= cost * 1.01 && proven > 0.95 * cost,
                "{proven} {cost}"
            );
        }
    }

    /// In every triangle that is kept, what is linear between the limits of its parts is no more than what a metre
    /// costs there; and what is left out are cores.
    #[test]
    fn limits_are_nowhere_more_than_a_metre_costs() {
        let scenario = scenario(0.2, &zones());
        let prices = Prices::of(&scenario);
        let walls = around::walls(&scenario, &prices);
        let rect = scenario.area;
        let zones = Zones::new(&walls, &prices, rect);
        let spacing = Spacing::even(rect, &zones, 1000);
        let ends = prices.ends.map(|end| end.xy());
        let vertices = vertices::lay(ends, &zones, &spacing);
        let is_core = |at: Point2| {
            walls.iter().any(|wall| match &wall.shape {
                OutlineShape::Disc(center) => (at - center).norm() <= wall.core,
                OutlineShape::Ring(ring) => {
                    ring::contains(ring, at) && ring::distance(ring, at) > prices.tolerance
                }
            })
        };
        let area = |[a, b, c]: &[Point2; 3]| 0.5 * (b - a).perp(&(c - a));
        let inside = || {
            (0..=6_u32).flat_map(|i| (0..=6 - i).map(move |j| [i, j].map(|at| f64::from(at) / 6.0)))
        };
        let all = Mesh::new(&vertices, |_| false).expect("they are apart");
        let (mut covered, mut left_out) = (0.0, 0);
        for triangle in &all.triangles {
            let places = all.places(triangle);
            let corners = [places[0], places[1], places[2]];
            covered += area(&corners);
            if zones.leave_out(&corners) {
                left_out += 1;
                for [u, v] in inside() {
                    let at =
                        corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
                    assert!(is_core(at), "{at}");
                }
                continue;
            }
            let limits = zones.limits(&places);
            for part in PARTS {
                let [a, b, c] = part.map(|node| (places[node], limits[node]));
                for [u, v] in inside() {
                    let at = a.0 + (b.0 - a.0) * u + (c.0 - a.0) * v;
                    let limit = a.1 + (b.1 - a.1) * u + (c.1 - a.1) * v;
                    let depth = |wall: &Wall| (wall.influence - wall.distance(at)).max(0.0);
                    let depths: f64 = walls.iter().map(depth).sum();
                    let price = prices.fuel + prices.exposure * depths;
                    assert!(limit <= price * (1.0 + 1e-9), "{limit} {price} at {at}");
                }
            }
        }
        assert!(
            (covered / 1e6 - 1.0).abs() < 1e-9 && left_out > 30,
            "{covered} {left_out}"
        );
    }

    #[test]
    fn thousands_of_discs_at_one_place_are_no_more_work() {
        let mut scenario = scenario(0.2, &disc(500.0, 480.0, 20.0, 100.0));
        let same = scenario.threats[0].clone();
        scenario.threats.extend((0..3000).map(|_| same.clone()));
        let prices = Prices::of(&scenario);
        let walls = around::walls(&scenario, &prices);
        let zones = Zones::new(&walls, &prices, scenario.area);
        let near = zones.near(Point2::new(500.0, 480.0)).count();
        assert!((50..=100).contains(&near), "{near}");
        let spacing = Spacing::even(scenario.area, &zones, 1000);
        let ends = prices.ends.map(|end| end.xy());
        let vertices = vertices::lay(ends, &zones, &spacing).len();
        assert!((500..2000).contains(&vertices), "{vertices}");
    }

    /// Over both ends, between them, on a ring with a bay and beyond the area.
    fn zones() -> String {
        [
            disc(240.0, 510.0, 20.0, 150.0),
            disc(520.0, 480.0, 60.0, 200.0),
            disc(780.0, 530.0, 10.0, 70.0),
            disc(990.0, 10.0, 40.0, 300.0),
            r#"{"kind": "polygon", "margin": 90, "vertices": [{"x": 300, "y": 250}, {"x": 480, "y": 250},
                {"x": 480, "y": 350}, {"x": 400, "y": 290}, {"x": 300, "y": 350}]}"#
                .to_owned(),
        ]
        .join(", ")
    }

    /// A straight leg into or out of any place costs no less than the potential rises by on it.
    #[test]
    fn no_leg_costs_less_than_the_rise() {
        let scenario = scenario(0.2, &zones());
        let prices = Prices::of(&scenario);
        let walls = around::walls(&scenario, &prices);
        let mut proof = proof(&scenario, (0.0, f64::INFINITY), false).expect("there is a way");
        proof.look_up();
        let mut tight = 0;
        for end in [0, 1] {
            let from = prices.ends[end].xy();
            assert!(
                proof
                    .rise(end, from, 0.0)
                    .is_some_and(|rise| rise.abs() < 1e-6)
            );
            let rise = |at: Point2, spread: f64| proof.rise(end, at, spread).expect("it is free");
            let other = rise(prices.ends[1 - end].xy(), 0.0);
            assert!((other - proof.total()).abs() < 1e-6, "{other}");
            for idx in 0..400 {
                let share = f64::from(idx) / 400.0;
                let (sin, cos) = libm::sincos(share * std::f64::consts::TAU);
                let to = from + Vector2::new(cos, sin) * (400.0 * (share * 37.0).fract());
                let place = |part: i32| from + (to - from) * ((f64::from(part) + 0.5) / 1000.0);
                let is_free = |at: Point2| walls.iter().all(|wall| wall.distance(at) > wall.core);
                if !(0..1000)
                    .all(|part| is_free(place(part)) && scenario.area.contains(place(part)))
                {
                    continue;
                }
                let depth = |at: Point2| -> f64 {
                    let depths = walls
                        .iter()
                        .map(|wall| (wall.influence - wall.distance(at)).max(0.0));
                    depths.sum()
                };
                let depths = (0..1000).map(|part| depth(place(part))).sum::<f64>() / 1000.0;
                let cost = (to - from).norm() * (prices.fuel + prices.exposure * depths);
                let to_there = rise(to, 0.0);
                assert!(
                    to_there <= cost * (1.0 + 1e-4) + 1e-6,
                    "{to_there} {cost} to {to}"
                );
                tight += u32::from(to_there > 0.95 * cost);
                // Of all places about it, one rises as much or more.
                let about = rise(to + Vector2::new(3.0, -2.0), 4.0);
                assert!(about >= to_there - 1e-6, "{about} {to_there}");
            }
        }
        assert!(tight > 20, "{tight}");
    }

    #[test]
    fn a_way_that_costs_as_much_as_is_known_is_not_looked_at() {
        let scenario = scenario(1.0, &disc(500.0, 930.0, 10.0, 20.0));
        assert!(proof(&scenario, (600.0, 600.0), false).is_none());
        assert!(proof(&scenario, (0.0, 0.0), true).is_none());
    }
}
