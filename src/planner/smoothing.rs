//! Eq. 26-27: a B-spline over the waypoints that keeps every constraint the waypoints keep.
//!
//! The control points are the waypoints. Where the curve, or the polyline through its samples,
//! would cut into a threat, the ground or a limit, the corners that shape it there are drawn
//! tighter: first two control points are added on the legs beside a corner, nearer and nearer, at
//! last the corner itself is repeated until the curve passes through it. With all corners repeated
//! the curve is the polyline of the waypoints, so a feasible route always has a path.

mod samples;

use self::samples::{Sample, corners_alone, fine_polyline, sample};
use super::Path;
use crate::cost::{Breach, Constraint, Model, Tolerance};
use crate::geometry::Point3;
use crate::geometry::bspline::BSpline;
use crate::scenario::Quadrature;

/// How tightly a corner is drawn: 0 is the bare waypoint, [`SHARP`] the repeated one.
type Tightness = u32;

/// The corner itself.
const SHARP: Tightness = 7;

/// By how much the curve may miss a limit, less how far the fine polyline that stands for it is off: 1 mm at threats, 1 cm at heights.
const CURVE_TOLERANCE: Tolerance = Tolerance {
    length_m: 4e-4,
    height_m: 9e-3,
    angle_deg: f64::INFINITY,
};

/// A chord of a curve may climb this much steeper than the limit, degrees.
const CHORD_CLIMB_SLACK: f64 = 0.05;

/// Maximum number of spacings in the length of a route; on a longer one the spacing grows. Where the path bends, there are
/// more samples.
const MOST_SPACINGS: f64 = 200_000.0;

/// The smoothed path of `route`; `None` when even its polyline breaks a constraint.
pub(super) fn smooth(model: &Model, route: &[Point3]) -> Option<Path> {
    let smoothing = model.scenario.planner.smoothing;
    let length: f64 = route
        .windows(2)
        .map(|ends| (ends[1] - ends[0]).norm())
        .sum();
    let spacing = smoothing.spacing.max(length / MOST_SPACINGS);
    let mut tightness: Vec<Tightness> = vec![0; route.len()];
    loop {
        let (control_points, corners) = control_points(route, &tightness, smoothing.degree);
        // A leg alone has no corner to tighten, so its spline has a lower degree.
        if control_points.len() <= smoothing.degree && tighten(&mut tightness, 0..route.len()) {
            continue;
        }
        let spline = BSpline::clamped_uniform(control_points, smoothing.degree);
        let samples = sample(&spline, spacing);
        let cutting = cutting_pieces(model, &spline, &samples);
        if cutting.is_empty() {
            return Some(deliver(model, spline, &samples));
        }
        let shaped_by = |piece: usize| corners[piece..=piece + spline.degree].iter().copied();
        // Where waypoints nearly coincide, so do samples, and the corner may be another's.
        if !tighten(&mut tightness, cutting.into_iter().flat_map(shaped_by))
            && !tighten(&mut tightness, 0..route.len())
        {
            // Legs shorter than the sample spacing turn too.
            let corners = corners_alone(route, spacing);
            if keeps(model, &corners) {
                return Some(deliver(model, spline, &corners));
            }
            // What rounding makes of samples between must not cost a route its path.
            let bare = corners_alone(route, f64::INFINITY);
            return keeps(model, &bare).then(|| deliver(model, spline, &bare));
        }
    }
}

fn deliver(model: &Model, spline: BSpline, samples: &[Sample]) -> Path {
    let points: Vec<Point3> = samples.iter().map(|sample| sample.point).collect();
    let length = points
        .windows(2)
        .map(|ends| (ends[1] - ends[0]).norm())
        .sum();
    Path {
        points,
        length,
        degree: spline.degree,
        knots: spline.knots,
        control_points: spline.control_points,
        duration_s: length / model.scenario.vehicle.cruise_speed,
    }
}

/// Draw each of `corners` one step tighter, once; returns whether any could be.
fn tighten(tightness: &mut [Tightness], corners: impl IntoIterator<Item = usize>) -> bool {
    let before = tightness.to_vec();
    for corner in corners {
        tightness[corner] = (before[corner] + 1).min(SHARP);
    }
    *tightness != *before
}

