//! What a potential proves when it is too steep in places.

use super::cells::floor;
use super::mesh::Mesh;
use super::slopes::{range, steepness};
use crate::geometry::Vector2;

/// Number of levels between the ends.
const LEVELS: usize = 4096;

/// Rounding error of a sum of a few products, as a share.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// A triangle this many times as long as wide is too slim for its slopes to be determined.
const SLIMMEST: f64 = 1e9;

/// A potential flattened or steepened level by level, so that no triangle that takes a level is steeper there than its
/// limits.
#[derive(Debug)]
pub(super) struct Levels {
    low: f64,
    /// Width of a level.
    width: f64,
    /// Remaining rise up to the beginning of each level, and to the end of the last.
    heights: Vec<f64>,
}

impl Levels {
    /// For the potential with these `values`, from its value in the first node to that in the second, which is greater;
    /// unreachable triangles, where it is not a number, take no levels.
    pub(super) fn new(mesh: &Mesh, limits: &[[f64; 6]], values: &[f64]) -> Self {
        let (low, high) = (values[0], values[1]);
        let width = (high - low) / LEVELS as f64;
        let level = |value: f64| floor((value - low) / width).min(LEVELS - 1);
        let finite = values.iter().filter(|value| value.is_finite());
        let greatest = finite.fold(0.0, |most: f64, value| most.max(value.abs()));
        let mut steepest = vec![0.0_f64; LEVELS];
        for (triangle, limits) in mesh.triangles.iter().zip(limits) {
            let values = triangle.of(values);
            let [least, most] = range(&values);
            if !values[0].is_finite() || most < low || least > high {
                continue;
            }
            let steepness = steepness(triangle, limits, &values);
            // Possible effect of rounding: of values, and of the shape of slim triangles.
            let rates: f64 = triangle.rates.iter().map(Vector2::norm).sum();
            let [a, b, c, ..] = mesh.places(triangle);
            let slimness = rates * ((b - a).norm() + (c - a).norm());
            let least_limit = limits.iter().copied().fold(f64::INFINITY, f64::min);
            let by_values = ROUNDING * rates * greatest / least_limit;
            let steepness = steepness * (1.0 + ROUNDING * slimness) + by_values;
            // If the triangle is too slim to tell, which is not a number, assume the greatest steepness.
            let steepness = if slimness < SLIMMEST && steepness.is_finite() {
                steepness
            } else {
                f64::INFINITY
            };
            for steepest in &mut steepest[level(least)..=level(most)] {
                *steepest = steepest.max(steepness);
            }
        }
        let mut height = 0.0;
        let mut heights = vec![height];
        for steepest in steepest {
            if steepest > 0.0 {
                height += width / steepest;
            }
            heights.push(height);
        }
        Self {
            low,
            width,
            heights,
        }
    }

    /// The whole remaining rise: what is proven.
    pub(super) fn total(&self) -> f64 {
        self.heights[LEVELS]
    }

    /// The remaining rise up to a value.
    pub(super) fn at(&self, value: f64) -> f64 {
        let levels = ((value - self.low) / self.width).clamp(0.0, LEVELS as f64);
        let level = floor(levels).min(LEVELS - 1);
        let [from, to] = [self.heights[level], self.heights[level + 1]];
        from + (to - from) * (levels - level as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point2;

    /// A strip of a thousand metres with the first two vertices at its ends.
    fn strip() -> Mesh {
        let mut vertices = vec![Point2::new(0.0, 0.0), Point2::new(1000.0, 0.0)];
        vertices.extend((1..100).map(|i| Point2::new(10.0 * f64::from(i), 0.0)));
        vertices.extend((0..=100).map(|i| Point2::new(10.0 * f64::from(i), 10.0)));
        Mesh::new(&vertices, |_| false).expect("they are apart")
    }

    /// The area of a triangle is lost in rounding: its rise is unknown and counts as zero.
    #[test]
    fn a_degenerate_triangle_removes_its_levels() {
        let vertices = [[0.0, 0.0], [1000.0, 0.0], [500.0, 1e-8], [500.0, 400.0]];
        let mesh = Mesh::new(&vertices.map(Point2::from), |_| false).expect("they are apart");
        assert_eq!(mesh.triangles.len(), 3);
        let limits = vec![[1.0; 6]; mesh.triangles.len()];
        let values: Vec<f64> = mesh.nodes.iter().map(|node| node.x).collect();
        let found = Levels::new(&mesh, &limits, &values).total();
        assert!(found.abs() < f64::EPSILON, "{found}");
    }

    #[test]
    fn excess_steepness_is_deducted_at_its_own_levels() {
        let mesh = strip();
        let check = |limit: f64, height: &dyn Fn(Point2) -> f64, expected: f64| {
            let limits = vec![[limit; 6]; mesh.triangles.len()];
            let values: Vec<f64> = mesh.nodes.iter().map(|node| height(*node)).collect();
            let levels = Levels::new(&mesh, &limits, &values);
            let found = levels.total();
            assert!((levels.at(values[1]) - found).abs() < 1e-9 * found);
            assert!(levels.at(values[0]).abs() < 1e-9 * found);
            assert!(found <= expected * (1.0 + 1e-9), "{found} {expected}");
            assert!(found > expected - 40.0 * limit, "{found} {expected}");
        };
        check(2.0, &|at| 2.0 * at.x, 2000.0);
        // Less steep than allowed everywhere, then too steep on a tenth of the way.
        check(2.0, &|at| at.x, 2000.0);
        check(1.0, &|at| at.x + (at.x - 500.0).clamp(0.0, 100.0), 1000.0);
        check(1.0, &|at| 4.0 * at.x.min(100.0) + 1e-3 * at.x, 1000.0);
    }
}
