//! Clamped uniform B-splines in space, Eq. 26-27 of the paper.
//!
//! The second term of Eq. 27 lacks its basis function as printed. The Cox-de Boor recursion is meant, evaluated here
//! by de Boor's algorithm.

use super::Point3;

/// A B-spline curve; the parameter runs over `[0, 1]`.
#[derive(Debug, Clone, PartialEq)]
pub struct BSpline {
    /// Polynomial degree p, >= 1.
    pub degree: usize,
    /// n + p + 1 non-decreasing values, the first and last p + 1 equal.
    pub knots: Vec<f64>,
    /// n >= p + 1 points.
    pub control_points: Vec<Point3>,
}

impl BSpline {
    /// The clamped uniform spline of `control_points`; its degree is lowered if there are too few of them.
    ///
    /// # Panics
    /// With fewer than two control points.
    #[must_use]
    pub fn clamped_uniform(control_points: Vec<Point3>, degree: usize) -> Self {
        assert!(
            control_points.len() >= 2,
            "a curve needs two control points"
        );
        let degree = degree.min(control_points.len() - 1);
        let spans = control_points.len() - degree;
        let knots = (0..=degree)
            .map(|_| 0.0)
            .chain((1..spans).map(|span| span as f64 / spans as f64))
            .chain((0..=degree).map(|_| 1.0))
            .collect();
        Self {
            degree,
            knots,
            control_points,
        }
    }

    /// The polynomial pieces: `(first control point, u0, u1)` of each, in order.
    pub fn spans(&self) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        let last = self.control_points.len() - self.degree;
        (0..last).map(|first| {
            let knot = first + self.degree;
            (first, self.knots[knot], self.knots[knot + 1])
        })
    }

    /// The point at `u` of the piece that begins with control point `first` (de Boor's algorithm).
    #[must_use]
    pub fn at(&self, first: usize, u: f64) -> Point3 {
        let p = self.degree;
        let knot = first + p;
        let mut points = [Point3::origin(); MAX_DEGREE + 1];
        points[..=p].copy_from_slice(&self.control_points[first..=knot]);
        for level in 1..=p {
            for i in (level..=p).rev() {
                let left = self.knots[first + i];
                let right = self.knots[knot + 1 + i - level];
                let share = (u - left) / (right - left);
                points[i] = points[i - 1] + (points[i] - points[i - 1]) * share;
            }
        }
        points[p]
    }

    /// An upper bound of `|C''|` over the piece that begins with control point `first`: the second derivative is a
    /// spline of degree p - 2, which stays within the hull of its control points.
    #[must_use]
    pub fn second_derivative_bound(&self, first: usize) -> f64 {
        let p = self.degree;
        if p < 2 {
            return 0.0;
        }
        let velocity = |i: usize| {
            let span = self.knots[i + p + 1] - self.knots[i + 1];
            (self.control_points[i + 1] - self.control_points[i]) * (p as f64 / span)
        };
        (first..first + p - 1)
            .map(|i| {
                let span = self.knots[i + p + 1] - self.knots[i + 2];
                ((velocity(i + 1) - velocity(i)) * ((p - 1) as f64 / span)).norm()
            })
            .fold(0.0, f64::max)
    }
}

/// The largest degree that [`BSpline::at`] supports.
pub const MAX_DEGREE: usize = 5;

#[cfg(test)]
mod tests {
    use super::*;

    fn zigzag(n: usize) -> Vec<Point3> {
        (0..n)
            .map(|i| Point3::new(i as f64, (i % 2) as f64, (i * i) as f64 * 0.1))
            .collect()
    }

    /// The Cox-de Boor recursion meant by Eq. 27, evaluated directly.
    fn basis(knots: &[f64], i: usize, p: usize, u: f64) -> f64 {
        if p == 0 {
            return f64::from(u8::from(knots[i] <= u && u < knots[i + 1]));
        }
        let term = |num: f64, den: f64| if den == 0.0 { 0.0 } else { num / den };
        term(u - knots[i], knots[i + p] - knots[i]) * basis(knots, i, p - 1, u)
            + term(knots[i + p + 1] - u, knots[i + p + 1] - knots[i + 1])
                * basis(knots, i + 1, p - 1, u)
    }

    #[test]
    fn evaluation_agrees_with_the_recursion() {
        for degree in 1..=MAX_DEGREE {
            let spline = BSpline::clamped_uniform(zigzag(9), degree);
            assert_eq!(spline.knots.len(), 9 + degree + 1);
            for (first, u0, u1) in spline.spans() {
                for share in [0.0, 0.3, 0.9] {
                    let u = u0 + (u1 - u0) * share;
                    let sum = (0..9).fold(nalgebra::Vector3::zeros(), |sum, i| {
                        sum + spline.control_points[i].coords * basis(&spline.knots, i, degree, u)
                    });
                    assert!(
                        (spline.at(first, u).coords - sum).norm() < 1e-12,
                        "degree {degree} u {u}"
                    );
                }
            }
        }
    }

    #[test]
    fn ends_are_reached_exactly() {
        let spline = BSpline::clamped_uniform(zigzag(6), 3);
        assert_eq!(spline.at(0, 0.0), spline.control_points[0]);
        assert_eq!(spline.at(2, 1.0), spline.control_points[5]);
    }

    #[test]
    fn a_repeated_control_point_makes_a_corner_and_straight_legs() {
        let corner = Point3::new(10.0, 0.0, 0.0);
        let points = vec![
            Point3::origin(),
            Point3::origin(),
            Point3::origin(),
            corner,
            corner,
            corner,
            Point3::new(10.0, 10.0, 0.0),
            Point3::new(10.0, 10.0, 0.0),
            Point3::new(10.0, 10.0, 0.0),
        ];
        let spline = BSpline::clamped_uniform(points, 3);
        for (first, u0, u1) in spline.spans() {
            for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let point = spline.at(first, u0 + (u1 - u0) * share);
                assert!(
                    point.y.abs() < 1e-12 || (point.x - 10.0).abs() < 1e-12,
                    "{point}"
                );
            }
        }
    }

    #[test]
    fn few_points_lower_the_degree() {
        assert_eq!(BSpline::clamped_uniform(zigzag(2), 3).degree, 1);
        assert_eq!(BSpline::clamped_uniform(zigzag(3), 3).degree, 2);
    }

    #[test]
    fn the_bound_of_the_second_derivative_holds() {
        let spline = BSpline::clamped_uniform(zigzag(8), 3);
        for (first, u0, u1) in spline.spans() {
            let step = (u1 - u0) * 1e-3;
            let middle = 0.5 * (u0 + u1);
            let second = (spline.at(first, middle + step).coords
                - spline.at(first, middle).coords * 2.0
                + spline.at(first, middle - step).coords)
                / (step * step);
            assert!(second.norm() <= spline.second_derivative_bound(first) * (1.0 + 1e-6));
        }
    }
}
