//! `noctule bench`: what it writes, and that everything except times is reproducible.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::support::process::run;
use crate::support::scenario;

/// The column names and rows of a CSV file.
fn rows(file: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let text = fs::read_to_string(file).expect("written");
    let mut lines = text.lines().map(fields);
    let columns = lines.next().expect("a line of columns");
    let rows: Vec<Vec<String>> = lines.collect();
    for row in &rows {
        assert_eq!(row.len(), columns.len(), "{row:?} in {}", file.display());
    }
    (columns, rows)
}

/// The fields of a line, as in RFC 4180.
fn fields(line: &str) -> Vec<String> {
    let mut fields = vec![String::new()];
    let mut quoted = false;
    for character in line.chars() {
        let last = fields.last_mut().expect("there is one");
        match character {
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            other => last.push(other),
        }
    }
    assert!(!quoted, "{line}");
    fields
}

/// One column, by its name.
fn column(file: &Path, name: &str) -> Vec<String> {
    let (columns, rows) = rows(file);
    let idx = columns.iter().position(|column| column == name);
    let idx = idx.unwrap_or_else(|| panic!("no column {name} in {columns:?}"));
    rows.into_iter()
        .map(|mut row| row.swap_remove(idx))
        .collect()
}

/// All columns except times.
fn essence(file: &Path) -> Vec<Vec<String>> {
    let (columns, rows) = rows(file);
    rows.into_iter()
        .map(|row| {
            let kept = row
                .into_iter()
                .zip(&columns)
                .filter(|(_, column)| !column.contains("CPU"));
            kept.map(|(field, _)| field).collect()
        })
        .collect()
}

fn numbers(column: &[String]) -> Vec<f64> {
    column
        .iter()
        .map(|field| field.parse().unwrap_or_else(|_| panic!("{field:?}")))
        .collect()
}

#[test]
fn bench_paper_is_reproducible_and_its_tables_follow_from_its_runs() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let own = directory.path().join("two-radars.json");
    fs::write(&own, scenario().to_string()).expect("written");
    let measure = |out: &Path, scenarios: &[&str]| {
        let arguments = [
            "bench",
            "paper",
            "--seeds",
            "2",
            "--population",
            "8",
            "--iterations",
            "8",
            "--waypoints",
            "4",
            "--out",
            out.to_str().expect("UTF-8"),
            "--scenario",
        ];
        let done = run(&[&arguments[..], scenarios].concat(), "");
        assert_eq!(done.status.code(), Some(0), "{done:?}");
        assert!(done.stdout.is_empty() && done.stderr.is_empty(), "{done:?}");
    };
    let (first, second) = (directory.path().join("1"), directory.path().join("2"));
    measure(&first, &["paper-1", own.to_str().expect("UTF-8")]);
    measure(&second, &["paper-1"]);

    // The second run has only the first scenario.
    let assert_same = |file: &str| {
        let again = essence(&second.join(file));
        assert_eq!(essence(&first.join(file))[..again.len()], again, "{file}");
    };
    let page = fs::read_to_string(first.join("paper.md")).expect("written");
    let tables = [
        "algorithms",
        "iterations",
        "population",
        "waypoints",
        "ablation",
    ];
    for (table, sizes) in tables.into_iter().zip([1, 4, 4, 4, 1]) {
        let file = format!("paper-{table}.csv");
        let algorithms = column(&first.join(&file), "algorithm");
        // Six algorithms, or the reference and its five variants, over two scenarios.
        assert_eq!(algorithms.len(), 2 * 6 * sizes, "{file}");
        assert_same(&file);
        let wins = column(&first.join(&file), "wins");
        for (algorithm, wins) in algorithms.iter().zip(&wins) {
            assert_eq!(
                algorithm == "tms-sba",
                wins.is_empty(),
                "{algorithm} {wins}"
            );
        }
        for p in column(&first.join(&file), "p")
            .iter()
            .filter(|p| !p.is_empty())
        {
            let p: f64 = p.parse().expect("a number");
            assert!((0.0..=1.0).contains(&p), "{p}");
        }
    }
    assert_eq!(page.matches("\n## ").count(), 5);
    assert_same("paper-runs.csv");

    // The figures of a table follow from the runs.
    let runs = first.join("paper-runs.csv");
    let (_, all) = rows(&runs);
    let costs: Vec<f64> = all
        .iter()
        .filter(|row| row[..5] == ["paper-1", "spso", "4", "8", "8"] && row[6] == "true")
        .map(|row| row[7].parse().expect("a cost"))
        .collect();
    let means = column(&first.join("paper-algorithms.csv"), "mean");
    let position = column(&first.join("paper-algorithms.csv"), "algorithm")
        .iter()
        .position(|algorithm| algorithm == "spso");
    let mean = &means[position.expect("a row")];
    if costs.is_empty() {
        assert_eq!(mean, "");
    } else {
        let expected = costs.iter().sum::<f64>() / costs.len() as f64;
        assert!((mean.parse::<f64>().expect("a mean") - expected).abs() < 1e-9);
    }

    for name in ["paper-1", "two-radars"] {
        let file = format!("paper-{name}.svg");
        assert!(page.contains(&format!("]({file})")), "{page}");
        let svg = fs::read_to_string(first.join(file)).expect("written");
        let tree = roxmltree::Document::parse(&svg).expect("well-formed");
        let curves = tree
            .descendants()
            .filter(|node| node.has_tag_name("polyline"));
        assert_eq!(curves.count(), 6);
    }
}

