//! A disc: distance in closed form, and the integral of its soft zone along a leg.

use super::{hover_exposure, intensity};
use crate::geometry::{LEVEL, Point2, Rect, Segment};

/// Where a leg stays beyond this fraction of the influence, its exposure is integrated numerically.
const NEAR_EDGE: f64 = 0.99;

/// The five Gauss-Legendre nodes in -1..1 and their weights: Abramowitz and Stegun, table 25.4.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// A disc that must not be entered, and a soft zone that costs, Eq. 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// Position of the axis.
    pub center: Point2,
    /// Radius of the disc, metres; `d_min` of the paper.
    pub radius: f64,
    /// End of the soft zone, metres from the axis, >= `radius`; `d_max` of the paper.
    pub influence: f64,
}

impl Cylinder {
    pub(super) fn distance(&self, point: Point2) -> f64 {
        (point - self.center).norm() - self.radius
    }

    pub(super) fn intensity(&self, point: Point2) -> f64 {
        intensity(self.influence, (point - self.center).norm())
    }

    pub(super) fn extent(&self) -> Rect {
        Rect {
            min: self.center,
            max: self.center,
        }
        .grown(self.influence)
    }

    /// Whether any point of `leg`, at any height, lies within the soft zone.
    pub(super) fn may_reach(&self, leg: &Segment) -> bool {
        let nearest = self.nearest(leg, (0.0, 1.0));
        (nearest - self.center).norm() <= self.influence
    }

    /// Least distance of the part `window` of `leg` from the circle, metres, negative inside.
    pub(super) fn clearance(&self, leg: &Segment, window: (f64, f64)) -> f64 {
        self.distance(self.nearest(leg, window))
    }

    /// The point of the part `window` of `leg` that is nearest to the axis. Its distance keeps its digits on legs of
    /// any length, which the squared distance as a function of `t` does not.
    fn nearest(&self, leg: &Segment, window: (f64, f64)) -> Point2 {
        let direction = leg.b.xy() - leg.a.xy();
        let squared = direction.norm_squared();
        let t = if squared < LEVEL * LEVEL {
            window.0
        } else {
            ((self.center - leg.a.xy()).dot(&direction) / squared).clamp(window.0, window.1)
        };
        leg.at(t).xy()
    }

    /// Integral of `T` over the part `window` of `leg`, Eq. 4-5, in closed form.
    ///
    /// With `p` the distance of the axis from the leg's line and `s` the distance from the foot of the perpendicular,
    /// `T = influence - d` with `d = sqrt(p^2 + s^2)` over the chord inside the disc, so an antiderivative is
    /// `influence s - (s d + p^2 asinh(s / p)) / 2`. Near the edge of the soft zone this is a small difference of large
    /// numbers, but there `T` is smooth and is integrated numerically.
    pub(super) fn exposure(&self, leg: &Segment, window: (f64, f64)) -> f64 {
        let length = leg.horizontal_length();
        if length < LEVEL {
            return hover_exposure(leg, window, |point| self.intensity(point));
        }
        let direction = (leg.b.xy() - leg.a.xy()) / length;
        let to_axis = self.center - leg.a.xy();
        let foot = to_axis.dot(&direction);
        let p = (to_axis.x * direction.y - to_axis.y * direction.x).abs();
        if p >= self.influence {
            return 0.0;
        }
        let half_chord = ((self.influence - p) * (self.influence + p)).sqrt();
        let s0 = (window.0 * length - foot).max(-half_chord);
        let s1 = (window.1 * length - foot).min(half_chord);
        if s0 >= s1 {
            return 0.0;
        }
        let distance = |s: f64| (p * p + s * s).sqrt();
        let slope = leg.length() / length;
        if distance(0.0_f64.clamp(s0, s1)) > NEAR_EDGE * self.influence {
            let (middle, half) = (0.5 * (s0 + s1), 0.5 * (s1 - s0));
            let sum = GAUSS.iter().map(|(at, weight)| {
                let s = middle + half * at;
                // influence - d, without cancellation.
                weight * (half_chord - s) * (half_chord + s) / (self.influence + distance(s))
            });
            return half * sum.sum::<f64>() * slope;
        }
        let primitive = |s: f64| {
            let d = distance(s);
            // p^2 asinh(s / p) goes to 0 with p.
            let logarithm = if p < LEVEL {
                0.0
            } else {
                p * p * libm::asinh(s / p)
            };
            self.influence * s - 0.5 * (s * d + logarithm)
        };
        (primitive(s1) - primitive(s0)) * slope
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Shape, Threat};
    use super::*;
    use crate::geometry::Point3;
    use proptest::prelude::*;

    fn disc(x: f64, y: f64, radius: f64, influence: f64) -> Cylinder {
        Cylinder {
            center: Point2::new(x, y),
            radius,
            influence,
        }
    }

    fn leg(a: [f64; 3], b: [f64; 3]) -> Segment {
        Segment {
            a: Point3::from(a),
            b: Point3::from(b),
        }
    }

