//! A straight leg, and its distance from points of the plane.

use super::{Point2, Point3, Quadratic, Rect};

/// Legs horizontally shorter than this have no heading, metres.
pub const LEVEL: f64 = 1e-9;

/// A straight leg from `a` (t = 0) to `b` (t = 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Start of the leg.
    pub a: Point3,
    /// End of the leg.
    pub b: Point3,
}

impl Segment {
    /// The point at `t`.
    #[must_use]
    pub fn at(&self, t: f64) -> Point3 {
        self.a + (self.b - self.a) * t
    }

    /// The rectangle around it, seen from above.
    #[must_use]
    pub fn bounds(&self) -> Rect {
        Rect {
            min: Point2::new(self.a.x.min(self.b.x), self.a.y.min(self.b.y)),
            max: Point2::new(self.a.x.max(self.b.x), self.a.y.max(self.b.y)),
        }
    }

    /// 3-D length, metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        (self.b - self.a).norm()
    }

    /// Horizontal length, metres.
    #[must_use]
    pub fn horizontal_length(&self) -> f64 {
        let (dx, dy) = (self.b.x - self.a.x, self.b.y - self.a.y);
        (dx * dx + dy * dy).sqrt()
    }

    /// Horizontal direction, radians counter-clockwise from east; `None` if the leg is vertical.
    #[must_use]
    pub fn heading(&self) -> Option<f64> {
        (self.horizontal_length() >= LEVEL)
            .then(|| libm::atan2(self.b.y - self.a.y, self.b.x - self.a.x))
    }

    /// Climb angle, radians, positive upwards.
    #[must_use]
    pub fn climb(&self) -> f64 {
        libm::atan2(self.b.z - self.a.z, self.horizontal_length())
    }

    /// Squared horizontal distance from `point`, as a function of `t`.
    #[must_use]
    pub fn squared_distance_to(&self, point: Point2) -> Quadratic {
        let (dx, dy) = (self.b.x - self.a.x, self.b.y - self.a.y);
        let (ox, oy) = (self.a.x - point.x, self.a.y - point.y);
        Quadratic {
            a: dx * dx + dy * dy,
            b: 2.0 * (dx * ox + dy * oy),
            c: ox * ox + oy * oy,
        }
    }

    /// The part `[t0, t1]` of the leg within horizontal `radius` of `point`, if any.
    #[must_use]
    pub fn within(&self, point: Point2, radius: f64) -> Option<(f64, f64)> {
        let mut distance = self.squared_distance_to(point);
        distance.c -= radius * radius;
        if distance.a < LEVEL * LEVEL {
            return (distance.c <= 0.0).then_some((0.0, 1.0));
        }
        let (t0, t1) = match distance.roots() {
            [Some(t0), Some(t1)] => (t0.max(0.0), t1.min(1.0)),
            // For a leg that hardly moves, the quadratic term is insignificant.
            [Some(t), None] if distance.b > 0.0 => (0.0, t.min(1.0)),
            [Some(t), None] => (t.max(0.0), 1.0),
            _ => {
                return (distance.a <= 1e-14 * distance.c.abs() && distance.c <= 0.0)
                    .then_some((0.0, 1.0));
            }
        };
        (t0 <= t1).then_some((t0, t1))
    }

    /// The part `[t0, t1]` of the leg with `base <= z < top`, if any.
    ///
    /// A leg that climbs from `top` is excluded. One that reaches `top` from below, or descends from it, keeps that
    /// point as a limit, where the least distance is an infimum.
    #[must_use]
    pub fn between_heights(&self, base: Option<f64>, top: Option<f64>) -> Option<(f64, f64)> {
        let (low, high) = (self.a.z.min(self.b.z), self.a.z.max(self.b.z));
        if top.is_some_and(|top| low >= top) || base.is_some_and(|base| high < base) {
            return None;
        }
        let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
        let rise = self.b.z - self.a.z;
        if rise != 0.0 {
            for height in [base, top].into_iter().flatten() {
                let t = (height - self.a.z) / rise;
                // Above base, below top: keep the side on which the leg satisfies it.
                let keeps_later = (rise > 0.0) == (Some(height) == base);
                if keeps_later {
                    t0 = t0.max(t);
                } else {
                    t1 = t1.min(t);
                }
            }
        }
        (t0 <= t1).then_some((t0.min(1.0), t1.max(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(a: [f64; 3], b: [f64; 3]) -> Segment {
        Segment {
            a: Point3::from(a),
            b: Point3::from(b),
        }
    }

    #[test]
    fn heights_cut_a_leg() {
        let check = |z0, z1, base, top, expected: Option<(f64, f64)>| {
            assert_eq!(
                segment([0.0, 0.0, z0], [10.0, 0.0, z1]).between_heights(base, top),
                expected,
                "{z0} {z1} {base:?} {top:?}"
            );
        };
        check(0.0, 100.0, None, None, Some((0.0, 1.0)));
        check(0.0, 100.0, Some(25.0), Some(75.0), Some((0.25, 0.75)));
        check(100.0, 0.0, Some(25.0), Some(75.0), Some((0.25, 0.75)));
        check(50.0, 50.0, Some(25.0), Some(75.0), Some((0.0, 1.0)));
        check(75.0, 75.0, Some(25.0), Some(75.0), None);
        check(25.0, 25.0, Some(25.0), Some(75.0), Some((0.0, 1.0)));
        check(75.0, 90.0, None, Some(75.0), None);
        check(90.0, 50.0, None, Some(70.0), Some((0.5, 1.0)));
        check(0.0, 10.0, Some(10.0), None, Some((1.0, 1.0)));
        check(10.0, 10.0, Some(5.0), Some(5.0), None);
    }

    #[test]
    fn a_disc_cuts_a_leg() {
        let leg = segment([0.0, 0.0, 0.0], [10.0, 0.0, 0.0]);
        assert_eq!(leg.within(Point2::new(5.0, 0.0), 2.5), Some((0.25, 0.75)));
        assert_eq!(leg.within(Point2::new(5.0, 3.0), 2.5), None);
        assert_eq!(leg.within(Point2::new(-2.0, 0.0), 1.0), None);
        // A leg with a horizontal extent seven digits below its distance from the middle is treated as vertical.
        for far in [-1e-7, 1e-7] {
            let hardly = segment([100.0, 0.0, 0.0], [100.0 + far, 0.0, 9.0]);
            assert_eq!(
                hardly.within(Point2::new(0.0, 0.0), 200.0),
                Some((0.0, 1.0))
            );
            assert_eq!(hardly.within(Point2::new(0.0, 0.0), 50.0), None);
            let across = segment([100.0, 0.0, 0.0], [100.0, far, 9.0]);
            assert_eq!(
                across.within(Point2::new(0.0, 0.0), 200.0),
                Some((0.0, 1.0))
            );
            assert_eq!(across.within(Point2::new(0.0, 0.0), 50.0), None);
        }
        let vertical = segment([1.0, 0.0, 0.0], [1.0, 0.0, 9.0]);
        assert_eq!(
            vertical.within(Point2::new(0.0, 0.0), 1.0),
            Some((0.0, 1.0))
        );
    }
}
