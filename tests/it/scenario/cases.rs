//! One document per fault: what is replaced in the full document, and the fault reported.

use noctule::scenario::json::Fault;

use super::edited;

/// The text replaced, its replacement, and the one fault this causes: pointer, code, detail.
type Case = (
    &'static str,
    &'static str,
    &'static str,
    &'static str,
    &'static str,
);

const CASES: &[Case] = &[
    (
        r#""altitude":{"min":10,"max":200},"#,
        "",
        "/altitude",
        "missing-field",
        "altitude is missing, must be given",
    ),
    (
        r#""radius":60,"#,
        "",
        "/threats/0/radius",
        "missing-field",
        "radius is missing, must be given",
    ),
    (
        r#""kind":"polygon","#,
        "",
        "/threats/1/kind",
        "missing-field",
        "kind is missing, must be one of cylinder, polygon",
    ),
    (
        r#""max_turn_deg""#,
        r#""maxTurnDeg""#,
        "/vehicle/maxTurnDeg",
        "unknown-field",
        "\"maxTurnDeg\" is no field here, allowed: max_turn_deg, max_climb_deg, min_leg, cruise_speed, fuel_per_km, \
         did you mean max_turn_deg?",
    ),
    (
        r#""margin":30"#,
        r#""radius":30"#,
        "/threats/1/radius",
        "unknown-field",
        "\"radius\" is no field here, allowed: kind, name, vertices, margin, base, top",
    ),
    (
        r#""frame":"local","#,
        r#""a/b~":1,"#,
        "/a~1b~0",
        "unknown-field",
        "\"a/b~\" is no field here, allowed: name, frame, altitude_datum, start, target, area, threats, terrain, \
         altitude, vehicle, weights, planner",
    ),
    (
        r#""radius":60,"#,
        r#""radius":60,"radius":61,"#,
        "/threats/0/radius",
        "duplicate-key",
        "radius is given twice, must be given once",
    ),
    (
        r#""loudness":0.5"#,
        r#""loudness":0.5,"loudness":0.5"#,
        "/planner/parameters/loudness",
        "duplicate-key",
        "loudness is given twice, must be given once",
    ),
    (
        r#""cell":500"#,
        r#""cell":"500""#,
        "/terrain/cell",
        "wrong-type",
        "cell is \"500\", must be a number",
    ),
    (
        r#""weights":{"fuel":0.5,"threat":1,"altitude":1}"#,
        r#""weights":1"#,
        "/weights",
        "wrong-type",
        "weights is 1, must be an object",
    ),
    (
        r#""polish":false"#,
        r#""polish":0"#,
        "/planner/polish",
        "wrong-type",
        "polish is 0, must be true or false",
    ),
    (
        r#""influence":90"#,
        r#""influence":null"#,
        "/threats/0/influence",
        "wrong-type",
        "influence is null, must be a number",
    ),
    (
        r#"{"x":500,"y":500},"#,
        "1,",
        "/threats/1/vertices/0",
        "wrong-type",
        "vertices[0] is 1, must be an object",
    ),
    (
        "0,0,0,0,100]",
        "0,0,[],0,100]",
        "/terrain/elevations/6",
        "wrong-type",
        "elevations[6] is an array, must be a number",
    ),
    (
        r#""radius":60"#,
        r#""radius":-3"#,
        "/threats/0/radius",
        "out-of-range",
        "radius is -3, must be > 0",
    ),
    (
        r#""x":350"#,
        r#""x":1e300"#,
        "/threats/0/center/x",
        "out-of-range",
        "x is 1e+300, must be >= -10000000 and <= 10000000",
    ),
    (
        r#""max_climb_deg":45"#,
        r#""max_climb_deg":90"#,
        "/vehicle/max_climb_deg",
        "out-of-range",
        "max_climb_deg is 90, must be > 0 and < 90",
    ),
    (
        r#""seed":7"#,
        r#""seed":9007199254740993"#,
        "/planner/seed",
        "out-of-range",
        "seed is 9007199254740993, must be >= 0 and <= 9007199254740991",
    ),
    (
        r#""seed":7"#,
        r#""seed":-7"#,
        "/planner/seed",
        "out-of-range",
        "seed is -7, must be >= 0",
    ),
    (
        r#""degree":3"#,
        r#""degree":6"#,
        "/planner/smoothing/degree",
        "out-of-range",
        "degree is 6, must be >= 1 and <= 5",
    ),
    (
        r#""loudness":0.5"#,
        r#""loudness":1.5"#,
        "/planner/parameters/loudness",
        "out-of-range",
        "loudness is 1.5, must be >= 0 and <= 1",
    ),
    (
        r#""waypoints":8"#,
        r#""waypoints":0"#,
        "/planner/waypoints",
        "out-of-range",
        "waypoints is 0, must be >= 1",
    ),
    (
        r#""waypoints":8"#,
        r#""waypoints":8.5"#,
        "/planner/waypoints",
        "not-an-integer",
        "waypoints is 8.5, must be a whole number",
    ),
    (
        "100]},\n\"altitude\"",
        "100,7]},\n\"altitude\"",
        "/terrain/elevations",
        "wrong-length",
        "elevations has 10 items, must have columns * rows = 9",
    ),
    (
        r#""waypoints":8"#,
        r#""waypoints":201"#,
        "/planner/waypoints",
        "too-many",
        "waypoints is 201, must be <= 200 (limit waypoints)",
    ),
    (
        r#""columns":3,"rows":3"#,
        r#""columns":2001,"rows":2000"#,
        "/terrain/elevations",
        "too-many",
        "the grid has 4002000 nodes, must have at most 4000000 (limit terrain_nodes)",
    ),
    (
        r#""spacing":5"#,
        r#""spacing":0.01"#,
        "/planner/smoothing/spacing",
        "too-many",
        "spacing is 0.01 over 1073.546 m from start to target, which makes 107356 samples, \
         must make at most 50000 (limit path_samples)",
    ),
    (
        r#""waypoints":8,"population":40,"iterations":30"#,
        r#""waypoints":200,"population":10000,"iterations":100000"#,
        "/planner",
        "too-much-work",
        "population * iterations * waypoints is 10000 * 100000 * 200 = 200000000000, must be <= 4000000000 (limit work)",
    ),
    (
        r#""kind":"cylinder""#,
        r#""kind":"sphere""#,
        "/threats/0/kind",
        "unknown-value",
        "kind is \"sphere\", must be one of cylinder, polygon",
    ),
    (
        r#""quadrature":"paper""#,
        r#""quadrature":"simpson""#,
        "/planner/parameters/quadrature",
        "unknown-value",
        "quadrature is \"simpson\", must be one of integral, paper",
    ),
    (
        r#""seeding":"random""#,
        r#""seeding":"magic""#,
        "/planner/seeding",
        "unknown-value",
        "seeding is \"magic\", must be one of tangent, random",
    ),
    (
        r#""warm_start":null"#,
        r#""warm_start":{}"#,
        "/planner/warm_start/plan_id",
        "missing-field",
        "plan_id is missing, and so is waypoints: one of them must be given",
    ),
    (
        r#""warm_start":null"#,
        r#""warm_start":{"waypoints":[{"x":1,"y":2}]}"#,
        "/planner/warm_start/waypoints/0/z",
        "missing-field",
        "z is missing, must be given",
    ),
    (
        r#""quadrature":"paper""#,
        r#""gap":-0.5"#,
        "/planner/parameters/gap",
        "out-of-range",
        "gap is -0.5, must be >= 0 and <= 10",
    ),
    (
        r#""quadrature":"paper""#,
        r#""threads":0"#,
        "/planner/parameters/threads",
        "out-of-range",
        "threads is 0, must be >= 1 and <= 256",
    ),
    (
        r#""frame":"local""#,
        r#""frame":"local","altitude_datum":"msl""#,
        "/altitude_datum",
        "not-applicable",
        "altitude_datum is given, must be left out where frame is local",
    ),
    (
        r#""warm_start":null"#,
        r#""warm_start":{"plan_id":"x","waypoints":[]}"#,
        "/planner/warm_start/waypoints",
        "not-applicable",
        "waypoints is given, must be left out where plan_id is given",
    ),
    (
        r#""tms-sba""#,
        r#""tms-sab""#,
        "/planner/algorithm",
        "unknown-algorithm",
        "algorithm is \"tms-sab\", must be one of tms-sba, sba, did you mean tms-sba?",
    ),
    (
        r#""loudness":0.5"#,
        r#""loundess":0.5"#,
        "/planner/parameters/loundess",
        "unknown-parameter",
        "\"loundess\" is no parameter of tms-sba, allowed: quadrature, gap, threads, f_min, loudness, did you mean loudness?",
    ),
    (
        r#""influence":90"#,
        r#""influence":59"#,
        "/threats/0/influence",
        "influence-below-radius",
        "influence is 59, must be >= radius, which is 60",
    ),
    (
        r#""base":null,"top":500"#,
        r#""base":500,"top":500"#,
        "/threats/0/base",
        "base-above-top",
        "base is 500, must be < top, which is 500",
    ),
    (
        r#"{"x":550,"y":600}"#,
        r#"{"x":700,"y":500}"#,
        "/threats/1/vertices",
        "degenerate-polygon",
        "vertices all lie on one line, must enclose an area",
    ),
    (
        r#"{"x":550,"y":600}"#,
        r#"{"x":500,"y":500}"#,
        "/threats/1/vertices",
        "degenerate-polygon",
        "vertices has 2 different points, must have at least 3",
    ),
    (
        r#"{"x":550,"y":600}"#,
        r#"{"x":550,"y":600},{"x":550,"y":600}"#,
        "/threats/1/vertices",
        "degenerate-polygon",
        "vertices 2 and 3 are the same point, must be different",
    ),
    (
        r#"{"x":550,"y":600}"#,
        r#"{"x":500,"y":600},{"x":600,"y":600}"#,
        "/threats/1/vertices",
        "self-crossing-polygon",
        "the edges from vertices 1 and 3 cross or touch, must meet nowhere but at their ends",
    ),
    (
        r#""max":{"x":1000,"y":1000}"#,
        r#""max":{"x":1000,"y":0}"#,
        "/area",
        "empty-area",
        "area runs from (0, 0) to (1000, 0), must have min < max in both x and y",
    ),
    (
        r#""max":{"x":1000,"y":1000}"#,
        r#""max":{"x":1001,"y":1000}"#,
        "/area",
        "area-outside-terrain",
        "area runs from (0, 0) to (1001, 1000), must lie in the terrain grid, from (0, 0) to (1000, 1000)",
    ),
    (
        r#"{"min":10,"max":200}"#,
        r#"{"min":200,"max":200}"#,
        "/altitude",
        "empty-altitude-band",
        "altitude runs from 200 to 200, must have min < max",
    ),
    (
        r#""x":100,"y":100,"z":0"#,
        r#""x":100,"y":100,"z":-0.5"#,
        "/start",
        "below-ground",
        "start has z -0.5, must be at most 0.1 m below the ground, which is at 0",
    ),
    (
        r#""y":800,"z":150"#,
        r#""y":800,"z":47"#,
        "/target",
        "below-ground",
        "target has z 47, must be at most 0.1 m below the ground, which is at 48",
    ),
    (
        r#""x":100,"y":100,"z":0"#,
        r#""x":320,"y":210,"z":0"#,
        "/start",
        "start-in-threat",
        "start is 50 m from the axis of threats/0 (\"radar\"), must be >= its radius 60",
    ),
    (
        r#""x":900,"y":800"#,
        r#""x":550,"y":520"#,
        "/target",
        "target-in-threat",
        "target is inside the polygon threats/1, must be outside",
    ),
    (
        r#""min":{"x":0,"y":0}"#,
        r#""min":{"x":200,"y":0}"#,
        "/start",
        "outside-area",
        "start is at (100, 100), must lie in the area, from (200, 0) to (1000, 1000)",
    ),
    (
        r#""start":{"x":100,"y":100,"z":0},"target":{"x":900,"y":800,"z":150},
"area":{"min":{"x":0,"y":0},"max":{"x":1000,"y":1000}},"#,
        r#""start":{"x":-1,"y":100,"z":0},"target":{"x":900,"y":800,"z":150},"#,
        "/start",
        "outside-terrain",
        "start is at (-1, 100), must lie in the terrain grid, from (0, 0) to (1000, 1000)",
    ),
    (
        r#""x":900,"y":800,"z":150"#,
        r#""x":100,"y":100,"z":0"#,
        "/target",
        "target-is-start",
        "target is 0 m from start, must be more than 0.000001 m away",
    ),
    (
        r#""x":900,"y":800,"z":150"#,
        r#""x":100,"y":100,"z":90"#,
        "/target",
        "target-above-start",
        "target is 0 m from start seen from above, must be at least 0.001 m",
    ),
];

