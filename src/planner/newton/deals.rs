//! Waypoints redistributed: a route has a fixed number, and they matter where it turns and climbs.

use super::{LOW, USUAL};
use crate::cost::Model;
use crate::geometry::Point3;

/// How much is tried.
pub(super) struct Effort {
    /// Initial prices of breaches that a route is improved with.
    pub(super) rates: &'static [f64],
    /// Routes priced at most, in budgets of the bats.
    pub(super) budgets: u64,
    /// Rounds that a route may be too expensive in before it is given up.
    pub(super) patience: usize,
    /// Number of waypoints that may be put elsewhere.
    spares: usize,
    /// Number of legs that each of them is tried on.
    places: usize,
}

/// On level ground, where a turn limit alone can make a route too dear by a tenth.
const ON_LEVEL_GROUND: Effort = Effort {
    rates: &[USUAL, LOW],
    budgets: 3,
    patience: 1,
    spares: 2,
    places: 8,
};

/// Over hills, where all of that takes twice the time of a search and gains little.
const OVER_HILLS: Effort = Effort {
    rates: &[USUAL],
    budgets: 1,
    patience: 2,
    spares: 1,
    places: 4,
};

impl Effort {
    pub(super) fn of(model: &Model) -> &'static Self {
        if model.scenario.terrain.is_flat() {
            &ON_LEVEL_GROUND
        } else {
            &OVER_HILLS
        }
    }
}

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
