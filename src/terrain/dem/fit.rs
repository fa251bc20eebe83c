//! Polynomial from metres on the plane to columns and rows of a raster. Every leg needs this mapping, and the exact
//! one goes over the ellipsoid and through a map projection.

use std::f64::consts::PI;

use crate::geometry::{Point2, Rect};

/// Numbers of terms tried along each axis; the first that is exact enough is kept.
const TERMS: [usize; 6] = [3, 4, 6, 8, 11, 15];

/// Largest allowed error of the polynomial, cells.
pub(super) const EXACTNESS: f64 = 2e-6;

/// Values are rounded to this fraction of a cell. Projections use the platform's maths library, whose last bits
/// differ between platforms. Rounding makes the results equal everywhere, except where a value lies close to the
/// midpoint between two multiples; that may happen in one of some hundreds of projected scenarios.
const ROUNDING: f64 = 1.0 / 1_048_576.0;

/// Evaluates the polynomial: each row holds coefficients by powers of `u`, and rows go by powers of `v`.
#[inline]
fn sum<'f, R: AsRef<[[f64; 2]]> + ?Sized + 'f>(
    rows: impl IntoIterator<Item = &'f R, IntoIter: DoubleEndedIterator>,
    u: f64,
    v: f64,
) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for row in rows.into_iter().rev() {
        let mut part = [0.0; 2];
        for factor in row.as_ref().iter().rev() {
            part = [part[0] * u + factor[0], part[1] * u + factor[1]];
        }
        sum = [sum[0] * v + part[0], sum[1] * v + part[1]];
    }
    sum
}

/// A polynomial over a rectangle, with metres scaled to -1 to 1 along each axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fit {
    center: Point2,
    /// 1 / half the length of each side.
    scale: [f64; 2],
    terms: usize,
    /// Coefficients for column and row, by powers of y, then x.
    factors: Vec<[f64; 2]>,
}

impl Fit {
    /// Fit `exact` over `region`; `None` where it has no value or even the most terms are not exact enough.
    pub(super) fn of(region: Rect, exact: impl Fn(Point2) -> Option<[f64; 2]>) -> Option<Self> {
        TERMS.into_iter().find_map(|terms| {
            let fit = Self::with_terms(region, &exact, terms)?;
            fit.is_exact(region, &exact).then_some(fit)
        })
    }

    /// Interpolates at the Chebyshev nodes.
    fn with_terms(
        region: Rect,
        exact: &impl Fn(Point2) -> Option<[f64; 2]>,
        terms: usize,
    ) -> Option<Self> {
        let half = (region.max - region.min) * 0.5;
        // A region may be a line or a point.
        let half = half.map(|half| half.max(1.0));
        let center = nalgebra::center(&region.min, &region.max);
        let knots: Vec<f64> = (0..terms)
            .map(|i| libm::cos(PI * (i as f64 + 0.5) / terms as f64))
            .collect();
        let to_powers = to_powers(&knots);
        let mut factors = vec![[0.0; 2]; terms * terms];
        for (k, v) in knots.iter().enumerate() {
            for (i, u) in knots.iter().enumerate() {
                let value = exact(center + nalgebra::Vector2::new(u * half.x, v * half.y))?
                    .map(|value| (value / ROUNDING).round() * ROUNDING);
                for l in 0..terms {
                    for m in 0..terms {
                        let share = to_powers[l][k] * to_powers[m][i];
                        for axis in 0..2 {
                            factors[l * terms + m][axis] += share * value[axis];
                        }
                    }
                }
            }
        }
        Some(Self {
            center,
            scale: [1.0 / half.x, 1.0 / half.y],
            terms,
            factors,
        })
    }

    /// Whether the fit is exact enough between the interpolation points and at the edge.
    fn is_exact(&self, region: Rect, exact: &impl Fn(Point2) -> Option<[f64; 2]>) -> bool {
        let count = 2 * self.terms;
        let size = region.max - region.min;
        (0..=count).all(|k| {
            (0..=count).all(|i| {
                let share = |i: usize| i as f64 / count as f64;
                let point =
                    region.min + nalgebra::Vector2::new(size.x * share(i), size.y * share(k));
                let found = self.at(point);
                exact(point).is_some_and(|exact| {
                    (0..2).all(|axis| (found[axis] - exact[axis]).abs() <= EXACTNESS)
                })
            })
        })
    }

