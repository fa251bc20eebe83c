//! Ways that turn by the same angle after each of their legs, which are as long as each other: where there is room for
//! nothing else, or legs must be long, these climb farthest.
//!
//! The end of `m` legs of length `l` with turns `t` between them is `l sin(m t / 2) / sin(t / 2)` away from their
//! beginning, the sum of a geometric series: for a given length of the whole, few turns end at the target.

use std::f64::consts::{PI, TAU};

use super::super::net::Found;
use super::{SLACK, steepest};
use crate::cost::Model;
use crate::geometry::{Point2, Point3};
use crate::optimizer::share_of;
use crate::planner::price::{Priced, price};
use crate::planner::same;
use crate::planner::starts::direction;

/// Maximum number of ways returned.
const ROUTES: usize = 8;

/// Lengths of the whole way, as multiples of what the climb takes.
const LENGTHS: [f64; 6] = [1.0, 1.05, 1.1, 1.2, 1.3, 1.5];

/// Numbers of legs, as shares of as many as there may be.
const SHARES: [f64; 10] = [1.0, 0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2];

/// Ways that are priced: those that leave the area least.
const PRICED: usize = 1_000;

/// Turns tried in each of the intervals between two for which the legs close a ring.
const TRIED: usize = 16;

/// Halvings of such an interval that may hold a turn: to the last digit.
const HALVINGS: usize = 52;

/// The best few from start to target; none where the direct way is long enough to climb.
pub(super) fn routes(model: &Model) -> Found {
    let scenario = model.scenario;
    let mut found = Found::default();
    let way = scenario.target - scenario.start;
    let (away, least) = (way.xy().norm(), way.z.abs() / steepest(scenario));
    if least <= away {
        return found;
    }
    let mut ways: Vec<(f64, Vec<Point3>)> = Vec::new();
    for times in LENGTHS {
        let length = least * times * (1.0 + SLACK);
        for legs in numbers(model, length) {
            let turns = turns(legs, away / length, scenario.vehicle.max_turn());
            for turn in turns.into_iter().flat_map(|turn| [turn, -turn]) {
                let route = winding(model, legs, length / legs as f64, turn);
                let outside = route.iter().map(|at| scenario.area.excess(at.xy()));
                ways.push((outside.sum(), route));
            }
        }
    }
    // Of those inside, the shorter ones come first.
    ways.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    ways.truncate(PRICED);
    let mut priced: Vec<Priced> = Vec::new();
    for (_, route) in ways {
        found.legs_priced += route.len() as u64 - 1;
        priced.push((price(model, &route), route));
    }
    priced.sort_by(|one, other| one.0.rank(&other.0));
    for (_, route) in priced {
        let is_known = |other: &Vec<Point3>| same(scenario, &route, other);
        if !found.routes.iter().any(is_known) {
            found.routes.push(route);
        }
        if found.routes.len() == ROUTES {
            break;
        }
    }
    found
}

/// Numbers of legs that a way of this length may have, the most first.
fn numbers(model: &Model, length: f64) -> Vec<usize> {
    let scenario = model.scenario;
    let rise = scenario.target.z - scenario.start.z;
    let shortest = scenario.vehicle.min_leg * (1.0 + SLACK);
    let asked = scenario.planner.waypoints + 1;
    let fit = libm::hypot(length, rise) / shortest / asked as f64;
    let most = share_of(asked, fit.min(1.0));
    let mut numbers = SHARES.map(|share| share_of(most, share)).to_vec();
    numbers.dedup();
    numbers.retain(|&number| number > 2);
    numbers
}

/// The turns, above 0 and at most `most`, after which `legs` legs end at this share of their length away from where they
/// began.
fn turns(legs: usize, share: f64, most: f64) -> Vec<f64> {
    let most = most * (1.0 - SLACK);
    let count = legs as f64;
    let beyond = |turn: f64| {
        let sum = libm::sin(0.5 * count * turn) / (count * libm::sin(0.5 * turn));
        sum.abs() - share
    };
    let step = TAU / (count * TRIED as f64);
    let mut turns = Vec::new();
    let mut low = step * SLACK;
    while low < most {
        let high = (low + step).min(most);
        if beyond(low) * beyond(high) <= 0.0 {
            let (mut from, mut to) = (low, high);
            for _ in 0..HALVINGS {
                let middle = f64::midpoint(from, to);
                if beyond(from) * beyond(middle) <= 0.0 {
                    to = middle;
                } else {
                    from = middle;
                }
            }
            turns.push(f64::midpoint(from, to));
        }
        low = high;
    }
    turns
}