#[test]
fn bench_quality_measures_against_the_best_known_cost() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let arguments = [
        "bench",
        "quality",
        "--seeds",
        "2",
        "--population",
        "40",
        "--iterations",
        "30",
        "--waypoints",
        "3,10",
        "--scenario",
        "paper-1",
    ];
    let out = directory.path().to_str().expect("UTF-8");
    let done = run(&[&arguments[..], &["--out", out]].concat(), "");
    assert_eq!(done.status.code(), Some(0), "{done:?}");
    let file = directory.path().join("quality-gaps.csv");
    assert_eq!(column(&file, "N"), ["3", "10"]);
    assert_eq!(column(&file, "*"), ["*", ""]);
    assert_eq!(column(&file, "reference")[1], "489.4413");
    let best = numbers(&column(&file, "best"));
    let gaps = numbers(&column(&file, "worst gap %"));
    assert!(best[1] > 489.0 && gaps[1] >= (best[1] / 489.4413 - 1.0) * 100.0 - 1e-9);
    for (mean, worst) in numbers(&column(&file, "mean gap %")).iter().zip(&gaps) {
        assert!((0.0..=*worst).contains(mean), "{mean} {worst}");
    }
    assert!(
        numbers(&column(&file, "proven gap %, mean"))
            .iter()
            .all(|gap| *gap > 0.0)
    );
    assert_eq!(
        column(&directory.path().join("quality-runs.csv"), "seed").len(),
        4
    );

    let printed = run(&arguments, "");
    assert_eq!(printed.status.code(), Some(0), "{printed:?}");
    let page = String::from_utf8(printed.stdout).expect("UTF-8");
    assert!(
        page.starts_with("# Quality with default settings\n"),
        "{page}"
    );
    assert!(
        page.contains("a population of 40") && page.contains("| paper-1 | 10 |"),
        "{page}"
    );
}

