//! `noctule bench speed`: routes priced in a second on one core.

use std::f64::consts::TAU;

use clap::Args;
use serde_json::{Value, json};

use super::Common;
use super::case::{self, Case};
use super::clock::Stopwatch;
use super::progress;
use super::report::Report;
use super::summary::median;
use super::table::{Cell, Table};
use super::trial;
use crate::cost::Model;
use crate::cost::batch::{LANES, PointRow, Pricer};
use crate::optimizer::{self, Fitness, Objective, Random, Settings};
use crate::planner::{self, Nobody};
use crate::scenario::{Scenario, Seeding};
use crate::terrain::{Flat, Terrain};

#[derive(Args)]
pub(in crate::cli) struct Arguments {
    #[command(flatten)]
    pub(super) common: Common,
    /// Processor time of each measurement, milliseconds
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u32).range(1..=60_000))]
    time_ms: u32,
}

/// The scenario in which the growth with waypoints, threats and population is measured.
const GROUND: &str = "paper-2";

const WAYPOINTS: [usize; 7] = [3, 5, 10, 20, 40, 80, 160];
const POPULATIONS: [usize; 6] = [2, 8, 40, 200, 1000, 5000];
const FAR_THREATS: [u32; 4] = [0, 10, 100, 1000];

/// Population size in measurements that do not vary it.
const POPULATION: usize = 200;
/// Members and iterations of the search that gathers the positions which are then priced.
const GATHERED: usize = 40;
const GATHERING: u32 = 50;
/// How far the courses of two copies of a member are apart, and how much they change from batch to batch: of a leg of
/// some hundred metres the end moves by more than a rounding, but by less than from one copy to the next for as long as
/// anybody measures.
const APART_RAD: f64 = 1e-7;
const SHIFT_RAD: f64 = 1e-12;
/// How far from a route its neighbours are, as a share of the way.
const NEIGHBOURHOOD: f64 = 0.01;
/// A measurement is divided into this many; the fastest counts, because the others were disturbed.
const SLICES: u32 = 5;
/// Plans of each scenario; the median counts.
const PLANS: u64 = 5;

/// What one table measures.
struct Measured {
    name: &'static str,
    title: &'static str,
    note: &'static str,
    /// The heading of the labels.
    column: &'static str,
    rows: Vec<Row>,
}

/// One row of what is priced.
struct Row {
    label: Cell,
    scenario: Scenario,
    /// Positions in a batch.
    batch: usize,
}

/// Measure all tables.
pub(super) fn measure(arguments: &Arguments, cases: &[Case]) -> anyhow::Result<Report> {
    let ground = case::cases(&[GROUND.into()])?;
    let all = [
        by_scenario(cases)?,
        by_waypoints(&ground[0])?,
        by_threats(&ground[0])?,
        by_population(&ground[0])?,
    ];
    let steps = all.iter().map(|table| table.rows.len()).sum::<usize>() + cases.len();
    let bar = progress::bar(steps);
    let mut tables = Vec::new();
    for table in all {
        bar.set_message(table.title);
        tables.push(rate_table(table, arguments.time_ms, || bar.inc(1)));
    }
    bar.set_message("Plans");
    tables.push(plan_table(cases, || bar.inc(1))?);
    bar.finish_and_clear();
    Ok(Report {
        title: "Speed".to_owned(),
        intro: format!(
            "One core, processor time; each figure the best of {SLICES} slices of {} ms. An evaluation decodes a position of tms-sba and \
             prices the route with every constraint. Scattered positions are drawn at random from the bounds; gathered ones are a \
             population of {GATHERED} after {GATHERING} iterations, which is what a search prices most of the time. Priced are \
             {LANES} neighbouring routes side by side, without decoding; the last two columns are of that.",
            arguments.time_ms / SLICES
        ),
        tables,
        raw: Vec::new(),
        drawings: Vec::new(),
    })
}

fn by_scenario(cases: &[Case]) -> anyhow::Result<Measured> {
    let mut rows = Vec::new();
    for case in cases {
        let whole = Row {
            label: Cell::text(&case.name),
            scenario: case.with(&planner_with(10))?,
            batch: POPULATION,
        };
        let level = levelled(&case.name, &whole);
        rows.extend(std::iter::once(whole).chain(level));
    }
    Ok(Measured {
        name: "scenarios",
        title: "Scenarios",
        note: "N = 10, population 200. Where there are hills, once more as if the ground were level.",
        column: "scenario",
        rows,
    })
}

