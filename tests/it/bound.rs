//! Attempts to break the proven lower bound: random scenarios, and routes made as cheap as possible. None may
//! cost less than the bound.

use std::fmt::Write;

use noctule::cost::{Constraint, Model};
use noctule::geometry::{Point2, Point3};
use noctule::planner::{self, Nobody};
use noctule::scenario::Scenario;
use noctule::scenario::json::{self, Rules};
use noctule::scenario::limits::Limits;
use noctule::seeding::{Obstacles, is_closed, lower_bound, steep_ground, taut_strings};
use proptest::prelude::*;
use serde_json::Value;

/// Nodes along a side of the lattice on which an initial way is found.
const NODES: usize = 26;

/// Metres between them; the area is 1000 m wide.
const SPACING: f64 = 40.0;

/// Steps of the search that makes a route cheaper.
const STEPS: usize = 2500;

#[derive(Debug, Clone)]
struct Drawn {
    /// Start and target.
    ends: [[f64; 2]; 2],
    threats: Vec<String>,
    hills: Vec<Hill>,
    /// Factor for all lengths.
    scale: f64,
    fuel: f64,
    threat: f64,
    altitude: f64,
    /// Of start and target above the ground.
    heights: [f64; 2],
    /// The lower limit of the band, metres; the upper one is 200.
    lowest: f64,
    climb: f64,
    waypoints: usize,
    is_sampled: bool,
    seed: u64,
}

/// A hill, or a hollow.
#[derive(Debug, Clone, Copy)]
struct Hill {
    center: [f64; 2],
    height: f64,
    spread: [f64; 2],
}

impl Hill {
    fn at(&self, place: [f64; 2]) -> f64 {
        let off = |axis: usize| (place[axis] - self.center[axis]) / self.spread[axis];
        self.height * libm::exp(-off(0) * off(0) - off(1) * off(1))
    }

    fn document(&self) -> String {
        let ([x, y], [wide, long]) = (self.center, self.spread);
        format!(
            r#"{{"center": {{"x": {x}, "y": {y}}}, "height": {}, "spread": {{"x": {wide}, "y": {long}}}}}"#,
            self.height
        )
    }
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
    (0.0..1000.0f64, 0.0..1000.0f64, 2.0..130.0f64, prop_oneof![Just(0.0), 0.0..90.0f64], heights()).prop_map(
        |(x, y, radius, margin, heights)| {
            format!(
                r#"{{"kind": "cylinder", "center": {{"x": {x}, "y": {y}}}, "radius": {radius}, "influence": {}{heights}}}"#,
                radius + margin
            )
        },
    )
}

