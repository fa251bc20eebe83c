//! Random paths along threats, and a few handmade ones.

use super::*;
use crate::export::tests::accepted;
use crate::geometry::Point2;
use crate::geometry::bspline::BSpline;
use crate::threat::{Cylinder, Threat};
use proptest::prelude::*;
use serde_json::json;

/// Open ground with 500 m of altitude band, and no limit that matters.
fn open(max_turn_deg: f64) -> Scenario {
    accepted(&json!({
        "start": {"x": 0, "y": 0, "z": 100},
        "target": {"x": 1000, "y": 0, "z": 100},
        "area": {"min": {"x": -500, "y": -800}, "max": {"x": 1500, "y": 800}},
        "terrain": {"kind": "peaks", "base": 0, "peaks":
            [{"center": {"x": 500, "y": 0}, "height": 60, "spread": {"x": 150, "y": 300}}]},
        "altitude": {"min": 10, "max": 500},
        "vehicle": {"max_turn_deg": max_turn_deg, "max_climb_deg": 60, "min_leg": 1},
    }))
}

/// A smoothed path over `steps` of 100 m east, and discs that touch it at some of its samples.
fn hugging(
    steps: &[(f64, f64)],
    touched: &[(usize, bool, f64)],
) -> Option<(Scenario, Vec<Point3>)> {
    let mut scenario = open(90.0);
    let free = steps
        .iter()
        .zip(1_i32..)
        .map(|(&(north, up), step)| Point3::new(100.0 * f64::from(step), north, 150.0 + up));
    let ends = (scenario.start, scenario.target);
    let route = std::iter::once(ends.0).chain(free).chain([ends.1]);
    let path = smoothed(route.collect());
    if !keeps_limits(&Model::new(&scenario), &path) {
        return None;
    }
    for &(sample, left, radius) in touched {
        let index = 1 + sample % (path.len() - 2);
        let along = (path[index + 1] - path[index - 1]).xy().normalize();
        let aside = nalgebra::Vector2::new(-along.y, along.x) * if left { radius } else { -radius };
        let disc = Threat {
            name: None,
            shape: crate::threat::Shape::Cylinder(Cylinder {
                center: Point2::from(path[index].xy() + aside),
                radius,
                influence: radius,
            }),
            base: None,
            top: None,
        };
        scenario.threats.push(disc);
        if !keeps_limits(&Model::new(&scenario), &path) {
            scenario.threats.pop();
        }
    }
    Some((scenario, path))
}

/// Samples of a B-spline, whatever it crosses.
fn smoothed(corners: Vec<Point3>) -> Vec<Point3> {
    let spline = BSpline::clamped_uniform(corners, 3);
    let mut samples = vec![spline.control_points[0]];
    for (piece, from, to) in spline.spans() {
        let step = |step: i32| from + (to - from) * f64::from(step) / 24.0;
        samples.extend((1..=24).map(|count| spline.at(piece, step(count))));
    }
    samples
}

