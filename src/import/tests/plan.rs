//! Plans of QGroundControl.

use serde_json::{Value, json};

use super::super::*;
use super::{MOST, convert, unused};

#[test]
fn missions_and_fences_of_a_plan() {
    let item = |command: u16, frame: u8, lat: f64, lon: f64, alt: f64| {
        json!({"type": "SimpleItem", "command": command, "frame": frame,
               "params": [0, 0, 0, null, lat, lon, alt]})
    };
    let plan = json!({
        "fileType": "Plan", "version": 1,
        "mission": {
            "vehicleType": 2, "cruiseSpeed": 20, "hoverSpeed": 5, "plannedHomePosition": [47.3, 8.5, 480],
            "items": [
                item(22, 3, 0.0, 0.0, 15.0),
                {"type": "SimpleItem", "command": 178, "frame": 2, "params": [1, 12, -1, 0, 0, 0, 0]},
                item(16, 3, 47.35, 8.55, 40.0),
                {"type": "ComplexItem", "complexItemType": "survey"},
                item(20, 2, 0.0, 0.0, 0.0),
                item(16, 0, 47.4, 8.6, 530.0),
            ]},
        "geoFence": {
            "circles": [
                {"inclusion": false, "circle": {"center": [47.35, 8.56], "radius": 200}},
                {"inclusion": true, "circle": {"center": [47.35, 8.55], "radius": 20000}},
                {"inclusion": false, "circle": {"center": [47.35], "radius": 200}}],
            "polygons": [{"inclusion": false, "polygon": [[47.31, 8.51], [47.31, 8.52], [47.32, 8.52]]}]},
        "rallyPoints": {"points": [[47.3, 8.5, 10]]},
    });
    let found = convert(plan.to_string().as_bytes(), Syntax::Json).expect("a scenario");
    assert_eq!(
        found.scenario,
        json!({
            "name": null,
            "frame": "wgs84",
            "altitude_datum": "msl",
            "start": {"lat": 47.3, "lon": 8.5, "alt": 480.0},
            "target": {"lat": 47.4, "lon": 8.6, "alt": 530.0},
            "threats": [
                {"kind": "cylinder", "name": null, "center": {"lat": 47.35, "lon": 8.56}, "radius": 200.0,
                 "influence": 200.0, "base": null, "top": null},
                {"kind": "polygon", "name": null, "vertices": [{"lat": 47.31, "lon": 8.51}, {"lat": 47.31, "lon": 8.52},
                 {"lat": 47.32, "lon": 8.52}], "margin": 0.0, "base": null, "top": null}],
            "terrain": {"kind": "flat", "elevation": 480.0},
            "altitude": {"min": 0.0, "max": 120.0},
            "vehicle": {"cruise_speed": 12.0},
        })
    );
    assert_eq!(
        unused(&found),
        [
            "/mission/items/3: a complex item (survey), which is not read",
            "/mission/items/4: command 20, which no scenario has",
            "/mission/items/2: a stop on the way: a plan finds its own",
            "/geoFence/circles/1: a fence to stay within, where a scenario has a box, its area",
            "/geoFence/circles/2: a circle without center",
            "/rallyPoints/points/0: a rally point, which no scenario has",
        ]
    );
}

