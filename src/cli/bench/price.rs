//! `noctule bench price`: prices routes that other programs propose.
//!
//! Each line of standard input is a JSON array of routes, each an array of its free waypoints
//! `[x, y, z]`, metres; start and target are the scenario's. Each is answered by a line, an array
//! of `[violation, cost]` in the same order: how much of the constraints the route breaks beyond
//! the tolerance of a feasible one, metres and degrees together, and its cost, Eq. 1.

use std::io::{self, BufRead, Write};
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;

use super::case;
use crate::cost::Model;
use crate::cost::batch::{LANES, PointRow, Pricer};
use crate::geometry::Point3;
use crate::scenario::Scenario;
use crate::scenario::limits::Limits;

#[derive(Args)]
pub(in crate::cli) struct Arguments {
    /// Scenario document, or the name of a shipped one
    scenario: PathBuf,
    /// Read the z of waypoints as height above the ground below them
    #[arg(long)]
    above_ground: bool,
}

/// A line that holds no routes.
#[derive(Debug, thiserror::Error)]
#[error("line {number} of standard input is refused: {why}")]
pub(super) struct BadLine {
    number: usize,
    why: String,
}

/// The free waypoints of a route.
type Waypoints = Vec<[f64; 3]>;

/// Maximum absolute coordinate, metres; far beyond any area, and its square is a finite number.
const FURTHEST: f64 = 1e9;

/// Answer every line until standard input ends.
///
/// # Errors
/// [`case::Refused`], [`BadLine`], or when a stream fails.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let cases = case::cases(std::slice::from_ref(&arguments.scenario))?;
    let scenario = cases[0].as_it_is()?;
    let model = Model::new(&scenario);
    let pricer = Pricer::new(&model, scenario.planner.quadrature, model.tolerance);
    let mut out = io::stdout().lock();
    for (line_idx, line) in io::stdin().lock().split(b'\n').enumerate() {
        let line = line.context("cannot read standard input")?;
        let routes = parse(&line).map_err(|why| BadLine {
            number: line_idx + 1,
            why,
        })?;
        let prices = price(&pricer, &scenario, &routes, arguments.above_ground);
        // The caller waits for the whole line.
        let written =
            writeln!(out, "{}", serde_json::to_string(&prices)?).and_then(|()| out.flush());
        if written
            .as_ref()
            .is_err_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
        {
            // The caller has gone.
            break;
        }
        written.context("cannot write to standard output")?;
    }
    Ok(())
}

fn parse(line: &[u8]) -> Result<Vec<Waypoints>, String> {
    let routes: Vec<Waypoints> = serde_json::from_slice(line).map_err(|error| {
        format!("{error}; a line is an array of routes, a route an array of waypoints [x, y, z]")
    })?;
    let most = Limits::default().waypoints;
    for (idx, route) in routes.iter().enumerate() {
        if route.len() > most {
            return Err(format!(
                "route {idx} has {} waypoints, at most {most} are allowed",
                route.len()
            ));
        }
        if let Some(far) = route.iter().flatten().find(|value| value.abs() > FURTHEST) {
            return Err(format!(
                "route {idx} has a coordinate {far}, must be within {FURTHEST} m of 0"
            ));
        }
    }
    Ok(routes)
}

/// Violation and cost of each route.
fn price(
    pricer: &Pricer,
    scenario: &Scenario,
    routes: &[Waypoints],
    above_ground: bool,
) -> Vec<[f64; 2]> {
    let mut prices = Vec::with_capacity(routes.len());
    // Only routes with the same number of waypoints fit side by side; unused lanes repeat the first route.
    let alike = routes.chunk_by(|one, next| one.len() == next.len());
    for routes in alike.flat_map(|alike| alike.chunks(LANES)) {
        let free = routes[0].len();
        let mut points = vec![PointRow::splat(scenario.start)];
        for idx in 0..free {
            let mut row = PointRow::splat(Point3::from(routes[0][idx]));
            for (lane, route) in routes.iter().enumerate() {
                row.set(lane, Point3::from(route[idx]));
            }
            points.push(row);
        }
        points.push(PointRow::splat(scenario.target));
        if above_ground {
            pricer.raise(&mut points[1..=free], &mut Vec::new());
        }
        let price = pricer.routes(&points);
        prices.extend((0..routes.len()).map(|lane| [price.violation[lane], price.cost[lane]]));
    }
    prices
}
