//! Eq. 13 as a move of the route: a neighbour that differs in one place, drawn in space.
//!
//! Here a route is the position of its Cartesian coding: x, y and the height above ground of each free waypoint. Moves
//! keep heights above ground, so that none needs an elevation anywhere.

use super::coding::PER_WAYPOINT;
use crate::cost::Model;
use crate::geometry::{LEVEL, Point2, Point3};
use crate::optimizer::Random;

/// x, y, height above ground.
type Waypoint = [f64; PER_WAYPOINT];

/// Moves for the routes of one scenario.
pub(super) struct Moves<'s> {
    model: Model<'s>,
    /// Metres from start to target.
    way: f64,
    start: Waypoint,
    target: Waypoint,
}

impl<'s> Moves<'s> {
    pub(super) fn new(model: &Model<'s>) -> Self {
        let scenario = model.scenario;
        let coded = |end: Point3| [end.x, end.y, scenario.terrain.height_of(end)];
        Self {
            model: model.clone(),
            way: scenario.direct(),
            start: coded(scenario.start),
            target: coded(scenario.target),
        }
    }

    /// Change the route of `position` in one place, by up to about `size` (0 to 1) of the way from
    /// start to target. It stays within the area, and the heights that are allowed there.
    pub(super) fn move_a_part(&self, position: &mut [f64], random: &mut Random, size: f64) {
        let (route, _) = position.as_chunks_mut::<PER_WAYPOINT>();
        let reach = self.way * size * order(random.unit());
        let kind = random.unit();
        if kind < 0.55 {
            self.shift(route, random, reach);
        } else if kind < 0.75 {
            self.lift(route, random, reach);
        } else if kind < 0.9 || route.len() < 2 {
            self.slide(route, random);
        } else {
            self.transplant(route, random, reach);
        }
    }

    /// Move one to four neighbouring waypoints sideways, the middle one farthest.
    fn shift(&self, route: &mut [Waypoint], random: &mut Random, reach: f64) {
        let (first, count) = part(route.len(), random);
        let [dx, dy] = random.normals().map(|normal| normal * reach);
        for (offset, waypoint) in route[first..first + count].iter_mut().enumerate() {
            let share = hat(offset, count);
            let [x, y, height] = *waypoint;
            *waypoint = self.within([x + dx * share, y + dy * share, height]);
        }
    }

    /// Move one to four neighbouring waypoints up or down.
    fn lift(&self, route: &mut [Waypoint], random: &mut Random, reach: f64) {
        let (first, count) = part(route.len(), random);
        let rise = random.normal() * reach;
        for (offset, waypoint) in route[first..first + count].iter_mut().enumerate() {
            let [x, y, height] = *waypoint;
            *waypoint = self.within([x, y, height + rise * hat(offset, count)]);
        }
    }

    /// Move a waypoint along one of its legs.
    fn slide(&self, route: &mut [Waypoint], random: &mut Random) {
        let idx = random.below(route.len());
        let [before, after] = self.neighbours(route, idx);
        let towards = if random.unit() < 0.5 { before } else { after };
        let share = random.unit() * random.unit() * if random.unit() < 0.5 { 1.0 } else { -0.5 };
        let [x, y, height] = route[idx];
        let at = |own: f64, other: f64| own + (other - own) * share;
        route[idx] = self.within([at(x, towards[0]), at(y, towards[1]), height]);
    }

    /// Move a waypoint from its place into another leg.
    fn transplant(&self, route: &mut [Waypoint], random: &mut Random, reach: f64) {
        let from = random.below(route.len());
        let into = random.below(route.len());
        if into > from {
            route[from..=into].rotate_left(1);
        } else {
            route[into..=from].rotate_right(1);
        }
        let [before, after] = self.neighbours(route, into);
        let share = random.unit();
        let between = |dim: usize| before[dim] + (after[dim] - before[dim]) * share;
        let (dx, dy) = (after[0] - before[0], after[1] - before[1]);
        let length = (dx * dx + dy * dy).sqrt();
        let aside = if length < LEVEL {
            0.0
        } else {
            random.normal() * reach / length
        };
        // Where a leg climbs over a threat, or down from it, a waypoint placed on it is too high or too low.
        let height = if random.unit() < 0.5 {
            between(2)
        } else {
            self.model.scenario.altitude.middle()
        };
        route[into] = self.within([between(0) - dy * aside, between(1) + dx * aside, height]);
    }

    /// The waypoints before and after number `idx`, or the ends of the route.
    fn neighbours(&self, route: &[Waypoint], idx: usize) -> [Waypoint; 2] {
        let before = if idx == 0 { self.start } else { route[idx - 1] };
        let after = route.get(idx + 1).copied().unwrap_or(self.target);
        [before, after]
    }

    fn within(&self, [x, y, height]: Waypoint) -> Waypoint {
        let at = self.model.scenario.area.nearest(Point2::new(x, y));
        let (floor, ceiling) = self.model.heights_over(at);
        [at.x, at.y, height.clamp(floor, ceiling)]
    }
}

/// Sizes of every order down to exp(-5), as `share` goes from 0 to 1: near the optimum most steps must be small.
fn order(share: f64) -> f64 {
    let sixth = 1.0 - 0.5654 * share;
    let half = sixth * sixth * sixth;
    half * half
}

/// The first of one to four neighbours among `free` waypoints, and how many they are.
fn part(free: usize, random: &mut Random) -> (usize, usize) {
    let count = 1 + random.below(4.min(free));
    (random.below(free - count + 1), count)
}

/// Share of the move of the waypoint at `offset` of `count`.
fn hat(offset: usize, count: usize) -> f64 {
    let middle = 0.5 * (count - 1) as f64;
    1.0 - (offset as f64 - middle).abs() / (middle + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::coding::Cartesian;
    use crate::planner::tests::scenario;

    /// Every move stays in the box, and over many moves every coordinate is changed.
    #[test]
    fn moves_stay_in_the_box_and_reach_every_waypoint() {
        let scenario = scenario();
        let model = Model::new(&scenario);
        let moves = Moves::new(&model);
        for waypoints in [1, 2, 3, 10] {
            let space = Cartesian::with_ends(&model, waypoints);
            let bounds = space.bounds();
            let mut random = Random::new(3);
            let mut base = vec![0.0; bounds.dimension()];
            bounds.draw(&mut random, &mut base);
            let mut moved = vec![false; bounds.dimension()];
            for _ in 0..2000 {
                let mut candidate = base.clone();
                moves.move_a_part(&mut candidate, &mut random, 0.5);
                assert_ne!(candidate, base);
                for (dim, value) in candidate.iter().enumerate() {
                    assert!((bounds.lower[dim]..=bounds.upper[dim]).contains(value));
                    moved[dim] |= value.to_bits() != base[dim].to_bits();
                }
            }
            assert!(moved.into_iter().all(|moved| moved), "N = {waypoints}");
        }
    }
}