/// Beside a height above terrain, a ground station keeps the altitude above sea that it amounts to.
#[test]
fn ends_above_terrain_are_at_their_altitude_above_sea() {
    let item = |frame: u8, lat: f64, height: Value, above_sea: Value| {
        json!({"type": "SimpleItem", "command": 16, "frame": frame, "AMSLAltAboveTerrain": above_sea,
               "params": [0, 0, 0, null, lat, 8.5, height]})
    };
    let converted = |items: Value| {
        let plan = json!({
            "fileType": "Plan",
            "mission": {"plannedHomePosition": [47.2, 8.5, 480], "items": items},
        });
        convert(plan.to_string().as_bytes(), Syntax::Json)
    };
    let check = |items: Value, start: Value, target: Value| {
        let found = converted(items).expect("a scenario");
        assert_eq!(found.scenario["start"], start);
        assert_eq!(found.scenario["target"], target);
        let between = "a stop on the way: a plan finds its own";
        assert!(
            found.unused.iter().all(|unused| unused.reason == between),
            "{:?}",
            found.unused
        );
    };
    check(
        json!([
            item(10, 47.3, json!(60), json!(541.5)),
            item(10, 47.4, json!(60), json!(null)),
            item(11, 47.5, json!(40), json!(652.25)),
        ]),
        json!({"lat": 47.3, "lon": 8.5, "alt": 541.5}),
        json!({"lat": 47.5, "lon": 8.5, "alt": 652.25}),
    );
    check(
        json!([item(10, 47.5, json!(40), json!(652.25))]),
        json!({"lat": 47.2, "lon": 8.5, "alt": 480.0}),
        json!({"lat": 47.5, "lon": 8.5, "alt": 652.25}),
    );
    // In the other frames it is left aside: there, some files have what it was before.
    check(
        json!([
            item(3, 47.3, json!(60), json!(1)),
            item(0, 47.5, json!(530), json!(1))
        ]),
        json!({"lat": 47.3, "lon": 8.5, "alt": 540.0}),
        json!({"lat": 47.5, "lon": 8.5, "alt": 530.0}),
    );
    let known = item(0, 47.3, json!(500), json!(null));
    for (items, expected) in [
        (
            json!([known, item(10, 47.5, json!(40), json!(null))]),
            "the target, /mission/items/1, is 40 m above terrain (frame 10), and AMSLAltAboveTerrain is null, must be its altitude above sea",
        ),
        (
            json!([item(11, 47.5, json!(40), json!("high")), known]),
            "the start, /mission/items/0, is 40 m above terrain (frame 11), and AMSLAltAboveTerrain is \"high\", must be its altitude above sea",
        ),
        (
            json!([known, item(0, 47.5, json!(null), json!(null))]),
            "the target, /mission/items/1, has the altitude null, must be a number",
        ),
        (
            json!([known, item(7, 47.5, json!(40), json!(null))]),
            "the target, /mission/items/1, has frame 7, must be 0, 3, 5, 6, 10 or 11",
        ),
    ] {
        let refused = converted(items).expect_err(expected);
        assert_eq!(refused.to_string(), expected);
    }
}

