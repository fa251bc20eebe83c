//! Waypoints redistributed: a route has a fixed number, and they matter where it turns and climbs.

use super::effort::Effort;
use crate::geometry::Point3;

/// `route` with one of its least useful waypoints put where limits are `felt` most: a route for each of a few legs.
pub(super) fn deals(effort: &Effort, felt: &[f64], route: &[Point3]) -> Vec<Vec<Point3>> {
    let mut legs: Vec<usize> = (0..felt.len()).filter(|&leg| felt[leg] > 0.0).collect();
    legs.sort_by(|&a, &b| felt[b].total_cmp(&felt[a]));
    dealt(route, effort.spares, &legs, effort.places)
}

/// `route` with one of the `spares` waypoints that make it longer by least put on the middle of one of `legs`: of those
/// that do not end in it the first `places`.
pub(in crate::planner) fn dealt(
    route: &[Point3],
    spares: usize,
    legs: &[usize],
    places: usize,
) -> Vec<Vec<Point3>> {
    let detour = |idx: usize| {
        let [before, at, after] = [route[idx - 1], route[idx], route[idx + 1]];
        (at - before).norm() + (after - at).norm() - (after - before).norm()
    };
    let mut least: Vec<usize> = (1..route.len() - 1).collect();
    least.sort_by(|&a, &b| detour(a).total_cmp(&detour(b)));
    least.truncate(spares);
    let moved = |spare: usize, leg: usize| {
        let mut moved = route.to_vec();
        moved.insert(leg + 1, nalgebra::center(&route[leg], &route[leg + 1]));
        moved.remove(if spare > leg { spare + 1 } else { spare });
        moved
    };
    let moves = |&spare: &usize| {
        let others = legs
            .iter()
            .filter(move |&&leg| leg != spare && leg + 1 != spare);
        others.take(places).map(move |&leg| moved(spare, leg))
    };
    least.iter().flat_map(moves).collect()
}
