//! `planner`: the algorithm, its size, its seed and its constants.

use crate::geometry::Point3;
use crate::scenario::limits::Limits;
use crate::scenario::{PlannerSettings, Seeding, Smoothing, WarmStart, work};

use super::chart::Chart;
use super::fault::Faults;
use super::fields::{Fields, hint};
use super::parameters::{Parameters, parameters};
use super::path::Path;
use super::ranges::{DEGREE, MIN_POPULATION, SEED, SPACING, TIME_LIMIT_MS};
use super::tree::Node;
use super::value::{At, quote};
use super::{AlgorithmRule, Rules};

const DEFAULT_WAYPOINTS: usize = 10;
const DEFAULT_POPULATION: usize = 200;
const DEFAULT_ITERATIONS: usize = 200;
/// Cubic, with a sample every five metres.
const DEFAULT_SMOOTHING: Smoothing = Smoothing {
    degree: 3,
    spacing: 5.0,
};

const FIELDS: &[&str] = &[
    "algorithm",
    "waypoints",
    "population",
    "iterations",
    "seed",
    "time_limit_ms",
    "seeding",
    "polish",
    "warm_start",
    "smoothing",
    "parameters",
];

/// The planner settings; an absent `planner` counts as an empty one.
pub(super) fn planner(
    at: At<'_>,
    chart: &Chart,
    rules: &Rules,
    drawn_seed: u64,
    faults: &mut Faults,
) -> Option<PlannerSettings> {
    let limits = &rules.limits;
    let fields = at.fields(FIELDS, faults)?;
    let algorithm = match rules.algorithms.first() {
        Some(first) => fields.or("algorithm", first, faults, |at, faults| {
            algorithm(at, rules, faults)
        }),
        None => fields.required("algorithm", faults, |at, faults| {
            algorithm(at, rules, faults)
        }),
    };
    let sizes = sizes(&fields, limits, faults);
    // The modulus keeps the drawn seed within the allowed range.
    let seed = fields.or("seed", drawn_seed % (1 << 53), faults, |at, faults| {
        at.whole(SEED, faults)
    });
    let time_limit_ms = fields.or("time_limit_ms", None, faults, |at, faults| match at.node {
        Node::Null => Some(None),
        _ => at.whole(TIME_LIMIT_MS, faults).map(Some),
    });
    let seeding = fields.or("seeding", Seeding::Tangent, faults, |at, faults| {
        at.named(Seeding::ALL, Seeding::name, faults)
    });
    #[expect(
        clippy::redundant_closure_for_method_calls,
        reason = "the method by its name takes one lifetime only"
    )]
    let polish = fields.or("polish", true, faults, |at, faults| at.boolean(faults));
    let warm_start = fields.or("warm_start", None, faults, |at, faults| {
        warm_start(at, chart, limits.waypoints, faults)
    });
    let smoothing = fields.or("smoothing", DEFAULT_SMOOTHING, faults, smoothing);
    let unset = Parameters::default(algorithm);
    let parameters = fields.or("parameters", unset, faults, |at, faults| {
        parameters(at, algorithm, faults)
    });
    check_work(at.path, sizes, limits.work, faults);
    let [population, iterations, waypoints] = sizes;
    let parameters = parameters?;
    Some(PlannerSettings {
        algorithm: algorithm?.name.to_owned(),
        waypoints: waypoints?,
        population: population?,
        iterations: iterations?,
        seed: seed?,
        time_limit_ms: time_limit_ms?,
        seeding: seeding?,
        polish: polish?,
        warm_start: warm_start?,
        smoothing: smoothing?,
        quadrature: parameters.quadrature,
        gap: parameters.gap,
        threads: parameters.threads,
        parameters: parameters.constants,
    })
}

/// Population, iterations and waypoints.
fn sizes(fields: &Fields<'_>, limits: &Limits, faults: &mut Faults) -> [Option<usize>; 3] {
    let mut size = |name, default: usize, least: usize, most| {
        // A size that is left out never exceeds its own limit.
        let default = default.min(most).max(least);
        fields.or(name, default, faults, |at, faults| {
            at.count(least, (name, most), faults)
        })
    };
    let waypoints = size("waypoints", DEFAULT_WAYPOINTS, 1, limits.waypoints);
    let population = size(
        "population",
        DEFAULT_POPULATION,
        MIN_POPULATION,
        limits.population,
    );
    // Nor do iterations that are left out ask for too much work.
    let room = population
        .zip(waypoints)
        .map_or(u64::MAX, |(population, waypoints)| {
            limits.work / work([population, 1, waypoints]).max(1)
        });
    let default =
        usize::try_from(room).map_or(DEFAULT_ITERATIONS, |room| room.min(DEFAULT_ITERATIONS));
    let iterations = size("iterations", default, 1, limits.iterations);
    [population, iterations, waypoints]
}