#[test]
fn heights_above_home_are_summed_as_decimals() {
    let item = |lat: f64, height: f64| json!({"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, null, lat, 8.5, height]});
    let plan = json!({"fileType": "Plan", "mission": {
        "plannedHomePosition": [47.2, 8.5, 0.1], "items": [item(47.3, 0.2), item(47.4, 1e300)],
    }});
    let scenario = convert(plan.to_string().as_bytes(), Syntax::Json)
        .expect("a scenario")
        .scenario;
    assert_eq!(scenario["start"]["alt"], json!(0.3));
    assert_eq!(scenario["target"]["alt"], json!(1e300));
}

/// Whatever counts from an unknown home is not known either.
#[test]
fn ends_that_count_from_home_need_its_altitude() {
    let item = |command: u16, frame: u8, lat: f64| json!({"type": "SimpleItem", "command": command, "frame": frame, "params": [0, 0, 0, null, lat, 8.5, 50]});
    let converted = |home: &Value, items: &[Value]| {
        let plan =
            json!({"fileType": "Plan", "mission": {"plannedHomePosition": home, "items": items}});
        convert(plan.to_string().as_bytes(), Syntax::Json)
    };
    let (takeoff, landing) = (item(22, 3, 47.3), item(21, 3, 47.5));
    let (above_home, above_sea) = (item(16, 3, 47.4), item(16, 0, 47.5));
    for home in [
        json!([47.2, 8.5, null]),
        json!([47.2, 8.5]),
        json!([47.2, 8.5, "high"]),
    ] {
        let alt = &home[2];
        let counts = format!("counts from home, whose altitude is {alt}, must be a number");
        for (items, expected) in [
            (
                vec![takeoff.clone(), above_home.clone()],
                format!("the start, /mission/items/0, {counts}"),
            ),
            (
                vec![above_sea.clone(), above_home.clone()],
                format!("the target, /mission/items/1, {counts}"),
            ),
            (
                vec![above_sea.clone(), item(16, 6, 47.4)],
                format!("the target, /mission/items/1, {counts}"),
            ),
            (
                vec![above_sea.clone(), landing.clone()],
                format!("the target, /mission/items/1, {counts}"),
            ),
            (
                vec![above_sea.clone()],
                format!(
                    "the start, /mission/plannedHomePosition, has the altitude {alt}, must be a number"
                ),
            ),
        ] {
            let refused = converted(&home, &items).expect_err(&expected);
            assert_eq!(refused.to_string(), expected);
        }
        // What lies between the ends is not needed.
        let items = [above_sea.clone(), above_home.clone(), above_sea.clone()];
        let found = converted(&home, &items).expect("a scenario");
        assert_eq!(found.scenario["start"]["alt"], 50.0);
        assert_eq!(found.scenario["terrain"]["elevation"], 50.0);
    }

    // Without a home, each end that counts from it is named.
    let named = |items: &[Value]| {
        let found = converted(&json!(null), items).expect("a scenario");
        let ends = found.assumed.into_iter();
        let ends = ends.filter(|assumed| assumed.pointer.ends_with("/alt"));
        ends.map(|assumed| format!("{} {}", assumed.pointer, assumed.reason))
            .collect::<Vec<_>>()
    };
    assert_eq!(
        named(&[takeoff, above_home]),
        [
            "/start/alt 0: the file has no home, which is taken to be at 0 m",
            "/target/alt 50: the file has no home, which is taken to be at 0 m"
        ]
    );
    assert_eq!(named(&[above_sea.clone(), above_sea]), [""; 0]);
}

#[test]
fn the_fence_of_an_old_plan_is_listed_as_unused() {
    let check = |fence: Value, expected: &[&str]| {
        let item = json!({"type": "SimpleItem", "command": 16, "frame": 0, "params": [0, 0, 0, null, 47.3, 8.5, 50]});
        let plan =
            json!({"fileType": "Plan", "mission": {"items": [item, item]}, "geoFence": fence});
        let found = convert(plan.to_string().as_bytes(), Syntax::Json).expect("a scenario");
        assert_eq!(unused(&found), expected);
    };
    let corners = json!([[47.31, 8.51], [47.31, 8.52], [47.32, 8.52]]);
    check(
        json!({"version": 1, "polygon": corners}),
        &["/geoFence/polygon: a fence to stay within, where a scenario has a box, its area"],
    );
    check(json!({"version": 1, "polygon": []}), &[]);
    check(json!({"version": 2, "circles": [], "polygons": []}), &[]);
}

#[test]
fn vehicles_with_wings_fly_at_their_cruise_speed() {
    let check = |kind: Value, expected: f64| {
        let item = json!({"type": "SimpleItem", "command": 16, "frame": 0, "params": [0, 0, 0, null, 47.3, 8.5, 50]});
        let mission =
            json!({"vehicleType": kind, "cruiseSpeed": 15, "hoverSpeed": 5, "items": [item, item]});
        let plan = json!({"fileType": "Plan", "mission": mission});
        let found = convert(plan.to_string().as_bytes(), Syntax::Json).expect("a scenario");
        let speed = &found.scenario["vehicle"]["cruise_speed"];
        assert_eq!(*speed, expected, "{kind}");
    };
    for kind in [1, 19, 20, 21, 22, 23, 24, 25] {
        check(kind.into(), 15.0);
    }
    for kind in [0, 2, 13, 14, 18, 26] {
        check(kind.into(), 5.0);
    }
    check(json!(null), 5.0);
    check(json!("vtol"), 5.0);
}

#[test]
fn speeds_of_a_plan() {
    let check = |params: Value, expected: Result<f64, &str>| {
        let plan = json!({
            "fileType": "Plan",
            "mission": {"hoverSpeed": 5, "plannedHomePosition": [47.3, 8.5, 480], "items": [
                {"type": "SimpleItem", "command": 178, "frame": 2, "params": params},
                {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, null, 47.4, 8.6, 30]}]},
        });
        let found = convert(plan.to_string().as_bytes(), Syntax::Json).expect("a scenario");
        let (speed, reasons) = match expected {
            Ok(speed) => (speed, vec![]),
            Err(reason) => (5.0, vec![format!("/mission/items/0: {reason}")]),
        };
        assert_eq!(found.scenario["vehicle"]["cruise_speed"], speed, "{params}");
        assert_eq!(unused(&found), reasons);
    };
    check(json!([0, 12, -1, 0, 0, 0, 0]), Ok(12.0));
    check(json!([1.0, 12.5, -1, 0, 0, 0, 0]), Ok(12.5));
    for kind in [json!(2), json!(3), json!(null)] {
        let reason = format!("a speed of type {kind}, must be 0 (air) or 1 (ground)");
        check(json!([kind, 12, -1, 0, 0, 0, 0]), Err(&reason));
    }
    check(
        json!([1, -1, 50, 0, 0, 0, 0]),
        Err("speed is -1, must be > 0"),
    );
    check(
        json!([]),
        Err("a speed of type null, must be 0 (air) or 1 (ground)"),
    );
}

#[test]
fn the_last_of_several_speeds_counts_and_the_others_are_told() {
    let speed = |speed: f64| json!({"type": "SimpleItem", "command": 178, "frame": 2, "params": [1, speed, -1, 0, 0, 0, 0]});
    let plan = json!({
        "fileType": "Plan",
        "mission": {"plannedHomePosition": [47.3, 8.5, 480], "items": [speed(12.0), speed(20.0), speed(20.0),
            {"type": "SimpleItem", "command": 16, "frame": 0, "params": [0, 0, 0, null, 47.4, 8.6, 530]}]},
    });
    let found = convert(plan.to_string().as_bytes(), Syntax::Json).expect("a scenario");
    assert_eq!(found.scenario["vehicle"]["cruise_speed"], 20.0);
    assert_eq!(
        unused(&found),
        ["/mission/items/0: a speed that a later item changes, where a scenario has one"]
    );
}

/// Programs that do not know it write so; a mission elsewhere does not begin in the Gulf of Guinea.
#[test]
fn a_home_at_no_degrees_is_none() {
    let plan = json!({
        "fileType": "Plan",
        "mission": {"plannedHomePosition": [0, 0, 0], "items": [
            {"type": "SimpleItem", "command": 22, "frame": 3, "params": [0, 0, 0, null, 47.3, 8.5, 30]},
            {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, null, 47.4, 8.6, 30]}]},
    });
    let found = convert(plan.to_string().as_bytes(), Syntax::Json).expect("a scenario");
    assert_eq!(found.scenario["start"]["lat"], 47.3);
    let assumed: Vec<_> = found
        .assumed
        .iter()
        .map(|assumed| assumed.pointer.as_str())
        .collect();
    assert!(
        assumed.contains(&"/start/alt") && assumed.contains(&"/target/alt"),
        "{assumed:?}"
    );
}

