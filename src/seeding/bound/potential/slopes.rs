//! The steepness of a quadratic in a triangle, given its values in the six nodes.

use super::mesh::{SIDES, Triangle};
use crate::geometry::Vector2;

/// The gradients in the six nodes of the quadratic that takes `values` there. They are linear in between.
#[inline]
pub(super) fn gradients(triangle: &Triangle, values: &[f64; 6]) -> [Vector2; 6] {
    with_middles(in_corners(triangle, values))
}

/// The first three of the `gradients`.
#[inline]
pub(super) fn in_corners(triangle: &Triangle, values: &[f64; 6]) -> [Vector2; 3] {
    let [a, b, c] = triangle.rates;
    let [p, q, r, pq, qr, rp] = *values;
    let (pq, qr, rp) = (4.0 * pq, 4.0 * qr, 4.0 * rp);
    [
        a * (3.0 * p) + b * (pq - q) + c * (rp - r),
        b * (3.0 * q) + c * (qr - r) + a * (pq - p),
        c * (3.0 * r) + a * (rp - p) + b * (qr - q),
    ]
}

/// How much a value in the node `which` of a triangle with these `rates` changes the gradients in its corners, per unit.
#[inline]
pub(super) fn response(rates: &[Vector2; 3], which: usize) -> [Vector2; 3] {
    if which < 3 {
        let mut corners = [-rates[which]; 3];
        corners[which] = rates[which] * 3.0;
        corners
    } else {
        let [one, other] = SIDES[which - 3];
        let mut corners = [Vector2::zeros(); 3];
        corners[one] = rates[other] * 4.0;
        corners[other] = rates[one] * 4.0;
        corners
    }
}

/// What is linear in a triangle, in all of its nodes, given it in the corners.
#[inline]
pub(super) fn with_middles([a, b, c]: [Vector2; 3]) -> [Vector2; 6] {
    [a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5]
}

/// The greatest steepness of a triangle with these `values` as a multiple of its `limits`: limits and gradients are
/// linear in each of its parts, so no place between nodes exceeds all of them. Infinite where the triangle is too slim
/// to tell.
#[inline]
pub(super) fn steepness(triangle: &Triangle, limits: &[f64; 6], values: &[f64; 6]) -> f64 {
    let gradients = gradients(triangle, values);
    let squares = gradients.iter().zip(limits);
    let squares = squares.map(|(gradient, limit)| gradient.norm_squared() / (limit * limit));
    let steepest = squares.fold(
        0.0,
        |most: f64, square| {
            if square <= most { most } else { square }
        },
    );
    if steepest.is_nan() {
        f64::INFINITY
    } else {
        steepest.sqrt()
    }
}

/// Bounds of the least and the greatest value of the quadratic: those of its Bezier points.
pub(super) fn range(values: &[f64; 6]) -> [f64; 2] {
    let mut points = *values;
    for (middle, [one, other]) in (3..).zip(SIDES) {
        points[middle] = 2.0 * values[middle] - 0.5 * (values[one] + values[other]);
    }
    [
        points.iter().copied().fold(f64::INFINITY, f64::min),
        points.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Mesh;
    use super::*;
    use crate::geometry::Point2;

    /// A triangle, and a quadratic function with its gradient.
    fn example() -> (Mesh, impl Fn(Point2) -> f64, impl Fn(Point2) -> Vector2) {
        let corners = [[1.0, 2.0], [6.0, 3.0], [2.5, 7.0]].map(Point2::from);
        let mesh = Mesh::new(&corners, |_| false).expect("they are apart");
        let height = |at: Point2| 3.0 + at.x - 2.0 * at.y + 0.3 * at.x * at.x - 0.2 * at.x * at.y;
        let slope = |at: Point2| Vector2::new(1.0 + 0.6 * at.x - 0.2 * at.y, -2.0 - 0.2 * at.x);
        (mesh, height, slope)
    }

    #[test]
    fn gradients_of_a_quadratic_are_exact() {
        let (mesh, height, slope) = example();
        let triangle = &mesh.triangles[0];
        let places = mesh.places(triangle);
        let values = places.map(&height);
        for (found, place) in gradients(triangle, &values).iter().zip(places) {
            assert!((found - slope(place)).norm() < 1e-12, "{found} at {place}");
        }
        let steepest = places.map(|place| slope(place).norm());
        let steepest = steepest.into_iter().fold(0.0, f64::max);
        assert!((steepness(triangle, &[2.0; 6], &values) - 0.5 * steepest).abs() < 1e-12);
    }

    #[test]
    fn a_response_is_the_change_of_gradients_per_unit_of_a_value() {
        let (mesh, height, _) = example();
        let triangle = &mesh.triangles[0];
        let values = mesh.places(triangle).map(&height);
        let before = gradients(triangle, &values);
        for which in 0..6 {
            let mut more = values;
            more[which] += 1.0;
            let after = gradients(triangle, &more);
            let response = with_middles(response(&triangle.rates, which));
            for (node, response) in response.iter().enumerate() {
                assert!((after[node] - before[node] - response).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn the_range_bounds_every_place() {
        let (mesh, height, _) = example();
        let places = mesh.places(&mesh.triangles[0]);
        let [least, most] = range(&places.map(&height));
        for i in 0..=20 {
            for j in 0..=20 - i {
                let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                let at = places[0] + (places[1] - places[0]) * u + (places[2] - places[0]) * v;
                assert!((least - 1e-12..=most + 1e-12).contains(&height(at)));
            }
        }
    }
}
