//! The drawing of a plan: well-formed whatever the names, for every shipped scenario, over HTTP and on the
//! command line.

use std::fs;

use noctule::export::document::{Path, Position, ResultDocument, Violation};
use noctule::export::{Format, Options, ResultInput};
use noctule::planner;
use noctule::scenario::json;
use noctule::scenario::limits::Limits;
use roxmltree::Document;
use serde_json::{Value, json};
use uuid::Uuid;

use crate::support::api::Api;
use crate::support::{process, run, scenario};

/// The colour used only for infeasible routes.
const ALARM: &str = "#d0021b";

fn accepted(document: &Value) -> String {
    let rules = planner::rules(Limits::default());
    let scenario =
        json::read(document.to_string().as_bytes(), &rules, 7).expect("a valid scenario");
    json::write(&scenario)
}

fn draw(scenario: &Value, result: &ResultDocument) -> String {
    let input = ResultInput {
        result: &result.to_json(),
        scenario: &accepted(scenario),
        rules: &planner::rules(Limits::NONE),
    };
    let svg = Format::named("svg").expect("svg is a format");
    svg.write(&input, &Options::default())
        .expect("every plan can be drawn")
}

/// A result whose path cuts the corner of its waypoints.
fn result() -> ResultDocument {
    let mut result = run::result(Uuid::nil(), "iterations");
    result.path = Some(Path {
        points: [
            (200.0, 100.0, 0.0),
            (490.0, 310.0, 78.0),
            (520.0, 340.0, 82.0),
            (800.0, 800.0, 150.0),
        ]
        .map(|(x, y, z)| Position::Local { x, y, z })
        .to_vec(),
        length: 950.0,
        degree: 3,
        knots: Vec::new(),
        control_points: Vec::new(),
        duration_s: 63.3,
    });
    result.checks.path = Some(result.checks.waypoints.clone());
    result
}

/// Panics unless the drawing is self-contained XML; its visible texts.
#[track_caller]
fn words(drawing: &str) -> Vec<String> {
    let document = Document::parse(drawing).unwrap_or_else(|error| panic!("{error}\n{drawing}"));
    let root = document.root_element();
    assert_eq!(root.tag_name().name(), "svg");
    for node in root.descendants() {
        let name = node.tag_name().name();
        assert!(
            !matches!(
                name,
                "script" | "style" | "image" | "use" | "a" | "foreignObject"
            ),
            "{name}"
        );
        for attribute in node.attributes() {
            let (name, value) = (attribute.name(), attribute.value());
            assert!(!name.starts_with("on") && name != "href", "{name}");
            assert!(
                !value.contains("NaN") && !value.contains("inf"),
                "{name}={value}"
            );
            assert!(
                !value.contains("url(") || value.starts_with("url(#"),
                "{name}={value}"
            );
        }
    }
    let texts = root
        .descendants()
        .filter(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "text")));
    texts
        .filter_map(|node| node.text())
        .map(str::to_owned)
        .collect()
}

#[track_caller]
fn expect_words(drawing: &str, expected: &str) {
    let words = words(drawing);
    assert!(
        words.iter().any(|line| line.contains(expected)),
        "{expected} is not in {words:#?}"
    );
}

#[test]
fn a_small_plan() {
    let mut small = scenario();
    small["threats"][1]["top"] = json!(120);
    small["terrain"] = json!({"kind": "grid", "origin": {"x": -100, "y": -100}, "cell": 600, "columns": 3,
        "rows": 3, "elevations": [-40, -40, -40, -40, 0, -40, -40, -40, -40]});
    small["altitude"]["min"] = json!(0);
    let drawing = draw(&small, &result());
    assert_eq!(
        drawing,
        draw(&small, &result()),
        "the same documents give the same bytes"
    );
    for expected in [
        "two radars",
        "seed 7",
        "cost 580.0",
        "length 950 m",
        "12.5 m (radar 1)",
        "below 120 m",
    ] {
        expect_words(&drawing, expected);
    }
    assert!(!drawing.contains(ALARM));
    // The relief is tested separately; without it the snapshot is readable.
    let lines: Vec<&str> = drawing.lines().filter(|line| line.len() < 600).collect();
    insta::assert_snapshot!(lines.join("\n"));
}

