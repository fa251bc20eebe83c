//! Scenario documents: what is accepted, and every fault that is reported.

mod cases;
mod dataset;
mod fuzz;
mod wgs84;

use std::collections::{BTreeMap, BTreeSet};

use noctule::scenario::json::{
    self, AlgorithmRule, CODES, Fault, MAX_LISTED, ParameterRule, Refusal, Rules,
};
use noctule::scenario::limits::Limits;
use noctule::scenario::{Quadrature, Scenario, Seeding};
use noctule::terrain::Terrain;
use noctule::threat::Shape;

use cases::all_cases;
pub(crate) use wgs84::IN_DEGREES;

use crate::support::patience::at_little_cost;

fn rules() -> Rules {
    let parameters = vec![
        ParameterRule {
            name: "f_min",
            default: -1.0,
            min: -10.0,
            max: 10.0,
        },
        ParameterRule {
            name: "loudness",
            default: 0.25,
            min: 0.0,
            max: 1.0,
        },
    ];
    let algorithms = vec![
        AlgorithmRule {
            name: "tms-sba",
            parameters,
        },
        AlgorithmRule {
            name: "sba",
            parameters: Vec::new(),
        },
    ];
    Rules::new(Limits::default(), algorithms).with_datasets(dataset::datasets())
}

fn read(text: &str) -> Result<Scenario, Refusal> {
    json::read(text.as_bytes(), &rules(), 11)
}

#[track_caller]
fn faults(text: &str) -> Vec<Fault> {
    match read(text) {
        Err(Refusal::Invalid(faults)) => faults,
        other => panic!("faults were expected, not {other:?}\n{text}"),
    }
}

/// The smallest complete document.
const LEAST: &str = r#"{"start":{"x":0,"y":0,"z":0},"target":{"x":300,"y":400,"z":0},"altitude":{"min":0,"max":200}}"#;

/// A document with every member; the cases below replace one part each.
pub(crate) const FULL: &str = r#"{
"name":"full","frame":"local",
"start":{"x":100,"y":100,"z":0},"target":{"x":900,"y":800,"z":150},
"area":{"min":{"x":0,"y":0},"max":{"x":1000,"y":1000}},
"threats":[
 {"kind":"cylinder","name":"radar","center":{"x":350,"y":250},"radius":60,"influence":90,"base":null,"top":500},
 {"kind":"polygon","name":null,"vertices":[{"x":500,"y":500},{"x":600,"y":500},{"x":550,"y":600}],"margin":30}
],
"terrain":{"kind":"grid","origin":{"x":0,"y":0},"cell":500,"columns":3,"rows":3,"elevations":[0,0,0,0,0,0,0,0,100]},
"altitude":{"min":10,"max":200},
"vehicle":{"max_turn_deg":60,"max_climb_deg":45,"min_leg":8,"cruise_speed":15,"fuel_per_km":1000},
"weights":{"fuel":0.5,"threat":1,"altitude":1},
"planner":{"algorithm":"tms-sba","waypoints":8,"population":40,"iterations":30,"seed":7,"time_limit_ms":null,
 "seeding":"random","polish":false,"warm_start":null,"smoothing":{"degree":3,"spacing":5},
 "parameters":{"quadrature":"paper","loudness":0.5}}
}"#;

fn edited(from: &str, to: &str) -> String {
    assert_eq!(
        FULL.matches(from).count(),
        1,
        "{from} must occur once in the document"
    );
    FULL.replace(from, to)
}

#[test]
fn every_case_causes_exactly_its_own_fault() {
    for (document, expected) in all_cases() {
        assert_eq!(faults(&document), [expected]);
    }
}

#[test]
fn every_code_has_a_case_and_a_row_in_the_docs() {
    let page = include_str!("../../../docs/PROBLEMS.md");
    let mut examples: BTreeMap<&str, Fault> = BTreeMap::new();
    for (_, fault) in all_cases() {
        examples.entry(fault.code).or_insert(fault);
    }
    let counted = faults(&format!(
        "{{{}}}",
        r#""x":0,"#.repeat(150).trim_end_matches(',')
    ));
    let last = counted.last().expect("there are many").clone();
    examples.insert(last.code, last);
    let unknown = Fault::unknown_plan(
        "01936f2c-7d1a-7c55-9a53-27b1b44c1a10",
        "no plan has this id",
    );
    examples.insert(unknown.code, unknown);
    for (code, meaning) in CODES {
        let Fault {
            pointer, detail, ..
        } = &examples
            .remove(code)
            .unwrap_or_else(|| panic!("{code} has no case"));
        let pointer = if pointer.is_empty() {
            "(the document)".to_owned()
        } else {
            format!("`{pointer}`")
        };
        let row = format!("| `{code}` | {meaning} | {pointer}: {detail} |");
        assert!(page.contains(&row), "docs/PROBLEMS.md has no row\n{row}");
    }
    assert!(
        examples.is_empty(),
        "not in the table of codes: {examples:?}"
    );
}

