use super::*;
use crate::geometry::{Point2, Rect};
use crate::scenario::{AltitudeBand, Frame, PlannerSettings, Vehicle, Weights};
use crate::terrain::{Flat, Terrain};
use crate::threat::{Cylinder, Shape, Threat};

/// A disc of 10 m at (50, 0) with a soft zone of another 10 m, below 80 m.
fn scenario() -> Scenario {
    Scenario {
        frame: Frame::Local,
        name: None,
        start: Point3::new(0.0, 0.0, 20.0),
        target: Point3::new(100.0, 0.0, 20.0),
        area: Rect {
            min: Point2::new(-10.0, -50.0),
            max: Point2::new(110.0, 50.0),
        },
        threats: vec![Threat {
            name: Some("radar".to_owned()),
            shape: Shape::Cylinder(Cylinder {
                center: Point2::new(50.0, 0.0),
                radius: 10.0,
                influence: 20.0,
            }),
            base: None,
            top: Some(80.0),
        }],
        terrain: Terrain::Flat(Flat { elevation: 10.0 }),
        altitude: AltitudeBand {
            min: 5.0,
            max: 105.0,
        },
        vehicle: Vehicle {
            max_turn_deg: 60.0,
            max_climb_deg: 45.0,
            min_leg: 5.0,
            cruise_speed: 15.0,
            fuel_per_km: 2000.0,
        },
        weights: Weights {
            fuel: 0.5,
            threat: 3.0,
            altitude: 2.0,
        },
        planner: PlannerSettings::plain(),
    }
}

fn route(points: &[[f64; 3]]) -> Vec<Point3> {
    points.iter().map(|&point| Point3::from(point)).collect()
}

fn breaches(scenario: &Scenario, points: &[[f64; 3]]) -> Vec<(Constraint, usize, f64)> {
    let model = Model::new(scenario);
    let mut found = Vec::new();
    model.assess(
        &route(points),
        Quadrature::Integral,
        model.tolerance,
        |breach| {
            found.push((breach.constraint, breach.index, breach.amount));
        },
    );
    found
}

fn check(points: &[[f64; 3]], expected: &[(Constraint, usize, f64)]) {
    let found = breaches(&scenario(), points);
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!((found.0, found.1), (expected.0, expected.1));
        assert!(
            (found.2 - expected.2).abs() < 1e-9,
            "{found:?} {expected:?}"
        );
    }
}

/// Worked by hand: 100 m straight through the axis, 10 m above ground, 45 m below the middle of the band. Fuel:
/// 0.5 * 2 * 100. Exposure: three times a fifth of a triangle with base 40 and height 20. Altitude: one
/// waypoint, twice 45.
#[test]
fn the_three_cost_terms_of_a_straight_route_are_as_worked_by_hand() {
    let scenario = scenario();
    let straight = route(&[[0.0, 0.0, 20.0], [40.0, 0.0, 20.0], [100.0, 0.0, 20.0]]);
    let figures = Model::new(&scenario).figures(&straight, Quadrature::Integral);
    assert!((figures.fuel - 100.0).abs() < 1e-9);
    assert!((figures.threat - 3.0 * 400.0 / 5.0).abs() < 1e-9);
    assert!((figures.altitude - 90.0).abs() < 1e-9);
    assert!((figures.total - (figures.fuel + figures.threat + figures.altitude)).abs() < 1e-12);
}

/// A long route past many threats costs the sum over its legs and threats.
#[test]
fn skipping_distant_threats_changes_no_result() {
    let mut scenario = scenario();
    for idx in 0..60 {
        let mut threat = scenario.threats[0].clone();
        threat.shape = Shape::Cylinder(Cylinder {
            center: Point2::new(f64::from(idx % 10) * 25.0, f64::from(idx / 10) * 17.0),
            radius: 2.0,
            influence: 9.0,
        });
        scenario.threats.push(threat);
    }
    let model = Model::new(&scenario);
    let winding: Vec<Point3> = (0..300)
        .map(|step| {
            Point3::new(
                f64::from(step),
                3.0 * f64::from(step % 20),
                20.0 + f64::from(step % 7),
            )
        })
        .collect();
    for quadrature in [Quadrature::Integral, Quadrature::Paper] {
        let mut together = Vec::new();
        let whole = model.assess(&winding, quadrature, model.tolerance, |breach| {
            if breach.constraint == Constraint::Threat {
                together.push((breach.index, breach.threat));
            }
        });
        let (mut exposure, mut alone) = (0.0, Vec::new());
        for (leg_idx, ends) in winding.windows(2).enumerate() {
            for (threat_idx, threat) in scenario.threats.iter().enumerate() {
                let mut one = scenario.clone();
                one.threats = vec![threat.clone()];
                let leg_model = Model::new(&one);
                exposure += leg_model.figures(ends, quadrature).threat;
                leg_model.assess(ends, quadrature, model.tolerance, |breach| {
                    if breach.constraint == Constraint::Threat {
                        alone.push((leg_idx, Some(threat_idx)));
                    }
                });
            }
        }
        assert!((whole.threat - exposure).abs() < 1e-9 * exposure);
        assert!(exposure > 0.0 && !alone.is_empty());
        assert_eq!(together, alone);
    }
}

