//! The search algorithms that a request may name: each is listed everywhere and plans correctly.

use std::collections::BTreeMap;

use noctule::optimizer;
use noctule::planner::{self, Nobody, Outcome};
use noctule::scenario::Scenario;
use noctule::scenario::json::{self, COMMON, CommonParameter, Takes};
use noctule::scenario::limits::Limits;
use serde_json::Value;

use crate::support::api::Api;
use crate::support::description::DESCRIPTION;

fn names() -> Vec<&'static str> {
    let algorithms = optimizer::ALL.iter();
    algorithms.map(|algorithm| algorithm.name).collect()
}

/// Plans the shipped `paper-1` without seeding or polishing: from a random start.
fn plan(algorithm: &str, seed: u64, size: [u64; 3]) -> Outcome {
    planner::plan(&scenario(algorithm, seed, size), &mut Nobody, &Nobody)
}

fn scenario(algorithm: &str, seed: u64, [waypoints, population, iterations]: [u64; 3]) -> Scenario {
    let text = include_str!("../../scenarios/paper-1.json");
    let mut document: Value = serde_json::from_str(text).expect("JSON");
    let planner = &mut document["planner"];
    planner["algorithm"] = algorithm.into();
    planner["seed"] = seed.into();
    planner["waypoints"] = waypoints.into();
    planner["population"] = population.into();
    planner["iterations"] = iterations.into();
    planner["seeding"] = "random".into();
    planner["polish"] = false.into();
    let rules = planner::rules(Limits::default());
    json::read(document.to_string().as_bytes(), &rules, 1).expect("no fault")
}

#[test]
fn the_same_seed_gives_the_same_plan_with_every_algorithm() {
    for name in names() {
        let size = [10, 30, 60];
        let outcome = plan(name, 7, size);
        assert_eq!(outcome, plan(name, 7, size), "{name}");
        assert_ne!(
            outcome.waypoints,
            plan(name, 8, size).waypoints,
            "{name} with another seed"
        );
        assert_eq!(outcome.waypoints.len(), 12, "{name}");
        let mut before = f64::INFINITY;
        for point in &outcome.convergence {
            assert!(point.best_violation <= before, "{name}");
            before = point.best_violation;
        }
    }
}

/// The spherical codings find a feasible route from every seed; the Cartesian ones get closer to one.
#[test]
fn spherical_codings_find_routes_and_cartesian_ones_reduce_violations() {
    for name in ["tms-sba", "sba", "spso"] {
        for seed in 1..=3 {
            let outcome = plan(name, seed, [10, 60, 100]);
            assert!(outcome.feasible, "{name}: {:?}", outcome.violations);
            assert!(
                outcome.cost.total < 650.0,
                "{name} costs {}",
                outcome.cost.total
            );
        }
    }
    for name in ["ba", "pso", "abc"] {
        let outcome = plan(name, 1, [10, 60, 100]);
        let (first, last) = (outcome.convergence[0], outcome.convergence[100]);
        assert!(
            last.best_violation < 0.2 * first.best_violation,
            "{name} ends at {}",
            last.best_violation
        );
    }
}

#[test]
fn every_algorithm_plans_with_the_smallest_population_and_one_waypoint() {
    for name in names() {
        for population in [2, 3] {
            assert_eq!(plan(name, 3, [1, population, 20]).waypoints.len(), 3);
            assert_eq!(plan(name, 3, [10, population, 20]).waypoints.len(), 12);
        }
        // A single corner fits between the radars.
        let outcome = plan(name, 3, [1, 40, 100]);
        assert!(outcome.feasible, "{name}: {:?}", outcome.violations);
    }
}

#[tokio::test]
async fn every_algorithm_is_listed_with_its_source() {
    let listed = Api::new().get("/algorithms").await.json();
    assert_eq!(
        listed["parameters"][0]["choices"],
        serde_json::json!(["integral", "paper"])
    );
    let listed = listed["algorithms"].as_array().expect("a list");
    let listed_names: Vec<&str> = listed
        .iter()
        .map(|algorithm| algorithm["name"].as_str().expect("a name"))
        .collect();
    assert_eq!(listed_names, names());
    for algorithm in listed {
        let source = algorithm["source"].as_str().expect("a source");
        let year = source.rsplit(", ").next().expect("the year comes last");
        assert!(year.parse::<u32>().is_ok(), "{source}");
        assert_ne!(algorithm["parameters"], serde_json::json!([]));
    }

    let described = &DESCRIPTION["components"]["schemas"]["Planner"]["properties"]["algorithm"];
    assert_eq!(described["enum"], serde_json::json!(names()));
    assert_eq!(described["default"], names()[0]);
    let page = include_str!("../../docs/EQUATIONS.md");
    for name in &names()[1..] {
        let heading = format!("### `{name}`\n");
        assert!(
            page.contains(&heading),
            "docs/EQUATIONS.md has no {heading}"
        );
    }
}

