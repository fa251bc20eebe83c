//! Starts that lead elsewhere than the best one, but begin or end as it does.
//!
//! Where an end lies in a soft zone or outside the band, much of the cost is how a route leaves it. Few starts do that
//! well, and those that do mostly go on alike: other ways look expensive only because of their ends.

use super::sides::sides;
use super::{is_vast, net, with_waypoints};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use crate::planner::price::{Priced, price, pricer, search_tolerance};

/// Ways past the threats, other than the best one's, that get its ends.
const MOST: usize = 16;

/// Of the cheapest joints, so many are looked at with the turns that they make.
const CLOSE: usize = 8;

/// How many legs and routes were priced.
#[derive(Default)]
pub(super) struct Effort {
    pub(super) legs: u64,
    pub(super) routes: u64,
}

/// Whether a search of `model` looks for them: over level ground, where ways lead through soft zones or narrow gaps, or an
/// end lies in such a zone or outside the band.
pub(super) fn are_wanted(model: &Model, is_rough: bool) -> bool {
    let scenario = model.scenario;
    let band = scenario.altitude;
    let is_costly = |end: Point3| {
        let height = scenario.terrain.height_of(end);
        let mut threats = scenario.threats.iter();
        !(band.min..=band.max).contains(&height)
            || threats.any(|threat| threat.intensity(end) > 0.0)
    };
    scenario.terrain.is_flat()
        && !is_vast(scenario)
        && (is_rough || [scenario.start, scenario.target].into_iter().any(is_costly))
}

/// Of each way past the threats the first of the `starts`, which are `priced` best first, with the beginning, the end,
/// or both, of the best of all; those that are better for it.
pub(super) fn grafted(model: &Model, starts: &[Priced]) -> (Vec<Priced>, Effort) {
    let (mut grafts, mut effort) = (Vec::new(), Effort::default());
    let Some(((_, best), others)) = starts.split_first() else {
        return (grafts, effort);
    };
    let backwards = |route: &[Point3]| -> Vec<Point3> { route.iter().rev().copied().collect() };
    let back = backwards(best);
    let mut met = vec![sides(model, best)];
    for (own, route) in others {
        let sides = sides(model, route);
        if met.contains(&sides) {
            continue;
        }
        let begun = joined(model, [best, route], &sides, &mut effort);
        let sides_back: Vec<i32> = sides.iter().map(|side| -side).collect();
        let ends = [&*back, &*backwards(&begun)];
        let both = backwards(&joined(model, ends, &sides_back, &mut effort));
        let graft = with_waypoints(model, both, route.len() - 2);
        let fitness = price(model, &graft);
        effort.routes += 1;
        if fitness.beats(own) {
            grafts.push((fitness, graft));
        }
        met.push(sides);
        if met.len() > MOST {
            break;
        }
    }
    (grafts, effort)
}

/// The best route that begins as `head` does, ends as `rest` does and passes the threats at these `sides`; `rest` itself
/// where none is better.
fn joined(
    model: &Model,
    [head, rest]: [&[Point3]; 2],
    wanted: &[i32],
    effort: &mut Effort,
) -> Vec<Point3> {
    let joints = joints(model, head, rest, effort).into_iter();
    let routes = joints.map(|(from, to)| [&head[..=from], &rest[to..]].concat());
    let alike = routes.filter(|route| sides(model, route) == wanted);
    // Turns decide among the cheapest.
    let few = std::iter::once(rest.to_vec()).chain(alike.take(CLOSE));
    let priced = few.map(|route| (price(model, &route), route));
    let priced = priced.inspect(|_| effort.routes += 1);
    let best = priced.min_by(|(one, _), (other, _)| one.rank(other));
    best.expect("the rest is one of them").1
}

