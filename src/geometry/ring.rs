//! A simple ring of points: its edges, containment, and distance.

use super::{Point2, Vector2};

/// The edges of `ring`; the last one leads back to the first point.
pub fn edges(ring: &[Point2]) -> impl Iterator<Item = (Point2, Point2)> + '_ {
    let next = ring.iter().cycle().skip(1);
    ring.iter().copied().zip(next.copied())
}

/// `ring` without points that repeat the one before, the last one among them if it repeats the first.
#[must_use]
pub fn distinct(mut ring: Vec<Point2>) -> Vec<Point2> {
    ring.dedup();
    if ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
    ring
}

/// Twice the area of the simple `ring`, square metres; negative if it is clockwise.
#[must_use]
pub fn twice_area(ring: &[Point2]) -> f64 {
    // Summed over triangles at the first point, so that no digits are lost far from the origin.
    edges(ring)
        .map(|(a, b)| (a - ring[0]).perp(&(b - ring[0])))
        .sum()
}

/// Whether the simple `ring` turns to the same side at every corner; repeated points are allowed.
#[must_use]
pub fn is_convex(ring: &[Point2]) -> bool {
    let ways: Vec<Vector2> = edges(ring)
        .map(|(a, b)| b - a)
        .filter(|way| *way != Vector2::zeros())
        .collect();
    let next = ways.iter().cycle().skip(1);
    let turns = || {
        ways.iter()
            .zip(next.clone())
            .map(|(way, next)| way.perp(next))
    };
    // A simple ring has winding number 1, so one sign suffices.
    turns().all(|turn| turn >= 0.0) || turns().all(|turn| turn <= 0.0)
}

/// Whether `point` lies inside `ring`, by the even-odd rule; on the ring itself, either.
#[must_use]
pub fn contains(ring: &[Point2], point: Point2) -> bool {
    let crossed = edges(ring).filter(|edge| is_crossed(*edge, point));
    crossed.count() % 2 == 1
}

/// Whether the ray from `point` to the right crosses an edge.
#[must_use]
pub fn is_crossed((a, b): (Point2, Point2), point: Point2) -> bool {
    (a.y > point.y) != (b.y > point.y)
        && point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y)
}

/// Distance of `point` from the edges of `ring`, metres; infinite without edges.
#[must_use]
pub fn distance(ring: &[Point2], point: Point2) -> f64 {
    edges(ring)
        .map(|edge| squared_distance(edge, point))
        .fold(f64::INFINITY, f64::min)
        .sqrt()
}

/// Squared distance of `point` from an edge, square metres.
#[must_use]
pub fn squared_distance((a, b): (Point2, Point2), point: Point2) -> f64 {
    let along = b - a;
    let t = (point - a).dot(&along) / along.norm_squared();
    // An edge of length 0 is its point.
    let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
    (point - (a + along * t)).norm_squared()
}

/// Where on the first of two segments they cross, as a share of it; `None` where they do not, or only touch.
#[must_use]
pub fn crossing((a, b): (Point2, Point2), (c, d): (Point2, Point2)) -> Option<f64> {
    let (one, other) = (b - a, d - c);
    let (a_off, b_off) = (other.perp(&(a - c)), other.perp(&(b - c)));
    let (c_off, d_off) = (one.perp(&(c - a)), one.perp(&(d - a)));
    let apart = |p: f64, q: f64| (p > 0.0 && q < 0.0) || (p < 0.0 && q > 0.0);
    (apart(a_off, b_off) && apart(c_off, d_off)).then(|| a_off / (a_off - b_off))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_with_a_repeated_corner() {
        let ring = [
            [0.0, 0.0],
            [10.0, 0.0],
            [10.0, 10.0],
            [10.0, 10.0],
            [0.0, 10.0],
        ];
        let ring = ring.map(Point2::from);
        let check = |x, y, inside, expected: f64| {
            let point = Point2::new(x, y);
            assert_eq!(contains(&ring, point), inside, "{point}");
            assert!((distance(&ring, point) - expected).abs() < 1e-12, "{point}");
        };
        check(4.0, 5.0, true, 4.0);
        check(13.0, 14.0, false, 5.0);
        check(5.0, -2.0, false, 2.0);
        let mut clockwise = ring;
        clockwise.reverse();
        for (ring, expected) in [(ring, 200.0), (clockwise, -200.0)] {
            assert!((twice_area(&ring) - expected).abs() < 1e-12);
        }
    }
}
