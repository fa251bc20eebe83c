//! Attempts to break the proven bound: random scenarios, and routes that were made as cheap as they
//! get. None may cost less.

use std::fmt::Write;

use noctule::cost::{Constraint, Model};
use noctule::geometry::{Point2, Point3};
use noctule::planner;
use noctule::scenario::json::{self, Rules};
use noctule::scenario::limits::Limits;
use noctule::scenario::{Quadrature, Scenario};
use noctule::seeding::{Obstacles, lower_bound, steep_ground, taut_strings};
use proptest::prelude::*;

/// Nodes along a side of the lattice on which a first way is found.
const NODES: usize = 26;

/// Metres between them; the area is 1000 m wide.
const SPACING: f64 = 40.0;

/// Steps of the search that makes a route cheaper.
const STEPS: usize = 2500;

#[derive(Debug, Clone)]
struct Drawn {
    threats: Vec<String>,
    fuel: f64,
    threat: f64,
    altitude: f64,
    heights: [f64; 2],
    waypoints: usize,
    seed: u64,
}

fn heights() -> impl Strategy<Value = String> {
    (
        prop::option::weighted(0.3, 60.0..260.0f64),
        prop::option::weighted(0.15, 0.0..50.0f64),
    )
        .prop_map(|(top, base)| {
            let mut members = String::new();
            if let Some(top) = top {
                write!(members, r#", "top": {top}"#).expect("strings grow");
            }
            if let Some(base) = base {
                write!(members, r#", "base": {base}"#).expect("strings grow");
            }
            members
        })
}

fn cylinder() -> impl Strategy<Value = String> {
    (100.0..900.0f64, 100.0..900.0f64, 2.0..130.0f64, prop_oneof![Just(0.0), 0.0..90.0f64], heights()).prop_map(
        |(x, y, radius, margin, heights)| {
            format!(
                r#"{{"kind": "cylinder", "center": {{"x": {x}, "y": {y}}}, "radius": {radius}, "influence": {}{heights}}}"#,
                radius + margin
            )
        },
    )
}

/// Star-shaped rings: convex, with bays, slim.
fn polygon() -> impl Strategy<Value = String> {
    let corner = (0.1..1.0f64, 15.0..160.0f64);
    (
        150.0..850.0f64,
        150.0..850.0f64,
        prop::collection::vec(corner, 3..9),
        prop_oneof![Just(0.0), 0.0..90.0f64],
        heights(),
    )
        .prop_map(|(x, y, corners, margin, heights)| {
            let whole: f64 = corners.iter().map(|corner| corner.0).sum();
            let mut angle = 0.0;
            let vertices: Vec<String> = corners
                .iter()
                .map(|(share, away)| {
                    angle += share / whole * std::f64::consts::TAU;
                    let (x, y) = (x + away * libm::cos(angle), y + away * libm::sin(angle));
                    format!(r#"{{"x": {x}, "y": {y}}}"#)
                })
                .collect();
            format!(
                r#"{{"kind": "polygon", "vertices": [{}], "margin": {margin}{heights}}}"#,
                vertices.join(", ")
            )
        })
}

fn drawn() -> impl Strategy<Value = Drawn> {
    let threat = prop_oneof![3 => cylinder(), 2 => polygon()];
    let log = |low: f64, high: f64| (low..high).prop_map(|exponent: f64| libm::exp2(exponent));
    (
        prop::collection::vec(threat, 0..8),
        log(-3.0, 1.0),
        prop_oneof![1 => Just(0.0), 6 => log(-8.0, 2.0)],
        prop_oneof![1 => Just(0.0), 4 => log(-5.0, 1.0)],
        [0.0..200.0f64, 0.0..200.0f64],
        prop_oneof![Just(1_usize), Just(2), Just(3), Just(6), Just(12)],
        any::<u64>(),
    )
        .prop_map(
            |(threats, fuel, threat, altitude, heights, waypoints, seed)| Drawn {
                threats,
                fuel,
                threat,
                altitude,
                heights,
                waypoints,
                seed,
            },
        )
}

fn rules() -> Rules {
    planner::rules(Limits::default())
}

/// `None` where no route can exist, or a ring is none.
fn scenario(drawn: &Drawn) -> Option<Scenario> {
    let document = format!(
        r#"{{ "frame": "local",
            "start": {{ "x": 80, "y": 120, "z": {} }}, "target": {{ "x": 920, "y": 840, "z": {} }},
            "area": {{ "min": {{ "x": 0, "y": 0 }}, "max": {{ "x": 1000, "y": 1000 }} }},
            "altitude": {{ "min": 0, "max": 200 }},
            "vehicle": {{ "max_turn_deg": 180, "max_climb_deg": 89, "fuel_per_km": 1000, "min_leg": 0.001 }},
            "weights": {{ "fuel": {}, "threat": {}, "altitude": {} }},
            "planner": {{ "algorithm": "tms-sba", "waypoints": {} }},
            "threats": [{}] }}"#,
        drawn.heights[0],
        drawn.heights[1],
        drawn.fuel,
        drawn.threat,
        drawn.altitude,
        drawn.waypoints,
        drawn.threats.join(",\n")
    );
    json::read(document.as_bytes(), &rules(), 1).ok()
}

/// Total violation and cost of a route.
fn price(model: &Model<'_>, route: &[Point3]) -> (f64, f64) {
    let mut violation = 0.0;
    let figures = model.assess(route, Quadrature::Integral, model.tolerance, |breach| {
        // A bound knows nothing of turns.
        if breach.constraint != Constraint::Turn {
            violation += breach.amount;
        }
    });
    (violation, figures.total)
}

/// The cheapest way over a lattice, at one height.
fn over_lattice(model: &Model<'_>, height: f64) -> Option<Vec<Point3>> {
    let [start, target] = [model.scenario.start, model.scenario.target];
    let node = |idx: usize| {
        let (column, row) = (idx % NODES, idx / NODES);
        Point3::new(column as f64 * SPACING, row as f64 * SPACING, height)
    };
    let at = |point: Point3| {
        (0..NODES * NODES)
            .min_by(|&i, &j| {
                let away = |idx| (node(idx).xy() - point.xy()).norm();
                away(i).total_cmp(&away(j))
            })
            .expect("there are nodes")
    };
    let (from, to) = (at(start), at(target));
    let mut best = vec![f64::INFINITY; NODES * NODES];
    let mut before = vec![from; NODES * NODES];
    let mut done = vec![false; NODES * NODES];
    best[from] = 0.0;
    while let Some(here) = (0..best.len())
        .filter(|&idx| !done[idx] && best[idx].is_finite())
        .min_by(|&i, &j| best[i].total_cmp(&best[j]))
    {
        done[here] = true;
        if here == to {
            break;
        }
        let (column, row) = (here % NODES, here / NODES);
        for next_row in row.saturating_sub(2)..=(row + 2).min(NODES - 1) {
            for next_column in column.saturating_sub(2)..=(column + 2).min(NODES - 1) {
                let next = next_row * NODES + next_column;
                if done[next] {
                    continue;
                }
                let (violation, cost) = price(model, &[node(here), node(next)]);
                if violation <= 0.0 && best[here] + cost < best[next] {
                    best[next] = best[here] + cost;
                    before[next] = here;
                }
            }
        }
    }
    best[to].is_finite().then(|| {
        let mut way = vec![target];
        let mut here = to;
        while here != from {
            way.push(node(here));
            here = before[here];
        }
        way.extend([node(from), start]);
        way.reverse();
        way
    })
}

/// `count` points spread evenly along `way`, and its ends.
fn resample(way: &[Point3], count: usize) -> Vec<Point3> {
    let length: f64 = way.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let mut route = vec![way[0]];
    for i in 1..=count {
        let mut remaining = length * i as f64 / (count + 1) as f64;
        for pair in way.windows(2) {
            let part = (pair[1] - pair[0]).norm();
            if remaining <= part || pair[1] == way[way.len() - 1] {
                route.push(pair[0] + (pair[1] - pair[0]) * (remaining / part.max(1e-9)).min(1.0));
                break;
            }
            remaining -= part;
        }
    }
    route.push(way[way.len() - 1]);
    route
}

/// Move waypoints at random as long as that helps.
fn cheapen(model: &Model<'_>, route: &mut Vec<Point3>, seed: u64) -> (f64, f64) {
    let mut state = seed | 1;
    let mut draw = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut best = price(model, route);
    let free = route.len() - 2;
    for _ in 0..STEPS {
        let mut moved = route.clone();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a share of the waypoints"
        )]
        let first = 1 + ((draw() * free as f64) as usize).min(free - 1);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to 2"
        )]
        let last = (first + (draw() * 3.0) as usize).min(free);
        let size = 200.0 * libm::exp2(-17.0 * draw());
        let way = nalgebra::Vector3::new(
            draw() - 0.5,
            draw() - 0.5,
            (draw() - 0.5) * if draw() < 0.5 { 0.0 } else { 1.0 },
        );
        for point in &mut moved[first..=last] {
            *point += way * size;
            point.z = point.z.clamp(0.0, 200.0);
        }
        let price = price(model, &moved);
        if price.0 < best.0 || (price.0 <= best.0 && price.1 < best.1) {
            best = price;
            *route = moved;
        }
    }
    best
}