#[test]
fn bench_random_measures_against_the_best_of_its_runs() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = |name: &str| directory.path().join(name);
    let measure = |out: &str, first: &str, scenarios: &str| {
        let (out, kept) = (path(out), path("kept"));
        let arguments = [
            &[
                "bench",
                "random",
                "--family",
                "agility,discs",
                "--longer",
                "1",
            ][..],
            &["--first", first, "--scenarios", scenarios, "--seeds", "1"],
            &["--out", out.to_str().expect("UTF-8")],
            &["--keep", kept.to_str().expect("UTF-8")],
        ];
        let done = run(&arguments.concat(), "");
        assert_eq!(done.status.code(), Some(0), "{done:?}");
    };
    measure("both", "3", "2");
    measure("second", "4", "1");

    let runs = path("both").join("random-runs.csv");
    let names = ["discs-3", "discs-4", "agility-3", "agility-4"];
    assert_eq!(column(&runs, "scenario"), names);
    // A scenario depends only on its seed, not on the scenarios before it.
    let (all, alone) = (
        essence(&runs),
        essence(&path("second").join("random-runs.csv")),
    );
    assert_eq!([&all[1], &all[3]], [&alone[0], &alone[1]]);

    let costs = numbers(&column(&runs, "cost"));
    let references = numbers(&column(&runs, "reference"));
    let gaps: Vec<f64> = costs
        .iter()
        .zip(&references)
        .map(|(cost, reference)| 100.0 * (cost / reference - 1.0))
        .collect();
    assert!(gaps.iter().all(|gap| *gap >= 0.0), "{gaps:?}");
    let families = path("both").join("random-families.csv");
    let told = numbers(&column(&families, "mean gap %"));
    for (told, gaps) in told.iter().zip(gaps.chunks(2)) {
        assert!(
            (told - f64::midpoint(gaps[0], gaps[1])).abs() < 1e-9,
            "{told} {gaps:?}"
        );
    }

    // A kept scenario can be planned again, with the same outcome.
    let plan = run(
        &[
            "plan",
            path("kept").join("discs-4.json").to_str().expect("UTF-8"),
        ],
        "",
    );
    let result: Value = serde_json::from_slice(&plan.stdout).expect("a result");
    assert_eq!(result["feasible"], true);
    let again = result["cost"]["total"].as_f64().expect("a cost");
    assert_eq!(again.to_bits(), costs[1].to_bits());

    let refused = run(&["bench", "random", "--family", "clouds"], "");
    assert_eq!(refused.status.code(), Some(1));
    let told = String::from_utf8(refused.stderr).expect("UTF-8");
    assert!(
        told.contains("clouds") && told.contains("polygons"),
        "{told}"
    );
}

#[test]
fn bench_speed_writes_its_tables() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let out = directory.path().to_str().expect("UTF-8");
    let done = run(
        &[
            "bench",
            "speed",
            "--time-ms",
            "5",
            "--scenario",
            "paper-1",
            "--out",
            out,
        ],
        "",
    );
    assert_eq!(done.status.code(), Some(0), "{done:?}");
    for (table, key, expected) in [
        ("scenarios", "scenario", &["paper-1"][..]),
        ("waypoints", "N", &["3", "5", "10", "20", "40", "80", "160"]),
        ("threats", "far threats", &["0", "10", "100", "1000"]),
        (
            "population",
            "population",
            &["2", "8", "40", "200", "1000", "5000"],
        ),
    ] {
        let file = directory.path().join(format!("speed-{table}.csv"));
        assert_eq!(column(&file, key), expected);
        for figure in [
            "evaluations/s, scattered",
            "evaluations/s, gathered",
            "priced/s",
        ] {
            for rate in numbers(&column(&file, figure)) {
                assert!(rate > 100.0, "{rate} in {table}");
            }
        }
    }
    let plans = directory.path().join("speed-plans.csv");
    assert!(numbers(&column(&plans, "CPU ms, median"))[0] > 0.0);
}