/// It may be any value, and all items may count from it.
#[test]
fn a_long_value_in_place_of_an_altitude_is_told_once_and_shortened() {
    let item =
        json!({"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, 0, 1, 1, 1]});
    let plan = json!({
        "fileType": "Plan",
        "mission": {"plannedHomePosition": [1, 1, "x".repeat(1_000_000)], "items": vec![item; 2_000]},
    });
    let refused = convert(plan.to_string().as_bytes(), Syntax::Json).expect_err("no start");
    let text = refused.to_string();
    let begin = "the start, /mission/items/0, counts from home, whose altitude is \"xxx";
    assert!(text.starts_with(begin) && text.len() < 400, "{text}");
}

#[test]
fn a_landing_is_at_the_altitude_that_it_names() {
    let landed = |frame: u8, alt: Value| {
        let item = |command: u16, frame: u8, lat: f64, alt: Value| json!({"type": "SimpleItem", "command": command, "frame": frame, "params": [0, 0, 0, null, lat, 8.5, alt]});
        let items = [item(22, 3, 47.3, json!(30)), item(21, frame, 47.4, alt)];
        let mission = json!({"plannedHomePosition": [47.3, 8.5, 480], "items": items});
        let plan = json!({"fileType": "Plan", "mission": mission}).to_string();
        let found = convert(plan.as_bytes(), Syntax::Json).expect("a scenario");
        assert_eq!(found.scenario["start"]["alt"], 480.0);
        found.scenario["target"]["alt"].clone()
    };
    assert_eq!(landed(3, json!(-411.5)), 68.5);
    assert_eq!(landed(0, json!(70)), 70.0);
    for unsaid in [json!(0), json!(null)] {
        assert_eq!(landed(3, unsaid.clone()), 480.0);
        assert_eq!(landed(0, unsaid), 480.0);
    }
}

#[test]
fn a_mission_without_positions_is_refused_in_words_of_its_own() {
    let plan = json!({"fileType": "Plan", "mission": {"plannedHomePosition": [47.3, 8.5, 480], "items": []}});
    let refused = convert(plan.to_string().as_bytes(), Syntax::Json).expect_err("it has no ends");
    assert_eq!(
        refused.to_string(),
        "the mission has no item with a position: its first and its last one make start and target"
    );
}

#[test]
fn an_end_that_the_request_gives_is_not_needed_in_a_plan() {
    let item = |lat: f64, alt: Value| json!({"type": "SimpleItem", "command": 16, "frame": 0, "params": [0, 0, 0, null, lat, 8.5, alt]});
    let converted = |items: &[Value], start: Option<&str>, target: Option<&str>| {
        let end = |text: &str| text.parse::<End>().expect("an end");
        let flight = Flight {
            start: start.map(end),
            target: target.map(end),
            within_m: None,
        };
        let mission = json!({"plannedHomePosition": [47.2, 8.5, null], "items": items});
        let plan = json!({"fileType": "Plan", "mission": mission}).to_string();
        super::super::convert(plan.as_bytes(), Syntax::Json, MOST, &flight)
    };
    let (start, target) = (Some("47.1,8.2,500"), Some("47.6,8.3,520"));
    let start_is = json!({"lat": 47.1, "lon": 8.2, "alt": 500.0});
    let target_is = json!({"lat": 47.6, "lon": 8.3, "alt": 520.0});
    let takeoff = json!({"type": "SimpleItem", "command": 22, "frame": 3, "params": [0, 0, 0, null, 47.3, 8.5, 30]});
    let (unknown, known) = (item(47.4, json!(null)), item(47.5, json!(530)));

    let home_is_left = "/mission/plannedHomePosition: another point is the start already";
    let start_is_left = "/mission/items/0: another point is the start already";
    let target_is_left =
        |index: usize| format!("/mission/items/{index}: another point is the target already");
    for (items, left) in [
        (vec![], vec![]),
        (
            vec![unknown.clone()],
            vec![home_is_left.to_owned(), target_is_left(0)],
        ),
        (
            vec![takeoff, unknown.clone()],
            vec![start_is_left.to_owned(), target_is_left(1)],
        ),
    ] {
        let found = converted(&items, start, target).expect("a scenario");
        assert_eq!(found.scenario["start"], start_is);
        assert_eq!(found.scenario["target"], target_is);
        assert_eq!(unused(&found), left);
        let mut assumed = found.assumed.iter();
        assert!(assumed.all(|assumed| !assumed.pointer.ends_with("/alt")));
    }

    let items = [unknown.clone(), known];
    let found = converted(&items, start, None).expect("a scenario");
    assert_eq!(found.scenario["start"], start_is);
    assert_eq!(found.scenario["target"]["alt"], 530.0);
    assert_eq!(unused(&found), [start_is_left]);

    // The other end still is.
    for (items, expected) in [
        (
            items.to_vec(),
            "the start, /mission/items/0, has the altitude null, must be a number",
        ),
        (
            vec![unknown],
            "the start, /mission/plannedHomePosition, has the altitude null, must be a number",
        ),
        (
            vec![],
            "the mission has no item with a position: its first and its last one make start and target",
        ),
    ] {
        let refused = converted(&items, None, target).expect_err(expected);
        assert_eq!(refused.to_string(), expected);
    }
}
