//! Separates waypoints that coincide: none such leave the planner, except where moving one by a hair would cost
//! something.

use std::ops::RangeInclusive;

use super::with_waypoints;
use crate::cost::Model;
use crate::geometry::{LEVEL, Point3, Vector2};
use crate::optimizer::Fitness;
use crate::planner::price::price;

/// Waypoints nearer than this, metres, count as coinciding.
const ONE_PLACE: f64 = 1e-6;

/// Distances, metres, between waypoints that become more expensive with any larger one. Where the limit of climb or
/// turn binds, or a metre of height is dear, only the smaller ones cost nothing.
const HAIRS: [f64; 3] = [1e-3, 1e-6, 1e-9];

/// A waypoint at this distance or more defines a direction, metres.
const FAR: f64 = 1.0;

/// Costs nearer than this share count as equal: a longer sum is rounded more often.
const ROUNDING: f64 = 1e-12;

/// `route` with coinciding waypoints spread along its legs, or a hair apart where spreading costs more; unchanged where
/// each way to do so breaks more limits or costs more.
pub(in crate::planner) fn spread(model: &Model, mut route: Vec<Point3>) -> Vec<Point3> {
    let mut apart = route.clone();
    apart.dedup_by(|next, before| (*next - *before).norm() < ONE_PLACE);
    if apart.len() == route.len() || apart[apart.len() - 1] != route[route.len() - 1] {
        return route;
    }
    let apart = with_waypoints(model, apart, route.len() - 2);
    let old = price(model, &route);
    let new = price(model, &apart);
    if new.violation <= old.violation && is_as_cheap(&new, &old) {
        return apart;
    }
    for heap in heaps(&route) {
        if let Some(apart) = a_hair_apart(model, &route, heap, &old) {
            route = apart;
        }
    }
    route
}

/// Whether a route of fitness `new` may replace one of fitness `old`.
fn is_no_worse(new: &Fitness, old: &Fitness) -> bool {
    new.violation < old.violation || (new.violation <= old.violation && is_as_cheap(new, old))
}

fn is_as_cheap(new: &Fitness, old: &Fitness) -> bool {
    new.cost <= old.cost * (1.0 + ROUNDING)
}

/// The runs of waypoints that coincide.
fn heaps(route: &[Point3]) -> Vec<RangeInclusive<usize>> {
    let mut heaps = Vec::new();
    let mut first = 0;
    for idx in 1..=route.len() {
        let is_near = |next: &Point3| (next - route[idx - 1]).norm() < ONE_PLACE;
        if !route.get(idx).is_some_and(is_near) {
            if first + 1 < idx {
                heaps.push(first..=idx - 1);
            }
            first = idx;
        }
    }
    heaps
}

/// `route` with the waypoints of `heap` in a row, as far apart as costs nothing and in the best direction; `None`
/// where the smallest hair makes it worse than `old`.
fn a_hair_apart(
    model: &Model,
    route: &[Point3],
    heap: RangeInclusive<usize>,
    old: &Fitness,
) -> Option<Vec<Point3>> {
    let rows = |hair: f64| {
        let rows = rows(model, route, heap.clone(), hair).into_iter();
        let priced = rows.map(|row| (price(model, &row), row));
        priced.min_by(|one, other| one.0.rank(&other.0))
    };
    let best = HAIRS.into_iter().filter_map(rows);
    let mut free = best.filter(|(fitness, _)| is_no_worse(fitness, old));
    free.next().map(|(_, row)| row)
}

