//! Ways round the threats, known as seen from above, at the heights of a route.

use crate::geometry::{Point2, Point3};

/// The route through `corners` from the start to the target of `route`, over level ground: as high as `route` is after the
/// same share of its way.
pub(in crate::planner) fn at_heights_of(route: &[Point3], corners: &[Point2]) -> Vec<Point3> {
    let (start, target) = (route[0], route[route.len() - 1]);
    let seen: Vec<Point2> = route.iter().map(Point3::xy).collect();
    let known = shares(&seen);
    let height = |share: f64| {
        let next = known.partition_point(|known| *known < share);
        let next = next.clamp(1, known.len() - 1);
        let (before, after) = (known[next - 1], known[next]);
        let part = (share - before) / (after - before);
        // No part of a leg without extent.
        let part = if part.is_finite() { part } else { 0.0 };
        let [low, high] = [route[next - 1].z, route[next].z];
        low + (high - low) * part.clamp(0.0, 1.0)
    };
    let way: Vec<Point2> = std::iter::once(start.xy())
        .chain(corners.iter().copied())
        .chain([target.xy()])
        .collect();
    let reached = shares(&way);
    let free = corners.iter().zip(&reached[1..]);
    let free = free.map(|(corner, share)| Point3::new(corner.x, corner.y, height(*share)));
    std::iter::once(start).chain(free).chain([target]).collect()
}

/// The share of the whole way after which each of the `points` is reached.
fn shares(points: &[Point2]) -> Vec<f64> {
    let mut flown = 0.0;
    let mut ways = vec![flown];
    for leg in points.windows(2) {
        flown += (leg[1] - leg[0]).norm();
        ways.push(flown);
    }
    ways.iter().map(|way| way / flown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at([x, y, z]: [f64; 3]) -> Point3 {
        Point3::new(x, y, z)
    }

    #[test]
    fn corners_are_as_high_as_the_route_is_after_the_same_share_of_its_way() {
        let straight = [[0.0, 0.0, 0.0], [50.0, 0.0, 40.0], [100.0, 0.0, 60.0]].map(at);
        // 30 + 40 + 30 of 100 m.
        let corners = [Point2::new(0.0, 30.0), Point2::new(40.0, 30.0)];
        let target = at([40.0, 0.0, 60.0]);
        let [a, b, _] = straight;
        let route = at_heights_of(&[a, b, target], &corners);
        let ways = 50.0 + 10.0;
        let height = |share: f64| {
            let flown = share * ways;
            if flown < 50.0 {
                0.8 * flown
            } else {
                40.0 + 2.0 * (flown - 50.0)
            }
        };
        assert_eq!((route[0], route[3]), (a, target));
        for (point, share) in route[1..3].iter().zip([0.3, 0.7]) {
            assert!((point.z - height(share)).abs() < 1e-9, "{point}");
        }
    }

    #[test]
    fn a_route_without_extent_has_a_height() {
        let up = [[5.0, 5.0, 0.0], [5.0, 5.0, 10.0], [5.0, 5.0, 20.0]].map(at);
        let route = at_heights_of(&up, &[Point2::new(5.0, 5.0)]);
        assert!(route.len() == 3 && route[1].z.is_finite());
    }
}
