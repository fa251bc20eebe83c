//! Second-degree polynomials of one variable: squared distances and heights along a leg.

/// `a t^2 + b t + c`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quadratic {
    /// Quadratic coefficient.
    pub a: f64,
    /// Linear coefficient.
    pub b: f64,
    /// Constant.
    pub c: f64,
}

impl Quadratic {
    /// The value at `t`.
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        (self.a * t + self.b) * t + self.c
    }

    /// `self - other`.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        Self {
            a: self.a - other.a,
            b: self.b - other.b,
            c: self.c - other.c,
        }
    }

    /// The real roots in ascending order; a double root appears twice. None for a constant.
    #[must_use]
    pub fn roots(&self) -> [Option<f64>; 2] {
        // If rounding makes the leading coefficient insignificant, the polynomial is linear.
        if self.a.abs() <= 1e-14 * (self.b.abs() + self.c.abs()) {
            let root = (self.b != 0.0)
                .then(|| -self.c / self.b)
                .filter(|root| root.is_finite());
            return [root, None];
        }
        let discriminant = self.b * self.b - 4.0 * self.a * self.c;
        if discriminant < 0.0 {
            return [None, None];
        }
        // Adding terms of equal sign loses no digits; the other root follows from the product c / a.
        let sum = -0.5 * (self.b + self.b.signum() * discriminant.sqrt());
        let first = sum / self.a;
        let second = if sum == 0.0 { 0.0 } else { self.c / sum };
        [Some(first.min(second)), Some(first.max(second))]
    }

    /// No value between 0 and 1 is farther from 0.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.a.abs() + self.b.abs() + self.c.abs()
    }

    /// Whether it is above `level` all over `[t0, t1]`; rounding aside.
    #[must_use]
    pub fn stays_above(&self, level: f64, (t0, t1): (f64, f64)) -> bool {
        if self.at(t0).min(self.at(t1)) <= level {
            return false;
        }
        // It dips below both ends only where its slope turns from falling to rising.
        let dips = 2.0 * self.a * t0 + self.b < 0.0 && 2.0 * self.a * t1 + self.b > 0.0;
        !dips || 4.0 * self.a * (self.c - level) > self.b * self.b
    }

    /// Least and greatest value over `[t0, t1]`.
    #[must_use]
    pub fn extremes(&self, t0: f64, t1: f64) -> (f64, f64) {
        let (v0, v1) = (self.at(t0), self.at(t1));
        let (mut least, mut greatest) = (v0.min(v1), v0.max(v1));
        // Where the slope changes sign.
        if (2.0 * self.a * t0 + self.b) * (2.0 * self.a * t1 + self.b) < 0.0 {
            let vertex = -self.b / (2.0 * self.a);
            let value = self.at(vertex);
            least = least.min(value);
            greatest = greatest.max(value);
        }
        (least, greatest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_found_and_sorted() {
        let check = |a, b, c, expected: [Option<f64>; 2]| {
            let roots = Quadratic { a, b, c }.roots();
            for (root, wanted) in roots.into_iter().zip(expected) {
                match (root, wanted) {
                    (Some(root), Some(wanted)) => {
                        assert!((root - wanted).abs() < 1e-12, "{root} {wanted}");
                    }
                    (None, None) => {}
                    other => panic!("{other:?}"),
                }
            }
        };
        check(1.0, -3.0, 2.0, [Some(1.0), Some(2.0)]);
        check(-1.0, 3.0, -2.0, [Some(1.0), Some(2.0)]);
        check(0.0, 2.0, -1.0, [Some(0.5), None]);
        check(1.0, 0.0, 1.0, [None, None]);
        check(1.0, 0.0, 0.0, [Some(0.0), Some(0.0)]);
        check(0.0, 0.0, 1.0, [None, None]);
    }

    #[test]
    fn a_dip_between_the_ends_is_seen() {
        let bowl = Quadratic {
            a: 4.0,
            b: -4.0,
            c: 3.0,
        };
        assert!((bowl.size() - 11.0).abs() < 1e-12);
        for (level, part, stays) in [
            (1.9, (0.0, 1.0), true),
            (2.1, (0.0, 1.0), false),
            (2.1, (0.7, 1.0), true),
            (2.1, (0.0, 0.4), false),
            (2.9, (-1.0, 0.0), true),
            (3.1, (-1.0, 0.0), false),
        ] {
            assert_eq!(bowl.stays_above(level, part), stays, "{level} {part:?}");
        }
    }

    #[test]
    fn extremes_see_the_vertex_only_inside() {
        let bowl = Quadratic {
            a: 1.0,
            b: -1.0,
            c: 0.0,
        };
        assert_eq!(bowl.extremes(0.0, 1.0), (-0.25, 0.0));
        assert_eq!(bowl.extremes(1.0, 2.0), (0.0, 2.0));
    }
}
