//! How far each wall may be widened: not over the ends, except for one wall around each.

use super::border::border;
use super::prices::Prices;
use super::toll::Heights;
use super::wall::Wall;
use crate::geometry::Point2;
use crate::scenario::Scenario;
use crate::threat::Threat;

/// All walls of `scenario`: its threats, and the border where it matters.
pub(super) fn walls(scenario: &Scenario, prices: &Prices) -> Vec<Wall> {
    let heights = Heights::of(scenario);
    let wall = |threat: &Threat| Wall::new(threat, scenario, prices, &heights);
    let mut walls: Vec<Wall> = scenario.threats.iter().filter_map(wall).collect();
    walls.extend(border(&walls, &scenario.area, prices));
    let ends = prices.ends.map(|end| end.xy());
    let first = Around::of(&walls, ends, None, prices);
    let taken = first.map(|first| first.wall);
    let around = [first, Around::of(&walls, [ends[1], ends[0]], taken, prices)];
    // For each end, the way straight out of the wall around it.
    let out = [0, 1].map(|end| {
        let farthest = around[end].map(|around| walls[around.wall].out(ends[end], around.radius));
        (ends[end], farthest.unwrap_or(ends[end]))
    });
    for (idx, wall) in walls.iter_mut().enumerate() {
        let mut most = f64::INFINITY;
        for end in 0..2 {
            most = most.min(match around[end] {
                Some(around) if around.wall == idx => around.radius,
                _ => wall.distance_to_way(out[end]),
            });
        }
        wall.widen(prices, most);
    }
    for end in 0..2 {
        // A wall too near to the other end's way out cannot be around this one.
        if let Some(around) = around[end]
            && !walls[around.wall].is_around(ends[end])
        {
            let nearest = walls[around.wall].distance(ends[end]);
            let wall = &mut walls[around.wall];
            let most = nearest.min(wall.wide);
            wall.widen(prices, most);
        }
    }
    walls
}

/// A wall that may be widened over an end.
#[derive(Debug, Clone, Copy)]
struct Around {
    wall: usize,
    /// Maximum radius: straight out to there, no other wall is in the way.
    radius: f64,
}

impl Around {
    /// Of the eligible walls, the one in whose soft zone the first of `ends` is deepest, except the one that is
    /// `taken`.
    fn of(
        walls: &[Wall],
        ends: [Point2; 2],
        taken: Option<usize>,
        prices: &Prices,
    ) -> Option<Self> {
        let depth = |wall: usize| walls[wall].influence - walls[wall].distance(ends[0]);
        let can_be = |idx: &usize| {
            let wall = &walls[*idx];
            taken != Some(*idx) && wall.toll.is_none() && wall.is_convex() && depth(*idx) > 0.0
        };
        let mut candidates: Vec<usize> = (0..walls.len()).filter(can_be).collect();
        candidates.sort_by(|one, other| depth(*other).total_cmp(&depth(*one)));
        candidates.into_iter().find_map(|wall| {
            let within = walls[wall].distance(ends[0]);
            let mut widened = walls[wall].clone();
            let radii = [1.0, 0.75, 0.5, 0.25].map(|share| within + share * depth(wall));
            let is_possible = |radius: &f64| {
                let way = (ends[0], widened.out(ends[0], *radius));
                widened.widen(prices, radius.min(widened.distance(ends[1])));
                let mut others = walls.iter().enumerate().filter(|(other, _)| *other != wall);
                widened.is_around(ends[0])
                    && others.all(|(_, other)| other.distance_to_way(way) > other.core)
            };
            let radius = radii.into_iter().find(is_possible)?;
            Some(Self { wall, radius })
        })
    }
}
