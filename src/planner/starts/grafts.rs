//! Starts that lead elsewhere than the best one, but begin or end as it does.
//!
//! Where an end lies in a soft zone or outside the band, much of the cost is how a route leaves it. Few starts do that
//! well, and those that do mostly go on alike: other ways look expensive only because of their ends.

use super::sides::sides;
use super::{is_vast, net, with_waypoints};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use crate::planner::price::{price, pricer, search_tolerance};

/// Ways past the threats, other than the best one's, that get its ends.
const MOST: usize = 16;

/// Of the cheapest joints, so many are looked at with the turns that they make.
const CLOSE: usize = 8;

/// Routes that begin or end as the best does, and what making them took.
#[derive(Default)]
pub(super) struct Grafts {
    pub(super) routes: Vec<(Fitness, Vec<Point3>)>,
    pub(super) legs_priced: u64,
}

/// Whether a search of `model` looks for them: over level ground, where ways lead through soft zones or narrow gaps, or an
/// end lies in such a zone or outside the band.
pub(super) fn are_wanted(model: &Model, is_rough: bool) -> bool {
    let scenario = model.scenario;
    let band = scenario.altitude;
    let is_costly = |end: Point3| {
        let height = end.z - scenario.terrain.elevation(end.xy());
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
pub(super) fn grafted(model: &Model, starts: &[(Fitness, Vec<Point3>)]) -> Grafts {
    let mut grafts = Grafts::default();
    let Some(((_, best), others)) = starts.split_first() else {
        return grafts;
    };
    let backwards = |route: &[Point3]| -> Vec<Point3> { route.iter().rev().copied().collect() };
    let mut met = vec![sides(model, best)];
    for (own, route) in others {
        let sides = sides(model, route);
        if met.contains(&sides) {
            continue;
        }
        let begun = joined(model, best, route, &sides, &mut grafts.legs_priced);
        let back: Vec<i32> = sides.iter().map(|side| -side).collect();
        let begun = backwards(&begun);
        let both = joined(
            model,
            &backwards(best),
            &begun,
            &back,
            &mut grafts.legs_priced,
        );
        let both = with_waypoints(model, backwards(&both), route.len() - 2);
        let fitness = price(model, &both);
        if fitness.beats(own) {
            grafts.routes.push((fitness, both));
        }
        met.push(sides);
        if met.len() > MOST {
            break;
        }
    }
    grafts
}

/// The best route that begins as `head` does, ends as `rest` does and passes the threats at these `sides`, by what its
/// legs and waypoints cost: one leg leads from a waypoint of the one to one of the other. `rest` itself where none is
/// better.
fn joined(
    model: &Model,
    head: &[Point3],
    rest: &[Point3],
    wanted: &[i32],
    legs_priced: &mut u64,
) -> Vec<Point3> {
    let places = [head, rest].concat();
    let first = head.len();
    // The legs of both, and those from each waypoint of the one to each of the other.
    let along = |from: usize, count: usize| (from..from + count - 1).map(|at| (at, at + 1));
    let across = (1..first - 1).flat_map(|from| {
        let onto = first + 1..places.len() - 1;
        onto.map(move |to| (from, to))
    });
    let own = along(0, first).chain(along(first, rest.len()));
    let ends: Vec<(usize, usize)> = own.chain(across).collect();
    *legs_priced += ends.len() as u64;
    let legs = net::priced(&places, &ends, |from, to, prices| {
        pricer(model).legs(from, to, prices);
    });
    let leg = |idx: usize| (legs[idx].violation, legs[idx].cost);
    let tolerance = search_tolerance(model);
    let waypoint = |place: usize| model.waypoint(places[place], tolerance);
    let plus = |(a, b): (f64, f64), (c, d): (f64, f64)| (a + c, b + d);
    // What it costs to reach each place of the head, and to get to the target from each of the rest.
    let mut reached = vec![(0.0, 0.0); first];
    for place in 1..first - 1 {
        reached[place] = plus(reached[place - 1], plus(leg(place - 1), waypoint(place)));
    }
    let mut left = vec![(0.0, 0.0); places.len()];
    for place in (first + 1..places.len() - 1).rev() {
        left[place] = plus(left[place + 1], plus(leg(place - 1), waypoint(place)));
    }
    let of_rest = plus(left[first + 1], leg(first - 1));
    let mut joints: Vec<(f64, f64, usize, usize)> = Vec::new();
    for (idx, &(from, to)) in ends.iter().enumerate().skip(places.len() - 2) {
        let (violation, cost) = plus(leg(idx), plus(reached[from], left[to]));
        if (violation, cost) < of_rest {
            joints.push((violation, cost, from, to));
        }
    }
    joints.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1)));
    let routes = joints
        .iter()
        .map(|&(_, _, from, to)| [&head[..=from], &places[to..]].concat());
    let alike = routes.filter(|route| sides(model, route) == wanted);
    // Turns decide among the cheapest.
    let priced = alike.take(CLOSE).map(|route| (price(model, &route), route));
    let rest = (price(model, rest), rest.to_vec());
    let best = priced.fold(
        rest,
        |best, next| if next.0.beats(&best.0) { next } else { best },
    );
    best.1
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
        let grafts = grafted(&model, &priced).routes;
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
        scenario.start.z = 0.5 * (scenario.altitude.min + scenario.altitude.max);
        scenario.target.z = scenario.start.z;
        assert!(!wanted(&scenario, false) && wanted(&scenario, true));
        let mut low = scenario.clone();
        low.altitude.min = low.start.z + 1.0;
        let mut near = scenario.clone();
        near.threats = vec![disc([near.start.x + 50.0, near.start.y, 20.0, 60.0])];
        assert!(wanted(&low, false) && wanted(&near, false));
    }
}
