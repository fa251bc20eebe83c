//! The command line: exit codes, faults, and where results are written.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::support::description::check_schema;
use crate::support::process::{Service, noctule, run, run_with};
use crate::support::scenario;

#[test]
fn a_feasible_plan_exits_0_with_its_result() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = |name: &str| {
        directory
            .path()
            .join(name)
            .to_str()
            .expect("UTF-8")
            .to_owned()
    };
    fs::write(path("scenario.json"), scenario().to_string()).expect("written");

    let from_file = run(&["plan", &path("scenario.json")], "");
    assert_eq!(from_file.status.code(), Some(0));
    assert!(
        from_file.stderr.is_empty(),
        "no progress bar without a terminal"
    );
    let result: Value = serde_json::from_slice(&from_file.stdout).expect("JSON");
    check_schema(
        &json!({"$ref": "#/components/schemas/ResultDocument"}),
        &result,
        "the result",
    );
    assert_eq!(result["feasible"], true);
    assert_eq!(result["plan_id"], Value::Null);

    let from_input = run(
        &["plan", "-", "--out", &path("result.json")],
        &scenario().to_string(),
    );
    assert_eq!(from_input.status.code(), Some(0));
    assert!(from_input.stdout.is_empty());
    let written: Value =
        serde_json::from_slice(&fs::read(path("result.json")).expect("written")).expect("JSON");
    assert_eq!(written["waypoints"], result["waypoints"]);
}

/// A search would be in vain: the scenario is not even looked for.
#[test]
fn options_that_cannot_be_are_refused_before_anything_is_read() {
    let check = |options: &[&str], said: &str| {
        let arguments = [&["plan", "nowhere.json"], options].concat();
        let refused = run(&arguments, "");
        assert_eq!(refused.status.code(), Some(1), "{options:?}");
        let told = String::from_utf8(refused.stderr).expect("UTF-8");
        assert!(told.contains(said), "{told}");
    };
    let epochs = ["epoch=2020-01-01T00:00:00Z", "epoch=2021-01-01T00:00:00Z"];
    check(
        &["--format", "czml", "--set", epochs[0], "--set", epochs[1]],
        "epoch is given twice",
    );
    check(
        &["--out", "route.waypoints", "--set", "altitude=terrain"],
        "must be relative or absolute for px4",
    );
}

#[test]
fn an_extension_that_no_format_has_is_told() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let told = |name: &str| {
        let out = directory.path().join(name);
        let out = out.to_str().expect("UTF-8");
        let planned = run(&["plan", "-", "--out", out], &scenario().to_string());
        assert_eq!(planned.status.code(), Some(0), "{name}");
        String::from_utf8(planned.stderr).expect("UTF-8")
    };
    let kmz = told("route.kmz");
    for part in ["the extension kmz", "it is json", "svg, csv"] {
        assert!(kmz.contains(part), "{kmz}");
    }
    assert_eq!(told("route"), "");
}

#[test]
fn a_bad_scenario_exits_2_with_every_fault() {
    let mut wrong = scenario();
    wrong["threats"][0]["radius"] = json!(-3);
    wrong["colour"] = json!("red");
    let refused = run(&["plan", "-"], &wrong.to_string());
    assert_eq!(refused.status.code(), Some(2));
    assert!(refused.stdout.is_empty());
    let faults = String::from_utf8(refused.stderr).expect("UTF-8");
    for part in [
        "/threats/0/radius",
        "radius is -3, must be > 0",
        "out-of-range",
        "/colour",
        "unknown-field",
    ] {
        assert!(faults.contains(part), "{part} is not in\n{faults}");
    }

    let refused = run(&["plan", "-"], "{\n  nope");
    assert_eq!(refused.status.code(), Some(2));
    let fault = String::from_utf8(refused.stderr).expect("UTF-8");
    assert!(fault.contains("line 2"), "{fault}");
}

