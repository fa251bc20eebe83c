//! Micro benchmarks of the engine: `cargo bench`.
//!
//! Single core; compare rows of one run, not times across machines.

use std::collections::BTreeMap;
use std::fs;

use noctule::cost::Model;
use noctule::cost::batch::{LANES, PointRow, Pricer};
use noctule::geometry::{Point2, Point3};
use noctule::optimizer::{self, Objective as _, Random, Settings};
use noctule::planner::{self, Nobody};
use noctule::scenario::json::{self, Rules};
use noctule::scenario::limits::Limits;
use noctule::scenario::{Quadrature, Scenario};
use noctule::seeding::{self, Obstacles};
use noctule::threat::{Cylinder, Shape, Threat};

fn main() {
    divan::main();
}

const SCENARIOS: [&str; 5] = ["paper-1", "paper-2", "paper-3", "paper-4", "jacksboro"];

fn document(name: &str) -> Vec<u8> {
    let path = format!("{}/scenarios/{name}.json", env!("CARGO_MANIFEST_DIR"));
    fs::read(path).expect("the scenario ships with the crate")
}

fn rules() -> Rules {
    planner::rules(Limits::default())
}

fn scenario(name: &str) -> Scenario {
    json::read(&document(name), &rules(), 1).expect("a shipped scenario has no fault")
}

/// Prices one good route; the counter gives evaluations per second.
#[divan::bench(args = SCENARIOS)]
fn evaluate(bencher: divan::Bencher, name: &str) {
    let scenario = scenario(name);
    let route: Vec<Point3> = planner::plan(&scenario, &mut Nobody, &Nobody).waypoints;
    let model = Model::new(&scenario);
    bencher
        .counter(divan::counter::ItemsCount::new(1_u32))
        .bench(|| {
            let mut violation = 0.0;
            let figures = model.assess(&route, Quadrature::Integral, model.tolerance, |breach| {
                violation += breach.amount;
            });
            (figures, violation)
        });
}

/// A good route and seven near it, side by side.
fn swarm(scenario: &Scenario) -> Vec<PointRow> {
    let route = planner::plan(scenario, &mut Nobody, &Nobody).waypoints;
    let mut rows: Vec<PointRow> = route.iter().copied().map(PointRow::splat).collect();
    let (last, step) = (
        rows.len() - 1,
        0.001 * (scenario.target - scenario.start).norm(),
    );
    for (idx, row) in rows[1..last].iter_mut().enumerate() {
        for lane in 0..LANES {
            let mut point = row.get(lane);
            let height = point.z - scenario.terrain.elevation(point.xy());
            point.x += step * ((lane * 3 + idx * 5) % 7) as f64;
            point.y += step * ((lane * 5 + idx * 2) % 7) as f64;
            point.z = scenario.terrain.elevation(point.xy()) + height;
            row.set(lane, point);
        }
    }
    rows
}

fn bench_lanes(bencher: divan::Bencher, scenario: &Scenario, rows: &[PointRow]) {
    let model = Model::new(scenario);
    let pricer = Pricer::new(&model, scenario.planner.quadrature, model.tolerance);
    bencher
        .counter(divan::counter::ItemsCount::new(LANES))
        .bench(|| pricer.routes(divan::black_box(rows)));
}

/// As `evaluate`, for eight routes side by side.
#[divan::bench(args = SCENARIOS)]
fn evaluate_lanes(bencher: divan::Bencher, name: &str) {
    let scenario = scenario(name);
    bench_lanes(bencher, &scenario, &swarm(&scenario));
}

/// As `evaluate_lanes`, with many small threats far from the route.
#[divan::bench(args = [10, 100, 1000])]
fn evaluate_lanes_by_threats(bencher: divan::Bencher, threats: usize) {
    let mut scenario = scenario("paper-2");
    let rows = swarm(&scenario);
    for idx in scenario.threats.len()..threats {
        let mut far = scenario.threats[0].clone();
        // In two strips parallel to the diagonal that the route follows, one on either side.
        let along = (idx * 37 % 1000) as f64 / 1000.0;
        let across = 400.0 + 90.0 * ((idx * 61 % 100) as f64 / 100.0);
        let side = if idx % 2 == 0 { across } else { -across };
        far.shape = Shape::Cylinder(Cylinder {
            center: Point2::new(1000.0 * along + side, 1000.0 * along - side),
            radius: 3.0,
            influence: 8.0,
        });
        scenario.threats.push(far);
    }
    bench_lanes(bencher, &scenario, &rows);
}

/// As `evaluate_lanes`, with different numbers of waypoints.
#[divan::bench(args = [5, 10, 20, 40, 80])]
fn evaluate_lanes_by_waypoints(bencher: divan::Bencher, waypoints: usize) {
    let mut scenario = scenario("paper-2");
    scenario.planner.waypoints = waypoints;
    scenario.planner.iterations = 20;
    bench_lanes(bencher, &scenario, &swarm(&scenario));
}