#[test]
fn hostile_names_are_escaped() {
    for name in [
        "</text><script>alert(1)</script>",
        "\" onload=\"alert(1)",
        "&amp; ]]> <![CDATA[ <!-- --> &#0;",
        "bell \u{7} escape \u{1b} null \u{0} delete \u{7f} next line \u{85}",
        "not a character \u{fffe} \u{ffff}",
        "turned round \u{202e}drow\u{202c} \u{2067}x",
        "\u{1f987} ночница 蝙蝠 خفاش",
        "\t\r\n",
        "",
    ] {
        let mut document = scenario();
        document["name"] = json!(name);
        document["threats"][0]["name"] = json!(name);
        let mut result = result();
        result.checks.waypoints.clearance[0].name = Some(name.to_owned());
        result.feasible = false;
        result.path = None;
        result.checks.violations.push(Violation {
            kind: "threat".to_owned(),
            place: planner::Place::Leg(0),
            amount: 3.0,
            message: format!("leg 0 enters threat 0 ({name}) by 3.000 m"),
        });
        let drawing = draw(&document, &result);
        words(&drawing);
        let kept = |letter: char| letter == '\n' || !letter.is_control();
        assert!(drawing.chars().all(kept), "{name:?}");
        assert!(
            !drawing.contains(['\u{202e}', '\u{2067}', '\u{fffe}']),
            "{name:?}"
        );
    }
}

#[test]
fn an_infeasible_route_is_clearly_marked() {
    let mut walled = scenario();
    walled["threats"] = json!([{
        "kind": "polygon",
        "name": "wall",
        "vertices": [{"x": 450, "y": -10}, {"x": 550, "y": -10}, {"x": 550, "y": 1010}, {"x": 450, "y": 1010}],
    }]);
    let plan = process::run(&["plan", "-", "--format", "svg"], &walled.to_string());
    assert_eq!(plan.status.code(), Some(3));
    let drawing = String::from_utf8(plan.stdout).expect("UTF-8");
    expect_words(&drawing, "NOT FEASIBLE: ");
    expect_words(&drawing, "leg in violation");
    assert!(
        !words(&drawing)
            .iter()
            .any(|line| line.contains("path flown"))
    );
    assert!(drawing.contains(ALARM));
}

/// As in the GeoJSON of the same plan.
#[test]
fn a_broken_leg_marks_the_waypoint_that_it_leads_to() {
    let marked = |place: &str| -> Vec<String> {
        let mut result = run::result(Uuid::nil(), "iterations");
        result.feasible = false;
        result.checks.violations = vec![Violation {
            kind: "threat".to_owned(),
            place: place.parse().expect("a place"),
            amount: 3.0,
            message: format!("{place} enters radar 1"),
        }];
        let drawing = draw(&scenario(), &result);
        let document = Document::parse(&drawing).expect("XML");
        let texts = document.descendants().filter(|node| {
            let numbers = node
                .text()
                .is_some_and(|text| text.parse::<usize>().is_ok());
            node.has_tag_name("text") && numbers && node.attribute("fill") == Some(ALARM)
        });
        texts
            .filter_map(|node| node.text())
            .map(str::to_owned)
            .collect()
    };
    assert_eq!(marked("leg 0"), ["1"]);
    assert_eq!(marked("waypoint 1"), ["1"]);
    // It leads to the target, which has no number.
    assert!(marked("leg 1").is_empty());
}

#[test]
fn every_shipped_scenario_draws() {
    let directory = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios");
    let files = fs::read_dir(directory).expect("there are scenarios");
    let mut drawn = 0;
    for file in files.map(|file| file.expect("readable").path()) {
        if file.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        let text = fs::read(&file).expect("readable");
        let mut document: Value = serde_json::from_slice(&text).expect("JSON");
        document["planner"]["population"] = 20.into();
        document["planner"]["iterations"] = 20.into();
        let terrains = format!("{directory}/terrain");
        let arguments = ["plan", "-", "--format", "svg", "--terrain-dir", &terrains];
        let plan = process::run(&arguments, &document.to_string());
        let drawing = String::from_utf8(plan.stdout).expect("UTF-8");
        expect_words(&drawing, document["name"].as_str().expect("named"));
        assert!(
            drawing.len() < 300_000,
            "{}: {} bytes",
            file.display(),
            drawing.len()
        );
        drawn += 1;
    }
    assert!(drawn >= 5, "{drawn}");
}