/// The control points, and the waypoint that each belongs to.
fn control_points(
    route: &[Point3],
    tightness: &[Tightness],
    degree: usize,
) -> (Vec<Point3>, Vec<usize>) {
    let last = route.len() - 1;
    let mut points = vec![route[0]];
    let mut corners = vec![0];
    for corner in 1..last {
        let at = route[corner];
        // On the legs before and after, at 1/4, 1/8, ... of each.
        let beside = |neighbour: Point3| {
            at + (neighbour - at) * libm::scalbn(1.0, -tightness[corner].cast_signed() - 1)
        };
        match tightness[corner] {
            0 => points.push(at),
            SHARP => points.extend(std::iter::repeat_n(at, degree)),
            _ => points.extend([beside(route[corner - 1]), at, beside(route[corner + 1])]),
        }
        corners.resize(points.len(), corner);
    }
    points.push(route[last]);
    corners.push(last);
    (points, corners)
}

fn keeps(model: &Model, samples: &[Sample]) -> bool {
    let points: Vec<Point3> = samples.iter().map(|sample| sample.point).collect();
    keeps_limits(model, &points)
}

/// Whether `points` break none of the constraints that apply to a path.
pub(crate) fn keeps_limits(model: &Model, points: &[Point3]) -> bool {
    let mut keeps = true;
    model.assess(points, Quadrature::Integral, model.tolerance, |breach| {
        keeps &= !binds(&breach);
    });
    keeps
}

/// Whether `breach` counts for a path: its samples are not waypoints, so least leg length and area do not apply, and
/// its chords may be slightly steeper than the curve.
fn binds(breach: &Breach) -> bool {
    match breach.constraint {
        Constraint::Threat | Constraint::Altitude | Constraint::Terrain | Constraint::Turn => true,
        Constraint::Climb => breach.amount > CHORD_CLIMB_SLACK,
        Constraint::Leg | Constraint::Area => false,
    }
}

