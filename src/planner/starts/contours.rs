//! Ways down a mountain too steep to fly straight down: along its flanks, as steeply as the vehicle can.
//!
//! A net of places has no such ways unless its legs happen to follow the contours, and a straight leg between two
//! places on a steep flank leaves the altitude band. Even the chains of `flanks` miss some, as along a cliff no wider
//! than a cell of the ground. A walker finds them: it goes straight for the target where the ground allows, and
//! elsewhere turns aside, always to the same side, until the ground under it is just steep enough to fly.

use super::net::Found;
use super::thin::thin;
use super::{direction, lifted, steepest};
use crate::cost::Model;
use crate::geometry::{Point2, Point3, Vector2, wrap_angle};
use crate::planner::price::pricer;
use crate::scenario::Scenario;

/// How steep the ground under the walker may be, as shares of what the vehicle can climb. The route lies inside its
/// bends, and needs a lower share where it has few waypoints.
const SHARES: [f64; 3] = [0.6, 0.85, 0.97];

/// The side to which it turns aside.
const SIDES: [f64; 2] = [1.0, -1.0];

/// Its steps, as a share of the direct way.
const STEP: f64 = 0.005;

/// A walker that has not arrived after this many steps is going in circles.
const STEPS: usize = 4_000;

/// Its greatest turn per step, radians.
const TURN: f64 = 0.12;

/// A walker going round a mountain continues until the target is ahead, no more than this to either side, radians:
/// turning back sooner leads to and fro on one flank, where the bends use up the waypoints.
const AHEAD: f64 = 0.5;

/// A place is kept along the way for each of this many radians of turning.
const PLACE_TURN: f64 = 0.15;

/// A place is kept for each such share of the way's length.
const PLACE_SHARE: f64 = 0.05;

/// Maximum number of places kept.
const PLACES: usize = 120;

/// Routes that follow the ground round mountains, from the higher end to the lower; none where the straight way is not
/// too steep. Once `is_over`, those found so far.
pub(super) fn routes(model: &Model, is_over: &dyn Fn() -> bool) -> Found {
    let scenario = model.scenario;
    let pricer = pricer(model).verdicts();
    let mut found = Found::default();
    for (side, share) in SIDES
        .iter()
        .flat_map(|&side| SHARES.map(|share| (side, share)))
    {
        if is_over() {
            break;
        }
        if let Some(way) = walk(scenario, side, share * steepest(scenario)) {
            let (route, legs_priced) = thin(model, &pricer, &places(scenario, &way, PLACES));
            // For few waypoints the best places may be those of a short cut that breaks one limit by far, instead of
            // many by a little, which are easily repaired.
            let even = places(scenario, &way, scenario.planner.waypoints);
            found.routes.extend([route, even]);
            found.legs_priced += legs_priced;
        }
    }
    found
}

/// The way of the walker, from the start to the target; `None` when it never had to turn aside, or did not arrive.
fn walk(scenario: &Scenario, side: f64, steep: f64) -> Option<Vec<Point2>> {
    let ends = [scenario.start, scenario.target].map(|end| end.xy());
    let height = |at: Point2| scenario.terrain.elevation(at);
    let is_downhill = height(ends[0]) >= height(ends[1]);
    let [from, to] = if is_downhill {
        ends
    } else {
        [ends[1], ends[0]]
    };
    let step = STEP * (to - from).norm();
    let mut way = vec![from];
    let (mut at, mut heading) = (from, None);
    let (mut is_aside, mut was_aside) = (false, false);
    while (to - at).norm() > step {
        if way.len() == STEPS {
            return None;
        }
        let straight = heading_of(to - at);
        let before: f64 = heading.unwrap_or(straight);
        let rise = rise(scenario, at, step);
        let is_too_steep = rise.dot(&direction(straight)).abs() > steep;
        let goes_on = is_aside && wrap_angle(straight - before).abs() > AHEAD;
        is_aside = rise.norm() > steep && (is_too_steep || goes_on);
        was_aside |= is_aside;
        let wanted = if is_aside {
            // Downhill from the start, even where that leads round the back, and uphill to the target.
            let is_near = (to - at).norm() < (from - at).norm();
            let goes_up = is_near && height(at) < height(to);
            let fall_line = heading_of(if goes_up { rise } else { -rise });
            fall_line + side * libm::acos(steep / rise.norm())
        } else {
            straight
        };
        let turned = before + wrap_angle(wanted - before).clamp(-TURN, TURN);
        heading = Some(turned);
        at = scenario.area.nearest(at + direction(turned) * step);
        way.push(at);
    }
    way.push(to);
    if !is_downhill {
        way.reverse();
    }
    was_aside.then_some(way)
}