/// Shapes that could overflow a page: lines, dots, and more names than there is room for.
#[test]
fn odd_areas_draw() {
    let area = |width: f64, height: f64| {
        let mut document = scenario();
        let at = |x: f64, y: f64| json!({"x": 0.5e7 + x * width, "y": -0.5e7 + y * height, "z": 0});
        document["start"] = at(0.1, 0.1);
        document["target"] = at(0.9, 0.9);
        document["area"] = json!({
            "min": {"x": 0.5e7, "y": -0.5e7},
            "max": {"x": 0.5e7 + width, "y": -0.5e7 + height},
        });
        document["threats"] = json!([]);
        document
    };
    let mut crowded = area(1000.0, 1000.0);
    crowded["threats"] = (0..2000)
        .map(|idx| {
            json!({"kind": "cylinder", "name": format!("threat {idx}"), "radius": 1,
                "center": {"x": 0.5e7 + f64::from(idx % 50) * 20.0 + 10.0,
                           "y": -0.5e7 + f64::from(idx / 50) * 20.0 + 10.0}})
        })
        .collect();
    crowded["start"] = json!({"x": 0.5e7, "y": -0.5e7, "z": 0});
    crowded["target"] = json!({"x": 0.5e7 + 1000.0, "y": -0.5e7 + 1000.0, "z": 0});
    for document in [
        area(100_000.0, 1.0),
        area(1.0, 100_000.0),
        area(0.5, 0.5),
        crowded,
    ] {
        let mut result = result();
        let ends = [&document["start"], &document["target"]];
        let ends =
            ends.map(|end| serde_json::from_value::<Position>(end.clone()).expect("a point"));
        result.waypoints = vec![ends[0], ends[0], ends[1]];
        result.path = None;
        expect_words(&draw(&document, &result), "two radars");
    }
}

#[tokio::test]
async fn the_service_draws_a_plan_on_request() {
    let api = Api::new();
    let address = api.submit().await;
    let early = api.get(&format!("{address}/result?format=svg")).await;
    early.expect_problem(409, "not-ready");
    run::complete(&*api.store, Vec::new()).await;

    let result = format!("{address}/result");
    let named = api.get(&format!("{result}?format=svg")).await;
    assert_eq!(named.status, 200);
    assert_eq!(named.header("content-type"), "image/svg+xml");
    expect_words(
        std::str::from_utf8(&named.body).expect("UTF-8"),
        "two radars",
    );
    for (accept, media_type) in [
        ("image/svg+xml", "image/svg+xml"),
        ("image/*", "image/svg+xml"),
        ("application/json;q=0.5, image/svg+xml", "image/svg+xml"),
        (
            "image/avif,image/svg+xml,image/*,*/*;q=0.8",
            "image/svg+xml",
        ),
        (
            "text/html,application/xml;q=0.9,*/*;q=0.8",
            "application/json",
        ),
        ("*/*", "application/json"),
    ] {
        let answer = api.get_with(&result, &[("accept", accept)]).await;
        assert_eq!(answer.header("content-type"), media_type, "{accept}");
        assert_eq!(
            answer.body == named.body,
            media_type == "image/svg+xml",
            "{accept}"
        );
    }
    let decided = api
        .get_with(
            &format!("{result}?format=json"),
            &[("accept", "image/svg+xml")],
        )
        .await;
    assert_eq!(decided.header("content-type"), "application/json");
}

#[test]
fn the_file_extension_decides_unless_a_format_is_given() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = |name: &str| {
        directory
            .path()
            .join(name)
            .to_str()
            .expect("UTF-8")
            .to_owned()
    };
    for (name, format, drawn) in [
        ("route.svg", None, true),
        ("ROUTE.SVG", None, true),
        ("route.txt", None, false),
        ("route", None, false),
        ("other.svg", Some("json"), false),
        ("route.json", Some("svg"), true),
    ] {
        let out = path(name);
        let mut arguments = vec!["plan", "-", "--out", &out];
        arguments.extend(format.iter().flat_map(|format| ["--format", format]));
        let plan = process::run(&arguments, &scenario().to_string());
        assert_eq!(plan.status.code(), Some(0), "{name}");
        let text = fs::read_to_string(&out).expect("written");
        assert_eq!(text.contains("<svg"), drawn, "{name}");
        assert!(text.ends_with('\n') && !text.ends_with("\n\n"), "{name}");
    }
    let refused = process::run(&["plan", "-", "--format", "dwg"], &scenario().to_string());
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        String::from_utf8(refused.stderr)
            .expect("UTF-8")
            .contains("json, svg")
    );
}