#[test]
fn no_feasible_route_exits_3_with_the_least_bad_one() {
    let mut walled = scenario();
    walled["threats"] = json!([{
        "kind": "polygon",
        "vertices": [{"x": 450, "y": -10}, {"x": 550, "y": -10}, {"x": 550, "y": 1010}, {"x": 450, "y": 1010}],
    }]);
    let infeasible = run(&["plan", "-"], &walled.to_string());
    assert_eq!(infeasible.status.code(), Some(3));
    let result: Value = serde_json::from_slice(&infeasible.stdout).expect("JSON");
    check_schema(
        &json!({"$ref": "#/components/schemas/ResultDocument"}),
        &result,
        "the result",
    );
    assert_eq!(result["feasible"], false);
    assert_eq!(result["path"], Value::Null);
    assert_ne!(result["checks"]["violations"], json!([]));
}

/// A search ends as soon as its route is proven good enough, and no sooner; both with seeding and polishing and
/// without, where it takes longer.
#[test]
fn reaching_the_requested_gap_ends_the_search() {
    let text = include_str!("../../scenarios/paper-2.json");
    let document: Value = serde_json::from_str(text).expect("JSON");
    for (seeding, polish, gap) in [("tangent", true, 0.05), ("random", false, 0.2)] {
        let planned = |gap: f64| -> Value {
            let mut document = document.clone();
            let planner = &mut document["planner"];
            planner["population"] = json!(40);
            planner["iterations"] = json!(60);
            planner["seeding"] = json!(seeding);
            planner["polish"] = json!(polish);
            planner["parameters"] = json!({"gap": gap});
            let output = run(&["plan", "-"], &document.to_string());
            assert_eq!(output.status.code(), Some(0));
            serde_json::from_slice(&output.stdout).expect("JSON")
        };
        let early = planned(gap);
        check_schema(
            &json!({"$ref": "#/components/schemas/ResultDocument"}),
            &early,
            "the result",
        );
        assert_eq!(early["stop_reason"], "converged", "{seeding}");
        let proven = early["bound"]["gap"].as_f64().expect("a feasible route");
        assert!((0.0..=gap).contains(&proven), "{seeding}: {proven}");
        // No earlier iteration was good enough.
        let lower = early["bound"]["lower"].as_f64().expect("a figure");
        let curve = early["convergence"].as_array().expect("a curve");
        for before in &curve[..curve.len() - 1] {
            let cost = before["best_cost"].as_f64();
            assert!(
                cost.is_none_or(|cost| cost > lower * (1.0 + gap)),
                "{before}"
            );
        }

        let whole = planned(0.0);
        assert_eq!(whole["stop_reason"], "iterations", "{seeding}");
        let evaluations = |result: &Value| result["evaluations"].as_u64().expect("a count");
        assert!(evaluations(&early) < evaluations(&whole), "{seeding}");
        assert!(curve.len() < 60, "{seeding}: {} points", curve.len());
        // A gap of 1e-9 is never proven.
        assert_eq!(planned(1e-9)["stop_reason"], "iterations", "{seeding}");
    }
}

#[test]
fn any_other_failure_exits_1() {
    for arguments in [
        &["plan", "/nowhere/scenario.json"][..],
        &["plan", "-", "--colour"],
        &["serve", "--listen", "nowhere"],
        &["serve", "--workers", "0"],
        &["healthcheck", "--url", "http://127.0.0.1:1/readyz"],
        &["healthcheck", "--url", "ftp://127.0.0.1/"],
        &["frobnicate"],
        &[],
    ] {
        let failed = run(arguments, "");
        assert_eq!(failed.status.code(), Some(1), "{arguments:?}");
        assert!(!failed.stderr.is_empty(), "{arguments:?}");
        assert!(failed.stdout.is_empty(), "{arguments:?}");
    }
}

#[test]
fn help_and_version_exit_0() {
    let help = run(&["--help"], "");
    assert_eq!(help.status.code(), Some(0));
    let text = String::from_utf8(help.stdout).expect("UTF-8");
    for command in ["serve", "plan", "bench", "healthcheck"] {
        assert!(text.contains(command), "{text}");
    }
    let version = run(&["--version"], "");
    let expected = format!("noctule {}\n", env!("CARGO_PKG_VERSION"));
    assert_eq!(String::from_utf8(version.stdout).expect("UTF-8"), expected);
}