/// `route` with the waypoints of `heap` in rows: along the legs that lead there and away, and at one height above
/// ground, where no waypoint's altitude changes.
fn rows(
    model: &Model,
    route: &[Point3],
    heap: RangeInclusive<usize>,
    hair: f64,
) -> Vec<Vec<Point3>> {
    let (first, last) = (*heap.start(), *heap.end());
    let place = route[first];
    let is_far = |point: &&Point3| (*point - place).norm() >= FAR;
    let before = route[..first].iter().rfind(is_far);
    let after = route[last + 1..].iter().find(is_far);
    let ways = [
        before.map(|&from| place - from),
        after.map(|&to| to - place),
    ];
    // Where the row begins, in shares of itself before the place; the ends of a route stay.
    let begins: &[f64] = match (first == 0, last + 1 == route.len()) {
        (true, true) => &[],
        (true, false) => &[0.0],
        (false, true) => &[1.0],
        (false, false) => &[0.0, 0.5, 1.0],
    };
    let ground = |at: Point3| model.scenario.terrain.elevation(at.xy());
    let height = place.z - ground(place);
    let level = |at: Point3| Point3::new(at.x, at.y, ground(at) + height);
    let row = |begin: f64, put: &dyn Fn(f64) -> Point3| {
        let mut row = route.to_vec();
        let count = (last - first) as f64;
        for (idx, point) in row[first..=last].iter_mut().enumerate() {
            let steps = idx as f64 - begin * count;
            if steps != 0.0 {
                *point = put(steps * hair);
            }
        }
        row
    };
    let mut rows = Vec::new();
    for way in ways.into_iter().flatten() {
        for &begin in begins {
            rows.push(row(begin, &|far| place + way.normalize() * far));
        }
        let flat = Vector2::new(way.x, way.y);
        if flat.norm() < LEVEL {
            continue;
        }
        let [ahead, aside] = [flat, Vector2::new(-flat.y, flat.x)].map(|way| way.normalize());
        for direction in [ahead, -ahead, aside, -aside] {
            for &begin in begins {
                let put = |far: f64| {
                    let step = direction * far;
                    level(Point3::new(place.x + step.x, place.y + step.y, place.z))
                };
                rows.push(row(begin, &put));
            }
        }
    }
    // So small a hair may be lost in a coordinate's rounding.
    rows.retain(|row| row[first..=last].windows(2).all(|ends| ends[0] != ends[1]));
    rows
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::planner::tests::{route, scenario};
    use crate::scenario::Scenario;

    #[test]
    fn coinciding_waypoints_are_spread_along_the_route() {
        let mut scenario = scenario();
        scenario.vehicle.min_leg = 0.0;
        let model = Model::new(&scenario);
        let [a, b] = [[150.0, 400.0, 100.0], [300.0, 900.0, 100.0]];
        let heap = route(&[a, a, a, b, b]);
        let apart = spread(&model, heap.clone());
        assert_eq!(apart.len(), heap.len());
        let shortest = apart.windows(2).map(|ends| (ends[1] - ends[0]).norm());
        assert!(shortest.fold(f64::INFINITY, f64::min) > 1.0);
        assert!((price(&model, &apart).cost - price(&model, &heap).cost).abs() < 1e-6);
    }

    /// Where only one place is in the middle of the band, waypoints crowded there are moved apart minimally.
    #[test]
    fn waypoints_on_the_best_place_are_moved_apart_minimally() {
        let mut scenario = scenario();
        scenario.vehicle.min_leg = 0.0;
        scenario.start.z = 0.0;
        scenario.target.z = 0.0;
        let model = Model::new(&scenario);
        let best = [500.0, 480.0, 100.0];
        let heap = route(&[best; 6]);
        let apart = spread(&model, heap.clone());
        let shortest = apart.windows(2).map(|ends| (ends[1] - ends[0]).norm());
        let shortest = shortest.fold(f64::INFINITY, f64::min);
        assert!(
            (0.9 * HAIRS[0]..2.0 * HAIRS[0]).contains(&shortest),
            "{shortest}"
        );
        let (old, new) = (price(&model, &heap), price(&model, &apart));
        assert!(new.violation <= old.violation && new.cost < old.cost + 0.05);
    }

    /// Altitude is so dear that a millimetre of it costs more than a metre of flight.
    #[test]
    fn waypoints_are_never_moved_apart_at_a_price() {
        let mut scenario = scenario();
        scenario.threats.clear();
        scenario.vehicle.min_leg = 0.0;
        scenario.weights.altitude = 1e4;
        (scenario.start.z, scenario.target.z) = (0.0, 0.0);
        let [start, target] = [scenario.start, scenario.target];
        let at = |share: f64| (start + (target - start) * share) + Vector3::z() * 100.0;
        let model = Model::new(&scenario);
        for places in [[0.5; 6], [0.3, 0.3, 0.3, 0.6, 0.6, 0.6]] {
            let heap = route_of(&scenario, &places.map(at));
            let apart = spread(&model, heap.clone());
            assert!(apart.windows(2).all(|ends| ends[0] != ends[1]));
            let (old, new) = (price(&model, &heap), price(&model, &apart));
            assert!(old.violation <= 0.0 && new.violation <= 0.0);
            assert!(new.cost <= old.cost * (1.0 + ROUNDING), "{old:?} {new:?}");
        }
    }

    fn route_of(scenario: &Scenario, free: &[Point3]) -> Vec<Point3> {
        [&[scenario.start], free, &[scenario.target]].concat()
    }
}