/// First ways: over the lattice at several heights, and along the strings.
fn ways(model: &Model<'_>) -> Vec<Vec<Point3>> {
    let scenario = model.scenario;
    let mut ways: Vec<Vec<Point3>> = [5.0, 100.0, 195.0]
        .into_iter()
        .filter_map(|height| over_lattice(model, height))
        .collect();
    let hard = Obstacles::hard(scenario, |_, threat| {
        threat.top.is_none() && threat.base.is_none()
    });
    for string in taut_strings(&hard, 3).strings {
        let along = (0..=60).map(|i| string.at(f64::from(i) / 60.0));
        let mut way: Vec<Point3> = along.map(|at| Point3::new(at.x, at.y, 100.0)).collect();
        way[0] = scenario.start;
        way[60] = scenario.target;
        ways.push(way);
    }
    ways
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases / 16, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_route_is_cheaper_than_the_bound(drawn in drawn()) {
        let Some(scenario) = scenario(&drawn) else { return Ok(()) };
        let model = Model::new(&scenario);
        let bound = lower_bound(&scenario);
        for way in ways(&model) {
            let mut route = resample(&way, drawn.waypoints);
            let (violation, cost) = cheapen(&model, &mut route, drawn.seed);
            if violation <= 0.0 {
                prop_assert!(cost >= bound, "{cost} is below the bound {bound}: {route:?}");
            }
        }
    }
}

