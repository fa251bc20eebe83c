//! Circles that a string bends round: common tangents, angles in a sense of rotation, distances.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector2;

use crate::geometry::{Point2, ring};

/// Turns within this many radians of a whole circle are zero turns with rounding.
const NO_TURN: f64 = 1e-9;

/// The sense in which a string goes round a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sense {
    /// Counter-clockwise: the circle lies to the left.
    Left,
    /// Clockwise: the circle lies to the right.
    Right,
}

impl Sense {
    /// +1 counter-clockwise, -1 clockwise.
    pub(super) fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// A circle and the sense in which it is rounded. A point is a circle of radius 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rounding {
    pub(super) center: Point2,
    pub(super) radius: f64,
    pub(super) sense: Sense,
}

/// A straight way that touches one circle where it begins and another where it ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tangent {
    pub(super) from: Point2,
    pub(super) to: Point2,
    /// Unit direction of flight.
    pub(super) along: Vector2<f64>,
    pub(super) length: f64,
}

/// The tangent along which a string leaves `a` and reaches `b`; `None` where one lies within the
/// other, or where they overlap and it would have to cross between them.
pub(super) fn tangent(a: &Rounding, b: &Rounding) -> Option<Tangent> {
    let between = b.center - a.center;
    let squared = between.norm_squared();
    // Both circles touch the line; seen from it, their centres lie this much apart.
    let offset = b.sense.sign() * b.radius - a.sense.sign() * a.radius;
    let remaining = squared - offset * offset;
    if squared <= 0.0 || remaining < -1e-12 * squared {
        return None;
    }
    let length = remaining.max(0.0).sqrt();
    // The direction along which `between` advances by `length` and moves to the left by `offset`.
    let along = Vector2::new(
        between.x * length + between.y * offset,
        between.y * length - between.x * offset,
    ) / squared;
    let left = Vector2::new(-along.y, along.x);
    Some(Tangent {
        from: a.center - left * (a.sense.sign() * a.radius),
        to: b.center - left * (b.sense.sign() * b.radius),
        along,
        length,
    })
}

/// A part of a circle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arc {
    pub(super) on: Rounding,
    /// Unit vector from the centre to where the arc begins.
    pub(super) from: Vector2<f64>,
    /// Unit vector from the centre to where it ends.
    pub(super) to: Vector2<f64>,
    /// Radians, 0 to less than a whole circle.
    pub(super) turn: f64,
}

impl Arc {
    pub(super) fn new(on: Rounding, from: Vector2<f64>, to: Vector2<f64>) -> Self {
        Self {
            on,
            from,
            to,
            turn: turn(from, to, on.sense),
        }
    }

    /// The same part of a circle whose radius is less by this much.
    pub(super) fn narrowed(&self, by: f64) -> Self {
        let mut narrowed = *self;
        narrowed.on.radius = (self.on.radius - by).max(0.0);
        narrowed
    }

    pub(super) fn length(&self) -> f64 {
        self.on.radius * self.turn
    }

    pub(super) fn start(&self) -> Point2 {
        self.on.center + self.from * self.on.radius
    }

    pub(super) fn end(&self) -> Point2 {
        self.on.center + self.to * self.on.radius
    }

    /// Whether the arc passes the direction `way` from the centre: whether [`turn`] from its beginning to there is no
    /// more than its own, without computing an angle.
    pub(super) fn passes(&self, way: Vector2<f64>) -> bool {
        let sign = self.on.sense.sign();
        let (aside, ahead) = (sign * self.from.perp(&way), self.from.dot(&way));
        if ahead >= 0.0 && aside <= 0.0 && -aside <= NO_TURN * ahead {
            return true;
        }
        // Within the first half of a circle from the beginning.
        let [is_early, ends_early] = [aside > 0.0, self.turn < PI];
        if is_early != ends_early {
            return is_early;
        }
        self.turn > 0.0 && sign * way.perp(&self.to) >= 0.0
    }

