//! From a taut string to waypoints: every arc becomes the corners of a polygon drawn around it.

use crate::geometry::{LEVEL, Point2};
use crate::scenario::Scenario;
use crate::seeding::{Piece, TautString};

/// An arc of a taut string.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Arc {
    /// Centre of the circle, metres.
    center: Point2,
    /// Radius of the circle; 0 at the corner of a polygon.
    radius: f64,
    /// Heading of the string where it meets the circle, radians counter-clockwise from east.
    heading: f64,
    /// Angle of the arc, radians, left positive.
    angle: f64,
}

/// Arcs of less than this, radians, count as straight.
const STRAIGHT: f64 = 1e-9;

/// The corners of the route that follows `arcs` on the outside: as few as the turn limit allows, and as many more, up
/// to `waypoints`, as shorten it most.
///
/// With `k` corners an arc of angle `a` and radius `r` is flown in `2 k r tan(a / 2k)`, so that the
/// gain of one corner more falls with each: taking the greatest gain first is optimal.
pub(in crate::planner) fn corners(
    scenario: &Scenario,
    string: &TautString,
    waypoints: usize,
) -> Vec<Point2> {
    let arcs = arcs(string);
    let max_turn = scenario.vehicle.max_turn() * (1.0 - 1e-6);
    let mut counts: Vec<usize> = arcs
        .iter()
        .map(|arc| least_corners(arc, max_turn))
        .collect();
    let mut left = waypoints.saturating_sub(counts.iter().sum());
    while left > 0 {
        let gain = |idx: usize| {
            let (arc, count) = (&arcs[idx], counts[idx]);
            let longer = side(arc, count + 1, arc.radius) < scenario.vehicle.min_leg * (1.0 + 1e-6);
            if longer {
                0.0
            } else {
                flown(arc, count) - flown(arc, count + 1)
            }
        };
        let Some(best) =
            (0..arcs.len()).max_by(|&a, &b| gain(a).total_cmp(&gain(b)).then(b.cmp(&a)))
        else {
            break;
        };
        if gain(best) <= 0.0 {
            break;
        }
        counts[best] += 1;
        left -= 1;
    }
    arcs.iter()
        .zip(counts)
        .flat_map(|(arc, count)| around(arc, count, scenario.vehicle.min_leg))
        .collect()
}

/// The bends of `string`, with its heading where each begins.
fn arcs(string: &TautString) -> Vec<Arc> {
    let mut heading = 0.0;
    let mut arcs = Vec::new();
    for piece in &string.pieces {
        match *piece {
            Piece::Straight { from, to } => {
                let way = to - from;
                if way.norm() > LEVEL {
                    heading = libm::atan2(way.y, way.x);
                }
            }
            Piece::Arc {
                center,
                radius,
                turn,
                ..
            } => {
                if turn.abs() > STRAIGHT {
                    arcs.push(Arc {
                        center,
                        radius,
                        heading,
                        angle: turn,
                    });
                }
                heading += turn;
            }
        }
    }
    arcs
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a circle's angle over a turn limit, capped"
)]
fn least_corners(arc: &Arc, max_turn: f64) -> usize {
    (arc.angle.abs() / max_turn).ceil().clamp(1.0, 1000.0) as usize
}

fn half_turn(arc: &Arc, count: usize) -> f64 {
    arc.angle.abs() / (2.0 * count as f64)
}

/// Distance flown round the arc with `count` corners.
fn flown(arc: &Arc, count: usize) -> f64 {
    let half = half_turn(arc, count);
    if half >= std::f64::consts::FRAC_PI_2 {
        f64::INFINITY
    } else {
        2.0 * count as f64 * arc.radius * libm::tan(half)
    }
}

/// Length of a leg between two of `count` corners round a circle of `radius`.
fn side(arc: &Arc, count: usize, radius: f64) -> f64 {
    2.0 * radius * libm::tan(half_turn(arc, count))
}

fn around(arc: &Arc, count: usize, min_leg: f64) -> impl Iterator<Item = Point2> {
    // Few enough corners that none runs away where the string turns back.
    let count = count.max(1);
    let half = half_turn(arc, count).min(1.2);
    // Round a small circle the legs between corners would be too short: stay farther away.
    let radius = if count > 1 {
        arc.radius
            .max(0.5 * min_leg * (1.0 + 1e-6) / libm::tan(half))
    } else {
        arc.radius
    };
    let sign = arc.angle.signum();
    // The circle lies to the left of a string that turns left round it.
    let first = arc.heading - sign * std::f64::consts::FRAC_PI_2;
    let (center, reach) = (arc.center, radius / libm::cos(half));
    (0..count).map(move |corner| {
        let angle = first + sign * half * (2 * corner + 1) as f64;
        center + nalgebra::Vector2::new(libm::cos(angle), libm::sin(angle)) * reach
    })
}