/// Legs of 50 m that meet at the axis: T is 0, 0, 0, 7.5, 20 at the five samples of each.
#[test]
fn the_papers_quadrature_takes_five_samples_per_leg() {
    let scenario = scenario();
    let straight = route(&[[0.0, 0.0, 20.0], [50.0, 0.0, 20.0], [100.0, 0.0, 20.0]]);
    let figures = Model::new(&scenario).figures(&straight, Quadrature::Paper);
    let exposure = 2.0 * 50.0 * (7.5 + 20.0) / 5.0;
    assert!(
        (figures.threat - 3.0 * exposure / 5.0).abs() < 1e-9,
        "{}",
        figures.threat
    );
}

/// A leg that ends at a base is in the threat there, and one that ends at a top is not, whatever the rounding in
/// between.
#[test]
fn a_sample_at_the_end_of_a_leg_has_exactly_its_height() {
    let mut scenario = scenario();
    let heights = (0..200).map(|nth| 20.0 + 0.37 * f64::from(nth));
    for (from, to) in heights.clone().zip(heights.rev()) {
        for (base, top, share) in [(Some(to), None, 0.2), (None, Some(to), 0.0)] {
            let threat = &mut scenario.threats[0];
            (threat.base, threat.top) = (base, top);
            // Within the soft zone only at its end.
            let leg = route(&[[0.0, 0.0, from], [35.0, 0.0, to]]);
            let climbs_to_base = base.is_some() && from < to;
            let descends_to_top = top.is_some() && from > to;
            if climbs_to_base || descends_to_top {
                let figures = Model::new(&scenario).figures(&leg, Quadrature::Paper);
                let length = (leg[1] - leg[0]).norm();
                let exposure = share * 5.0 * length * 3.0 / 5.0;
                assert!(
                    (figures.threat - exposure).abs() < 1e-9 * length,
                    "{from} {to}"
                );
            }
        }
    }
}

#[test]
fn each_constraint_is_measured() {
    use Constraint::{Altitude, Area, Climb, Leg, Terrain, Threat, Turn};
    // Around the disc with room to spare.
    check(
        &[[0.0, 0.0, 20.0], [50.0, 25.0, 30.0], [100.0, 0.0, 20.0]],
        &[],
    );
    check(
        &[[0.0, 0.0, 20.0], [50.0, 0.0, 20.0], [100.0, 0.0, 20.0]],
        &[(Threat, 0, 10.0), (Threat, 1, 10.0)],
    );
    // It may pass above the top.
    check(
        &[[0.0, 0.0, 80.0], [50.0, 0.0, 80.0], [100.0, 0.0, 80.0]],
        &[],
    );
    check(
        &[[0.0, 0.0, 20.0], [50.0, 25.0, 12.0], [100.0, 0.0, 20.0]],
        &[(Altitude, 0, 3.0), (Altitude, 1, 3.0)],
    );
    check(
        &[[0.0, 0.0, 20.0], [50.0, 25.0, 8.0], [100.0, 0.0, 20.0]],
        &[
            (Altitude, 0, 7.0),
            (Terrain, 0, 2.0),
            (Altitude, 1, 7.0),
            (Terrain, 1, 2.0),
        ],
    );
    check(
        &[[0.0, 0.0, 20.0], [0.0, 40.0, 20.0], [100.0, 0.0, 20.0]],
        &[(Turn, 1, 111.801_409_486_351_78 - 60.0)],
    );
    check(
        &[
            [0.0, 0.0, 20.0],
            [0.0, 40.0, 100.0],
            [50.0, 40.0, 100.0],
            [100.0, 0.0, 20.0],
        ],
        &[
            (Climb, 0, 63.434_948_822_922_01 - 45.0),
            (Turn, 1, 30.0),
            (Climb, 2, 51.326_550_623_864_67 - 45.0),
        ],
    );
    check(
        &[
            [0.0, 0.0, 20.0],
            [2.0, 1.0, 20.0],
            [50.0, 25.0, 20.0],
            [100.0, 0.0, 20.0],
        ],
        &[(Leg, 0, 5.0 - 5.0_f64.sqrt())],
    );
    let mut narrow = scenario();
    narrow.area.max.y = 22.0;
    let found = breaches(
        &narrow,
        &[[0.0, 0.0, 20.0], [50.0, 25.0, 20.0], [100.0, 0.0, 20.0]],
    );
    assert_eq!(found, [(Area, 1, 3.0)]);
}

/// The start stands on the ground, 5 m below the band: within 2 * 5 / tan 45 = 10 m of it only the ground
/// counts.
#[test]
fn a_terminal_zone_lets_a_vehicle_take_off() {
    let mut scenario = scenario();
    scenario.start.z = 10.0;
    let check = |first: [f64; 3], expected: usize| {
        let found = breaches(
            &scenario,
            &[
                [0.0, 0.0, 10.0],
                first,
                [50.0, 25.0, 20.0],
                [100.0, 0.0, 20.0],
            ],
        );
        assert_eq!(found.len(), expected, "{found:?}");
    };
    // At the edge of the zone the route is exactly 5 m above ground.
    check([10.0, 5.0, 15.0 + 10.0 * (1.25_f64.sqrt() - 1.0) / 2.0], 0);
    // Two metres lower where the zone ends.
    check([12.0, 6.0, 13.0], 2);
}