    /// Distance of `point` to the arc.
    pub(super) fn distance_to(&self, point: Point2) -> f64 {
        let way = point - self.on.center;
        let away = way.norm();
        if away > 0.0 && self.passes(way) {
            return (away - self.on.radius).abs();
        }
        (point - self.start())
            .norm()
            .min((point - self.end()).norm())
    }

    /// Least distance to the segment from `a` to `b`.
    pub(super) fn distance_to_segment(&self, a: Point2, b: Point2) -> f64 {
        let way = b - a;
        let length = way.norm();
        if length <= 0.0 {
            return self.distance_to(a);
        }
        let along = way / length;
        let foot = (self.on.center - a).dot(&along);
        let across = Vector2::new(-along.y, along.x);
        let off = (self.on.center - a).dot(&across);
        // Where the segment's line meets the circle.
        let half_chord = self.on.radius * self.on.radius - off * off;
        if half_chord >= 0.0 {
            let half_chord = half_chord.sqrt();
            for at in [foot - half_chord, foot + half_chord] {
                if at >= 0.0 && at <= length && self.passes(a + along * at - self.on.center) {
                    return 0.0;
                }
            }
        }
        let mut least = self.distance_to(a).min(self.distance_to(b));
        for end in [self.start(), self.end()] {
            least = least.min(point_segment(end, a, b));
        }
        for way in [across, -across] {
            if self.passes(way) {
                least = least.min(point_segment(self.on.center + way * self.on.radius, a, b));
            }
        }
        least
    }
}

/// The angle from `from` to `to` in `sense`, radians, at least 0 and less than a whole circle.
pub(super) fn turn(from: Vector2<f64>, to: Vector2<f64>, sense: Sense) -> f64 {
    let angle = libm::atan2(sense.sign() * from.perp(&to), from.dot(&to));
    let angle = if angle < 0.0 { angle + TAU } else { angle };
    if angle > TAU - NO_TURN { 0.0 } else { angle }
}

/// Distance of `point` to the segment from `a` to `b`.
pub(super) fn point_segment(point: Point2, a: Point2, b: Point2) -> f64 {
    ring::squared_distance((a, b), point).sqrt()
}

/// The nearest points of two segments, one on each.
pub(super) fn nearest_points(
    (a, b): (Point2, Point2),
    (c, d): (Point2, Point2),
) -> (Point2, Point2) {
    if let Some(shares) = ring::crossing((a, b), (c, d)) {
        let at = a + (b - a) * shares;
        return (at, at);
    }
    let foot = |point: Point2, from: Point2, to: Point2| {
        let way = to - from;
        let squared = way.norm_squared();
        if squared > 0.0 {
            from + way * ((point - from).dot(&way) / squared).clamp(0.0, 1.0)
        } else {
            from
        }
    };
    let pairs = [
        (a, foot(a, c, d)),
        (b, foot(b, c, d)),
        (foot(c, a, b), c),
        (foot(d, a, b), d),
    ];
    let mut best = pairs[0];
    for pair in pairs {
        if (pair.0 - pair.1).norm_squared() < (best.0 - best.1).norm_squared() {
            best = pair;
        }
    }
    best
}