/// The polynomial pieces at which the polyline of `samples`, or the curve itself, breaks a constraint.
fn cutting_pieces(model: &Model, spline: &BSpline, samples: &[Sample]) -> Vec<usize> {
    let mut cutting = Vec::new();
    let points: Vec<Point3> = samples.iter().map(|sample| sample.point).collect();
    model.assess(&points, Quadrature::Integral, model.tolerance, |breach| {
        if binds(&breach) {
            // Leg k ends at sample k + 1; a turn at its start is shaped by the piece before too.
            cutting.push(samples[breach.index + 1].piece);
            if breach.constraint == Constraint::Turn {
                cutting.push(samples[breach.index].piece);
            }
        }
    });
    if cutting.is_empty() {
        let (curve, pieces) = fine_polyline(spline, samples);
        model.assess(&curve, Quadrature::Integral, CURVE_TOLERANCE, |breach| {
            if matches!(
                breach.constraint,
                Constraint::Threat | Constraint::Altitude | Constraint::Terrain
            ) {
                cutting.push(pieces[breach.index + 1]);
            }
        });
    }
    cutting.sort_unstable();
    cutting.dedup();
    cutting
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::scenario;

    fn points(route: &[[f64; 3]]) -> Vec<Point3> {
        route.iter().map(|&point| Point3::from(point)).collect()
    }

    #[test]
    fn a_route_in_the_open_keeps_its_waypoints_as_control_points() {
        let scenario = scenario();
        let route = points(&[
            [200.0, 100.0, 0.0],
            [150.0, 400.0, 100.0],
            [300.0, 900.0, 100.0],
            [800.0, 800.0, 150.0],
        ]);
        let path = smooth(&Model::new(&scenario), &route).expect("nothing is in the way");
        assert_eq!(path.control_points, route);
        assert_eq!(path.points[0], route[0]);
        assert_eq!(path.points[path.points.len() - 1], route[3]);
        let longest = path
            .points
            .windows(2)
            .map(|ends| (ends[1] - ends[0]).norm())
            .fold(0.0, f64::max);
        assert!(longest <= scenario.planner.smoothing.spacing);
        assert!((path.duration_s * scenario.vehicle.cruise_speed - path.length).abs() < 1e-9);
    }

    /// Both legs at the corner (555, 425) graze the disc (500, 480, 70); the plain spline would cut across it.
    #[test]
    fn a_corner_around_a_threat_is_drawn_tighter() {
        let mut scenario = scenario();
        scenario.threats.swap_remove(2);
        scenario.threats.swap_remove(0);
        let route = points(&[
            [200.0, 100.0, 0.0],
            [367.0, 356.0, 50.0],
            [555.0, 425.0, 100.0],
            [610.0, 570.0, 100.0],
            [800.0, 800.0, 150.0],
        ]);
        for degree in 1..=5 {
            scenario.planner.smoothing.degree = degree;
            let model = Model::new(&scenario);
            let path = smooth(&model, &route).expect("the polyline is clear");
            assert!(
                degree == 1 || path.control_points.len() > route.len(),
                "degree {degree}"
            );
            assert_eq!(path.degree, degree);
            let mut broken = 0;
            model.assess(
                &path.points,
                Quadrature::Integral,
                model.tolerance,
                |breach| {
                    broken += usize::from(breach.constraint == Constraint::Threat);
                },
            );
            assert_eq!(broken, 0, "degree {degree}");
        }
    }

    /// Around a corner within some nanometres, and back: turns too small to show in samples.
    #[test]
    fn a_route_that_turns_within_nanometres_has_a_path() {
        let mut scenario = scenario();
        scenario.threats.clear();
        scenario.vehicle.min_leg = 0.0;
        scenario.start = Point3::new(100.0, 100.0, 100.0);
        scenario.target = Point3::new(100.0, 102.0, 100.0);
        let mut route = vec![scenario.start];
        let mut at = Point3::new(600.0, 101.0, 100.0);
        for bend in 0..5 {
            route.push(at);
            let heading = (45.0 * f64::from(bend)).to_radians();
            at += nalgebra::Vector3::new(libm::cos(heading), libm::sin(heading), 0.0) * 1e-8;
        }
        route.push(scenario.target);
        let model = Model::new(&scenario);
        let mut breaches = 0;
        model.assess(&route, Quadrature::Integral, model.tolerance, |_| {
            breaches += 1;
        });
        assert_eq!(breaches, 0);
        let path = smooth(&model, &route).expect("the route itself can be flown");
        assert!(keeps_limits(&model, &path.points));
        assert!(route.iter().all(|corner| path.points.contains(corner)));
    }

    /// A cluster of waypoints nanometres apart gives samples whose corner lies in another sample's piece.
    #[test]
    fn a_route_with_nearly_coinciding_waypoints_has_a_path() {
        let mut scenario = scenario();
        scenario.threats.clear();
        scenario.vehicle.max_climb_deg = 10.0;
        scenario.vehicle.min_leg = 0.0;
        scenario.start = Point3::new(0.0, 100.0, 0.0);
        scenario.target = Point3::origin();
        let pile = Point3::new(-8.0, 55.0, 8.0);
        let shares = (0..8)
            .map(|step| 1e-11 * f64::from(step))
            .chain((0..9).map(|doubled| 8e-11 * libm::exp2(f64::from(doubled))));
        let mut route = vec![scenario.start];
        route.extend(shares.map(|share| pile + (scenario.target - pile) * share));
        route.push(scenario.target);
        let path = smooth(&Model::new(&scenario), &route).expect("the polyline is clear");
        assert_eq!(path.points[path.points.len() - 1], scenario.target);
    }

    /// As near below a threat as numbers allow, from an end at its base: samples between must not be rounded up to it.
    #[test]
    fn a_route_just_below_a_threat_has_a_path() {
        let mut scenario = scenario();
        scenario.threats.truncate(1);
        scenario.threats[0].base = Some(100.0);
        (scenario.start, scenario.target) = (
            Point3::new(200.0, 250.0, 100.0),
            Point3::new(500.0, 250.0, 100.0),
        );
        let below = 100.0_f64.next_down();
        let model = Model::new(&scenario);
        for free in [
            vec![[250.0, 250.0, below]],
            vec![[450.0, 250.0, below]],
            vec![[250.0, 250.0, below], [450.0, 250.0, below]],
        ] {
            let route = [&[scenario.start], &points(&free)[..], &[scenario.target]].concat();
            assert!(keeps_limits(&model, &route));
            let path = smooth(&model, &route).expect("the route itself can be flown");
            assert!(keeps_limits(&model, &path.points));
            let apart = path
                .points
                .windows(2)
                .map(|ends| (ends[1] - ends[0]).norm());
            assert!(apart.fold(0.0, f64::max) <= scenario.planner.smoothing.spacing + 1e-9);
        }
    }

    #[test]
    fn a_route_through_a_threat_has_no_path() {
        let scenario = scenario();
        let route = points(&[
            [200.0, 100.0, 0.0],
            [500.0, 480.0, 100.0],
            [800.0, 800.0, 150.0],
        ]);
        assert_eq!(smooth(&Model::new(&scenario), &route), None);
    }
}