/// What is accepted says how it is planned: with the listed default of each parameter that was not given.
#[tokio::test]
async fn an_accepted_document_lists_every_parameter_with_its_value() {
    let api = Api::new();
    let listed = api.get("/algorithms").await.json();
    let parameters = |of: &Value| {
        let parameters = of["parameters"].as_array().expect("a list").clone();
        let parameters = parameters.into_iter();
        parameters.map(|parameter| {
            let name = parameter["name"].as_str().expect("a name").to_owned();
            (name, parameter["default"].clone())
        })
    };
    for algorithm in listed["algorithms"].as_array().expect("a list") {
        let mut document = crate::support::scenario();
        document["planner"]["algorithm"] = algorithm["name"].clone();
        let mut expected: BTreeMap<String, Value> =
            parameters(&listed).chain(parameters(algorithm)).collect();
        let given = parameters(algorithm).next().expect("it has constants").0;
        for chosen in [None, Some(0.5)] {
            if let Some(chosen) = chosen {
                document["planner"]["parameters"] = serde_json::json!({ &given: chosen });
                expected.insert(given.clone(), chosen.into());
            }
            let valid = api.post("/plans?validate_only=true", &document).await;
            let validated = &valid.json()["scenario"];
            let submitted = api.post("/plans", &document).await;
            let plan = submitted.header("location");
            let accepted = api.get(&format!("{plan}/scenario")).await.json();
            for filled in [validated, &accepted] {
                let filled = filled["planner"]["parameters"].as_object();
                let filled = filled.expect("an object").clone();
                let filled = filled.into_iter().map(in_floating_point);
                let expected = expected.clone().into_iter().map(in_floating_point);
                assert_eq!(
                    filled.collect::<BTreeMap<_, _>>(),
                    expected.collect(),
                    "{algorithm}"
                );
            }
        }
    }
}

/// Whole numbers are written without a fraction in one place and with one in the other.
fn in_floating_point((name, value): (String, Value)) -> (String, Value) {
    let value = value.as_f64().map_or(value, Into::into);
    (name, value)
}

/// Earlier versions kept only the constants that were given. Such a document is still read, and what is filled in
/// changes no bit of its plan.
#[test]
fn defaults_that_are_filled_in_change_no_plan() {
    let rules = planner::rules(Limits::NONE);
    for name in names() {
        let scenario = scenario(name, 5, [5, 20, 20]);
        let mut sparse = scenario.clone();
        sparse.planner.parameters.clear();
        let stored = json::write(&sparse);
        let read = json::read_accepted(&stored, &rules).expect("no fault");
        assert_eq!(read, scenario, "{name}");
        let filled = json::write(&read);
        assert_ne!(filled, stored, "{name}");
        let again = json::read_accepted(&filled, &rules).expect("no fault");
        assert_eq!(again, scenario, "{name}");
        let plan = |scenario| planner::plan(scenario, &mut Nobody, &Nobody);
        assert_eq!(plan(&again), plan(&sparse), "{name}");
    }
}

/// Every constant of every algorithm is described, within the widest range that any allows it. One that takes less says
/// so in words.
#[test]
fn the_description_lists_the_constants() {
    let planner = &DESCRIPTION["components"]["schemas"]["Planner"]["properties"];
    let described = planner["parameters"]["properties"].as_object();
    let mut described = described.expect("properties").clone();
    for common in ["quadrature", "gap", "threads"] {
        assert!(described.remove(common).is_some(), "{common}");
    }
    let mut ranges: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
    for constant in optimizer::ALL
        .iter()
        .flat_map(|algorithm| algorithm.parameters)
    {
        let range = ranges
            .entry(constant.name)
            .or_insert((constant.min, constant.max));
        *range = (range.0.min(constant.min), range.1.max(constant.max));
    }
    for algorithm in optimizer::ALL {
        for constant in algorithm.parameters {
            let (min, max) = ranges[constant.name];
            if min < constant.min || constant.max < max {
                let said = described[constant.name]["description"].as_str();
                let range = format!("`{}`: {} to {}", algorithm.name, constant.min, constant.max);
                assert!(
                    said.is_some_and(|said| said.contains(&range)),
                    "{}: {said:?} does not say {range}",
                    constant.name
                );
            }
        }
    }
    let described: BTreeMap<&str, (f64, f64)> = described
        .iter()
        .map(|(name, schema)| {
            let number = |key: &str| schema[key].as_f64().expect("a number");
            (name.as_str(), (number("minimum"), number("maximum")))
        })
        .collect();
    assert_eq!(described, ranges);
}

/// Each algorithm accepts every common parameter over exactly its listed range, and uses the listed default
/// when it is absent.
#[test]
fn every_algorithm_accepts_the_common_parameters() {
    let rules = planner::rules(Limits::default());
    let accepted = |parameters: Value, algorithm: &str| {
        let text = include_str!("../../scenarios/paper-1.json");
        let mut document: Value = serde_json::from_str(text).expect("JSON");
        document["planner"]["algorithm"] = algorithm.into();
        document["planner"]["parameters"] = parameters;
        json::read(document.to_string().as_bytes(), &rules, 1).ok()
    };
    for name in names() {
        let absent = accepted(serde_json::json!({}), name).expect("nothing is needed");
        for CommonParameter {
            name: key, takes, ..
        } in COMMON
        {
            let with = |value: Value| accepted(serde_json::json!({ key: value }), name);
            let (default, taken, refused): (Value, Vec<Value>, Vec<Value>) = match takes {
                Takes::Choice { default, choices } => (
                    default.into(),
                    choices.iter().map(|choice| (*choice).into()).collect(),
                    vec!["none of them".into()],
                ),
                Takes::Number { default, min, max } => (
                    default.into(),
                    vec![min.into(), max.into()],
                    vec![(min - 1e-3).into(), (max + 1.0).into()],
                ),
            };
            assert_eq!(with(default).as_ref(), Some(&absent), "{name}, {key}");
            let mut different = 0;
            for value in taken {
                let scenario = with(value).unwrap_or_else(|| panic!("{name} refuses {key}"));
                different += u32::from(scenario != absent);
            }
            assert!(different > 0, "{name} takes {key} and does not keep it");
            for value in refused {
                assert!(with(value).is_none(), "{name} takes any {key}");
            }
        }
    }
}
