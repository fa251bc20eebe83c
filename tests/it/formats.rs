//! Formats over HTTP and on the command line: selection, file names, refusals.

use std::collections::BTreeSet;
use std::fs;
use std::sync::Arc;

use axum::http::Method;
use noctule::digest::sha256_hex;
use noctule::export::ALL;
use noctule::export::document::{Convergence, Origin, Position, ResultDocument, Timing};
use noctule::http;
use noctule::planner;
use noctule::scenario::json;
use noctule::scenario::limits::Limits;
use noctule::store::Ending;
use serde_json::{Value, json};

use crate::support::api::Api;
use crate::support::description::DESCRIPTION;
use crate::support::process;

/// A kilometre over a meadow near Zurich, past a mast.
fn scenario() -> Value {
    json!({
        "name": "Meadow, east",
        "frame": "wgs84",
        "start": {"lat": 47.3977, "lon": 8.5456, "alt": 500},
        "target": {"lat": 47.4012, "lon": 8.5556, "alt": 520},
        "threats": [{"kind": "cylinder", "name": "mast", "center": {"lat": 47.4010, "lon": 8.5500}, "radius": 60}],
        "terrain": {"kind": "flat", "elevation": 488},
        "altitude": {"min": 5, "max": 80},
        "planner": {"waypoints": 1, "population": 10, "iterations": 2, "seed": 1},
    })
}

/// Browsers of our time take the second name, others the first.
#[tokio::test]
async fn a_download_is_named_in_the_script_of_its_scenario() {
    let api = Api::new();
    let mut scenario = scenario();
    scenario["name"] = "Übung 巡检".into();
    let plan = ended(&api, &scenario, 47.3985, 8.5510).await;
    let tail = &plan[plan.len() - 8..];
    let answer = api.get(&format!("{plan}/result?format=kml")).await;
    assert_eq!(
        answer.header("content-disposition"),
        format!(
            "attachment; filename=\"bung-{tail}.kml\"; \
             filename*=UTF-8''%C3%BCbung-%E5%B7%A1%E6%A3%80-{tail}.kml"
        )
    );
}

/// Submits the scenario and ends its plan with a route through one place; the plan's address.
async fn ended(api: &Api, scenario: &Value, lat: f64, lon: f64) -> String {
    let answer = api.post("/plans", scenario).await;
    assert_eq!(answer.status, 202, "{answer:?}");
    let lease = api.store.claim().await.expect("a queued plan");
    let stored = api.store.scenario(lease.plan.id).await.expect("a scenario");
    let read = json::read_accepted(&stored, &planner::rules(Limits::NONE)).expect("accepted");
    let between = Position::Geodetic {
        lat,
        lon,
        alt: 520.0,
    };
    let between = between.within(&read.frame).expect("degrees");
    let lower = noctule::seeding::lower_bound(&read);
    let outcome = planner::so_far(&read, vec![read.start, between, read.target], lower);
    let origin = Origin {
        plan_id: Some(lease.plan.id),
        algorithm: "tms-sba".to_owned(),
        seed: 1,
        scenario_sha256: sha256_hex(stored.as_bytes()),
        timing: Timing {
            queued_ms: 0.0,
            run_ms: 0.0,
        },
    };
    let ending = Ending::Result {
        cancelled: false,
        stop_reason: "iterations".to_owned(),
        feasible: outcome.feasible,
        best_cost: None,
        evaluations: 1,
        iteration: 1,
        document: ResultDocument {
            evaluations: 1,
            convergence: vec![Convergence {
                iteration: 0,
                evaluations: 1,
                elapsed_ms: 0.0,
                best_cost: None,
                best_violation: 0.0,
                mean_cost: 0.0,
                feasible_fraction: 0.0,
            }],
            ..ResultDocument::new(&outcome, origin)
        }
        .to_json(),
    };
    let at_ms = lease.plan.created_ms + 50;
    api.store
        .finish(&lease, ending.at(at_ms))
        .await
        .expect("the lease holds");
    format!("/plans/{}", lease.plan.id)
}

async fn feasible(api: &Api) -> String {
    ended(api, &scenario(), 47.3985, 8.5510).await
}