#[test]
fn bench_reports_faults_of_scenarios_and_arguments() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("wrong.json");
    let mut wrong = scenario();
    wrong["threats"][0]["radius"] = serde_json::json!(-3);
    fs::write(&file, wrong.to_string()).expect("written");
    let file = file.to_str().expect("UTF-8");
    let refused = run(&["bench", "quality", "--scenario", file], "");
    assert_eq!(refused.status.code(), Some(2));
    let faults = String::from_utf8(refused.stderr).expect("UTF-8");
    assert!(faults.contains("/threats/0/radius"), "{faults}");

    for arguments in [
        &["bench"][..],
        &["bench", "paper", "--seeds", "0"],
        &["bench", "paper", "--scenario", "/nowhere/scenario.json"],
        &["bench", "speed", "--time-ms", "never"],
    ] {
        let failed = run(arguments, "");
        assert_eq!(failed.status.code(), Some(1), "{arguments:?}");
        assert!(!failed.stderr.is_empty() && failed.stdout.is_empty());
    }
    // A size that the planner rejects is reported as a fault of the generated document.
    let refused = run(
        &["bench", "quality", "--seeds", "1", "--waypoints", "0"],
        "",
    );
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn bench_price_agrees_with_the_planner() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("scenario.json");
    let mut hilly = scenario();
    hilly["terrain"] = json!({"kind": "flat", "elevation": 30});
    for end in ["start", "target"] {
        hilly[end]["z"] = json!(90);
    }
    fs::write(&file, hilly.to_string()).expect("written");
    let file = file.to_str().expect("UTF-8");
    let planned = run(&["plan", file], "");
    assert_eq!(planned.status.code(), Some(0), "{planned:?}");
    let planned: Value = serde_json::from_slice(&planned.stdout).expect("JSON");
    let all = planned["waypoints"].as_array().expect("waypoints");
    let free = |lift: f64| -> Vec<[f64; 3]> {
        let coordinate = |point: &Value, axis| point[axis].as_f64().expect("a number");
        let point = |point| {
            let [x, y, z] = ["x", "y", "z"].map(|axis| coordinate(point, axis));
            [x, y, z - lift]
        };
        all[1..all.len() - 1].iter().map(point).collect()
    };
    // More than one batch of lanes, of several lengths; the last route goes below ground.
    let mut routes = vec![free(0.0); 9];
    routes.push(vec![]);
    routes.push(free(500.0));
    let asked = format!("[]\n{}", json!(routes));
    let priced = run(&["bench", "price", file], &asked);
    assert_eq!(priced.status.code(), Some(0), "{priced:?}");
    let text = String::from_utf8(priced.stdout).expect("UTF-8");
    let answers: Vec<Vec<[f64; 2]>> = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("pairs"))
        .collect();
    assert_eq!(answers.len(), 2);
    assert!(answers[0].is_empty());
    assert_eq!(answers[1].len(), 11);
    let cost = planned["cost"]["total"].as_f64().expect("a number");
    for [violation, price] in &answers[1][..9] {
        assert!(violation.abs() < 1e-12, "{violation}");
        assert!((price - cost).abs() < 1e-9 * cost, "{price} {cost}");
    }
    assert!(answers[1][10][0] > 100.0);

    let above = run(
        &["bench", "price", file, "--above-ground"],
        &json!([free(30.0)]).to_string(),
    );
    let above: Vec<[f64; 2]> = serde_json::from_slice(&above.stdout).expect("a line");
    assert!((above[0][1] - cost).abs() < 1e-9 * cost);
}

#[test]
fn bench_price_refuses_lines_that_are_not_routes() {
    for (line, why) in [
        ("nope", "an array of routes"),
        ("", "an array of routes"),
        ("[[[1,2]]]", "[x, y, z]"),
        ("[[[1,2,null]]]", "[x, y, z]"),
        ("[[[1,2,1e999]]]", "out of range"),
        ("[[[1,2,-1e10]]]", "must be within"),
    ] {
        let refused = run(&["bench", "price", "paper-1"], &format!("[]\n{line}\n"));
        assert_eq!(refused.status.code(), Some(2), "{line}: {refused:?}");
        assert_eq!(refused.stdout, b"[]\n");
        let told = String::from_utf8(refused.stderr).expect("UTF-8");
        assert!(told.contains("line 2") && told.contains(why), "{told}");
    }
    let long = json!([vec![[1, 2, 3]; 201]]).to_string();
    let refused = run(&["bench", "price", "paper-1"], &long);
    assert_eq!(refused.status.code(), Some(2), "{refused:?}");
    let missing = run(&["bench", "price", "/nowhere/scenario.json"], "[]");
    assert_eq!(missing.status.code(), Some(1));
}

#[test]
fn bench_serve_measures_requests_refusals_streams_and_planning() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let out = directory.path().to_str().expect("UTF-8");
    let least = [
        "--rounds=1",
        "--time-ms=50",
        "--plans=2",
        "--readers=3",
        "--connections=2",
    ];
    let arguments = [
        &["bench", "serve", "--out", out, "--scenario", "paper-1"],
        &least[..],
    ]
    .concat();
    let done = run(&arguments, "");
    assert!(done.status.success(), "{done:?}");
    for (table, rows, key) in [
        ("requests", 3, "ratio"),
        ("full-queue", 2, "p99 ms"),
        ("streams", 2, "events 1/s"),
        ("planning", 1, "ratio"),
    ] {
        let figures = column(&directory.path().join(format!("serve-{table}.csv")), key);
        assert_eq!(figures.len(), rows, "{table}");
        for figure in figures {
            assert!(
                figure.parse::<f64>().expect("a number") > 0.0,
                "{table}: {figure}"
            );
        }
    }
}