/// Star-shaped rings: convex, with bays, or slim.
fn polygon() -> impl Strategy<Value = String> {
    let corner = (0.1..1.0f64, 15.0..160.0f64);
    (
        0.0..1000.0f64,
        0.0..1000.0f64,
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

/// Rings of many corners round their middle, as airspace has: smooth, or jagged.
fn airspace() -> impl Strategy<Value = String> {
    (
        [0.0..1000.0f64, 0.0..1000.0f64],
        15.0..160.0f64,
        prop::collection::vec(-1.0..1.0f64, 40..80),
        prop_oneof![Just(0.0), Just(0.005), Just(0.1)],
        prop_oneof![Just(0.0), 0.0..90.0f64],
        heights(),
    )
        .prop_map(|([x, y], radius, corners, jagged, margin, heights)| {
            let step = std::f64::consts::TAU / corners.len() as f64;
            let corner = |(idx, off): (usize, &f64)| {
                let (sin, cos) = libm::sincos(step * idx as f64);
                let away = radius * (1.0 + jagged * off);
                format!(r#"{{"x": {}, "y": {}}}"#, x + away * cos, y + away * sin)
            };
            let vertices: Vec<String> = corners.iter().enumerate().map(corner).collect();
            format!(
                r#"{{"kind": "polygon", "vertices": [{}], "margin": {margin}{heights}}}"#,
                vertices.join(", ")
            )
        })
}

fn drawn() -> impl Strategy<Value = Drawn> {
    let threat = prop_oneof![6 => cylinder(), 4 => polygon(), 1 => airspace()];
    (
        prop::collection::vec(threat, 0..8),
        log(-3.0, 1.0),
        prop_oneof![1 => Just(0.0), 6 => log(-8.0, 2.0)],
        prop_oneof![1 => Just(0.0), 4 => log(-5.0, 1.0)],
        (
            [0.0..200.0f64, 0.0..200.0f64],
            prop_oneof![2 => Just(0.0), 1 => 0.0..150.0f64],
        ),
        prop_oneof![1 => Just(89.0), 2 => 12.0..60.0f64],
        prop_oneof![Just(1_usize), Just(2), Just(3), Just(6), Just(12)],
        prop::bool::weighted(0.1),
        any::<u64>(),
    )
        .prop_map(
            |(
                threats,
                fuel,
                threat,
                altitude,
                (heights, lowest),
                climb,
                waypoints,
                is_sampled,
                seed,
            )| {
                Drawn {
                    ends: [[80.0, 120.0], [920.0, 840.0]],
                    threats,
                    hills: Vec::new(),
                    scale: 1.0,
                    fuel,
                    threat,
                    altitude,
                    heights,
                    lowest,
                    climb,
                    waypoints,
                    is_sampled,
                    seed,
                }
            },
        )
}

/// Values log-uniform between two powers of two.
fn log(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low..high).prop_map(libm::exp2)
}

/// A soft zone around an end: sometimes exactly at its edge or core, sometimes below its top or above its base.
fn over(end: [f64; 2]) -> impl Strategy<Value = String> {
    (
        0.0..std::f64::consts::TAU,
        log(0.0, 6.5),
        log(-9.0, 6.0),
        prop_oneof![1 => Just(0.0), 8 => log(-9.0, 9.5)],
        prop::option::weighted(0.4, prop::collection::vec((0.2..1.0f64, 0.1..1.0f64), 3..8)),
        heights(),
    )
        .prop_map(move |(angle, radius, gap, depth, corners, heights)| {
            let away = radius + gap;
            let (x, y) = (
                end[0] + away * libm::cos(angle),
                end[1] + away * libm::sin(angle),
            );
            let Some(corners) = corners else {
                return format!(
                    r#"{{"kind": "cylinder", "center": {{"x": {x}, "y": {y}}}, "radius": {radius}, "influence": {}{heights}}}"#,
                    away + depth
                );
            };
            let whole: f64 = corners.iter().map(|corner| corner.0).sum();
            let mut angle = angle;
            let vertices: Vec<String> = corners
                .iter()
                .map(|(share, length)| {
                    angle += share / whole * std::f64::consts::TAU;
                    let length = length * radius;
                    let (x, y) = (x + length * libm::cos(angle), y + length * libm::sin(angle));
                    format!(r#"{{"x": {x}, "y": {y}}}"#)
                })
                .collect();
            format!(
                r#"{{"kind": "polygon", "vertices": [{}], "margin": {}{heights}}}"#,
                vertices.join(", "),
                gap + depth
            )
        })
}

/// Ends far apart, close together, or on the border.
fn ends() -> impl Strategy<Value = [[f64; 2]; 2]> {
    let place = || {
        prop_oneof![
            3 => [20.0..980.0f64, 20.0..980.0f64],
            1 => (prop_oneof![Just(0.0), 0.0..3.0f64], 0.0..1000.0f64).prop_map(|(x, y)| [x, y]),
        ]
    };
    let near = (0.0..std::f64::consts::TAU, log(-2.0, 6.0));
    (place(), place(), prop::option::weighted(0.25, near)).prop_map(|(start, far, near)| {
        let target = near.map_or(far, |(angle, away)| {
            [
                start[0] + away * libm::cos(angle),
                start[1] + away * libm::sin(angle),
            ]
            .map(|place| place.clamp(0.0, 1000.0))
        });
        [start, target]
    })
}

/// A row of threats across the whole area between the ends: soft zones overlap, cores leave gaps.
fn row() -> impl Strategy<Value = Vec<String>> {
    (5.0..45.0f64, 1.0..30.0f64, 350.0..650.0f64, -0.3..0.3f64).prop_map(
        |(radius, soft, x, slant)| {
            let spacing = 2.0 * radius + soft;
            let mut threats = Vec::new();
            let mut y = 0.0;
            while y < 1000.0 {
                threats.push(format!(
                    r#"{{"kind": "cylinder", "center": {{"x": {}, "y": {y}}}, "radius": {radius}, "influence": {}}}"#,
                    x + slant * (y - 500.0),
                    radius + 2.0 * soft
                ));
                y += spacing;
            }
            threats
        },
    )
}

/// Scenarios whose soft zones cannot be avoided.
fn soft() -> impl Strategy<Value = Drawn> {
    let zones = ends().prop_flat_map(|ends| {
        let over = ends.map(|end| prop::collection::vec(over(end), 0..3));
        (Just(ends), over)
    });
    let row = prop_oneof![2 => Just(Vec::new()).boxed(), 1 => row().boxed()];
    let weight = || prop_oneof![2 => log(-3.0, 1.0), 1 => log(-17.0, 10.0)];
    let scale = prop_oneof![2 => Just(1.0), 1 => log(-10.0, 10.0)];
    (drawn(), zones, row, weight(), weight(), scale).prop_map(
        |(drawn, (ends, [start, target]), row, fuel, threat, scale)| Drawn {
            ends,
            threats: drawn
                .threats
                .into_iter()
                .take(3)
                .chain(start)
                .chain(target)
                .chain(row)
                .collect(),
            scale,
            fuel,
            threat,
            ..drawn
        },
    )
}

/// Scenarios over hills and hollows; ends stand on them, above them and in between.
fn hilly() -> impl Strategy<Value = Drawn> {
    let height = prop_oneof![3 => 10.0..300.0f64, 1 => -200.0..-10.0f64];
    let place = || 0.0..1000.0f64;
    let hill = ([place(), place()], height, [40.0..300.0f64, 40.0..300.0f64]);
    let hill = hill.prop_map(|(center, height, spread)| Hill {
        center,
        height,
        spread,
    });
    let end = || prop_oneof![1 => Just(0.0), 2 => 0.0..200.0f64];
    let hills = prop::collection::vec(hill, 1..7);
    (drawn(), hills, [end(), end()]).prop_map(|(drawn, hills, heights)| Drawn {
        threats: drawn.threats.into_iter().take(4).collect(),
        hills,
        heights,
        ..drawn
    })
}

/// Multiplies all lengths of a document by `scale`.
fn scaled(value: &mut Value, scale: f64) {
    const LENGTHS: [&str; 10] = [
        "x",
        "y",
        "z",
        "min",
        "max",
        "radius",
        "influence",
        "margin",
        "top",
        "base",
    ];
    match value {
        Value::Object(members) => {
            for (name, value) in members {
                match value.as_f64() {
                    Some(length) if LENGTHS.contains(&name.as_str()) => {
                        *value = (length * scale).into();
                    }
                    _ => scaled(value, scale),
                }
            }
        }
        Value::Array(values) => values.iter_mut().for_each(|value| scaled(value, scale)),
        _ => {}
    }
}

fn rules() -> Rules {
    planner::rules(Limits::default())
}

/// `None` when no route can exist or a ring is invalid.
fn scenario(drawn: &Drawn) -> Option<Scenario> {
    let ground = |end: [f64; 2]| drawn.hills.iter().map(|hill| hill.at(end)).sum::<f64>();
    let terrain = if drawn.hills.is_empty() {
        r#"{"kind": "flat"}"#.to_owned()
    } else {
        let hills: Vec<String> = drawn.hills.iter().map(Hill::document).collect();
        format!(r#"{{"kind": "peaks", "peaks": [{}]}}"#, hills.join(", "))
    };
    let document = format!(
        r#"{{ "frame": "local",
            "start": {{ "x": {}, "y": {}, "z": {} }}, "target": {{ "x": {}, "y": {}, "z": {} }},
            "area": {{ "min": {{ "x": 0, "y": 0 }}, "max": {{ "x": 1000, "y": 1000 }} }},
            "altitude": {{ "min": {}, "max": 200 }},
            "terrain": {terrain},
            "vehicle": {{ "max_turn_deg": 180, "max_climb_deg": {}, "fuel_per_km": 1000, "min_leg": 0.001 }},
            "weights": {{ "fuel": {}, "threat": {}, "altitude": {} }},
            "planner": {{ "algorithm": "tms-sba", "waypoints": {}, "population": 40, "iterations": 40, "parameters": {{ "quadrature": "{}" }} }},
            "threats": [{}] }}"#,
        drawn.ends[0][0],
        drawn.ends[0][1],
        ground(drawn.ends[0]) + drawn.heights[0],
        drawn.ends[1][0],
        drawn.ends[1][1],
        ground(drawn.ends[1]) + drawn.heights[1],
        drawn.lowest,
        drawn.climb,
        drawn.fuel,
        drawn.threat,
        drawn.altitude,
        drawn.waypoints,
        if drawn.is_sampled {
            "paper"
        } else {
            "integral"
        },
        drawn.threats.join(",\n")
    );
    let mut document: Value = serde_json::from_str(&document).expect("it is a document");
    scaled(&mut document, drawn.scale);
    json::read(document.to_string().as_bytes(), &rules(), 1).ok()
}

/// The width of the area in kilometres.
fn scale(scenario: &Scenario) -> f64 {
    (scenario.area.max.x - scenario.area.min.x) / 1000.0
}

/// Total violation and cost of a route; turns are ignored.
fn price(model: &Model<'_>, route: &[Point3]) -> (f64, f64) {
    let mut violation = 0.0;
    let quadrature = model.scenario.planner.quadrature;
    let figures = model.assess(route, quadrature, model.tolerance, |breach| {
        // The bound does not account for turns.
        if breach.constraint != Constraint::Turn {
            violation += breach.amount;
        }
    });
    (violation, figures.total)
}

/// The cheapest way over a lattice at one height above the ground.
fn over_lattice(model: &Model<'_>, height: f64) -> Option<Vec<Point3>> {
    let [start, target] = [model.scenario.start, model.scenario.target];
    let spacing = SPACING * scale(model.scenario);
    let node = |idx: usize| {
        let (column, row) = (idx % NODES, idx / NODES);
        let at = Point2::new(column as f64 * spacing, row as f64 * spacing);
        let ground = model.scenario.terrain.elevation(at);
        Point3::new(at.x, at.y, ground + height)
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

/// `count` points spread evenly along `way`, plus its ends.
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

/// Moves waypoints at random, keeping every move that helps.
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
    let scale = scale(model.scenario);
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
        let size = scale * 200.0 * libm::exp2(-17.0 * draw());
        let way = nalgebra::Vector3::new(
            draw() - 0.5,
            draw() - 0.5,
            (draw() - 0.5) * if draw() < 0.5 { 0.0 } else { 1.0 },
        );
        for point in &mut moved[first..=last] {
            *point += way * size;
            let ground = model.scenario.terrain.elevation(point.xy());
            point.z = point.z.clamp(ground, ground + model.scenario.altitude.max);
        }
        let price = price(model, &moved);
        if price.0 < best.0 || (price.0 <= best.0 && price.1 < best.1) {
            best = price;
            *route = moved;
        }
    }
    best
}

/// Initial ways: over the lattice at several heights, and along the taut strings.
fn ways(model: &Model<'_>) -> Vec<Vec<Point3>> {
    let scenario = model.scenario;
    let scale = scale(scenario);
    let band = scenario.altitude;
    let middle = 0.5 * (band.min + band.max);
    let inside = scale * 5.0;
    let mut ways: Vec<Vec<Point3>> = [band.min + inside, middle, band.max - inside]
        .into_iter()
        .filter_map(|height| over_lattice(model, height))
        .collect();
    let hard = Obstacles::hard(scenario, |_, threat| {
        threat.top.is_none() && threat.base.is_none()
    });
    for string in taut_strings(&hard, 3).strings {
        let along = (0..=60).map(|i| string.at(f64::from(i) / 60.0));
        let ground = |at: Point2| scenario.terrain.elevation(at);
        let mut way: Vec<Point3> = along
            .map(|at| Point3::new(at.x, at.y, ground(at) + middle))
            .collect();
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
        check(&drawn)?;
    }

    #[test]
    fn no_route_over_random_hills_is_cheaper_than_the_bound(drawn in hilly()) {
        check(&drawn)?;
    }

    #[test]
    fn no_route_through_unavoidable_soft_zones_is_cheaper_than_the_bound(drawn in soft()) {
        check(&drawn)?;
    }
}

fn check(drawn: &Drawn) -> Result<(), TestCaseError> {
    // A rejected case does not count: others are drawn until there are enough.
    let Some(scenario) = scenario(drawn) else {
        return Err(TestCaseError::reject("the scenario has a fault"));
    };
    let model = Model::new(&scenario);
    let bound = lower_bound(&scenario);
    let closed = is_closed(&scenario, &|| false);
    for way in ways(&model) {
        let mut route = resample(&way, drawn.waypoints);
        let (violation, cost) = cheapen(&model, &mut route, drawn.seed);
        if violation <= 0.0 {
            prop_assert!(!closed, "there is a way: {route:?}");
            prop_assert!(
                cost >= bound,
                "{cost} is below the bound {bound}: {route:?}"
            );
        }
    }
    let planned = planner::plan(&scenario, &mut Nobody, &Nobody);
    if planned.feasible {
        prop_assert!(!closed, "there is a way: {drawn:?}");
        let cost = planned.cost.total;
        prop_assert!(
            cost >= bound,
            "{cost} is below the bound {bound}: {drawn:?}"
        );
    }
    Ok(())
}

/// The bound also holds over hills; steep ground only guides the seeds and never enters it.
#[test]
fn no_route_over_hills_is_cheaper_than_the_bound() {
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
    let mut feasible = 0;
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
        if violation <= 0.0 {
            assert!(cost >= bound, "{cost} {bound}");
            feasible += 1;
        }
    }
    assert!(feasible > 0, "no route can be flown");
    // The planner's route is much cheaper than those along strings.
    let mut route = planner::plan(&scenario, &mut Nobody, &Nobody).waypoints;
    let (violation, cost) = cheapen(&model, &mut route, 1);
    assert!(
        violation <= 0.0 && cost >= bound,
        "{violation} {cost} {bound}"
    );
}