fn farthest(path: &[Point3], corners: &[Point3]) -> f64 {
    let miss = |&point: &Point3| {
        let legs = corners
            .windows(2)
            .map(|ends| distance(point, (ends[0], ends[1])));
        legs.fold(f64::INFINITY, f64::min)
    };
    path.iter().map(miss).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases / 5, ..ProptestConfig::default() })]

    #[test]
    fn the_legs_keep_what_the_path_keeps(
        steps in prop::collection::vec((-60.0..60.0, -20.0..20.0), 9),
        touched in prop::collection::vec((any::<usize>(), any::<bool>(), 5.0..80.0), 0..6),
        tolerance_m in prop_oneof![Just(0.05), Just(1.0), Just(8.0)],
        follows_ground: bool,
    ) {
        if let Some((scenario, path)) = hugging(&steps, &touched) {
            let shape = Shape { tolerance_m, follows_ground };
            let corners = reduce(&scenario, &path, shape);
            prop_assert!(farthest(&path, &corners) <= tolerance_m);
            prop_assert!(keeps_limits(&Model::new(&scenario), &corners));
            prop_assert_eq!(corners[0], path[0]);
            prop_assert_eq!(corners[corners.len() - 1], path[path.len() - 1]);
            prop_assert!(corners.len() <= path.len());
            if follows_ground {
                let flat = |points: &[Point3]| -> Vec<Point3> {
                    points.iter().map(|point| {
                        let z = scenario.terrain.height_of(*point);
                        Point3::new(point.x, point.y, z)
                    }).collect()
                };
                prop_assert!(farthest(&flat(&path), &flat(&corners)) <= tolerance_m);
            }
        }
    }

    /// Of all chains over the thinned samples of a short path, tried one by one, none has fewer legs; over all
    /// samples there may be shorter ones.
    #[test]
    fn the_legs_are_few(offsets in prop::collection::vec(-3.0..3.0_f64, 9)) {
        let scenario = open(90.0);
        let path: Vec<Point3> = std::iter::once(0.0)
            .chain(offsets)
            .chain([0.0])
            .zip(0_i32..)
            .map(|(north, step)| Point3::new(100.0 * f64::from(step), north, 150.0))
            .collect();
        let shape = Shape { tolerance_m: 1.0, follows_ground: false };
        let found = reduce(&scenario, &path, shape).len();
        let samples = corners_of(&scenario, &path, shape);
        let thinned: Vec<usize> = Reduction { model: Model::new(&scenario), shape, samples }
            .thinned()
            .iter()
            .map(|corner| corner.index)
            .collect();
        let between = thinned.len() - 2;
        let best = (0..1_u32 << between)
            .filter_map(|chosen| {
                let kept = |at: &usize| *at == 0 || *at > between || chosen >> (at - 1) & 1 == 1;
                let corners: Vec<usize> = (0..thinned.len()).filter(kept).map(|at| thinned[at]).collect();
                let holds = corners.windows(2).all(|ends| {
                    let leg = (path[ends[0]], path[ends[1]]);
                    path[ends[0]..=ends[1]].iter().all(|&point| distance(point, leg) <= 1.0)
                });
                holds.then_some(corners.len())
            })
            .min()
            .expect("the path itself holds");
        prop_assert!(found <= best, "{found} corners where {best} do");
    }
}

/// Around a disc, exactly at its edge, all legs between samples would cut it; legs beside the path do not.
#[test]
fn an_arc_along_a_threat_takes_few_legs() {
    let mut scenario = open(90.0);
    scenario.terrain = crate::terrain::Terrain::Flat(crate::terrain::Flat { elevation: 0.0 });
    let center = Point2::new(500.0, 0.0);
    scenario.threats.push(Threat {
        name: None,
        shape: crate::threat::Shape::Cylinder(Cylinder {
            center,
            radius: 199.9,
            influence: 199.9,
        }),
        base: None,
        top: None,
    });
    let path: Vec<Point3> = (0..=180)
        .map(|step| {
            let (sin, cos) = libm::sincos(std::f64::consts::PI * (1.0 - f64::from(step) / 180.0));
            Point3::new(500.0 + 200.0 * cos, 200.0 * sin, 150.0)
        })
        .collect();
    assert!(keeps_limits(&Model::new(&scenario), &path));
    let shape = Shape {
        tolerance_m: 1.0,
        follows_ground: false,
    };
    let corners = reduce(&scenario, &path, shape);
    // Tangents of 199.9 m between corners at 200.95 m are 41 m long, of an arc of 628 m; samples are
    // 3.5 m apart.
    assert!((16..=23).contains(&corners.len()), "{}", corners.len());
}

/// A bend that the tolerance would allow in one corner is split into as many as the vehicle's turn limit needs.
#[test]
fn no_corner_is_sharper_than_the_vehicle_can_turn() {
    let bend = |step: i32| {
        let (sin, cos) = libm::sincos(f64::from(step).to_radians());
        Point3::new(300.0 + 2.0 * sin, 2.0 - 2.0 * cos, 150.0)
    };
    let straight = |step: i32| Point3::new(10.0 * f64::from(step), 0.0, 150.0);
    let back = |step: i32| Point3::new(300.0 - 10.0 * f64::from(step), 4.0, 150.0);
    let path: Vec<Point3> = (0..30)
        .map(straight)
        .chain((0..=18).map(|step| bend(10 * step)))
        .chain((1..30).map(back))
        .collect();
    let scenario = open(60.0);
    let shape = Shape {
        tolerance_m: 1.5,
        follows_ground: false,
    };
    let corners = reduce(&scenario, &path, shape);
    let sharpest = turns(&corners)
        .map(f64::abs)
        .fold(0.0, f64::max)
        .to_degrees();
    assert!(sharpest <= 60.0 + 1e-6, "{sharpest}");
    assert!(corners.len() <= 8, "{}", corners.len());
}