#[tokio::test]
async fn every_format_is_selected_by_name_and_by_media_type() {
    let api = Api::new();
    let plan = feasible(&api).await;
    let tail = &plan[plan.len() - 8..];
    for format in ALL {
        let answer = api
            .get(&format!("{plan}/result?format={}", format.name))
            .await;
        assert_eq!(answer.status, 200, "{}: {answer:?}", format.name);
        assert_eq!(answer.header("content-type"), format.media_type);
        let kind = if ["json", "svg"].contains(&format.name) {
            "inline"
        } else {
            "attachment"
        };
        let named = format!(
            "{kind}; filename=\"meadow-east-{tail}.{}\"",
            format.extension
        );
        assert_eq!(answer.header("content-disposition"), named);
        let accept = [("accept", format.media_type)];
        let by_type = api.get_with(&format!("{plan}/result"), &accept).await;
        assert_eq!(by_type.body, answer.body, "{}", format.name);
    }
    let answer = api.get(&format!("{plan}/scenario")).await;
    assert_eq!(
        answer.header("content-disposition"),
        format!("inline; filename=\"meadow-east-{tail}-scenario.json\"")
    );
    let browser = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8";
    let answer = api
        .get_with(&format!("{plan}/result"), &[("accept", browser)])
        .await;
    assert_eq!(answer.header("content-type"), "application/json");
}

#[tokio::test]
async fn format_options_are_applied_or_refused() {
    let api = Api::new();
    let plan = feasible(&api).await;
    let uri = |query: &str| format!("{plan}/result?{query}");
    let read = api
        .get(&uri(
            "format=qgc&firmware=ardupilot&altitude=terrain&takeoff=0&landing=true&tolerance=5",
        ))
        .await
        .json();
    assert_eq!(read["mission"]["firmwareType"], 3);
    let items = read["mission"]["items"].as_array().expect("items");
    let commands: Vec<_> = items.iter().map(|item| item["command"].as_u64()).collect();
    assert_eq!(commands[0], Some(178));
    assert_eq!(commands[commands.len() - 1], Some(21));
    assert_eq!(items[1]["frame"], 10);
    let scene = api
        .get(&uri("format=czml&epoch=2026-03-01T07:00:00Z"))
        .await
        .json();
    assert_eq!(scene[0]["clock"]["currentTime"], "2026-03-01T07:00:00Z");
    for (query, parameter) in [
        ("format=qgc&firmware=inav", "firmware"),
        ("format=qgc&tolerance=0", "tolerance"),
        ("format=qgc&takeoff=-1", "takeoff"),
        ("format=qgc&takeoff=NaN", "takeoff"),
        ("format=wpl&altitude=terrain", "altitude"),
        ("format=gpx&landing=true", "landing"),
        ("format=gpx&epoch=tomorrow", "epoch"),
        ("landing=true", "landing"),
        ("format=kml&colour=red", "colour"),
        ("format=kmz", "format"),
        ("format=kml&allow_infeasible=maybe", "allow_infeasible"),
    ] {
        let problem = api
            .get(&uri(query))
            .await
            .expect_problem(400, "invalid-parameter");
        assert_eq!(problem["parameter"], parameter, "{query}");
    }
}

#[tokio::test]
async fn an_infeasible_route_is_refused_in_flight_formats() {
    let api = Api::new();
    // Straight through the mast.
    let plan = ended(&api, &scenario(), 47.4010, 8.5500).await;
    for format in ALL {
        let uri = format!("{plan}/result?format={}", format.name);
        let answer = api.get(&uri).await;
        if format.flown {
            answer.expect_problem(409, "infeasible");
        } else {
            assert_eq!(answer.status, 200, "{}", format.name);
        }
        let answer = api.get(&format!("{uri}&allow_infeasible=true")).await;
        assert_eq!(answer.status, 200, "{}", format.name);
    }
}

/// `Accept` lists alternatives: a format that the plan cannot be written in is skipped.
#[tokio::test]
async fn accept_skips_formats_that_the_plan_cannot_be_written_in() {
    let api = Api::new();
    api.submit().await;
    let lease = crate::support::run::complete(&*api.store, Vec::new()).await;
    let local = format!("/plans/{}/result", lease.plan.id);
    // Straight through the mast.
    let infeasible = ended(&api, &scenario(), 47.4010, 8.5500).await + "/result";
    for (uri, accept, expected) in [
        (
            &local,
            "application/geo+json, application/json;q=0.5",
            "application/json",
        ),
        (
            &local,
            "application/geo+json, text/csv;q=0.5, */*;q=0.1",
            "text/csv",
        ),
        (
            &infeasible,
            "application/gpx+xml, application/geo+json;q=0.9",
            "application/geo+json",
        ),
    ] {
        let answer = api.get_with(uri, &[("accept", accept)]).await;
        assert_eq!(answer.status, 200, "{accept}: {answer:?}");
        assert_eq!(answer.header("content-type"), expected, "{accept}");
    }
    for (uri, accept, slug) in [
        (local.clone(), "application/geo+json", "no-geodetic-frame"),
        (
            local.clone() + "?format=geojson",
            "*/*",
            "no-geodetic-frame",
        ),
        // Mission options exclude every other format.
        (
            local + "?landing=true",
            "text/plain, application/json;q=0.5",
            "no-geodetic-frame",
        ),
        (
            infeasible,
            "application/gpx+xml, text/plain;q=0.5",
            "infeasible",
        ),
    ] {
        let answer = api.get_with(&uri, &[("accept", accept)]).await;
        answer.expect_problem(409, slug);
    }
}