    /// Through the axis: T falls linearly from 0 to 10 and back, area 10 * 10.
    #[test]
    fn a_leg_through_the_axis() {
        let exposure =
            disc(50.0, 0.0, 2.0, 10.0).exposure(&leg([0.0; 3], [100.0, 0.0, 0.0]), (0.0, 1.0));
        assert!((exposure - 100.0).abs() < 1e-9, "{exposure}");
    }

    /// At the edge of a disc of 100 km, where the closed form would lose all digits.
    #[test]
    fn a_leg_that_grazes_the_soft_zone() {
        let check = |depth: f64, t0: f64| {
            let influence = 1e5;
            let p = influence - depth;
            let depth = influence - p;
            let leg = leg([-1000.0, p, 0.0], [1000.0, p, 0.0]);
            let exposure = disc(0.0, 0.0, 1.0, influence).exposure(&leg, (t0, 1.0));
            // T is (c^2 - s^2) / (influence + d), nearly a parabola; c is the half chord.
            let c = (depth * (influence + p)).sqrt();
            let from = (2000.0 * t0 - 1000.0).max(-c);
            let cubes = c * c * c - from * from * from;
            let parabola = c * c * (c - from) - cubes / 3.0;
            let expected = parabola / (2.0 * influence);
            assert!(
                (exposure / expected - 1.0).abs() < 1e-7 + depth / influence,
                "{exposure} {expected}"
            );
        };
        check(1.0, 0.0);
        check(1e-3, 0.0);
        check(1e-3, 0.503);
        check(1e-5, 0.0);
    }

    #[test]
    fn a_vertical_leg_hovers() {
        let exposure =
            disc(3.0, 0.0, 1.0, 10.0).exposure(&leg([0.0; 3], [0.0, 0.0, 20.0]), (0.25, 0.75));
        assert!((exposure - 70.0).abs() < 1e-12, "{exposure}");
    }

    #[test]
    fn clearance_is_signed() {
        let check = |a, b, expected: f64| {
            let clearance = disc(0.0, 0.0, 5.0, 8.0).clearance(&leg(a, b), (0.0, 1.0));
            assert!(
                (clearance - expected).abs() < 1e-12,
                "{clearance} {expected}"
            );
        };
        check([-10.0, 7.0, 0.0], [10.0, 7.0, 0.0], 2.0);
        check([-10.0, 1.0, 0.0], [10.0, 1.0, 0.0], -4.0);
        check([8.0, 6.0, 0.0], [20.0, 6.0, 0.0], 5.0);
    }

    /// Through a disc of 5 mm in the middle of 1000 km.
    #[test]
    fn a_tiny_disc_is_met_on_a_long_leg() {
        let tiny = disc(123_456.7, 234_567.8, 0.005, 0.005);
        let half = [400_000.3, -300_000.1];
        let end = |sign: f64| {
            [
                tiny.center.x + sign * half[0],
                tiny.center.y + sign * half[1],
                0.0,
            ]
        };
        let leg = leg(end(-1.0), end(1.0));
        assert!(tiny.may_reach(&leg));
        assert!(tiny.clearance(&leg, (0.0, 1.0)) < -0.0049);
    }

    #[test]
    fn flying_at_the_top_is_clear() {
        let threat = Threat {
            name: None,
            shape: Shape::Cylinder(disc(0.0, 0.0, 5.0, 8.0)),
            base: None,
            top: Some(100.0),
        };
        assert_eq!(
            threat.clearance(&leg([-9.0, 0.0, 100.0], [9.0, 0.0, 100.0])),
            None
        );
        let below = threat.encounter(&leg([-9.0, 0.0, 99.0], [9.0, 0.0, 99.0]));
        assert!((below.depth - 5.0).abs() < 1e-12);
        assert!(below.exposure > 0.0);
    }

    proptest! {
        /// The closed form agrees with a fine midpoint sum, climbs and windows included.
        #[test]
        fn exposure_agrees_with_a_sum(
            a in prop::array::uniform3(-50.0..50.0f64), b in prop::array::uniform3(-50.0..50.0f64),
            influence in 5.0..40.0f64, t0 in 0.0..0.5f64, t1 in 0.5..1.0f64,
        ) {
            let (disc, leg) = (disc(1.0, 2.0, 5.0, influence), leg(a, b));
            let steps = 20_000;
            let sum: f64 = (0..steps)
                .map(|i| disc.intensity(leg.at(t0 + (t1 - t0) * (f64::from(i) + 0.5) / f64::from(steps)).xy()))
                .sum::<f64>() * leg.length() * (t1 - t0) / f64::from(steps);
            let exact = disc.exposure(&leg, (t0, t1));
            prop_assert!((exact - sum).abs() <= 1e-4 * (1.0 + sum), "{exact} {sum}");
            if !disc.may_reach(&leg) {
                prop_assert!(exact.abs() < 1e-9);
            }
        }
    }
}
