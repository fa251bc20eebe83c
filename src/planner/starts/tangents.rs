//! From a taut string to waypoints: every arc becomes the corners of a polygon drawn around it.

use super::direction;
use crate::geometry::{LEVEL, Point2, Vector2};
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

/// Half of the sharpest turn at a corner, radians: where the string turns back, sharper ones would be far away.
const STEEPEST: f64 = 1.2;

/// A bend that needs more corners than a route has waypoints cannot be flown, and gets no more than these.
const MOST_UNFLOWN: usize = 64;

/// The corners of the route that follows `string` on the outside: as few as the turn limit allows, and as many more, up
/// to `waypoints`, as shorten it most.
///
/// With `k` corners an arc of angle `a` and radius `r` is flown in `2 k r tan(a / 2k)`, so that the
/// gain of one corner more falls with each: taking the greatest gain first is optimal.
pub(in crate::planner) fn corners(
    scenario: &Scenario,
    string: &TautString,
    waypoints: usize,
) -> Vec<Point2> {
    let min_leg = scenario.vehicle.min_leg * (1.0 + 1e-6);
    let bends = bends(arcs(string), min_leg);
    let max_turn = scenario.vehicle.max_turn() * (1.0 - 1e-6);
    let most = scenario.planner.waypoints.max(MOST_UNFLOWN);
    let mut counts: Vec<usize> = bends
        .iter()
        .map(|bend| bend.least_corners(max_turn).min(most))
        .collect();
    let mut left = waypoints.saturating_sub(counts.iter().sum());
    while left > 0 {
        let gain = |idx: usize| bends[idx].gain(counts[idx], min_leg);
        let Some(best) =
            (0..bends.len()).max_by(|&a, &b| gain(a).total_cmp(&gain(b)).then(b.cmp(&a)))
        else {
            break;
        };
        if gain(best) <= 0.0 {
            break;
        }
        counts[best] += 1;
        left -= 1;
    }
    bends
        .iter()
        .zip(counts)
        .flat_map(|(bend, count)| bend.around(count, min_leg))
        .collect()
}

/// Arcs that are flown as one: no leg fits between them.
struct Bend(Vec<Arc>);

/// The arcs of a string as bends.
fn bends(arcs: Vec<Arc>, min_leg: f64) -> Vec<Bend> {
    let mut bends: Vec<Bend> = Vec::new();
    for arc in arcs {
        match bends.last_mut() {
            Some(bend) if bend.takes(&arc, min_leg) => bend.0.push(arc),
            _ => bends.push(Bend(vec![arc])),
        }
    }
    bends
}

impl Bend {
    /// Whether `arc`, which is next, turns the same way, and so soon that no leg fits between.
    fn takes(&self, arc: &Arc, min_leg: f64) -> bool {
        let first = &self.0[0];
        let reach = first.radius + (arc.center - first.center).norm() + arc.radius;
        first.angle.signum() == arc.angle.signum()
            && reach < min_leg
            && (self.angle() + arc.angle).abs() < std::f64::consts::TAU
    }

    fn angle(&self) -> f64 {
        self.0.iter().map(|arc| arc.angle).sum()
    }

    fn least_corners(&self, max_turn: f64) -> usize {
        least_corners(self.angle(), max_turn)
    }

    /// How much shorter it is flown with a corner more.
    fn gain(&self, count: usize, min_leg: f64) -> f64 {
        match self.0.as_slice() {
            [arc] if side(arc, count + 1, arc.radius) >= min_leg => {
                flown(arc, count) - flown(arc, count + 1)
            }
            _ => 0.0,
        }
    }

    fn around(&self, count: usize, min_leg: f64) -> Vec<Point2> {
        match self.0.as_slice() {
            [arc] => around(arc, count, min_leg).collect(),
            arcs => around_all(arcs, self.angle(), count.max(1), min_leg),
        }
    }
}