#[tokio::test]
async fn a_local_plan_is_refused_in_geodetic_formats() {
    let api = Api::new();
    api.submit().await;
    let lease = crate::support::run::complete(&*api.store, Vec::new()).await;
    for format in ALL {
        let answer = api
            .get(&format!(
                "/plans/{}/result?format={}",
                lease.plan.id, format.name
            ))
            .await;
        if format.geodetic {
            answer.expect_problem(409, "no-geodetic-frame");
        } else {
            assert_eq!(answer.status, 200, "{}", format.name);
        }
    }
}

#[tokio::test]
async fn a_threat_below_the_start_blocks_a_take_off() {
    let api = Api::new();
    let mut low = scenario();
    low["threats"][0] = json!({
        "kind": "cylinder", "center": {"lat": 47.3977, "lon": 8.5456}, "radius": 20, "top": 495,
    });
    let plan = ended(&api, &low, 47.3985, 8.5510).await;
    let answer = api.get(&format!("{plan}/result?format=wpl")).await;
    answer.expect_problem(409, "unflyable");
    let answer = api
        .get(&format!("{plan}/result?format=wpl&takeoff=0"))
        .await;
    assert_eq!(answer.status, 200);
}

/// An exported file converts back to an accepted scenario with the same ends and threats.
#[tokio::test]
async fn exports_convert_back_to_scenarios() {
    let api = Api::new();
    let plan = feasible(&api).await;
    for (format, media_type) in [
        ("geojson", "application/geo+json"),
        ("kml", "application/vnd.google-earth.kml+xml; charset=utf-8"),
        ("qgc", "application/json"),
    ] {
        let file = api.get(&format!("{plan}/result?format={format}")).await;
        let headers = [("content-type", media_type)];
        // A request body is limited to 4096 bytes here; the path is not needed.
        let text = String::from_utf8(file.body.to_vec()).expect("UTF-8");
        let text = without_path(format, &text);
        let answer = api
            .send(Method::POST, "/scenarios:convert", &headers, text)
            .await;
        assert_eq!(answer.status, 200, "{format}: {answer:?}");
        let scenario = &answer.json()["scenario"];
        let degrees = |value: &Value| value.as_f64().expect("a number");
        for end in ["start", "target"] {
            let (found, expected) = (&scenario[end], &self::scenario()[end]);
            assert!((degrees(&found["lat"]) - degrees(&expected["lat"])).abs() < 1e-8);
            assert!((degrees(&found["lon"]) - degrees(&expected["lon"])).abs() < 1e-8);
        }
        assert_eq!(scenario["threats"][0]["kind"], "cylinder", "{format}");
        assert_eq!(scenario["threats"][0]["radius"], 60.0);
        if format == "geojson" {
            assert_eq!(scenario["name"], self::scenario()["name"]);
        }
        let accepted = api.post("/plans?validate_only=true", scenario).await;
        assert_eq!(accepted.status, 200, "{format}: {accepted:?}");
    }
}

