//! The bound of whole scenarios, compared with the best known routes.

use super::super::tests::{among, disc, read, scenario};
use super::*;
use crate::geometry::Point3;
use crate::scenario::Weights;

/// From ground to ground, with bands above it.
#[test]
fn the_bound_is_within_half_a_percent_with_take_off_and_landing() {
    let check = |document: &str, [min, max]: [u32; 2], best: f64| {
        let band = format!(r#""min": {min}, "max": {max}"#);
        let document = document.replace(r#""min": 0, "max": 200"#, &band);
        let document = document.replace(r#""z": 150"#, r#""z": 0"#);
        let bound = lower_bound(&read(&document));
        assert!(bound <= best, "{bound} {best}");
        assert!(best / bound - 1.0 <= 0.005, "{bound} {best}");
    };
    let [one, two] = [
        include_str!("../../../scenarios/paper-1.json"),
        include_str!("../../../scenarios/paper-2.json"),
    ];
    check(one, [60, 260], 517.6716);
    check(one, [100, 300], 531.1);
    check(two, [30, 120], 510.5145);
}

/// The best route round it is known from a search of its true ring.
#[test]
fn the_bound_is_within_half_a_percent_beside_a_ring_of_a_thousand_corners() {
    let corner = |idx: i32| {
        let angle = std::f64::consts::TAU / 1000.0 * f64::from(idx);
        let (sin, cos) = libm::sincos(angle);
        let away = 200.0 + 60.0 * libm::sin(3.0 * angle) + 15.0 * libm::sin(20.0 * angle);
        format!(
            r#"{{"x": {}, "y": {}}}"#,
            500.0 + away * cos,
            450.0 + away * sin
        )
    };
    let corners: Vec<String> = (0..1000).map(corner).collect();
    let bound = lower_bound(&scenario(&format!(
        r#""threats": [{{"kind": "polygon", "margin": 30, "vertices": [{}]}}]"#,
        corners.join(", ")
    )));
    let best = 544.7142;
    assert!(bound <= best && best / bound <= 1.005, "{bound} {best}");
}

/// Where only length counts, the way out of the zone around each end may be flown in any number of legs.
#[test]
fn the_bound_counts_the_climb_out_of_the_zones_around_both_ends() {
    let mut scenario = scenario(
        r#""threats": [{"kind": "cylinder", "center": {"x": 500, "y": 520}, "radius": 50}]"#,
    );
    (scenario.start.z, scenario.target.z) = (0.0, 0.0);
    (scenario.altitude.min, scenario.altitude.max) = (60.0, 260.0);
    scenario.weights.altitude = 0.0;
    let climbing = lower_bound(&scenario);
    (scenario.altitude.min, scenario.altitude.max) = (0.0, 260.0);
    let level = lower_bound(&scenario);
    let zone = 0.5 * (libm::hypot(120.0, 60.0) - 120.0);
    assert!(
        (climbing - level - 2.0 * zone).abs() < 1e-3,
        "{climbing} {level} {zone}"
    );
}

/// Strings account for neither effect: the last leg climbs through the target's soft zone, and the best route
/// leaves the string where it can go straight ahead.
#[test]
fn the_bound_is_within_a_percent_where_the_last_leg_climbs_out_of_a_gap() {
    let discs = [
        [916, 787, 66, 105],
        [406, 734, 75, 112],
        [88, 76, 25, 54],
        [91, 829, 30, 61],
        [447, 462, 57, 97],
        [990, 272, 45, 71],
        [613, 65, 66, 96],
        [187, 830, 50, 74],
    ];
    let mut scenario = among(discs.map(|numbers: [i32; 4]| numbers.map(f64::from)));
    scenario.start = Point3::new(63.6, 94.9, 75.4);
    scenario.target = Point3::new(847.9, 817.0, 145.5);
    (scenario.altitude.min, scenario.altitude.max) = (0.0, 200.0);
    scenario.planner.waypoints = 18;
    let (bound, best) = (lower_bound(&scenario), 746.7366);
    assert!(bound <= best && bound > 0.99 * best, "{bound} {best}");
}

/// The minimum leg length leaves this slowly climbing vehicle no other way than the known route.
#[test]
fn the_bound_is_within_a_thousandth_with_long_legs_and_slow_climbs() {
    let mut scenario = scenario(r#""threats": []"#);
    scenario.start = Point3::new(78.0, 83.6, 20.5);
    scenario.target = Point3::new(799.6, 804.0, 138.7);
    (scenario.altitude.min, scenario.altitude.max) = (0.0, 200.0);
    scenario.vehicle.max_climb_deg = 15.1;
    scenario.vehicle.min_leg = 38.4;
    scenario.planner.waypoints = 19;
    let (bound, best) = (lower_bound(&scenario), 554.0766);
    assert!(bound <= best && bound > 0.999 * best, "{bound} {best}");
}

/// The best known routes, from long searches, are upper bounds of the optimum.
#[test]
fn the_bound_is_within_its_gap_of_the_best_known_paper_routes() {
    let check = |document: &str, best: f64, gap: f64| {
        let bound = lower_bound(&read(document));
        assert!(bound <= best, "{bound} {best}");
        assert!(best / bound - 1.0 <= gap, "{bound} {best}");
    };
    check(
        include_str!("../../../scenarios/paper-1.json"),
        489.4413,
        0.02,
    );
    check(
        include_str!("../../../scenarios/paper-2.json"),
        505.1495,
        0.02,
    );
    check(
        include_str!("../../../scenarios/paper-3.json"),
        519.4687,
        0.02,
    );
    check(
        include_str!("../../../scenarios/paper-4.json"),
        525.6264,
        0.20,
    );
}

/// Start and target in soft zones that block each other, with three gaps between: the best known route has 30
/// waypoints.
#[test]
fn the_bound_is_within_a_percent_through_soft_zones_and_gaps() {
    let mut scenario = scenario(
        r#""threats": [
            {"kind": "cylinder", "center": {"x": 240, "y": 150}, "radius": 45, "influence": 75},
            {"kind": "cylinder", "center": {"x": 440, "y": 470}, "radius": 60, "influence": 90},
            {"kind": "cylinder", "center": {"x": 560, "y": 370}, "radius": 65, "influence": 95},
            {"kind": "cylinder", "center": {"x": 330, "y": 580}, "radius": 60, "influence": 90},
            {"kind": "cylinder", "center": {"x": 690, "y": 290}, "radius": 60, "influence": 90},
            {"kind": "polygon", "margin": 30, "vertices": [{"x": 760, "y": 740}, {"x": 800, "y": 740},
                {"x": 800, "y": 780}, {"x": 760, "y": 780}]}
        ]"#,
    );
    (scenario.start.z, scenario.target.z) = (100.0, 100.0);
    let (bound, best) = (lower_bound(&scenario), 598.893);
    assert!(bound <= best && bound > 0.99 * best, "{bound} {best}");
}

/// A start low in two wide soft zones, out of which every leg climbs: the best known route has 20 waypoints.
#[test]
fn the_bound_is_within_two_percent_where_a_leg_climbs_in_soft_zones() {
    let mut scenario = among([
        [344.0, 72.0, 17.0, 252.0],
        [156.0, 557.0, 30.0, 107.0],
        [642.0, 264.0, 34.0, 276.0],
        [413.0, 238.0, 50.0, 140.0],
    ]);
    scenario.start = Point3::new(237.0, 222.0, 28.0);
    scenario.target = Point3::new(743.0, 892.0, 89.0);
    let (bound, best) = (lower_bound(&scenario), 976.19);
    assert!(bound <= best && bound > 0.98 * best, "{bound} {best}");
}

/// Ends low in soft zones that could be flown over only with room to climb: the best known route has 30 waypoints.
#[test]
fn the_bound_is_within_a_percent_where_threats_cannot_be_overflown_immediately() {
    let mut scenario = scenario(
        r#""threats": [
            {"kind": "cylinder", "center": {"x": 166, "y": 232}, "radius": 58, "influence": 85, "top": 106},
            {"kind": "cylinder", "center": {"x": 270, "y": 483}, "radius": 54, "influence": 93, "top": 154}
        ]"#,
    );
    scenario.start = Point3::new(162.0, 168.0, 19.0);
    scenario.target = Point3::new(820.0, 844.0, 139.0);
    (scenario.weights.fuel, scenario.weights.altitude) = (0.3, 3.0);
    let (bound, best) = (lower_bound(&scenario), 395.560);
    assert!(bound <= best && bound > 0.99 * best, "{bound} {best}");
}

/// The target is 9 m above the top of a disc on the way: a last leg over the disc cannot come from near the middle of
/// the band.
#[test]
fn the_bound_is_within_a_percent_where_the_last_leg_passes_over_a_top() {
    let mut scenario = scenario(
        r#""threats": [
            {"kind": "cylinder", "center": {"x": 819, "y": 715}, "radius": 79, "influence": 116, "top": 139},
            {"kind": "cylinder", "center": {"x": 727, "y": 479}, "radius": 99, "influence": 119, "base": 70},
            {"kind": "cylinder", "center": {"x": 414, "y": 117}, "radius": 94, "influence": 131}
        ]"#,
    );
    scenario.start = Point3::new(215.0, 56.0, 145.0);
    scenario.target = Point3::new(932.0, 777.0, 148.0);
    scenario.weights.fuel = 1.0;
    scenario.planner.waypoints = 20;
    let (bound, best) = (lower_bound(&scenario), 1066.6164);
    assert!(bound <= best && bound > 0.99 * best, "{bound} {best}");
}

/// The gain from cutting corners may exceed the way; and a route may pass through anything thinner than its
/// tolerance.
#[test]
fn the_bound_never_exceeds_a_way_through_negligible_obstacles() {
    let check = |ring: &str, fuel: f64, threat: f64| {
        let mut scenario = scenario(&format!(
            r#""threats": [{{"kind": "polygon", "margin": 60, "vertices": [{ring}]}}]"#
        ));
        scenario.weights.fuel = fuel;
        scenario.weights.threat = threat;
        scenario.weights.altitude = 0.0;
        let straight = fuel * scenario.direct();
        let bound = lower_bound(&scenario);
        assert!(bound <= straight, "{bound} {straight}");
    };
    // Both obstacles are out of the way, including their soft zones.
    let triangle = r#"{"x": 900, "y": 0}, {"x": 990, "y": 0}, {"x": 950, "y": 90}"#;
    check(triangle, 1e-6, 1000.0);
    let needle = r#"{"x": 900, "y": 0}, {"x": 900.001, "y": 0}, {"x": 900, "y": 100}"#;
    check(needle, 0.5, 1000.0);
    // Half a micrometre wide where the way crosses it.
    check(
        r#"{"x": 0, "y": 500}, {"x": 0, "y": 500.000003}, {"x": 640, "y": 500}"#,
        0.5,
        0.0,
    );
    // A block with an arm one micrometre wide.
    check(
        r#"{"x": 0, "y": 900}, {"x": 0, "y": 500}, {"x": 900, "y": 500},
           {"x": 900, "y": 500.000001}, {"x": 50, "y": 500.000001}, {"x": 50, "y": 900}"#,
        0.5,
        0.0,
    );
}

/// A comb with close teeth: nearly as many pairs as teeth squared, each involving all teeth.
#[test]
fn a_stop_is_noticed_while_gaps_are_examined() {
    let teeth = 20;
    let corners: Vec<String> = (0..=2 * teeth)
        .map(|corner| {
            format!(
                r#"{{"x": {}, "y": {}}}"#,
                500 + corner,
                600 - 50 * (corner % 2)
            )
        })
        .chain([format!(r#"{{"x": {}, "y": 650}}"#, 500 + teeth)])
        .collect();
    let scenario = scenario(&format!(
        r#""threats": [{{"kind": "polygon", "margin": 60, "vertices": [{}]}}]"#,
        corners.join(", ")
    ));
    let prices = Prices::of(&scenario);
    let walls = widening::walls(&scenario, &prices);
    assert!(event::events(&walls, &prices, &|| false).is_some());
    let looks = Cell::new(0);
    let stop = || {
        looks.set(looks.get() + 1);
        looks.get() > 2
    };
    assert!(event::events(&walls, &prices, &stop).is_none());
    assert_eq!(looks.get(), 3);
}

#[test]
fn the_bound_is_never_below_the_straight_line() {
    let scenario = scenario(r#""threats": []"#);
    let straight = 0.5 * scenario.direct();
    assert!(lower_bound(&scenario) >= straight * (1.0 - 1e-8));
}

/// To touch is not to enter: threats that touch leave a way between them, and so do some that overlap by less than
/// routes may enter them.
#[test]
fn routes_may_pass_where_threats_touch() {
    let block = |y: f64| {
        format!(
            r#"{{"x": -1500, "y": {y}}}, {{"x": 2500, "y": {y}}}, {{"x": 2500, "y": 2500}}, {{"x": -1500, "y": 2500}}"#
        )
    };
    let tip = r#"{"x": 500, "y": 600}, {"x": 480, "y": 0}, {"x": 520, "y": 0}"#;
    let flush =
        r#"{"x": 495, "y": 600}, {"x": 505, "y": 600}, {"x": 505, "y": 0}, {"x": 495, "y": 0}"#;
    let ring = |vertices: &str, margin: f64| {
        format!(r#"{{"kind": "polygon", "margin": {margin}, "vertices": [{vertices}]}}"#)
    };
    let bound = |[one, other]: [&str; 2], [x, y]: [f64; 2]| {
        lower_bound(&read(&format!(
            r#"{{ "frame": "local",
                "start": {{ "x": {x}, "y": {y}, "z": 100 }}, "target": {{ "x": {}, "y": {y}, "z": 100 }},
                "area": {{ "min": {{ "x": -2000, "y": -2000 }}, "max": {{ "x": 3000, "y": 3000 }} }},
                "altitude": {{ "min": 0, "max": 200 }},
                "vehicle": {{ "max_turn_deg": 180, "max_climb_deg": 45, "fuel_per_km": 1000 }},
                "weights": {{ "fuel": 1, "threat": 1, "altitude": 1 }},
                "planner": {{ "algorithm": "tms-sba" }}, "threats": [{one}, {other}] }}"#,
            1000.0 - x
        )))
    };
    // Totals of feasible routes through the common point.
    for (vertices, margin, total) in [
        (tip, 10.0, 418.526),
        (tip, 30.0, 880.094),
        (flush, 10.0, 459.276),
        (flush, 30.0, 993.104),
    ] {
        let threats = [&ring(&block(600.0), margin), &ring(vertices, margin)];
        let bound = bound(threats.map(String::as_str), [350.0, 500.0]);
        assert!(bound > 300.0 && bound <= total, "{bound} {total}");
    }
    let disc = r#"{"kind": "cylinder", "center": {"x": 500, "y": -699.9999893933983}, "radius": 1200, "influence": 1200}"#;
    let threats = [&*ring(&block(500.0), 0.0), disc];
    let bound = bound(threats, [0.0, 440.0]);
    assert!(bound > 1000.0 && bound <= 1033.239, "{bound}");
}

/// A waypoint pays for its height once, whether it is beyond a threat or on the way to the middle of the band.
#[test]
fn the_height_of_a_waypoint_beyond_a_threat_is_counted_once() {
    for (width, limit, z, waypoints, weight, total) in [
        (20.0, r#""base": 50"#, 51.0, 1, 1.0, 850.03),
        (20.0, r#""top": 150"#, 149.0, 1, 0.1, 805.006),
        (200.0, r#""base": 50"#, 51.0, 2, 0.1, 809.917),
    ] {
        let [west, east] = [500.0 - 0.5 * width, 500.0 + 0.5 * width];
        let mut scenario = scenario(&format!(
            r#""threats": [{{"kind": "polygon", {limit}, "vertices": [{{"x": {west}, "y": -3000}}, {{"x": {east}, "y": -3000}}, {{"x": {east}, "y": 4000}}, {{"x": {west}, "y": 4000}}]}}]"#
        ));
        scenario.start = Point3::new(100.0, 500.0, z);
        scenario.target = Point3::new(900.0, 500.0, z);
        scenario.weights = Weights {
            fuel: 1.0,
            threat: 1.0,
            altitude: weight,
        };
        scenario.planner.waypoints = waypoints;
        let bound = lower_bound(&scenario);
        assert!(bound > 0.99 * total && bound <= total, "{bound} {total}");
    }
}

/// A zone without room for its widened wall beside a polygon without margin, or beside the border: narrowed to touch it,
/// the wall leaves a way there. A feasible route through the gap, with the start in the zone, costs 187.935.
#[test]
fn a_wall_that_just_touches_a_polygon_or_the_border_leaves_a_way() {
    let polygon = r#", { "kind": "polygon", "margin": 0, "vertices": [{ "x": -99, "y": -99 }, { "x": 0, "y": -99 },
        { "x": 0, "y": 300 }, { "x": -99, "y": 300 }] }"#;
    for (west, polygon) in [(-100, polygon), (0, "")] {
        let scenario = read(&format!(
            r#"{{ "frame": "local", "start": {{ "x": 0.7, "y": 108.8, "z": 32 }}, "target": {{ "x": 142.3, "y": 59.5, "z": 32.4 }},
                "area": {{ "min": {{ "x": {west}, "y": -100 }}, "max": {{ "x": 304, "y": 304 }} }},
                "altitude": {{ "min": 12.2, "max": 61 }},
                "vehicle": {{ "max_turn_deg": 180, "max_climb_deg": 89, "fuel_per_km": 1000 }},
                "weights": {{ "fuel": 1, "threat": 100, "altitude": 0 }},
                "threats": [
                    {{ "kind": "cylinder", "center": {{ "x": 1, "y": 119.8 }}, "radius": 6.8, "influence": 11 }},
                    {{ "kind": "cylinder", "center": {{ "x": 7.6, "y": 106.5 }}, "radius": 7.2, "influence": 8 }}{polygon}
                ] }}"#
        ));
        let bound = lower_bound(&scenario);
        assert!(bound > 149.0 && bound <= 187.935, "{bound}");
    }
}

/// A wall that reaches over the border is gone round inside the area; a disc near the border may be passed beside it.
#[test]
fn strings_stay_inside_the_area() {
    let bound = |threats: &str, y: f64| {
        let mut scenario = scenario(&format!(r#""threats": [{threats}]"#));
        scenario.start = Point3::new(100.0, y, 100.0);
        scenario.target = Point3::new(900.0, y, 100.0);
        scenario.weights.fuel = 1.0;
        lower_bound(&scenario)
    };
    let slab = |west: u32, [south, north]: [i32; 2]| {
        let east = west + 20;
        format!(
            r#"{{"kind": "polygon", "margin": 20, "vertices": [{{"x": {west}, "y": {south}}}, {{"x": {east}, "y": {south}}},
                {{"x": {east}, "y": {north}}}, {{"x": {west}, "y": {north}}}]}}"#
        )
    };
    let round = |north: f64| 2.0 * libm::hypot(390.0, north - 100.0) + 20.0;
    for south in [-50, -1] {
        let bound = bound(&slab(490, [south, 900]), 100.0);
        assert!(bound > round(900.0) && bound < round(930.0), "{bound}");
    }
    let slalom = [
        slab(300, [-10, 900]),
        slab(490, [100, 1010]),
        slab(680, [-10, 900]),
    ];
    let length = 2.0 * libm::hypot(200.0, 800.0) + 2.0 * libm::hypot(170.0, 800.0) + 60.0;
    let slaloms = bound(&slalom.join(", "), 100.0);
    assert!(slaloms > length && slaloms < 1.05 * length, "{slaloms}");

    // Ten metres are left beside the disc, with a soft zone that costs more than the way round the other side; or none.
    let beside = |influence: f64| bound(&disc(500.0, 200.0, 190.0, influence), 20.0);
    let (free, dear) = (beside(190.0), beside(230.0));
    assert!(free < 850.0 && dear > free + 50.0, "{free} {dear}");
}