fn by_waypoints(ground: &Case) -> anyhow::Result<Measured> {
    let row = |&waypoints: &usize| {
        Ok(Row {
            label: Cell::count(waypoints),
            scenario: ground.with(&planner_with(waypoints))?,
            batch: POPULATION,
        })
    };
    Ok(Measured {
        name: "waypoints",
        title: "Growth with waypoints",
        note: "paper-2, population 200.",
        column: "N",
        rows: WAYPOINTS.iter().map(row).collect::<anyhow::Result<_>>()?,
    })
}

fn by_threats(ground: &Case) -> anyhow::Result<Measured> {
    let row = |&count: &u32| {
        let threats = (0..count).map(|idx| far_threat(idx, count)).collect();
        Ok(Row {
            label: Cell::Number(f64::from(count), 0),
            scenario: ground.with_threats(&planner_with(10), threats)?,
            batch: POPULATION,
        })
    };
    Ok(Measured {
        name: "threats",
        title: "Growth with far threats",
        note: "paper-2, N = 10, population 200, and so many threats more whose soft zones no sensible route comes near.",
        column: "far threats",
        rows: FAR_THREATS.iter().map(row).collect::<anyhow::Result<_>>()?,
    })
}

fn by_population(ground: &Case) -> anyhow::Result<Measured> {
    let row = |&population: &usize| {
        Ok(Row {
            label: Cell::count(population),
            scenario: ground.with(&planner_with(10))?,
            batch: population,
        })
    };
    Ok(Measured {
        name: "population",
        title: "Growth with the population",
        note: "paper-2, N = 10; a population is priced in one batch.",
        column: "population",
        rows: POPULATIONS.iter().map(row).collect::<anyhow::Result<_>>()?,
    })
}

fn planner_with(waypoints: usize) -> Value {
    json!({"waypoints": waypoints, "population": POPULATION, "seed": 1})
}

/// The same without its hills, if it has any.
fn levelled(name: &str, row: &Row) -> Option<Row> {
    let mut scenario = row.scenario.clone();
    if scenario.terrain.is_flat() {
        return None;
    }
    scenario.terrain = Terrain::Flat(Flat {
        elevation: scenario.terrain.elevation(scenario.start.xy()),
    });
    Some(Row {
        label: Cell::text(format!("{name}, levelled")),
        scenario,
        batch: row.batch,
    })
}

/// Evaluations a second.
struct Rates {
    scattered: f64,
    gathered: f64,
    /// Routes priced side by side, without decoding.
    priced: f64,
}

fn rates(scenario: &Scenario, batch: usize, time_ms: u32) -> Rates {
    let mut objective = planner::objective(scenario, &Nobody);
    let dimension = objective.bounds().dimension();
    let mut positions = vec![0.0; batch * dimension];
    let mut random = Random::new(scenario.planner.seed);
    for position in positions.chunks_exact_mut(dimension) {
        objective.draw(&mut random, position);
    }
    let scattered = rate(&mut objective, &positions, batch, time_ms);

    let algorithm = optimizer::by_name(&scenario.planner.algorithm)
        .expect("the reader accepts only names in the table");
    let settings = Settings {
        population: GATHERED,
        seed: scenario.planner.seed,
        parameters: algorithm.parameters_with(|_| None),
    };
    let mut search = (algorithm.start)(&settings, &mut objective);
    for step in 1..=GATHERING {
        search.iterate(&mut objective, f64::from(step) / f64::from(GATHERING));
    }
    let members = (0..search.swarm().len()).cycle().take(batch);
    let positions: Vec<f64> = members
        .flat_map(|idx| search.swarm().position(idx).to_vec())
        .collect();
    Rates {
        scattered,
        gathered: rate(&mut objective, &positions, batch, time_ms),
        priced: priced(scenario, batch, time_ms),
    }
}

/// Pricing alone: the route of a short search and neighbours of it, one a lane, as many times as make
/// a batch.
fn priced(scenario: &Scenario, batch: usize, time_ms: u32) -> f64 {
    let mut short = scenario.clone();
    short.planner.population = GATHERED;
    short.planner.iterations = 10;
    short.planner.seeding = Seeding::Random;
    short.planner.polish = false;
    let route = planner::plan(&short, &mut Nobody, &Nobody).waypoints;
    let mut rows: Vec<PointRow> = route.iter().copied().map(PointRow::splat).collect();
    let mut random = Random::new(scenario.planner.seed);
    let reach = NEIGHBOURHOOD * scenario.direct();
    for (row, point) in rows.iter_mut().zip(&route).skip(1).take(route.len() - 2) {
        for lane in 1..LANES {
            let mut beside = *point;
            beside.x += random.between(-reach, reach);
            beside.y += random.between(-reach, reach);
            row.set(lane, beside);
        }
    }
    let model = Model::new(scenario);
    let pricer = Pricer::new(&model, scenario.planner.quadrature, model.tolerance);
    let rounds = batch.div_ceil(LANES);
    best_rate(rounds * LANES, time_ms, || {
        for _ in 0..rounds {
            std::hint::black_box(pricer.routes(std::hint::black_box(&rows)));
        }
    })
}