fn algorithm<'r>(at: At<'_>, rules: &'r Rules, faults: &mut Faults) -> Option<&'r AlgorithmRule> {
    let name = at.text(faults)?;
    let found = rules.algorithms.iter().find(|rule| rule.name == name);
    if found.is_none() {
        faults.add(at.path, "unknown-algorithm", || {
            let known: Vec<&str> = rules.algorithms.iter().map(|rule| rule.name).collect();
            format!(
                "algorithm is {}, must be one of {}{}",
                quote(name),
                known.join(", "),
                hint(name, &known)
            )
        });
    }
    found
}

/// `{"plan_id"}` or `{"waypoints"}`, exactly one of them.
#[expect(
    clippy::option_option,
    reason = "the outer one tells whether it could be read"
)]
fn warm_start(
    at: At<'_>,
    chart: &Chart,
    limit: usize,
    faults: &mut Faults,
) -> Option<Option<WarmStart>> {
    if *at.node == Node::Null {
        return Some(None);
    }
    let fields = at.fields(&["plan_id", "waypoints"], faults)?;
    let plan = fields.or("plan_id", None, faults, |at, faults| {
        at.text(faults).map(|id| Some(id.to_owned()))
    });
    let waypoints = fields.or("waypoints", None, faults, |at, faults| {
        waypoints(at, chart, limit, faults).map(Some)
    });
    match (plan?, waypoints?) {
        (Some(id), None) => Some(Some(WarmStart::Plan(id))),
        (None, Some(waypoints)) => Some(Some(WarmStart::Waypoints(waypoints))),
        (None, None) => {
            faults.add(
                &Path::Key(at.path, "plan_id"),
                "missing-field",
                || "plan_id is missing, and so is waypoints: one of them must be given",
            );
            None
        }
        (Some(_), Some(_)) => {
            faults.add(
                &Path::Key(at.path, "waypoints"),
                "not-applicable",
                || "waypoints is given, must be left out where plan_id is given",
            );
            None
        }
    }
}

/// Points of a route, with or without start and target.
fn waypoints(at: At<'_>, chart: &Chart, limit: usize, faults: &mut Faults) -> Option<Vec<Point3>> {
    let count = at.len(faults)?;
    // Start and target included.
    let most = limit.saturating_add(2);
    if count > most {
        faults.add(at.path, "too-many", || {
            format!(
                "waypoints has {count} items, must have at most {most} (limit waypoints, and both ends)"
            )
        });
        return None;
    }
    at.items(faults, |at, faults| chart.point3(at, faults))
        .into_iter()
        .collect()
}

fn smoothing(at: At<'_>, faults: &mut Faults) -> Option<Smoothing> {
    let fields = at.fields(&["degree", "spacing"], faults)?;
    let default_degree = DEFAULT_SMOOTHING.degree as u64;
    let degree = fields.or("degree", default_degree, faults, |at, faults| {
        at.whole(DEGREE, faults)
    });
    let spacing = fields.number_or("spacing", DEFAULT_SMOOTHING.spacing, SPACING, faults);
    Some(Smoothing {
        degree: usize::try_from(degree?).ok()?,
        spacing: spacing?,
    })
}

/// Checks population * iterations * waypoints against the operator's limit, if all of them could be read.
fn check_work(path: &Path<'_>, sizes: [Option<usize>; 3], limit: u64, faults: &mut Faults) {
    let [Some(population), Some(iterations), Some(waypoints)] = sizes else {
        return;
    };
    let work = work([population, iterations, waypoints]);
    if work > limit {
        faults.add(path, "too-much-work", || {
            format!(
                "population * iterations * waypoints is {population} * {iterations} * {waypoints} = {work}, \
                 must be <= {limit} (limit work)"
            )
        });
    }
}