#[tokio::test]
async fn healthcheck_exits_0_when_the_service_is_ready() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    for path in ["/readyz", "/", ""] {
        let ready = run(&["healthcheck", "--url", &service.url(path)], "");
        assert_eq!(ready.status.code(), Some(0), "{path}");
    }
    // Alive and not ready, while the page at the root is there.
    let second = Service::start(directory.path(), &[]);
    let unready = run(&["healthcheck", "--url", &second.url("")], "");
    assert_eq!(unready.status.code(), Some(1));
    let reason = String::from_utf8(unready.stderr).expect("UTF-8");
    assert!(reason.contains("answers 503"), "{reason}");
    let elsewhere = run(&["healthcheck", "--url", &service.url("/nothing")], "");
    assert_eq!(elsewhere.status.code(), Some(1));
    let reason = String::from_utf8(elsewhere.stderr).expect("UTF-8");
    assert!(reason.contains("answers 404"), "{reason}");
    // A port that is none is not that of the web.
    for port in ["99999", "0", "65536"] {
        let url = format!("http://127.0.0.1:{port}/readyz");
        let refused = run(&["healthcheck", "--url", &url], "");
        assert_eq!(refused.status.code(), Some(1));
        let reason = String::from_utf8(refused.stderr).expect("UTF-8");
        let expected = "the port must be a whole number from 1 to 65535";
        assert!(reason.contains(expected), "{reason}");
    }
}

/// As it is standard input for files that are read.
#[test]
fn a_dash_is_standard_output() {
    let document = scenario().to_string();
    let waypoints = |arguments: &[&str]| -> Value {
        let planned = run(arguments, &document);
        assert_eq!(planned.status.code(), Some(0), "{planned:?}");
        let result: Value = serde_json::from_slice(&planned.stdout).expect("a result");
        result["waypoints"].clone()
    };
    assert_eq!(
        waypoints(&["plan", "-", "--out", "-"]),
        waypoints(&["plan", "-"])
    );
}

#[test]
fn points_may_have_empty_lines_and_a_tile_another_name() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let tile = directory.path().join("download.hgt");
    fs::write(&tile, vec![0; 2 * 1201 * 1201]).expect("written");
    let tile = tile.to_str().expect("UTF-8");
    let points = "\u{feff}36.5 -84.5\n\n36.25,-84.75\r\n \n";
    let sampled = |more: &[&str]| {
        let arguments = ["terrain", "sample", tile, "--points", "-"];
        run(&[&arguments[..], more].concat(), points)
    };
    let found = sampled(&["--filename", "N36W085.SRTMGL1.hgt"]);
    assert_eq!(String::from_utf8_lossy(&found.stdout), "0\n0\n");
    assert_eq!(sampled(&[]).status.code(), Some(1));
}

#[test]
fn a_measurement_whose_report_could_not_be_kept_is_not_begun() {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    let out = file.path().to_str().expect("UTF-8");
    let refused = run(&["bench", "paper", "--seeds", "1000", "--out", out], "");
    assert_eq!(refused.status.code(), Some(1));
    let reason = String::from_utf8(refused.stderr).expect("UTF-8");
    assert!(
        reason.contains(&format!("cannot make the directory {out}")),
        "{reason}"
    );
}

/// Such as after `| head -1`.
#[test]
fn a_closed_standard_output_is_not_a_failure() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    drop(Service::start(directory.path(), &[]));
    let data_dir = directory.path().to_str().expect("UTF-8");
    let file = directory.path().join("scenario.json");
    fs::write(&file, scenario().to_string()).expect("written");
    let file = file.to_str().expect("UTF-8");
    let dataset = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/scenarios/terrain/jacksboro.tif"
    );
    for arguments in [
        &["plan", file][..],
        &["terrain", "info", dataset],
        &["store", "check", "--data-dir", data_dir],
        &["serve", "--print-config"],
    ] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let ended = noctule()
            .args(arguments)
            .stdout(writer)
            .output()
            .expect("the binary ends");
        let told = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(
            (ended.status.code(), &*told),
            (Some(0), ""),
            "{arguments:?}"
        );
    }
}