/// Over hills the bound still holds, and steep ground is only ever a hint to seeds.
#[test]
fn hills_make_no_route_cheaper() {
    let document = std::fs::read_to_string(format!(
        "{}/scenarios/paper-4.json",
        env!("CARGO_MANIFEST_DIR")
    ))
    .expect("the scenario ships with the crate");
    let scenario = json::read(document.as_bytes(), &rules(), 1).expect("it has no fault");
    let model = Model::new(&scenario);
    let bound = lower_bound(&scenario);
    assert!(steep_ground(&scenario).len() < 400);
    let hard = Obstacles::hard(&scenario, |_, _| true);
    for (seed, string) in taut_strings(&hard, 4).strings.iter().enumerate() {
        let ground = |at: Point2| scenario.terrain.elevation(at);
        let along = (0..=60).map(|i| string.at(f64::from(i) / 60.0));
        let mut way: Vec<Point3> = along
            .map(|at| Point3::new(at.x, at.y, ground(at) + 200.0))
            .collect();
        way[0] = scenario.start;
        way[60] = scenario.target;
        let mut route = resample(&way, 10);
        let (violation, cost) = cheapen(&model, &mut route, seed as u64 + 7);
        assert!(violation > 0.0 || cost >= bound, "{cost} {bound}");
    }
}