    /// Column and row at `point`.
    pub(super) fn at(&self, point: Point2) -> [f64; 2] {
        let u = (point.x - self.center.x) * self.scale[0];
        let v = (point.y - self.center.y) * self.scale[1];
        // Most fits have few terms; a length known at compile time halves the cost.
        match self.terms {
            3 => sum(self.factors.as_chunks::<3>().0, u, v),
            4 => sum(self.factors.as_chunks::<4>().0, u, v),
            terms => sum(self.factors.chunks_exact(terms), u, v),
        }
    }

    /// Largest second derivative along any heading, cells per square metre. Times the square of a line's length in
    /// metres, it bounds how many cells the line bends.
    pub(super) fn bend(&self) -> f64 {
        let [x, y] = self.scale;
        let mut most = 0.0_f64;
        for axis in 0..2 {
            // No power exceeds 1 within the rectangle.
            let mut parts = [0.0; 3];
            for l in 0..self.terms {
                for m in 0..self.terms {
                    let factor = self.factors[l * self.terms + m][axis].abs();
                    let (l, m) = (l as f64, m as f64);
                    parts[0] += factor * m * (m - 1.0) * x * x;
                    parts[1] += factor * l * m * x * y;
                    parts[2] += factor * l * (l - 1.0) * y * y;
                }
            }
            most = most.max(parts[0] + 2.0 * parts[1] + parts[2]);
        }
        most
    }
}

/// By power, then by knot: what a unit value at a knot adds to the coefficient of a power.
fn to_powers(knots: &[f64]) -> Vec<Vec<f64>> {
    let terms = knots.len();
    // Coefficients of the Chebyshev polynomials.
    let mut polynomials: Vec<Vec<f64>> = Vec::with_capacity(terms);
    for degree in 0..terms {
        let mut factors = vec![0.0; terms];
        match degree {
            0 | 1 => factors[degree] = 1.0,
            _ => {
                for power in 0..terms {
                    let doubled = if power > 0 {
                        2.0 * polynomials[degree - 1][power - 1]
                    } else {
                        0.0
                    };
                    factors[power] = doubled - polynomials[degree - 2][power];
                }
            }
        }
        polynomials.push(factors);
    }
    let mut matrix = vec![vec![0.0; terms]; terms];
    for (knot_idx, knot) in knots.iter().enumerate() {
        for (degree, factors) in polynomials.iter().enumerate() {
            let value = libm::cos(degree as f64 * libm::acos(*knot));
            let weight = if degree == 0 { 1.0 } else { 2.0 } / terms as f64;
            for power in 0..terms {
                matrix[power][knot_idx] += weight * value * factors[power];
            }
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region() -> Rect {
        Rect {
            min: Point2::new(-2000.0, 500.0),
            max: Point2::new(7000.0, 3500.0),
        }
    }

    #[test]
    fn a_smooth_way_is_met_everywhere() {
        let way = |point: Point2| {
            Some([
                point.x / 30.0 + libm::sin(point.y / 9000.0),
                40.0 - point.y / 30.0 + point.x * point.y * 1e-8,
            ])
        };
        let fit = Fit::of(region(), way).expect("a polynomial is found");
        let mut bend = 0.0_f64;
        for i in 0..=100 {
            let share = f64::from(i) / 100.0;
            let at = |share: f64| region().min + nalgebra::Vector2::new(9000.0, 3000.0) * share;
            let (found, exact) = (fit.at(at(share)), way(at(share)).expect("it has a value"));
            assert!(
                (found[0] - exact[0]).abs() <= EXACTNESS
                    && (found[1] - exact[1]).abs() <= EXACTNESS
            );
            // Second differences over the diagonal, 9487 m long.
            let [a, b, c] = [share - 0.01, share, share + 0.01].map(|share| fit.at(at(share)));
            bend = bend.max((a[0] - 2.0 * b[0] + c[0]).abs() / (0.01 * 9487.0 * 0.01 * 9487.0));
        }
        // 1 / 9000^2 along y, 1e-8 across.
        assert!(
            bend <= fit.bend() && fit.bend() < 5e-8,
            "{bend} {}",
            fit.bend()
        );
    }

    #[test]
    fn a_way_that_breaks_off_or_leaps_has_no_polynomial() {
        assert!(Fit::of(region(), |point| (point.x < 6000.0).then_some([0.0, 0.0])).is_none());
        assert!(Fit::of(region(), |point| Some([point.x.signum(), 0.0])).is_none());
    }
}