/// Deployments leave variables empty that they have no value for.
#[test]
fn an_empty_environment_variable_counts_as_unset() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let service = Service::start(directory.path(), &[]);
    let data_dir = directory.path().to_str().expect("UTF-8");
    let url = service.url("/readyz");
    let document = scenario().to_string();
    for (variable, arguments) in [
        ("NOCTULE_CONFIG", &["serve", "--print-config"][..]),
        ("NOCTULE_TERRAIN_DIR", &["plan", "-"]),
        ("NOCTULE_STORE", &["store", "check", "--data-dir", data_dir]),
        ("NOCTULE_HEALTHCHECK_URL", &["healthcheck", "--url", &url]),
    ] {
        let ended = run_with(&[(variable, "")], arguments, &document);
        let told = String::from_utf8_lossy(&ended.stderr);
        assert_eq!((ended.status.code(), &*told), (Some(0), ""), "{variable}");
    }
    let elsewhere = run_with(
        &[("NOCTULE_DATA_DIR", ""), ("XDG_DATA_HOME", data_dir)],
        &["store", "check"],
        "",
    );
    let told = String::from_utf8_lossy(&elsewhere.stderr);
    assert!(told.contains("there is no store at"), "{told}");
}

/// A copy of another store than the service's would be no backup.
#[test]
fn the_store_is_looked_for_where_the_service_keeps_it() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = |name: &str| {
        let path = directory.path().join(name);
        path.to_str().expect("UTF-8").to_owned()
    };
    let (here, elsewhere) = (path("here"), path("elsewhere"));
    for data_dir in [&here, &elsewhere] {
        drop(Service::start(Path::new(data_dir), &[]));
    }
    fs::write(path("own.toml"), format!("data_dir = '{here}'\n")).expect("written");
    fs::write(path("shared.toml"), "store = \"nats://a:4222\"\n").expect("written");
    let (own, shared) = (path("own.toml"), path("shared.toml"));
    let found = |data_dir: &str| Ok::<_, &str>(format!("0 plans, 0 faults in {data_dir}\n"));
    for (variables, arguments, expected) in [
        (&[("NOCTULE_CONFIG", &*own)][..], &[][..], found(&here)),
        (&[], &["--config", &*own], found(&here)),
        (
            &[("NOCTULE_CONFIG", &own), ("NOCTULE_DATA_DIR", &elsewhere)],
            &[],
            found(&elsewhere),
        ),
        (
            &[("NOCTULE_CONFIG", &own)],
            &["--data-dir", &elsewhere],
            found(&elsewhere),
        ),
        (
            &[("NOCTULE_CONFIG", &shared)],
            &["--data-dir", &here],
            Err("the plans are on NATS servers"),
        ),
        (
            &[("NOCTULE_CONFIG", &shared)],
            &["--data-dir", &here, "--store", "sqlite"],
            found(&here),
        ),
        (
            &[("NOCTULE_CONFIG", &own), ("NOCTULE_STORE", "")],
            &["--store", ""],
            found(&here),
        ),
        (
            &[],
            &["--data-dir", &here, "--store", "sqllite"],
            Err("--store is \"sqllite\", must be sqlite, or nats://HOST:PORT"),
        ),
        (
            &[],
            &["--data-dir", &here, "--store", "nats://me:hush@a"],
            Err("--store is wrong, must be sqlite, or nats://HOST:PORT"),
        ),
        (
            &[("NOCTULE_WORKERS", "no")],
            &["--data-dir", &here],
            Err("NOCTULE_WORKERS is \"no\", must be a whole number"),
        ),
    ] {
        let ended = run_with(variables, &[&["store", "check"], arguments].concat(), "");
        let told = String::from_utf8(ended.stdout).expect("UTF-8");
        let refused = String::from_utf8(ended.stderr).expect("UTF-8");
        match expected {
            Ok(expected) => assert_eq!((told, refused), (expected, String::new())),
            Err(expected) => assert!(refused.contains(expected), "{refused}"),
        }
    }
}