/// From which waypoint of `head` to which of `rest` a leg can lead so that the whole, turns apart, is better than `rest`:
/// the cheapest first.
fn joints(
    model: &Model,
    head: &[Point3],
    rest: &[Point3],
    effort: &mut Effort,
) -> Vec<(usize, usize)> {
    let across: Vec<(usize, usize)> = (1..head.len() - 1)
        .flat_map(|from| (1..rest.len() - 1).map(move |to| (from, to)))
        .collect();
    let places = [head, rest].concat();
    let along = |from: usize, count: usize| (from + 1..from + count).map(|at| (at - 1, at));
    let own = along(0, head.len()).chain(along(head.len(), rest.len()));
    let between = across.iter().map(|(from, to)| (*from, head.len() + to));
    let ends: Vec<(usize, usize)> = own.chain(between).collect();
    effort.legs += ends.len() as u64;
    let legs = net::priced(&places, &ends, |from, to, prices| {
        pricer(model).legs(from, to, prices);
    });
    let (of_head, legs) = legs.split_at(head.len() - 1);
    let (of_rest, legs) = legs.split_at(rest.len() - 1);
    let tolerance = search_tolerance(model);
    let with = |sum: Fitness, leg: &Fitness, place: Point3| {
        let own = model.waypoint(place, tolerance);
        Fitness {
            violation: sum.violation + leg.violation + own.0,
            cost: sum.cost + leg.cost + own.1,
        }
    };
    // What it takes to reach each waypoint of the head, and to get to the target from each of the rest.
    let mut reached = vec![Fitness::ZERO; head.len()];
    for place in 1..head.len() - 1 {
        reached[place] = with(reached[place - 1], &of_head[place - 1], head[place]);
    }
    let mut left = vec![Fitness::ZERO; rest.len()];
    for place in (1..rest.len() - 1).rev() {
        left[place] = with(left[place + 1], &of_rest[place], rest[place]);
    }
    let whole = |from: Fitness, leg: &Fitness, to: Fitness| Fitness {
        violation: from.violation + leg.violation + to.violation,
        cost: from.cost + leg.cost + to.cost,
    };
    let without = whole(Fitness::ZERO, &of_rest[0], left[1]);
    let priced = across.into_iter().zip(legs);
    let mut joints: Vec<(Fitness, (usize, usize))> = priced
        .map(|((from, to), leg)| (whole(reached[from], leg, left[to]), (from, to)))
        .filter(|(fitness, _)| fitness.beats(&without))
        .collect();
    joints.sort_by(|(one, _), (other, _)| one.rank(other));
    joints.into_iter().map(|(_, joint)| joint).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::{disc, scenario};

    /// The start lies in a wide soft zone. One route leaves it at once and passes the next threat on the left, the other
    /// lingers and passes it on the right.
    #[test]
    fn a_way_elsewhere_begins_as_the_best_does() {
        let mut scenario = scenario();
        scenario.start = Point3::new(250.0, 350.0, 100.0);
        scenario.target = Point3::new(900.0, 350.0, 100.0);
        scenario.threats = vec![
            disc([200.0, 500.0, 60.0, 200.0]),
            disc([600.0, 350.0, 50.0, 80.0]),
        ];
        let model = Model::new(&scenario);
        let through = |places: &[[f64; 2]]| -> Vec<Point3> {
            let free = places.iter().map(|&[x, y]| Point3::new(x, y, 100.0));
            let ends = (scenario.start, scenario.target);
            std::iter::once(ends.0)
                .chain(free)
                .chain([ends.1])
                .collect()
        };
        let best = through(&[[300.0, 310.0], [400.0, 340.0], [600.0, 440.0]]);
        let other = through(&[[265.0, 430.0], [380.0, 400.0], [600.0, 255.0]]);
        let priced = [best.clone(), other.clone()].map(|route| (price(&model, &route), route));
        assert!(priced[0].0.beats(&priced[1].0));
        let (grafts, _) = grafted(&model, &priced);
        assert_eq!(grafts.len(), 1);
        let (fitness, graft) = &grafts[0];
        assert!(fitness.is_feasible() && fitness.beats(&priced[1].0));
        assert_eq!(sides(&model, graft), sides(&model, &other));
        assert_eq!((graft[1], graft.len()), (best[1], other.len()));
    }

    #[test]
    fn they_are_wanted_where_an_end_is_costly_or_ways_are_narrow() {
        let mut scenario = scenario();
        scenario.threats = vec![disc([500.0, 480.0, 60.0, 90.0])];
        let wanted = |scenario: &_, is_rough| are_wanted(&Model::new(scenario), is_rough);
        scenario.start.z = scenario.altitude.middle();
        scenario.target.z = scenario.start.z;
        assert!(!wanted(&scenario, false) && wanted(&scenario, true));
        let mut low = scenario.clone();
        low.altitude.min = low.start.z + 1.0;
        let mut near = scenario.clone();
        near.threats = vec![disc([near.start.x + 50.0, near.start.y, 20.0, 60.0])];
        assert!(wanted(&low, false) && wanted(&near, false));
    }
}