/// GeoJSON requires a cut at the 180th meridian, and autopilots need one; a route along the cut would pass through.
#[tokio::test]
async fn a_polygon_across_the_antimeridian_converts_back_to_one_threat() {
    let api = Api::new();
    let mut scenario = scenario();
    scenario["start"] = json!({"lat": -17.0, "lon": 179.99, "alt": 500});
    scenario["target"] = json!({"lat": -17.0, "lon": -179.99, "alt": 520});
    let corner = |lat: f64, lon: f64| json!({"lat": lat, "lon": lon});
    scenario["threats"] = json!([{"kind": "polygon", "name": "atoll", "margin": 20, "vertices": [
        corner(-17.004, 179.998), corner(-17.004, -179.997), corner(-17.002, -179.997), corner(-17.002, 179.998)]}]);
    let address = ended(&api, &scenario, -17.0, 180.0).await;
    for (format, media_type, halves) in [
        ("geojson", "application/geo+json", "MultiPolygon"),
        ("qgc", "application/json", "-180.0"),
    ] {
        let exported = api.get(&format!("{address}/result?format={format}")).await;
        let headers = [("content-type", media_type)];
        let text = String::from_utf8(exported.body.to_vec()).expect("UTF-8");
        assert!(text.contains(halves), "{format} is cut: {text}");
        let text = without_path(format, &text);
        let back = api
            .send(Method::POST, "/scenarios:convert", &headers, text)
            .await;
        let threats = &back.json()["scenario"]["threats"];
        assert_eq!(
            threats.as_array().map(Vec::len),
            Some(1),
            "{format}: {threats}"
        );
        let lons = threats[0]["vertices"].as_array().expect("corners").iter();
        let mut lons: Vec<f64> = lons.filter_map(|corner| corner["lon"].as_f64()).collect();
        lons.sort_by(f64::total_cmp);
        let expected = [-180.0, -179.997, -179.997, 179.998, 179.998, 180.0];
        assert_eq!(lons, expected, "{format}");
    }
}

/// The file without its path, its rings shortened.
fn without_path(format: &str, text: &str) -> String {
    match format {
        "geojson" => {
            let mut read: Value = serde_json::from_str(text).expect("JSON");
            let features = read["features"].as_array_mut().expect("features");
            let is_line = |kind: &Value| kind == "LineString" || kind == "MultiLineString";
            features.retain(|feature| !is_line(&feature["geometry"]["type"]));
            for feature in features {
                if feature["geometry"]["type"] == "Polygon" {
                    let ring = feature["geometry"]["coordinates"][0].as_array_mut();
                    ring.expect("a ring").truncate(4);
                }
            }
            read.to_string()
        }
        "kml" => {
            let (before, after) = text.split_once("<LineString>").expect("a path");
            let (_, after) = after.split_once("</LineString>").expect("its end");
            let (start, ring) = after.rsplit_once("<coordinates>").expect("a ring");
            let (ring, end) = ring.split_once("</coordinates>").expect("its end");
            let ring: Vec<_> = ring.lines().take(4).collect();
            format!(
                "{before}{start}<coordinates>{}</coordinates>{end}",
                ring.join("\n")
            )
        }
        _ => text.to_owned(),
    }
}

#[tokio::test]
async fn files_that_are_no_scenario_are_refused() {
    let api = Api::new();
    for (media_type, body, status, slug) in [
        ("application/geo+json", "{", 400, "invalid-json"),
        (
            "application/json",
            r#"{"type": "FeatureCollection", "features": []}"#,
            422,
            "no-scenario",
        ),
        (
            "application/json",
            r#"{"fileType": "Plan"}"#,
            422,
            "no-scenario",
        ),
        ("application/xml", "<kml><Document>", 400, "invalid-xml"),
        ("text/xml", "<!DOCTYPE kml><kml/>", 400, "invalid-xml"),
        (
            "application/vnd.google-earth.kml+xml",
            "<kml/>",
            422,
            "no-scenario",
        ),
        (
            "application/vnd.google-earth.kmz",
            "PK",
            415,
            "unsupported-media-type",
        ),
        ("text/plain", "QGC WPL 110", 422, "no-scenario"),
        (
            "text/plain; charset=utf-16",
            "AC R",
            415,
            "unsupported-media-type",
        ),
        (
            "application/xml; charset=latin1",
            "<kml/>",
            415,
            "unsupported-media-type",
        ),
    ] {
        let headers = [("content-type", media_type)];
        let answer = api
            .send(Method::POST, "/scenarios:convert", &headers, body)
            .await;
        let problem = answer.expect_problem(status, slug);
        if status == 415 {
            let detail = problem["detail"].as_str().expect("a text");
            for read in [
                "application/geo+json",
                "application/xml",
                "text/xml or text/plain",
            ] {
                assert!(detail.contains(read), "{detail}");
            }
        }
    }
    let long = "x".repeat(5000);
    let headers = [("content-type", "application/json")];
    let answer = api
        .send(Method::POST, "/scenarios:convert", &headers, long)
        .await;
    answer.expect_problem(413, "body-too-large");
    for query in [
        "into=kml",
        "start=47.4",
        "start=47.4,8.5&start=47.4,8.5",
        "target=98,8.5",
        "within=100",
        "start=47.4,8.5&target=47.5,8.5&within=0",
        "start=47.4,8.5&target=47.5,8.5&within=100001",
    ] {
        let path = format!("/scenarios:convert?{query}");
        let answer = api.post(&path, &json!({})).await;
        let problem = answer.expect_problem(400, "invalid-parameter");
        let detail = problem["detail"].as_str().expect("a text");
        assert!(detail.matches("must be").count() <= 1, "{detail}");
    }
}

