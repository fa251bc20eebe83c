//! Waypoints redistributed: a route has a fixed number, and they matter where it turns and climbs.

use crate::geometry::Point3;

/// Number of legs that it is tried on.
const PLACES: usize = 4;

/// `route` with its least useful waypoint put where limits are felt most: one route for each of a few legs.
pub(super) fn deals(felt: &[f64], route: &[Point3]) -> Vec<Vec<Point3>> {
    let detour = |idx: &usize| {
        let [before, at, after] = [route[idx - 1], route[*idx], route[idx + 1]];
        (at - before).norm() + (after - at).norm() - (after - before).norm()
    };
    let Some(spare) = (1..route.len() - 1).min_by(|a, b| detour(a).total_cmp(&detour(b))) else {
        return Vec::new();
    };
    let mut legs: Vec<usize> = (0..felt.len())
        .filter(|&leg| leg != spare && leg + 1 != spare && felt[leg] > 0.0)
        .collect();
    legs.sort_by(|&a, &b| felt[b].total_cmp(&felt[a]).then(a.cmp(&b)));
    let dealt = |&leg: &usize| {
        let mut dealt = route.to_vec();
        dealt.insert(leg + 1, nalgebra::center(&route[leg], &route[leg + 1]));
        dealt.remove(if spare > leg { spare + 1 } else { spare });
        dealt
    };
    legs.iter().take(PLACES).map(dealt).collect()
}