/// The corners of a route round all of these arcs: its legs touch them, or pass so far outside that none is too short.
fn around_all(arcs: &[Arc], angle: f64, count: usize, min_leg: f64) -> Vec<Point2> {
    let half = (angle.abs() / (2.0 * count as f64)).min(STEEPEST);
    let sign = angle.signum();
    let outwards = |leg: usize| {
        let heading = arcs[0].heading + sign * 2.0 * half * leg as f64;
        Vector2::new(libm::sin(heading), -libm::cos(heading)) * sign
    };
    // How far outwards of the first arc each leg is, from the one to the bend to the one from it.
    let origin = arcs[0].center;
    let normals: Vec<Vector2> = (0..=count).map(outwards).collect();
    let touching = |normal: &Vector2| {
        let reach = |arc: &Arc| (arc.center - origin).dot(normal) + arc.radius;
        arcs.iter().map(reach).fold(f64::NEG_INFINITY, f64::max)
    };
    let reaches: Vec<f64> = normals.iter().map(touching).collect();
    let corner = |leg: usize, farther: f64| {
        let [one, other] = [leg, leg + 1].map(|leg| reaches[leg] + farther);
        let (sine, cosine) = (libm::sin(2.0 * half), libm::cos(2.0 * half));
        let along =
            normals[leg] * (one - other * cosine) + normals[leg + 1] * (other - one * cosine);
        origin + along / (sine * sine)
    };
    // A leg grows by so much for each metre that all of them move outwards.
    let growth = 2.0 * libm::tan(half);
    let shortest = (1..count)
        .map(|leg| (corner(leg, 0.0) - corner(leg - 1, 0.0)).norm())
        .fold(f64::INFINITY, f64::min);
    let farther = ((min_leg - shortest) / growth).max(0.0);
    (0..count).map(|leg| corner(leg, farther)).collect()
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
fn least_corners(angle: f64, max_turn: f64) -> usize {
    (angle.abs() / max_turn).ceil().clamp(1.0, 1000.0) as usize
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
    let count = count.max(1);
    let half = half_turn(arc, count).min(STEEPEST);
    // Round a small circle the legs between corners would be too short: stay farther away.
    let radius = if count > 1 {
        arc.radius.max(0.5 * min_leg / libm::tan(half))
    } else {
        arc.radius
    };
    let sign = arc.angle.signum();
    // The circle lies to the left of a string that turns left round it.
    let first = arc.heading - sign * std::f64::consts::FRAC_PI_2;
    let (center, reach) = (arc.center, radius / libm::cos(half));
    (0..count).map(move |corner| {
        let angle = first + sign * half * (2 * corner + 1) as f64;
        center + direction(angle) * reach
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;
    use crate::planner::tests::{scenario, search_briefly, wall};
    use crate::planner::{Nobody, plan};

    const MIN_LEG: f64 = 27.0;

    /// A corner of a polygon, or a disc, at which a string turns left by `angle`.
    fn arc([x, y]: [f64; 2], radius: f64, heading: f64, angle: f64) -> Arc {
        Arc {
            center: Point2::new(x, y),
            radius,
            heading,
            angle,
        }
    }

    /// The tip of a wall as wide as this, which a string flies round to the left, from east to west.
    fn tip(width: f64) -> [Arc; 2] {
        let quarter = std::f64::consts::FRAC_PI_2;
        [
            arc([0.0, 0.0], 0.0, 0.0, quarter),
            arc([0.0, width], 0.0, quarter, quarter),
        ]
    }

    #[test]
    fn arcs_without_room_for_a_leg_between_them_are_one_bend() {
        let count = |arcs: &[Arc]| bends(arcs.to_vec(), MIN_LEG).len();
        assert_eq!(count(&tip(20.0)), 1);
        assert_eq!(count(&tip(28.0)), 2);
        let [mut one, mut other] = tip(20.0);
        (one.radius, other.radius) = (4.0, 4.0);
        assert_eq!(count(&[one, other]), 2, "the arcs are long enough");
        let [one, mut other] = tip(20.0);
        other.angle = -other.angle;
        assert_eq!(count(&[one, other]), 2, "they turn apart");
        assert_eq!(bends(tip(20.0).to_vec(), 0.0).len(), 2);
    }

    /// As many corners as the turns need, far enough apart, and no leg through the tip.
    #[test]
    fn a_bend_clears_all_of_its_arcs_in_legs_that_are_long_enough() {
        for (width, reach) in [(20.0, 0.0), (1.0, 0.0), (20.0, 3.0)] {
            let mut arcs = tip(width);
            for arc in &mut arcs {
                arc.radius = reach;
            }
            for count in [2, 3, 5] {
                let corners = around_all(&arcs, std::f64::consts::PI, count, MIN_LEG);
                assert_eq!(corners.len(), count);
                for legs in corners.windows(2) {
                    let way = legs[1] - legs[0];
                    assert!(way.norm() > MIN_LEG * (1.0 - 1e-9), "{corners:?}");
                    for arc in &arcs {
                        // A left turn keeps what it goes round on its left.
                        let aside = way.perp(&(arc.center - legs[0])) / way.norm();
                        assert!(aside > reach - 1e-9, "{aside} {corners:?}");
                    }
                }
            }
        }
    }

    /// The same corners as those of a single arc.
    #[test]
    fn a_bend_of_one_arc_is_that_arc() {
        for (radius, count) in [(100.0, 1), (100.0, 3), (5.0, 3)] {
            let one = arc([10.0, 20.0], radius, 0.4, 1.7);
            let expected: Vec<Point2> = around(&one, count, MIN_LEG).collect();
            let found = around_all(&[one], one.angle, count, MIN_LEG);
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).norm() < 1e-9, "{found} {expected}");
            }
        }
    }

    /// Walls narrower than the least leg, to be passed in turn on either side.
    #[test]
    fn a_slalom_round_thin_walls_takes_the_shortest_way() {
        let mut scenario = scenario();
        (scenario.start, scenario.target) = (
            Point3::new(50.0, 500.0, 100.0),
            Point3::new(950.0, 500.0, 100.0),
        );
        scenario.threats = vec![
            wall([250.0, 254.0], [300.0, 990.0]),
            wall([500.0, 504.0], [10.0, 700.0]),
            wall([750.0, 754.0], [300.0, 990.0]),
        ];
        scenario.vehicle.min_leg = 9.0;
        scenario.planner.waypoints = 10;
        search_briefly(&mut scenario);
        let outcome = plan(&scenario, &mut Nobody, &Nobody);
        assert!(outcome.feasible);
        let gap = outcome.cost.total / outcome.bound.lower - 1.0;
        assert!(gap < 0.01, "{gap}");
    }
}
