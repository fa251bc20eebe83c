//! Eq. 13 as a move of the route: a neighbour that differs in one place, drawn in space and not in
//! the numbers of the coding.

use crate::geometry::{LEVEL, Point2, Point3};
use crate::optimizer::Random;
use crate::scenario::Scenario;

/// Change `route` in one place, by up to about `size` (0 to 1) of the way from start to target.
pub(super) fn move_a_part(
    scenario: &Scenario,
    route: &mut [Point3],
    random: &mut Random,
    size: f64,
) {
    let free = route.len() - 2;
    let way = (scenario.target - scenario.start).norm();
    // Sizes of every order: most steps near the optimum must be small.
    let reach = way * size * libm::exp(-5.0 * random.unit());
    let kind = random.unit();
    if kind < 0.55 {
        shift(scenario, route, random, reach);
    } else if kind < 0.75 {
        lift(scenario, route, random, reach);
    } else if kind < 0.9 || free < 2 {
        slide(scenario, route, random);
    } else {
        transplant(scenario, route, random, reach);
    }
}

/// One to four neighbouring waypoints aside, the middle one farthest.
fn shift(scenario: &Scenario, route: &mut [Point3], random: &mut Random, reach: f64) {
    let free = route.len() - 2;
    let (first, count) = part(free, random);
    let (dx, dy) = (random.normal() * reach, random.normal() * reach);
    for offset in 0..count {
        let share = hat(offset, count);
        let point = route[first + offset];
        route[first + offset] = moved(
            scenario,
            point,
            Point2::new(point.x + dx * share, point.y + dy * share),
            0.0,
        );
    }
}

/// One to four neighbouring waypoints up or down.
fn lift(scenario: &Scenario, route: &mut [Point3], random: &mut Random, reach: f64) {
    let free = route.len() - 2;
    let (first, count) = part(free, random);
    let rise = random.normal() * reach;
    for offset in 0..count {
        let point = route[first + offset];
        route[first + offset] = moved(scenario, point, point.xy(), rise * hat(offset, count));
    }
}

/// A waypoint along one of its legs.
fn slide(scenario: &Scenario, route: &mut [Point3], random: &mut Random) {
    let idx = 1 + random.below(route.len() - 2);
    let towards = if random.unit() < 0.5 {
        route[idx - 1]
    } else {
        route[idx + 1]
    };
    let share = random.unit() * random.unit() * if random.unit() < 0.5 { 1.0 } else { -0.5 };
    let point = route[idx];
    let at = point.xy() + (towards.xy() - point.xy()) * share;
    route[idx] = moved(scenario, point, at, 0.0);
}

/// A waypoint out of its place and into another leg.
fn transplant(scenario: &Scenario, route: &mut [Point3], random: &mut Random, reach: f64) {
    let free = route.len() - 2;
    let from = 1 + random.below(free);
    let into = 1 + random.below(free);
    if into > from {
        route[from..=into].rotate_left(1);
    } else {
        route[into..=from].rotate_right(1);
    }
    let (before, after) = (route[into - 1], route[into + 1]);
    let middle = before + (after - before) * random.unit();
    let way = after.xy() - before.xy();
    let length = way.norm();
    let aside = if length < LEVEL {
        way
    } else {
        nalgebra::Vector2::new(-way.y, way.x) / length * (random.normal() * reach)
    };
    route[into] = moved(scenario, middle, middle.xy() + aside, 0.0);
}

fn part(free: usize, random: &mut Random) -> (usize, usize) {
    let count = 1 + random.below(4.min(free));
    (1 + random.below(free - count + 1), count)
}

/// Share of the move of the waypoint at `offset` of `count`.
fn hat(offset: usize, count: usize) -> f64 {
    let middle = 0.5 * (count - 1) as f64;
    1.0 - (offset as f64 - middle).abs() / (middle + 1.0)
}

/// `point` at `at`, as high above ground as before and `rise` more, within area and band.
fn moved(scenario: &Scenario, point: Point3, at: Point2, rise: f64) -> Point3 {
    let area = &scenario.area;
    let at = Point2::new(
        at.x.clamp(area.min.x, area.max.x),
        at.y.clamp(area.min.y, area.max.y),
    );
    let height = point.z - scenario.terrain.elevation(point.xy()) + rise;
    let height = height.clamp(scenario.altitude.min, scenario.altitude.max);
    Point3::new(at.x, at.y, scenario.terrain.elevation(at) + height)
}
