//! Waypoints redistributed: a route has a fixed number, and they matter where it turns and climbs.

use super::effort::Effort;
use crate::geometry::Point3;

/// `route` with one of its least useful waypoints put where limits are `felt` most: a route for each of a few legs.
pub(super) fn deals(effort: &Effort, felt: &[f64], route: &[Point3]) -> Vec<Vec<Point3>> {
    let detour = |idx: usize| {
        let [before, at, after] = [route[idx - 1], route[idx], route[idx + 1]];
        (at - before).norm() + (after - at).norm() - (after - before).norm()
    };
    let mut spares: Vec<usize> = (1..route.len() - 1).collect();
    spares.sort_by(|&a, &b| detour(a).total_cmp(&detour(b)));
    spares.truncate(effort.spares);
    let mut legs: Vec<usize> = (0..felt.len()).filter(|&leg| felt[leg] > 0.0).collect();
    legs.sort_by(|&a, &b| felt[b].total_cmp(&felt[a]));
    let dealt = |spare: usize, leg: usize| {
        let mut dealt = route.to_vec();
        dealt.insert(leg + 1, nalgebra::center(&route[leg], &route[leg + 1]));
        dealt.remove(if spare > leg { spare + 1 } else { spare });
        dealt
    };
    let dealt = |&spare: &usize| {
        let others = legs
            .iter()
            .filter(move |&&leg| leg != spare && leg + 1 != spare);
        let chosen = others.take(effort.places);
        chosen.map(move |&leg| dealt(spare, leg))
    };
    spares.iter().flat_map(dealt).collect()
}
