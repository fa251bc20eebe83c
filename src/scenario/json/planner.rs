//! `planner`: the algorithm, its size, its seed and its constants.

use std::collections::BTreeMap;

use crate::scenario::{PlannerSettings, Quadrature, Seeding, Smoothing};

use super::fault::Faults;
use super::fields::{nearest, unknown_key};
use super::path::Path;
use super::ranges::{DEGREE, MIN_POPULATION, Range, SEED, SPACING, TIME_LIMIT_MS};
use super::tree::Node;
use super::value::{At, quote};
use super::{AlgorithmRule, Rules};

const DEFAULT_WAYPOINTS: usize = 10;
const DEFAULT_POPULATION: usize = 200;
const DEFAULT_ITERATIONS: usize = 200;
/// Cubic, and a sample every five metres.
const DEFAULT_SMOOTHING: Smoothing = Smoothing {
    degree: 3,
    spacing: 5.0,
};

/// The quadrature stands among the algorithm's constants, but belongs to the cost.
const QUADRATURE: &str = "quadrature";

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

/// How to search; an absent `planner` is an empty one.
pub(super) fn planner(
    at: At<'_>,
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
    let size = |name: &'static str, limit: usize| {
        move |at: At<'_>, faults: &mut Faults| {
            let min = if name == "population" {
                MIN_POPULATION
            } else {
                1
            };
            at.count(min, (name, limit), faults)
        }
    };
    let waypoints = fields.or(
        "waypoints",
        DEFAULT_WAYPOINTS,
        faults,
        size("waypoints", limits.waypoints),
    );
    let population = fields.or(
        "population",
        DEFAULT_POPULATION,
        faults,
        size("population", limits.population),
    );
    let iterations = fields.or(
        "iterations",
        DEFAULT_ITERATIONS,
        faults,
        size("iterations", limits.iterations),
    );
    // The modulus holds whatever is drawn to the range of a seed.
    let seed = fields.or("seed", drawn_seed % (1 << 53), faults, |at, faults| {
        at.whole(SEED, faults)
    });
    let time_limit_ms = fields.or("time_limit_ms", None, faults, |at, faults| match at.node {
        Node::Null => Some(None),
        _ => at.whole(TIME_LIMIT_MS, faults).map(Some),
    });
    let seeding = fields.or("seeding", Seeding::Random, faults, |at, faults| {
        at.choice(&["random"], &["tangent"], faults)
            .map(|_| Seeding::Random)
    });
    let polish = fields.or("polish", false, faults, polish);
    let cold = fields.or("warm_start", (), faults, warm_start);
    let smoothing = fields.or("smoothing", DEFAULT_SMOOTHING, faults, smoothing);
    let parameters = fields.or(
        "parameters",
        (Quadrature::Integral, BTreeMap::new()),
        faults,
        |at, faults| parameters(at, algorithm, faults),
    );
    if let (Some(waypoints), Some(population), Some(iterations)) =
        (waypoints, population, iterations)
    {
        check_work(
            at.path,
            [population, iterations, waypoints],
            limits.work,
            faults,
        );
    }
    cold?;
    let (quadrature, parameters) = parameters?;
    Some(PlannerSettings {
        algorithm: algorithm?.name.to_owned(),
        waypoints: waypoints?,
        population: population?,
        iterations: iterations?,
        seed: seed?,
        time_limit_ms: time_limit_ms?,
        seeding: seeding?,
        polish: polish?,
        smoothing: smoothing?,
        quadrature,
        parameters,
    })
}

fn algorithm<'r>(at: At<'_>, rules: &'r Rules, faults: &mut Faults) -> Option<&'r AlgorithmRule> {
    let name = at.text(faults)?;
    let found = rules.algorithms.iter().find(|rule| rule.name == name);
    if found.is_none() {
        faults.add(at.path, "unknown-algorithm", || {
            let known: Vec<&str> = rules.algorithms.iter().map(|rule| rule.name).collect();
            let hint = nearest(name, &known)
                .map(|name| format!(", did you mean {name}?"))
                .unwrap_or_default();
            format!(
                "algorithm is {}, must be one of {}{hint}",
                quote(name),
                known.join(", ")
            )
        });
    }
    found
}

fn polish(at: At<'_>, faults: &mut Faults) -> Option<bool> {
    let polish = at.boolean(faults)?;
    if polish {
        faults.add(
            at.path,
            "not-available",
            || "polish is true, which is not available yet, must be false",
        );
        return None;
    }
    Some(polish)
}

fn warm_start(at: At<'_>, faults: &mut Faults) -> Option<()> {
    if *at.node == Node::Null {
        return Some(());
    }
    faults.add(
        at.path,
        "not-available",
        || "warm_start is given, which is not available yet, must be null",
    );
    None
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

/// The quadrature, and the constants that `rule` allows; with the algorithm unknown, none is checked.
fn parameters(
    at: At<'_>,
    rule: Option<&AlgorithmRule>,
    faults: &mut Faults,
) -> Option<(Quadrature, BTreeMap<String, f64>)> {
    let Node::Object(entries) = at.node else {
        at.fields(&[], faults);
        return None;
    };
    let rule = rule?;
    let mut allowed = vec![QUADRATURE];
    allowed.extend(rule.parameters.iter().map(|parameter| parameter.name));
    let mut seen = vec![false; allowed.len()];
    let mut quadrature = Some(Quadrature::Integral);
    let mut parameters = Some(BTreeMap::new());
    for (key, node) in entries {
        let Some(slot) = allowed.iter().position(|name| *name == &**key) else {
            let role = format!("parameter of {}", rule.name);
            unknown_key(at.path, key, "unknown-parameter", &role, &allowed, faults);
            parameters = None;
            continue;
        };
        let path = Path::Key(at.path, key);
        if std::mem::replace(&mut seen[slot], true) {
            faults.add(&path, "duplicate-key", || {
                format!("{key} is given twice, must be given once")
            });
            continue;
        }
        let at = At { node, path: &path };
        if slot == 0 {
            quadrature =
                at.choice(&["integral", "paper"], &[], faults)
                    .map(|choice| match choice {
                        "paper" => Quadrature::Paper,
                        _ => Quadrature::Integral,
                    });
            continue;
        }
        let constant = rule.parameters[slot - 1];
        match (
            at.number(Range::closed(constant.min, constant.max), faults),
            &mut parameters,
        ) {
            (Some(value), Some(parameters)) => {
                parameters.insert(key.to_string(), value);
            }
            (None, _) => parameters = None,
            (_, None) => {}
        }
    }
    Some((quadrature?, parameters?))
}

/// population * iterations * waypoints against the operator's limit.
fn check_work(path: &Path<'_>, factors: [usize; 3], limit: u64, faults: &mut Faults) {
    let work = factors
        .iter()
        .fold(1_u64, |work, factor| work.saturating_mul(*factor as u64));
    if work > limit {
        let [population, iterations, waypoints] = factors;
        faults.add(path, "too-much-work", || {
            format!(
                "population * iterations * waypoints is {population} * {iterations} * {waypoints} = {work}, \
                 must be <= {limit} (limit work)"
            )
        });
    }
}