/// Distance between two segments.
pub(super) fn segment_segment(one: (Point2, Point2), other: (Point2, Point2)) -> f64 {
    let (p, q) = nearest_points(one, other);
    (p - q).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    fn rounding(x: f64, y: f64, radius: f64, sense: Sense) -> Rounding {
        Rounding {
            center: Point2::new(x, y),
            radius,
            sense,
        }
    }

    /// Including arcs that are empty, a half circle or nearly a full one, and directions exactly at their ends.
    #[test]
    fn an_arc_passes_exactly_the_directions_it_turns_through() {
        let unit = |degrees: i32| {
            let (sin, cos) = libm::sincos(f64::from(degrees).to_radians());
            Vector2::new(cos, sin)
        };
        for (sense, sign) in [(Sense::Left, 1), (Sense::Right, -1)] {
            for (start, turned) in (0..360)
                .step_by(24)
                .zip([0, 1, 60, 179, 180, 181, 270, 359].into_iter().cycle())
            {
                let to = unit(start + sign * turned);
                let arc = Arc::new(rounding(3.0, 4.0, 5.0, sense), unit(start), to);
                for degrees in 0..360 {
                    let passes = arc.passes(unit(start + sign * degrees) * 7.0);
                    // At the arc's end the result depends on rounding.
                    assert!(
                        passes == (degrees <= turned) || degrees == turned,
                        "{arc:?} {degrees}"
                    );
                }
                assert!(arc.passes(arc.from) && arc.passes(Vector2::zeros()));
            }
            let hair = Vector2::new(1.0, -1e-12 * f64::from(sign));
            let none = Arc::new(rounding(0.0, 0.0, 1.0, sense), Vector2::new(1.0, 0.0), hair);
            assert!(
                none.turn <= 0.0
                    && none.passes(hair)
                    && !none.passes(unit(sign * 5))
                    && !none.passes(unit(-sign * 5))
            );
        }
    }

    #[test]
    fn tangents_of_two_equal_circles() {
        let check = |one, other, expected: Option<([f64; 2], [f64; 2])>| {
            let found = tangent(
                &rounding(0.0, 0.0, 3.0, one),
                &rounding(10.0, 0.0, 3.0, other),
            );
            match (found, expected) {
                (Some(found), Some((from, to))) => {
                    assert!(
                        (found.from - Point2::from(from)).norm() < 1e-12,
                        "{found:?}"
                    );
                    assert!((found.to - Point2::from(to)).norm() < 1e-12, "{found:?}");
                    assert!((found.length - (found.to - found.from).norm()).abs() < 1e-12);
                }
                (found, expected) => assert_eq!(found.is_some(), expected.is_some()),
            }
        };
        check(Sense::Left, Sense::Left, Some(([0.0, -3.0], [10.0, -3.0])));
        check(Sense::Right, Sense::Right, Some(([0.0, 3.0], [10.0, 3.0])));
        // The inner tangent: the sine of its slope is 6 / 10.
        check(Sense::Left, Sense::Right, Some(([1.8, -2.4], [8.2, 2.4])));
        let overlapping = tangent(
            &rounding(0.0, 0.0, 6.0, Sense::Left),
            &rounding(10.0, 0.0, 6.0, Sense::Right),
        );
        assert!(overlapping.is_none());
        let nested = tangent(
            &rounding(0.0, 0.0, 6.0, Sense::Left),
            &rounding(1.0, 0.0, 3.0, Sense::Left),
        );
        assert!(nested.is_none());
    }

    #[test]
    fn turns_are_measured_in_their_sense() {
        let (east, north) = (Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0));
        assert!((turn(east, north, Sense::Left) - FRAC_PI_2).abs() < 1e-12);
        assert!((turn(east, north, Sense::Right) - 3.0 * FRAC_PI_2).abs() < 1e-12);
        assert!((turn(east, -east, Sense::Right) - PI).abs() < 1e-12);
        let hair = Vector2::new(1.0, -1e-12);
        assert!(turn(east, hair, Sense::Left).abs() < 1e-11);
    }

    proptest! {
        #[test]
        fn the_distance_of_an_arc_matches_its_nearest_sample(
            angles in prop::array::uniform2(-3.0..3.0f64), left in any::<bool>(),
            a in prop::array::uniform2(-9.0..9.0f64), b in prop::array::uniform2(-9.0..9.0f64),
        ) {
            let sense = if left { Sense::Left } else { Sense::Right };
            let unit = |angle: f64| Vector2::new(libm::cos(angle), libm::sin(angle));
            let arc = Arc::new(rounding(1.0, 2.0, 4.0, sense), unit(angles[0]), unit(angles[1]));
            let (a, b) = (Point2::from(a), Point2::from(b));
            let sampled = (0..=2000)
                .map(|i| angles[0] + sense.sign() * arc.turn * f64::from(i) / 2000.0)
                .map(|angle| point_segment(arc.on.center + unit(angle) * 4.0, a, b))
                .fold(f64::INFINITY, f64::min);
            let exact = arc.distance_to_segment(a, b);
            prop_assert!(exact <= sampled + 1e-9 && sampled - exact < 0.02, "{exact} {sampled}");
        }
    }
}