/// All cases, including those that take more than a replacement: the document and its one fault.
pub(crate) fn all_cases() -> Vec<(String, Fault)> {
    let fault = |pointer: &str, code, detail: &str| Fault {
        pointer: pointer.to_owned(),
        code,
        detail: detail.to_owned(),
    };
    let mut cases: Vec<(String, Fault)> = CASES
        .iter()
        .map(|(from, to, pointer, code, detail)| (edited(from, to), fault(pointer, code, detail)))
        .collect();
    let long_name = edited(
        r#""name":"full""#,
        &format!(r#""name":"{}""#, "n".repeat(201)),
    );
    cases.push((
        long_name,
        fault(
            "/name",
            "too-long",
            "name has 201 characters, must have at most 200",
        ),
    ));
    let threat = r#"{"kind":"cylinder","center":{"x":350,"y":250},"radius":1},"#;
    let crowded = edited(
        r#""threats":["#,
        &format!(r#""threats":[{}"#, threat.repeat(9_999)),
    );
    let detail = "threats has 10001 items, must have at most 10000 (limit threats)";
    cases.push((crowded, fault("/threats", "too-many", detail)));
    let known = r#"{"x":1,"y":2,"z":3},"#.repeat(203);
    let winding = edited(
        r#""warm_start":null"#,
        &format!(
            r#""warm_start":{{"waypoints":[{}]}}"#,
            known.trim_end_matches(',')
        ),
    );
    let detail = "waypoints has 203 items, must have at most 202 (limit waypoints, and both ends)";
    let pointer = "/planner/warm_start/waypoints";
    cases.push((winding, fault(pointer, "too-many", detail)));
    let vertices = r#"{"x":500,"y":500},"#.repeat(20_000);
    let detailed = edited(r#""vertices":["#, &format!(r#""vertices":[{vertices}"#));
    let detail = "the polygons have 20003 vertices together, must have at most 20000 (limit polygon_vertices)";
    cases.push((detailed, fault("/threats", "too-many", detail)));
    let in_degrees = super::wgs84::cases().into_iter();
    let in_degrees = in_degrees.chain(super::dataset::cases());
    cases.extend(
        in_degrees
            .map(|(document, pointer, code, detail)| (document, fault(pointer, code, detail))),
    );
    cases
}