/// Such a map says where not to fly: from where to where is in the request.
#[tokio::test]
async fn a_map_of_airspace_becomes_a_scenario_for_a_flight() {
    let api = Api::new();
    let zone = |name: &str, center: &str| {
        format!("AC R\nAN {name}\nAL GND\nAH 3000ft MSL\nV X={center}\nDC 0.3\n")
    };
    let map = [
        zone("range", "47:24:00 N 008:33:00 E"),
        zone("abroad", "60:00:00 N 008:33:00 E"),
    ]
    .concat();
    let headers = [("content-type", "text/plain; charset=utf-8")];
    let path = "/scenarios:convert?start=47.4,8.53,500&target=47.4,8.57,500&within=3000";
    let answer = api.send(Method::POST, path, &headers, map.clone()).await;
    assert_eq!(answer.status, 200, "{answer:?}");
    let scenario = &answer.json()["scenario"];
    assert_eq!(scenario["threats"].as_array().map(Vec::len), Some(1));
    let accepted = api.post("/plans?validate_only=true", scenario).await;
    assert_eq!(accepted.status, 200, "{accepted:?}");

    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("zones.txt");
    fs::write(&file, &map).expect("written");
    let file = file.to_str().expect("UTF-8");
    let ends = ["--start", "47.4,8.53,500", "--target", "47.4,8.57,500"];
    let read = process::run(
        &[&["convert", file, "--within", "3000"], &ends[..]].concat(),
        "",
    );
    assert_eq!(read.status.code(), Some(0), "{read:?}");
    let read: Value = serde_json::from_slice(&read.stdout).expect("a scenario");
    assert_eq!(&read, scenario);
    let refused = process::run(&["convert", file, "--within", "3000"], "");
    assert_eq!(refused.status.code(), Some(1), "a wrong command line");
}

/// What is not used for the same reason is told together.
#[test]
fn the_command_line_groups_what_it_does_not_use() {
    let line = json!({"type": "Feature", "properties": {},
        "geometry": {"type": "LineString", "coordinates": [[8.5, 47.4], [8.6, 47.4]]}});
    let map = json!({"type": "FeatureCollection", "features": vec![line; 5]});
    let told = process::run(&["convert", "-"], &map.to_string());
    assert_eq!(
        String::from_utf8_lossy(&told.stderr),
        "not used /features/0, /features/1, /features/2 and 2 more: a line: points and polygons make a scenario\n\
         -: no start and no target in the file: a point of that name makes one in GeoJSON and KML, the options start and target do with any file\n"
    );
}

/// A file gets no further than the scenario that it would become: the service's own limits hold, and on the command
/// line the defaults.
#[tokio::test]
async fn files_of_more_threats_than_a_scenario_may_have_are_refused() {
    let file = |n_circles: usize| {
        let point = |properties: Value| {
            json!({"type": "Feature", "properties": properties,
            "geometry": {"type": "Point", "coordinates": [8.5, 47.4, 500]}})
        };
        let mut features = vec![point(json!({"radius": 5})); n_circles];
        features.extend(["start", "target"].map(|name| point(json!({"name": name}))));
        json!({"type": "FeatureCollection", "features": features})
    };
    let mut api = Api::new();
    let limits = Limits {
        threats: 2,
        ..api.state.rules.limits
    };
    api.state.rules = Arc::new(planner::rules(limits));
    api.router = http::router(api.state.clone());
    let answer = api.post("/scenarios:convert", &file(2)).await;
    assert_eq!(answer.status, 200, "{answer:?}");
    let answer = api.post("/scenarios:convert", &file(3)).await;
    let problem = answer.expect_problem(422, "no-scenario");
    assert_eq!(
        problem["detail"],
        "the file has 3 threats, must have at most 2 (limit threats)"
    );

    let read = process::run(&["convert", "-"], &file(10_000).to_string());
    assert_eq!(read.status.code(), Some(0));
    let refused = process::run(&["convert", "-"], &file(10_001).to_string());
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&refused.stderr)
            .contains("the file has 10001 threats, must have at most 10000 (limit threats)")
    );
}