/// The spacing is checked by the distance between the ends, which other faults leave known.
#[test]
fn too_fine_a_spacing_is_told_beside_other_faults() {
    let found = faults(
        &edited(r#""spacing":5"#, r#""spacing":0.01"#).replace(r#""radius":60"#, r#""radius":-60"#),
    );
    let pointers: Vec<_> = found.iter().map(|fault| fault.pointer.as_str()).collect();
    assert_eq!(
        pointers,
        ["/threats/0/radius", "/planner/smoothing/spacing"]
    );
}

/// At 300 km apart, samples every 5 m would exceed the limit.
#[test]
fn a_default_spacing_is_never_refused() {
    let spacing = |x: u32| {
        let text = format!(
            r#"{{"start":{{"x":0,"y":0,"z":50}},"target":{{"x":{x},"y":0,"z":50}},"altitude":{{"min":0,"max":100}}}}"#
        );
        read(&text).expect("no fault").planner.smoothing.spacing
    };
    for (x, expected) in [(1_000, 5.0), (249_990, 5.0), (300_000, 12.0)] {
        assert!((spacing(x) - expected).abs() < 1e-12, "{x}: {}", spacing(x));
    }
}

/// Where an operator allows less than the defaults, what is left out is what is allowed.
#[test]
fn a_default_is_never_beyond_a_limit() {
    let mut rules = rules();
    let limits = &mut rules.limits;
    (limits.waypoints, limits.population, limits.iterations) = (5, 50, 30);
    let scenario = json::read(LEAST.as_bytes(), &rules, 11).expect("no fault");
    let sizes = &scenario.planner;
    assert_eq!(
        (sizes.waypoints, sizes.population, sizes.iterations),
        (5, 50, 30)
    );
    // Of the product of the three, iterations give way.
    rules.limits = Limits {
        work: 300_000,
        ..Limits::default()
    };
    let scenario = json::read(LEAST.as_bytes(), &rules, 11).expect("no fault");
    assert_eq!(scenario.planner.iterations, 150);
    rules.limits.work = 1999;
    let refused = json::read(LEAST.as_bytes(), &rules, 11).expect_err("too much");
    assert!(refused.to_string().contains("limit work"), "{refused}");
}

/// A target that is steeper above the start than the vehicle climbs needs room for a detour, and so does the
/// middle of the band over ends that are close together.
#[test]
fn the_default_area_has_room_for_the_climb() {
    let area = |target: &str, climb: &str| {
        let text = format!(
            r#"{{"start":{{"x":0,"y":0,"z":0}},"target":{target},"altitude":{{"min":400,"max":700}},
            "terrain":{{"kind":"flat","elevation":-500}},"vehicle":{{"max_climb_deg":{climb}}}}}"#
        );
        let scenario = read(&text).expect("no fault");
        // What is written is accepted again, with the same area.
        let again = read(&json::write(&scenario)).expect("no fault");
        assert_eq!(again.area, scenario.area, "{text}");
        let area = scenario.area;
        [area.min.x, area.min.y, area.max.x, area.max.y]
    };
    let check = |target, climb, expected: [f64; 4]| {
        for (actual, expected) in area(target, climb).into_iter().zip(expected) {
            assert!(
                (actual - expected).abs() < 1e-6,
                "{target} {climb}: {actual} {expected}"
            );
        }
    };
    // As steep as the vehicle climbs: a quarter of the box.
    check(
        r#"{"x":100,"y":0,"z":100}"#,
        "45.001",
        [-25.0, -25.0, 125.0, 25.0],
    );
    // Half of the 300 m of ground distance that the climb takes, on every side.
    check(
        r#"{"x":100,"y":0,"z":300}"#,
        "45",
        [-150.0, -150.0, 250.0, 150.0],
    );
    // The middle of the band is at 50 m: up to there, and down again.
    check(
        r#"{"x":100,"y":0,"z":-300}"#,
        "45",
        [-200.0, -200.0, 300.0, 200.0],
    );
    check(r#"{"x":30,"y":0,"z":0}"#, "45", [-50.0, -50.0, 80.0, 50.0]);
    // However slowly the vehicle climbs, the area stays within limits.
    let far = area(r#"{"x":100,"y":0,"z":1000}"#, "1e-9");
    assert!(far.iter().all(|coordinate| coordinate.abs() < 1e8));
}

#[test]
fn the_least_document_is_filled_with_the_defaults() {
    let scenario = read(LEAST).expect("it says all that is needed");
    insta::assert_snapshot!(json::write(&scenario));
    assert_eq!(scenario.planner.seed, 11);
    assert_eq!(scenario.planner.seeding, Seeding::Tangent);
    assert!(scenario.planner.polish);
    assert_eq!(scenario.planner.quadrature, Quadrature::Integral);
    // |ST| / (10 (N + 1)) with |ST| = 500 and N = 10, and a box of 300 by 400 with a quarter of 500 added all round.
    assert!((scenario.vehicle.min_leg - 500.0 / 110.0).abs() < 1e-12);
    assert!((scenario.area.min.x + 125.0).abs() < 1e-9);
    assert!((scenario.area.max.y - 525.0).abs() < 1e-9);
}

#[test]
fn every_part_of_a_full_document_is_read() {
    let scenario = read(FULL).expect("it has no fault");
    assert_eq!(scenario.name.as_deref(), Some("full"));
    assert_eq!(scenario.threats.len(), 2);
    assert_eq!(scenario.threats[0].top, Some(500.0));
    assert!(
        matches!(&scenario.threats[1].shape, Shape::Polygon(polygon) if polygon.vertices().len() == 3)
    );
    assert!(matches!(&scenario.terrain, Terrain::Grid(grid) if grid.elevations.len() == 9));
    assert_eq!(scenario.planner.quadrature, Quadrature::Paper);
    assert_eq!(
        scenario.planner.parameters,
        BTreeMap::from([("f_min".to_owned(), -1.0), ("loudness".to_owned(), 0.5)])
    );
}

#[test]
fn values_at_the_edge_of_a_fault_are_accepted() {
    for (from, to) in [
        // Touching a threat is not being inside it; neither is being at its top.
        (r#""x":100,"y":100,"z":0"#, r#""x":290,"y":250,"z":0"#),
        (r#""x":100,"y":100,"z":0"#, r#""x":350,"y":250,"z":500"#),
        // Nor is what only rounding puts inside.
        (
            r#""x":100,"y":100,"z":0"#,
            r#""x":290.0000000001,"y":250,"z":0"#,
        ),
        (r#""x":100,"y":100,"z":0"#, r#""x":550,"y":500,"z":0"#),
        (r#""x":100,"y":100,"z":0"#, r#""x":100,"y":100,"z":-0.1"#),
        // The start may be below or above the band.
        (r#""x":100,"y":100,"z":0"#, r#""x":100,"y":100,"z":5000"#),
        (r#""x":100,"y":100,"z":0"#, r#""x":0,"y":0,"z":0"#),
        (r#""seed":7"#, r#""seed":7.0"#),
        (r#""seed":7"#, r#""seed":9007199254740991"#),
        (r#""waypoints":8"#, r#""waypoints":2e2"#),
        (r#""max_turn_deg":60"#, r#""max_turn_deg":180"#),
        (
            r#""fuel":0.5,"threat":1,"altitude":1"#,
            r#""fuel":0,"threat":0,"altitude":0"#,
        ),
        (
            r#"{"x":550,"y":600}"#,
            r#"{"x":550,"y":600},{"x":500,"y":500}"#,
        ),
        (
            r#""max":{"x":1000,"y":1000}"#,
            r#""max":{"x":1000.0000001,"y":1000}"#,
        ),
        (r#""influence":90,"#, r#""influence":60,"#),
        (r#""name":"full""#, r#""name":null"#),
        // A known route may include its ends, or be empty.
        (r#""warm_start":null"#, r#""warm_start":{"waypoints":[]}"#),
        (
            r#""warm_start":null"#,
            r#""warm_start":{"waypoints":[{"x":100,"y":100,"z":0},{"x":-5000,"y":9,"z":-7}]}"#,
        ),
        (
            r#""quadrature":"paper""#,
            r#""gap":10,"threads":256,"quadrature":"paper""#,
        ),
    ] {
        let scenario = read(&edited(from, to)).unwrap_or_else(|refusal| panic!("{to}: {refusal}"));
        assert!(
            scenario.area.max.x <= 1000.0,
            "the area must stay within the grid"
        );
    }
}

/// A program may fill in a scenario by itself and have it checked by way of its document.
#[test]
fn numbers_that_are_not_finite_are_written_and_refused() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut scenario = read(LEAST).expect("no fault");
        scenario.start.x = bad;
        let faults = faults(&json::write(&scenario));
        let pointers: Vec<&str> = faults.iter().map(|fault| fault.pointer.as_str()).collect();
        assert_eq!(pointers, ["/start/x"], "{bad}");
    }
}

#[test]
fn a_drawn_seed_stays_below_two_to_the_53() {
    let scenario = json::read(LEAST.as_bytes(), &rules(), u64::MAX).expect("it has no fault");
    assert_eq!(scenario.planner.seed, (1 << 53) - 1);
}

#[test]
fn the_default_area_contains_everything_and_a_grid_is_its_own_area() {
    let area = "\"area\":{\"min\":{\"x\":0,\"y\":0},\"max\":{\"x\":1000,\"y\":1000}},\n";
    let scenario = read(&edited(area, "")).expect("it has no fault");
    assert!((scenario.area.max.x - 1000.0).abs() < 1e-9 && scenario.area.min.x.abs() < 1e-9);

    let far = LEAST.replace(
        r#""altitude""#,
        r#""threats":[{"kind":"cylinder","center":{"x":-1e7,"y":0},"radius":1e7}],"altitude""#,
    );
    let far = far.replace(r#""x":0,"y":0,"#, r#""x":1,"y":0,"#);
    let scenario = read(&far).expect("the largest threat still has an area round it");
    assert!(scenario.area.min.x < -2e7);
    assert_eq!(
        read(&json::write(&scenario)).expect("its area is in range"),
        scenario
    );
}

#[test]
fn all_faults_come_at_once_and_in_document_order() {
    let document = r#"{
        "threats": [
            {"kind":"cylinder","center":{"x":0,"y":"1"},"radius":-3,"top":"high"},
            {"kind":"polygon","vertices":[{"x":0,"y":0},{"x":9,"y":9},{"x":9,"y":0},{"x":0,"y":9}],"colour":"red"},
            {"kind":"cylinder","name":"here","center":{"x":1,"y":1},"radius":5,"influence":4},
            {"kind":"cylinder","name":"there","center":{"x":1,"y":1},"radius":5},
            {"kind":"cone"}, 7
        ],
        "start": {"x":0,"y":0,"z":-4},
        "planner": {"algorithm":"bat","waypoints":0.5,"seed":-1,"population":1e9,"parameters":{"f_min":3}},
        "start": {"x":1,"y":1,"z":1},
        "terrain": {"kind":"peaks","peaks":[{"center":{"x":0},"height":1,"spread":{"x":0,"y":5}}]},
        "vehicle": {"max_turn_deg":0,"max_climb_deg":-45},
        "weights": {"fuel":-1}
    }"#;
    let faults = faults(document);
    insta::assert_snapshot!(Refusal::Invalid(faults).to_string());
}

/// Unless the ground may end with the area: that would be the same fault twice.
#[test]
fn an_end_outside_the_area_is_told_of_the_ground_below_it_as_well() {
    let codes = |terrain: &str| -> Vec<&'static str> {
        let document = format!(
            r#"{{
                "area": {{"min":{{"x":0,"y":0}},"max":{{"x":100,"y":100}}}},
                "start": {{"x":-10,"y":50,"z":0}}, "target": {{"x":90,"y":50,"z":60}},
                "terrain": {terrain}, "altitude": {{"min":0,"max":50}}
            }}"#
        );
        let faults = faults(&document).into_iter();
        faults.map(|fault| fault.code).collect()
    };
    let both = ["outside-area", "below-ground"];
    assert_eq!(codes(r#"{"kind":"flat","elevation":50}"#), both);
    assert_eq!(codes(r#"{"kind":"peaks","base":50,"peaks":[]}"#), both);
    assert_eq!(
        codes(
            r#"{"kind":"grid","origin":{"x":0,"y":0},"cell":100,"columns":2,"rows":2,"elevations":[50,50,50,50]}"#
        ),
        ["outside-area"]
    );
}

/// Whatever needs no frame is checked without one, and whatever all algorithms share without an algorithm.
#[test]
fn an_unknown_frame_or_algorithm_hides_no_other_faults() {
    let unknown = r#"{
        "start":{"x":0,"y":0},"target":{"x":"a","y":0,"z":0},"altitude":{"min":5,"max":1},"frame":"bogus",
        "threats":[1,{"kind":"cylinder","radius":-3},{"kind":"polygon","vertices":[{"x":0}],"margin":-1},
            {"kind":"cylinder","center":{},"radius":3,"influence":1}],
        "terrain":{"kind":"dataset","name":"nowhere"},
        "vehicle":{"max_turn_deg":-1},
        "planner":{"algorithm":"zzz","waypoints":0,"parameters":{"foo":1,"gap":-1},"smoothing":{"x":1}}
    }"#;
    let pointers = |document: &str| -> Vec<String> {
        let faults = faults(document).into_iter();
        faults.map(|fault| fault.pointer).collect()
    };
    assert_eq!(
        pointers(unknown),
        [
            "/altitude",
            "/frame",
            "/threats/0",
            "/threats/1/radius",
            "/threats/1/center",
            "/threats/2/margin",
            "/threats/3/influence",
            "/terrain/name",
            "/vehicle/max_turn_deg",
            "/planner/algorithm",
            "/planner/waypoints",
            "/planner/parameters/gap",
            "/planner/smoothing/x",
        ]
    );

    // Places are read as degrees even where no plane fits.
    let wide = r#"{
        "frame":"wgs84","area":{"min":{"lat":0,"lon":0},"max":{"lat":9,"lon":9}},
        "start":{"lat":1,"lon":1},"target":{"lat":91,"lon":2,"alt":0},"altitude":{"min":0,"max":90},
        "threats":[{"kind":"cylinder","center":{"lat":1,"x":2},"radius":-1}],
        "terrain":{"kind":"dataset","name":"nowhere"},
        "planner":{"waypoints":0,"warm_start":{"waypoints":[{"lat":1,"lon":1,"alt":"high"}]}}
    }"#;
    assert_eq!(
        pointers(wide),
        [
            "/area",
            "/start/alt",
            "/target/lat",
            "/threats/0/center/x",
            "/threats/0/center/lon",
            "/threats/0/radius",
            "/terrain/name",
            "/planner/waypoints",
            "/planner/warm_start/waypoints/0/alt",
        ]
    );
}

#[test]
fn ten_thousand_faults_are_reported_briefly() {
    let threat = r#"{"kind":"cylinder","center":{"x":0,"y":0},"radius":-1},"#;
    let threats = format!(
        r#""threats":[{}],"altitude""#,
        threat.repeat(10_000).trim_end_matches(',')
    );
    let faults = faults(&LEAST.replace(r#""altitude""#, &threats));
    assert_eq!(faults.len(), MAX_LISTED + 1);
    let last = faults.last().expect("there are many");
    assert_eq!((last.code, last.pointer.as_str()), ("more-faults", ""));
    assert_eq!(
        last.detail,
        "9900 more faults are not listed, at most 100 are"
    );
}

#[test]
fn hostile_keys_and_texts_are_not_echoed_in_full() {
    let long = "\u{7}k".repeat(100_000);
    let document = LEAST.replace(
        r#""altitude""#,
        &format!(
            r#"{}:1,"frame":{},"altitude""#,
            serde_json::json!(long),
            serde_json::json!(long)
        ),
    );
    for fault in faults(&document) {
        assert!(fault.pointer.len() + fault.detail.len() < 1000, "{fault:?}");
        assert!(!fault.detail.contains(char::is_control), "{fault:?}");
    }
}

#[test]
fn a_document_that_is_not_an_object_is_refused() {
    for text in ["null", "[]", "7", "\"scenario\"", "[1,2]"] {
        let faults = faults(text);
        assert_eq!(
            (faults.len(), faults[0].code, faults[0].pointer.as_str()),
            (1, "wrong-type", ""),
            "{text}"
        );
    }
}

#[test]
fn broken_json_says_line_column_and_pointer() {
    let Err(Refusal::Syntax {
        line,
        column,
        pointer,
        ..
    }) = read(&edited(r#""radius":60"#, r#""radius":1e999"#))
    else {
        panic!("a syntax error was expected");
    };
    assert_eq!((line, pointer.as_str()), (6, "/threats/0/radius"));
    assert!(column > 60);
}

#[test]
fn a_grid_of_a_million_nodes_is_read_quickly() {
    let nodes = 1_000_000;
    let elevations = "123.25,".repeat(nodes - 1) + "123.25";
    let grid = format!(
        r#""terrain":{{"kind":"grid","origin":{{"x":0,"y":0}},"cell":30,"columns":1000,"rows":1000,
        "elevations":[{elevations}]}},"altitude""#
    );
    let document = LEAST
        .replace(r#""altitude""#, &grid)
        .replace(r#""z":0"#, r#""z":200"#);
    let scenario = at_little_cost(|| read(&document)).expect("it has no fault");
    assert!(matches!(&scenario.terrain, Terrain::Grid(grid) if grid.elevations.len() == nodes));
}

#[test]
fn a_hostile_body_of_eight_mebibytes_is_refused_quickly() {
    let size = 8 << 20;
    for (open, item, close) in [
        ("{", "\"\":0,", "\"\":0}"),
        ("{\"threats\":[", "[],", "[]]}"),
        (
            "{\"threats\":[{\"kind\":\"polygon\",\"vertices\":[",
            "0,",
            "0]}]}",
        ),
        (
            "{\"planner\":{\"parameters\":{",
            "\"f_min\":9,",
            "\"f_min\":9}}}",
        ),
        (
            "{\"terrain\":{\"kind\":\"peaks\",\"peaks\":[",
            "{},",
            "{}]}}",
        ),
        (
            "{\"terrain\":{\"kind\":\"grid\",\"rows\":2,\"columns\":2,\"elevations\":[",
            "1e9,\"\",",
            "1]}}",
        ),
    ] {
        let document = format!("{open}{}{close}", item.repeat(size / item.len()));
        let faults = at_little_cost(|| faults(&document));
        assert!(faults.len() <= MAX_LISTED + 1);
    }
}

#[test]
fn every_document_in_scenarios_is_accepted() {
    let mut n_documents = 0;
    for entry in std::fs::read_dir("scenarios").expect("the directory is there") {
        let path = entry.expect("it can be listed").path();
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        n_documents += 1;
        let text = std::fs::read_to_string(&path).expect("it can be read");
        let scenario = read(&text)
            .unwrap_or_else(|refusal| panic!("{} is refused:\n{refusal}", path.display()));
        let again = read(&json::write(&scenario)).expect("what is written is accepted");
        assert_eq!(again, scenario, "{}", path.display());
    }
    assert!(n_documents >= 5, "only {n_documents} documents were found");
}

/// A code that no document of these tests leads to would be missing from the manual, too.
#[test]
fn the_code_of_every_fault_is_in_the_table() {
    let mut found = BTreeSet::new();
    for entry in std::fs::read_dir("src/scenario/json").expect("the directory is there") {
        let path = entry.expect("it can be listed").path();
        let source = std::fs::read_to_string(&path).expect("it can be read");
        for call in source.split(".add(").skip(1) {
            // Right before the closure that tells the detail.
            let before = call.split("||").next().unwrap_or_default().trim_end();
            let code = before
                .strip_suffix("\",")
                .and_then(|before| before.rsplit('"').next());
            found.extend(code.map(str::to_owned));
        }
    }
    assert!(found.len() > 20, "{found:?}");
    for code in found {
        assert!(CODES.iter().any(|(known, _)| *known == code), "{code}");
    }
}

#[test]
fn the_fault_codes_are_distinct_and_well_formed() {
    let codes: BTreeSet<&str> = CODES.iter().map(|(code, _)| *code).collect();
    assert_eq!(codes.len(), CODES.len());
    assert!(
        codes
            .iter()
            .all(|code| code.chars().all(|c| c.is_ascii_lowercase() || c == '-'))
    );
}
