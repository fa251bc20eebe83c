//! Compares potentials with lattices of legs, and their components with prices at many places.

use super::super::super::tests::{disc, read};
use super::super::widening;
use super::mesh::PARTS;
use super::*;
use crate::geometry::{Vector2, ring};
use crate::scenario::Scenario;
use crate::seeding::outline::OutlineShape;

/// From (200, 500) to (800, 500) in a square of a kilometre, at `fuel` per metre.
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

fn proof(scenario: &Scenario, known: (f64, f64), stop: bool) -> Option<Proof> {
    let prices = Prices::of(scenario);
    let walls = widening::walls(scenario, &prices);
    prove(&walls, &prices, &scenario.area, known, &FREE, &|| stop)
}

fn proven(scenario: &Scenario) -> f64 {
    let proof = proof(scenario, (0.0, f64::INFINITY), false);
    proof.expect("there is a way").total()
}

/// The cheapest way over a lattice of `NODES` nodes a side, with legs of up to 4 nodes in each axis, each
/// summed by the midpoint rule: apart from the error of that sum, more expensive than the optimum.
fn over_lattice(scenario: &Scenario) -> f64 {
    const NODES: i32 = 51;
    let spacing = 20.0;
    let prices = Prices::of(scenario);
    let walls = widening::walls(scenario, &prices);
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
    let index = |[i, j]: [i32; 2]| usize::try_from(j * NODES + i).expect("it lies in the lattice");
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
fn a_soft_zone_far_from_the_way_leaves_the_straight_line_bound() {
    let scenario = scenario(1.0, &disc(500.0, 930.0, 10.0, 20.0));
    let proven = proven(&scenario);
    assert!(proven <= 600.0 && proven > 0.98 * 600.0, "{proven}");
}

#[test]
fn the_bound_is_slightly_below_the_cheapest_way() {
    let check = |fuel: f64, threats: &[String], share: f64| {
        let scenario = scenario(fuel, &threats.join(", "));
        let (proven, found) = (proven(&scenario), over_lattice(&scenario));
        assert!(proven <= found * (1.0 + 1e-3), "{proven} {found}");
        assert!(proven >= share * found, "{proven} {found}");
    };
    // One soft zone over both ends, without and with a core in the way.
    check(1.0, &[disc(500.0, 560.0, 1.0, 600.0)], 0.95);
    check(1.0, &[disc(500.0, 510.0, 80.0, 400.0)], 0.95);
    // Each end in a zone of its own.
    let ends = [
        disc(230.0, 500.0, 20.0, 150.0),
        disc(800.0, 460.0, 25.0, 120.0),
    ];
    check(0.5, &ends, 0.95);
    // A wall of overlapping zones.
    let wall: Vec<String> = (0..9)
        .map(|i| disc(500.0, 60.0 + 110.0 * f64::from(i), 30.0, 110.0))
        .collect();
    check(0.5, &wall, 0.90);
}

/// A potential that is nowhere steeper than the prices is not reduced.
#[test]
fn nearly_all_of_the_marched_cost_is_proven() {
    let scenario = scenario(0.2, &zones());
    let prices = Prices::of(&scenario);
    let walls = widening::walls(&scenario, &prices);
    let ends = prices.ends.map(|end| end.xy());
    let zones = Zones::new(&walls, &prices, scenario.area);
    let mut spacing = Spacing::even(scenario.area, &zones, 4000);
    let vertices = vertices::lay(ends, &zones, &spacing);
    let priced = Priced::over(&vertices, &zones, &spacing, &FREE).expect("they are apart");
    let (costs, _) = priced.costs();
    let steepest = steepest(vertices, (&zones, &mut spacing), (&FREE, [0.0; 2]), &|| {
        false
    });
    let proven = steepest.expect("there is a way").2.total();
    for cost in [costs[0][1], costs[1][0]] {
        assert!(
            proven <= cost * 1.01 && proven > 0.95 * cost,
            "{proven} {cost}"
        );
    }
}

/// In every triangle kept, interpolating the limits linearly over its parts never exceeds the price per metre;
/// triangles left out lie entirely in cores.
#[test]
fn limits_never_exceed_the_price_per_metre() {
    let scenario = scenario(0.2, &zones());
    let prices = Prices::of(&scenario);
    let walls = widening::walls(&scenario, &prices);
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
    let inside =
        || (0..=6_u32).flat_map(|i| (0..=6 - i).map(move |j| [i, j].map(|at| f64::from(at) / 6.0)));
    let all = Mesh::new(&vertices, |_| false).expect("they are apart");
    let (mut covered, mut left_out) = (0.0, 0);
    for triangle in &all.triangles {
        let places = all.places(triangle);
        let corners = [places[0], places[1], places[2]];
        covered += area(&corners);
        if zones.leave_out(&corners) {
            left_out += 1;
            for [u, v] in inside() {
                let at = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
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

/// Where edges cross the border of the area, touch it or run close to it, vertices are on it or well inside.
#[test]
fn no_triangle_along_the_border_is_slim() {
    let threats = [
        disc(300.0, 60.5, 20.0, 60.0),
        disc(600.0, 59.0, 59.5, 90.0),
        disc(941.0, 700.0, 40.0, 60.0),
        disc(995.0, 300.0, 30.0, 80.0),
        disc(200.0, 1049.0, 10.0, 50.0),
    ];
    let scenario = scenario(0.2, &threats.join(", "));
    let prices = Prices::of(&scenario);
    let walls = widening::walls(&scenario, &prices);
    let rect = scenario.area;
    let zones = Zones::new(&walls, &prices, rect);
    let ends = prices.ends.map(|end| end.xy());
    for vertices in [500, 1000, 2500, 4000] {
        let spacing = Spacing::even(rect, &zones, vertices);
        let vertices = vertices::lay(ends, &zones, &spacing);
        let mesh = Mesh::new(&vertices, |corners| zones.leave_out(corners));
        let mesh = mesh.expect("they are apart");
        let is_on = |at: &Point2| {
            [at.x, at.y]
                .iter()
                .any(|at| at.abs() < 1e-6 || (at - 1000.0).abs() < 1e-6)
        };
        let mut along = 0;
        for triangle in &mesh.triangles {
            let [a, b, c, ..] = mesh.places(triangle);
            let corners = [a, b, c];
            if corners.iter().filter(|at| is_on(at)).count() == 2 {
                let longest = ring::edges(&corners).map(|(from, to)| (to - from).norm());
                let longest = longest.fold(0.0, f64::max);
                let height = (b - a).perp(&(c - a)) / longest;
                assert!(height > 0.1 * longest, "{corners:?}");
                along += 1;
            }
        }
        assert!(along > 50, "{along}");
    }
}

/// However close start and target are to the border.
#[test]
fn a_mesh_contains_the_exact_start_and_target() {
    let mut scenario = scenario(0.2, &disc(500.0, 60.0, 20.0, 60.0));
    (scenario.start.y, scenario.target.y) = (1e-9, 1000.0 - 0.3);
    let prices = Prices::of(&scenario);
    let walls = widening::walls(&scenario, &prices);
    let zones = Zones::new(&walls, &prices, scenario.area);
    let ends = prices.ends.map(|end| end.xy());
    let vertices = vertices::lay(ends, &zones, &Spacing::even(scenario.area, &zones, 500));
    assert_eq!(vertices[..2], ends);
}

#[test]
fn thousands_of_coinciding_discs_do_not_increase_the_work() {
    let mut scenario = scenario(0.2, &disc(500.0, 480.0, 20.0, 100.0));
    let same = scenario.threats[0].clone();
    scenario.threats.extend((0..3000).map(|_| same.clone()));
    let prices = Prices::of(&scenario);
    let walls = widening::walls(&scenario, &prices);
    let zones = Zones::new(&walls, &prices, scenario.area);
    let near = zones.near(Point2::new(500.0, 480.0)).count();
    assert!((50..=100).contains(&near), "{near}");
    let spacing = Spacing::even(scenario.area, &zones, 1000);
    let ends = prices.ends.map(|end| end.xy());
    let vertices = vertices::lay(ends, &zones, &spacing).len();
    assert!((500..2000).contains(&vertices), "{vertices}");
}

/// Over both ends, between them, around a ring with a bay, and beyond the area.
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

/// A straight leg into or out of any place costs at least the rise of the potential along it.
#[test]
fn no_leg_costs_less_than_the_rise_of_the_potential() {
    let scenario = scenario(0.2, &zones());
    let prices = Prices::of(&scenario);
    let walls = widening::walls(&scenario, &prices);
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
            // Nothing where a wall or the border is in the way.
            let depth = |at: Point2| -> Option<f64> {
                let mut depths = 0.0;
                for wall in &walls {
                    let distance = wall.distance(at);
                    if distance <= wall.core {
                        return None;
                    }
                    depths += (wall.influence - distance).max(0.0);
                }
                scenario.area.contains(at).then_some(depths)
            };
            let depths = (0..1000).map(|part| depth(place(part)));
            let Some(depths) = depths.sum::<Option<f64>>() else {
                continue;
            };
            let depths = depths / 1000.0;
            let cost = (to - from).norm() * (prices.fuel + prices.exposure * depths);
            let to_there = rise(to, 0.0);
            assert!(
                to_there <= cost * (1.0 + 1e-4) + 1e-6,
                "{to_there} {cost} to {to}"
            );
            tight += u32::from(to_there > 0.95 * cost);
            // At least one of the places around it has this rise.
            let about = rise(to + Vector2::new(3.0, -2.0), 4.0);
            assert!(about >= to_there - 1e-6, "{about} {to_there}");
        }
    }
    assert!(tight > 20, "{tight}");
}

#[test]
fn a_proof_is_skipped_when_it_cannot_help_or_is_stopped() {
    let scenario = scenario(1.0, &disc(500.0, 930.0, 10.0, 20.0));
    assert!(proof(&scenario, (600.0, 600.0), false).is_none());
    assert!(proof(&scenario, (0.0, 0.0), true).is_none());
}
