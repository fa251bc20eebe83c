//! Separates waypoints that coincide: none such leave the planner.

use super::spare::NOTHING;
use super::with_waypoints;
use crate::cost::Model;
use crate::geometry::Point3;
use crate::planner::price::price;

/// Waypoints nearer than this, metres, count as coinciding.
const ONE_PLACE: f64 = 1e-6;

/// Distance, metres, between waypoints that become more expensive with any larger one.
const HAIR: f64 = 1e-3;

/// A waypoint at this distance or more defines a direction, metres.
const FAR: f64 = 1.0;

/// `route` with coinciding waypoints spread along its legs, or a hair apart where spreading costs more; unchanged where
/// that breaks more limits.
pub(in crate::planner) fn spread(model: &Model, route: Vec<Point3>) -> Vec<Point3> {
    let mut apart = route.clone();
    apart.dedup_by(|next, before| (*next - *before).norm() < ONE_PLACE);
    if apart.len() == route.len() || apart[apart.len() - 1] != route[route.len() - 1] {
        return route;
    }
    let apart = with_waypoints(model, apart, route.len() - 2);
    let (old, new) = (price(model, &route), price(model, &apart));
    let dearer = new.cost > old.cost + NOTHING * (1.0 + old.cost);
    if new.violation <= old.violation && !dearer {
        return apart;
    }
    let apart = a_hair_apart(&route);
    if price(model, &apart).violation > old.violation {
        return route;
    }
    apart
}

/// Coinciding waypoints are placed one after the other along the leg that leads away, or, at the end, along the one
/// that leads there.
fn a_hair_apart(route: &[Point3]) -> Vec<Point3> {
    let mut apart = route.to_vec();
    let last = route.len() - 1;
    let far = |from: usize| move |to: &&Point3| (*to - route[from]).norm() >= FAR;
    let at_one = |one: usize, other: usize| (route[one] - route[other]).norm() < ONE_PLACE;
    let towards = |from: Point3, to: &Point3| from + (to - from).normalize() * HAIR;
    for idx in 1..last {
        if let Some(next) = route[idx..].iter().find(far(idx))
            && at_one(idx - 1, idx)
        {
            apart[idx] = towards(apart[idx - 1], next);
        }
    }
    for idx in (1..last).rev() {
        if let Some(before) = route[..idx].iter().rfind(far(idx))
            && at_one(idx, idx + 1)
            && at_one(idx, last)
        {
            apart[idx] = towards(apart[idx + 1], before);
        }
    }
    apart
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::tests::{route, scenario};

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
        assert!((0.9 * HAIR..2.0 * HAIR).contains(&shortest), "{shortest}");
        let (old, new) = (price(&model, &heap), price(&model, &apart));
        assert!(new.violation <= old.violation && new.cost < old.cost + 0.05);
    }
}