/// Decodes a position of the search into a route, Eq. 22.
#[divan::bench(args = SCENARIOS)]
fn decode(bencher: divan::Bencher, name: &str) {
    let scenario = scenario(name);
    let mut objective = planner::objective(&scenario, &Nobody);
    let mut position = vec![0.0; objective.bounds().dimension()];
    objective.draw(&mut Random::new(1), &mut position);
    let decode = planner::decoder(&scenario);
    bencher
        .counter(divan::counter::ItemsCount::new(1_u32))
        .bench(|| decode(divan::black_box(&position)));
}

/// One iteration of the plain algorithm with the document's population.
#[divan::bench(args = SCENARIOS)]
fn iteration(bencher: divan::Bencher, name: &str) {
    let scenario = scenario(name);
    let mut objective = planner::objective(&scenario, &Nobody);
    let algorithm = optimizer::by_name(&scenario.planner.algorithm).expect("one of the table");
    let settings = Settings {
        population: scenario.planner.population,
        seed: 1,
        parameters: algorithm.parameters_with(|_| None),
    };
    let mut search = (algorithm.start)(&settings, &mut objective);
    bencher
        .counter(divan::counter::ItemsCount::new(settings.population))
        .bench_local(|| search.iterate(&mut objective, 0.5));
}

/// From waypoints to the path flown, Eq. 26 and 27.
#[divan::bench(args = SCENARIOS)]
fn smoothing(bencher: divan::Bencher, name: &str) {
    let scenario = scenario(name);
    let route = planner::plan(&scenario, &mut Nobody, &Nobody).waypoints;
    bencher.bench(|| planner::smoothed(&scenario, &route));
}

/// A whole plan with the document's settings (200 x 200 for the paper's scenarios), including smoothing and
/// certificate.
#[divan::bench(args = SCENARIOS, sample_count = 5, sample_size = 1)]
fn plan(bencher: divan::Bencher, name: &str) {
    let scenario = scenario(name);
    bencher.bench(|| planner::plan(&scenario, &mut Nobody, &Nobody));
}

/// Reading and writing a scenario document.
#[divan::bench(args = SCENARIOS)]
fn read_scenario(bencher: divan::Bencher, name: &str) {
    let (document, rules) = (document(name), rules());
    bencher.bench(|| json::write(&json::read(&document, &rules, 1).expect("no fault")).len());
}

/// How the cost of pricing a route grows with the number of waypoints.
#[divan::bench(args = [5, 10, 20, 40, 80])]
fn search_by_waypoints(bencher: divan::Bencher, waypoints: usize) {
    let mut scenario = scenario("paper-2");
    scenario.planner.waypoints = waypoints;
    scenario.planner.population = 50;
    scenario.planner.iterations = 20;
    scenario.planner.parameters = BTreeMap::new();
    bencher
        .counter(divan::counter::ItemsCount::new(50_u32 * 21))
        .bench(|| planner::plan(&scenario, &mut Nobody, &Nobody));
}

/// Discs spread evenly over the square of the paper's scenarios; the more there are, the smaller they are.
fn discs(count: u32) -> Scenario {
    let mut scenario = scenario("paper-1");
    let radius = 300.0 / f64::from(count).sqrt();
    // Powers of the plastic number's inverse fill a square without clusters.
    let disc = |idx: u32| Cylinder {
        center: Point2::new(
            1000.0 * (0.754_877_666 * f64::from(idx + 1)).fract(),
            1000.0 * (0.569_840_291 * f64::from(idx + 1)).fract(),
        ),
        radius,
        influence: 1.3 * radius,
    };
    let ends = [scenario.start.xy(), scenario.target.xy()];
    scenario.threats = (0..)
        .map(disc)
        .filter(|disc| ends.iter().all(|end| (end - disc.center).norm() > radius))
        .take(count as usize)
        .map(|disc| Threat {
            name: None,
            shape: Shape::Cylinder(disc),
            base: None,
            top: None,
        })
        .collect();
    scenario
}

/// The shortest ways past a number of discs.
#[divan::bench(args = [10, 100, 1000], consts = [1, 6])]
fn taut_strings<const K: usize>(bencher: divan::Bencher, discs_count: u32) {
    let scenario = discs(discs_count);
    bencher.bench(|| seeding::taut_strings(&Obstacles::hard(&scenario, |_, _| true), K));
}

/// The proven lower bound on the paper's scenarios.
#[divan::bench(args = SCENARIOS)]
fn bound(bencher: divan::Bencher, name: &str) {
    let scenario = scenario(name);
    bencher.bench(|| seeding::lower_bound(&scenario));
}

/// The proven lower bound among a number of discs.
#[divan::bench(args = [10, 100, 1000])]
fn bound_by_discs(bencher: divan::Bencher, discs_count: u32) {
    let scenario = discs(discs_count);
    bencher.bench(|| seeding::lower_bound(&scenario));
}