/// Metres that the ground rises per metre, and in which direction.
fn rise(scenario: &Scenario, at: Point2, step: f64) -> Vector2 {
    let height = |x: f64, y: f64| scenario.terrain.elevation(Point2::new(at.x + x, at.y + y));
    Vector2::new(
        height(step, 0.0) - height(-step, 0.0),
        height(0.0, step) - height(0.0, -step),
    ) / (2.0 * step)
}

fn heading_of(way: Vector2) -> f64 {
    libm::atan2(way.y, way.x)
}

/// At most `most` places along a way, fewer where it has few bends, in the middle of the band.
fn places(scenario: &Scenario, way: &[Point2], most: usize) -> Vec<Point3> {
    let whole: f64 = way.windows(2).map(|step| (step[1] - step[0]).norm()).sum();
    let progress = |steps: &[Point2]| {
        let [before, after] = [steps[1] - steps[0], steps[2] - steps[1]];
        let turn = libm::atan2(before.perp(&after), before.dot(&after)).abs();
        turn / PLACE_TURN + before.norm() / (PLACE_SHARE * whole)
    };
    let all: f64 = way.windows(3).map(progress).sum();
    let each = (all / (most + 1) as f64).max(1.0);
    let mut chain = vec![scenario.start];
    let mut gone = 0.0;
    for steps in way.windows(3) {
        gone += progress(steps);
        if gone >= each && chain.len() <= most {
            gone -= each;
            chain.push(lifted(scenario, steps[1], 0.5));
        }
    }
    chain.push(scenario.target);
    chain
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::mountain;

    /// Plans of the same mountain, down and up, are made in the tests of `flanks`.
    #[test]
    fn a_mountain_that_is_too_steep_is_left_along_its_flanks_on_both_sides() {
        for is_down in [true, false] {
            let scenario = mountain(250.0, is_down);
            let steep = 0.85 * steepest(&scenario);
            for side in SIDES {
                let way = walk(&scenario, side, steep).expect("it arrives");
                assert_eq!(way[0], scenario.start.xy());
                assert_eq!(way[way.len() - 1], scenario.target.xy());
                // After its initial turns, the way follows ground of nearly the allowed steepness.
                let slopes = way.windows(2).skip(20).map(|step| {
                    let heights = [step[0], step[1]].map(|at| scenario.terrain.elevation(at));
                    (heights[1] - heights[0]).abs() / (step[1] - step[0]).norm()
                });
                let steps = way.len() - 60;
                let too_steep = slopes.take(steps).filter(|slope| *slope > 1.2 * steep);
                let too_steep = too_steep.count();
                assert!(too_steep * 10 < steps, "{too_steep} of {steps}");
            }
            let model = Model::new(&scenario);
            let found = routes(&model, &|| false);
            assert_eq!(found.routes.len(), 2 * SIDES.len() * SHARES.len());
        }
    }

    #[test]
    fn a_hill_that_is_not_too_steep_gets_no_ways_around_it() {
        let scenario = mountain(30.0, true);
        let found = routes(&Model::new(&scenario), &|| false);
        assert!(found.routes.is_empty() && found.legs_priced == 0);
    }
}
