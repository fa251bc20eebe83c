//! What a potential proves that is too steep here and there.

use super::cells::floor;
use super::mesh::Mesh;
use super::slopes::{range, steepness};
use crate::geometry::Vector2;

/// Levels between the ends that are told apart.
const LEVELS: usize = 4096;

/// Share by which a sum of a few products may be off.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// How much the potential of `values` rises from the first node to the second when it is made flatter, or steeper,
/// level by level, so that no triangle that takes a level is steeper there than its `limits`; those that nothing
/// leads to take none.
pub(super) fn proven(mesh: &Mesh, limits: &[[f64; 6]], values: &[f64]) -> f64 {
    let (low, high) = (values[0], values[1]);
    if high <= low {
        return 0.0;
    }
    let level = |value: f64| floor((value - low) / (high - low) * LEVELS as f64).min(LEVELS - 1);
    let greatest = values.iter().filter(|value| value.is_finite());
    let greatest = greatest.fold(0.0, |most: f64, value| most.max(value.abs()));
    let mut steepest = vec![0.0_f64; LEVELS];
    for (triangle, limits) in mesh.triangles.iter().zip(limits) {
        let values = triangle.of(values);
        if !values[0].is_finite() {
            continue;
        }
        let [least, most] = range(&values);
        if most < low || least > high {
            continue;
        }
        // What rounding can make of slopes: of values, and of the shape of slim triangles.
        let rates: f64 = triangle.rates.iter().map(Vector2::norm).sum();
        let [a, b, c, ..] = mesh.places(triangle);
        let extent = (b - a).norm() + (c - a).norm();
        let least_limit = limits.iter().copied().fold(f64::INFINITY, f64::min);
        let steepness = steepness(triangle, limits, &values);
        let rounding = ROUNDING * rates * (greatest / least_limit + extent * steepness);
        let steepness = steepness + rounding;
        for steepest in &mut steepest[level(least)..=level(most)] {
            *steepest = steepest.max(steepness);
        }
    }
    let width = (high - low) / LEVELS as f64;
    let flattened = steepest.iter().filter(|steepest| **steepest > 0.0);
    flattened.map(|steepest| width / steepest).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point2;

    /// A strip of a thousand metres, the first two vertices at its ends.
    fn strip() -> Mesh {
        let mut vertices = vec![Point2::new(0.0, 0.0), Point2::new(1000.0, 0.0)];
        vertices.extend((1..100).map(|i| Point2::new(10.0 * f64::from(i), 0.0)));
        vertices.extend((0..=100).map(|i| Point2::new(10.0 * f64::from(i), 10.0)));
        Mesh::new(&vertices, |_| false).expect("they are apart")
    }

    #[test]
    fn what_is_too_steep_costs_the_levels_at_which_it_lies() {
        let mesh = strip();
        let check = |limit: f64, height: &dyn Fn(Point2) -> f64, expected: f64| {
            let limits = vec![[limit; 6]; mesh.triangles.len()];
            let values: Vec<f64> = mesh.nodes.iter().map(|node| height(*node)).collect();
            let found = proven(&mesh, &limits, &values);
            assert!(found <= expected * (1.0 + 1e-9), "{found} {expected}");
            assert!(found > expected - 40.0 * limit, "{found} {expected}");
        };
        check(2.0, &|at| 2.0 * at.x, 2000.0);
        // Not as steep as may be everywhere, and too steep on a tenth of the way.
        check(2.0, &|at| at.x, 2000.0);
        check(1.0, &|at| at.x + (at.x - 500.0).clamp(0.0, 100.0), 1000.0);
        check(1.0, &|at| -at.x, 0.0);
        check(1.0, &|at| 4.0 * at.x.min(100.0) + 1e-3 * at.x, 1000.0);
    }
}