fn rate(objective: &mut impl Objective, positions: &[f64], batch: usize, time_ms: u32) -> f64 {
    let mut fitness = vec![Fitness::WORST; batch];
    let mut positions = positions.to_vec();
    let dimension = positions.len() / batch;
    // A member is there more than once: its copies must have no leg in common.
    for (idx, position) in positions.chunks_exact_mut(dimension).enumerate() {
        position[1] += APART_RAD * idx as f64;
    }
    best_rate(batch, time_ms, || {
        // Shift the course slightly, so that remembered legs are of no use.
        for position in positions.chunks_exact_mut(dimension) {
            position[1] += SHIFT_RAD;
        }
        objective.evaluate(&positions, &mut fitness);
        std::hint::black_box(&fitness);
    })
}

/// How many per second `price` does, which does `count` per call.
fn best_rate(count: usize, time_ms: u32, mut price: impl FnMut()) -> f64 {
    let slice_s = f64::from(time_ms) * 1e-3 / f64::from(SLICES);
    let mut best = 0.0;
    for _ in 0..SLICES {
        let watch = Stopwatch::start();
        let mut priced = 0.0;
        let seconds = loop {
            price();
            priced += count as f64;
            let seconds = watch.seconds();
            if seconds >= slice_s {
                break seconds;
            }
        };
        best = f64::max(best, priced / seconds);
    }
    best
}

/// Number `idx` of `count`, on a spiral round the area, from half a kilometre beyond its edge outwards.
fn far_threat(idx: u32, count: u32) -> Value {
    let share = f64::from(idx) / f64::from(count);
    // Neighbours are 137.5 degrees apart, so that every direction is covered.
    let angle = TAU * 0.381_966 * f64::from(idx);
    let distance = 1200.0 + 8800.0 * share.sqrt();
    json!({
        "kind": "cylinder",
        "center": {"x": 500.0 + distance * libm::cos(angle), "y": 500.0 + distance * libm::sin(angle)},
        "radius": 30,
        "influence": 60,
    })
}

/// Measure the rows of a table; `step` follows each.
fn rate_table(table: Measured, time_ms: u32, step: impl Fn()) -> Table {
    let mut first = None;
    let row = |Row {
                   label,
                   scenario,
                   batch,
               }: Row| {
        let rates = rates(&scenario, batch, time_ms);
        step();
        vec![
            label,
            Cell::Number(rates.scattered, 0),
            Cell::Number(rates.gathered, 0),
            Cell::Number(rates.priced, 0),
            Cell::Number(1e6 / rates.priced, 3),
            Cell::Number(*first.get_or_insert(rates.priced) / rates.priced, 2),
        ]
    };
    Table {
        name: table.name,
        title: table.title.to_owned(),
        note: table.note.to_owned(),
        columns: vec![
            table.column,
            "evaluations/s, scattered",
            "evaluations/s, gathered",
            "priced/s",
            "us each",
            "times the first row",
        ],
        rows: table.rows.into_iter().map(row).collect(),
    }
}

/// Whole plans with the planner's default settings.
fn plan_table(cases: &[Case], step: impl Fn()) -> anyhow::Result<Table> {
    let mut rows = Vec::new();
    for case in cases {
        let mut times = Vec::new();
        let mut evaluations = 0.0;
        for seed in 1..=PLANS {
            let trial = trial::run(&case.with(&json!({"seed": seed}))?);
            times.push(trial.cpu_ms);
            evaluations += trial.evaluations as f64;
        }
        let seconds = times.iter().sum::<f64>() * 1e-3;
        rows.push(vec![
            Cell::text(&case.name),
            Cell::number(median(times), 1),
            Cell::Number(evaluations / PLANS as f64, 0),
            Cell::Number(evaluations / seconds, 0),
        ]);
        step();
    }
    Ok(Table {
        name: "plans",
        title: "Whole plans".to_owned(),
        note: format!(
            "The planner's default settings, N = 10, seeds 1 to {PLANS}; search, smoothing and certificate."
        ),
        columns: vec!["scenario", "CPU ms, median", "evaluations", "evaluations/s"],
        rows,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_threats_lie_outside_the_area() {
        for idx in 0..1000 {
            let threat = far_threat(idx, 1000);
            let offset = |axis: &str| threat["center"][axis].as_f64().expect("a number") - 500.0;
            let distance = (offset("x") * offset("x") + offset("y") * offset("y")).sqrt();
            // A corner of the area is 707.1 m from its middle.
            assert!(distance > 1199.9, "{threat}");
        }
    }
}