/// From start to target by so many `legs`, each of `length` along the ground and turning by `turn` after the one before,
/// evenly up or down.
fn winding(model: &Model, legs: usize, length: f64, turn: f64) -> Vec<Point3> {
    let scenario = model.scenario;
    let [start, target] = [scenario.start, scenario.target];
    let way = (target - start).xy();
    let count = legs as f64;
    // Along the sum of all legs, or against it.
    let is_ahead = libm::sin(0.5 * count * turn) / libm::sin(0.5 * turn) >= 0.0;
    let about = libm::atan2(way.y, way.x) + if is_ahead { 0.0 } else { PI };
    let first = about - 0.5 * (count - 1.0) * turn;
    let mut at: Point2 = start.xy();
    let mut route = vec![start];
    for leg in 1..legs {
        at += direction(first + turn * (leg - 1) as f64) * length;
        let z = start.z + (target.z - start.z) * (leg as f64 / count);
        route.push(Point3::new(at.x, at.y, z));
    }
    route.push(target);
    route
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::turns as headings;
    use crate::planner::tests::scenario;
    use crate::planner::{Nobody, plan};
    use crate::scenario::{Scenario, Seeding};

    /// Up a shaft in which there is room for a bow and little more.
    fn shaft(min_leg: f64) -> Scenario {
        let mut scenario = scenario();
        scenario.threats.clear();
        scenario.start = Point3::new(500.0, 500.0, 0.0);
        scenario.target = Point3::new(531.8, 523.1, 28.5);
        scenario.area.min = Point2::new(485.4, 492.9);
        scenario.area.max = Point2::new(536.8, 546.4);
        (scenario.altitude.min, scenario.altitude.max) = (0.0, 39.0);
        scenario.weights.altitude = 0.0;
        scenario.vehicle.max_turn_deg = 60.0;
        scenario.vehicle.max_climb_deg = 10.0;
        scenario.vehicle.min_leg = min_leg;
        scenario.planner.waypoints = 8;
        scenario.planner.seeding = Seeding::Tangent;
        scenario.planner.polish = true;
        (scenario.planner.population, scenario.planner.iterations) = (20, 20);
        scenario
    }

    #[test]
    fn legs_are_as_long_as_each_other_and_turn_evenly() {
        let scenario = shaft(15.0);
        let model = Model::new(&scenario);
        let least = 28.5 / steepest(&scenario);
        let found = routes(&model);
        assert!(!found.routes.is_empty());
        for route in &found.routes {
            let lengths = route.windows(2).map(|ends| (ends[1] - ends[0]).xy().norm());
            let lengths: Vec<f64> = lengths.collect();
            let turns: Vec<f64> = headings(route).skip(1).collect();
            assert!(lengths.iter().sum::<f64>() >= least);
            for length in &lengths {
                assert!((length - lengths[0]).abs() < 1e-6, "{lengths:?}");
            }
            for turn in &turns {
                assert!((turn - turns[0]).abs() < 1e-6, "{turns:?}");
            }
        }
        assert!(price(&model, &found.routes[0]).is_feasible());
    }

    /// As long as the climb takes, which no route undercuts.
    #[test]
    fn a_climb_in_a_shaft_is_planned_whatever_the_shortest_leg() {
        for min_leg in [0.0, 5.0, 15.0] {
            let scenario = shaft(min_leg);
            let outcome = plan(&scenario, &mut Nobody, &Nobody);
            assert!(outcome.feasible, "{min_leg}");
            let (total, lower) = (outcome.cost.total, outcome.bound.lower);
            assert!(total < 1.001 * lower, "{min_leg}: {total} {lower}");
        }
    }
}