#[test]
fn the_command_line_plans_exports_and_converts() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = |name: &str| {
        let path = directory.path().join(name);
        path.to_str().expect("UTF-8").to_owned()
    };
    fs::write(path("flight.json"), scenario().to_string()).expect("written");
    let outs = ["result.json", "a.KML", "a.plan", "a.waypoints", "a.geojson"].map(path);
    let mut arguments = vec!["plan".to_owned(), path("flight.json")];
    arguments.extend(
        outs.iter()
            .flat_map(|out| ["--out".to_owned(), out.clone()]),
    );
    arguments.extend(["--set".to_owned(), "landing=true".to_owned()]);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let planned = process::run(&arguments, "");
    assert_eq!(planned.status.code(), Some(0), "{planned:?}");
    assert!(planned.stdout.is_empty());
    let text = |name: &str| fs::read_to_string(path(name)).expect("written");
    assert!(text("a.KML").starts_with("<?xml"));
    assert!(text("a.plan").contains("\"fileType\": \"Plan\""));

    // The seed in the scenario is used; another scenario does not match the result.
    let export = |scenario: &str, more: &[&str]| {
        let (result, scenario) = (path("result.json"), path(scenario));
        let arguments = ["export", &result, "--scenario", &scenario];
        process::run(&[&arguments[..], more].concat(), "")
    };
    let again = export("flight.json", &["--format", "wpl", "--set", "landing=true"]);
    assert_eq!(again.status.code(), Some(0), "{again:?}");
    assert_eq!(String::from_utf8_lossy(&again.stdout), text("a.waypoints"));
    let mut other = scenario();
    other["altitude"]["max"] = 90.into();
    fs::write(path("other.json"), other.to_string()).expect("written");
    let refused = export("other.json", &["--format", "wpl"]);
    assert_eq!(refused.status.code(), Some(2));
    assert_eq!(
        String::from_utf8_lossy(&refused.stderr),
        format!(
            "{}: the scenario is not the one that the result was planned for\n",
            path("other.json")
        )
    );
    let both = process::run(&["export", "-", "--scenario", "-"], "{}");
    assert_eq!(both.status.code(), Some(1));
    let told = String::from_utf8_lossy(&both.stderr);
    assert!(told.contains("cannot both be standard input"), "{told}");
    let refused = export("flight.json", &["--format", "kml", "--set", "landing=true"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        String::from_utf8_lossy(&refused.stderr)
            .contains("landing is no option of kml, only of qgc, wpl")
    );

    let converted = process::run(
        &["convert", &path("a.geojson"), "-o", &path("again.json")],
        "",
    );
    assert_eq!(converted.status.code(), Some(0), "{converted:?}");
    assert!(String::from_utf8_lossy(&converted.stderr).contains("assumed /altitude"));
    let read: Value = serde_json::from_str(&text("again.json")).expect("JSON");
    assert_eq!(read["threats"][0]["radius"], 60.0);
    let local = crate::support::scenario().to_string();
    let refused = process::run(&["plan", "-", "--format", "kml"], &local);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("kml needs degrees"));
    let refused = process::run(&["convert", "-"], "<kml/>");
    assert_eq!(refused.status.code(), Some(2));
}

/// Whatever is exported is described, and offered by the page.
#[test]
fn every_format_is_described_and_offered() {
    let get = &DESCRIPTION["paths"]["/plans/{id}/result"]["get"];
    let parameters = get["parameters"].as_array().expect("a list");
    let format = parameters
        .iter()
        .find(|parameter| parameter["name"] == "format");
    let names: BTreeSet<&str> = ALL.iter().map(|format| format.name).collect();
    let described = format.expect("the parameter")["schema"]["enum"].as_array();
    let described = described.expect("a list").iter().filter_map(Value::as_str);
    assert_eq!(described.collect::<BTreeSet<_>>(), names);

    let media_types = get["responses"]["200"]["content"]
        .as_object()
        .expect("types");
    let page = include_str!("../../src/page/format.js");
    for format in ALL {
        let media_type = format.media_type.split(';').next().expect("a type");
        assert!(media_types.contains_key(media_type), "{media_type}");
        let row = format!("{{ name: '{}', ", format.name);
        assert!(page.contains(&row), "{row}");
    }
}
