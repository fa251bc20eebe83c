//! What a start is worth once it has all its waypoints: where the way is low, each waypoint is expensive.

use super::with_waypoints;
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use crate::planner::price::price;

/// A route more expensive than the best by this share is dropped.
const DEAR: f64 = 0.16;

/// Where spare waypoints cost more than this share of the best route, its climb must not be searched with fewer
/// waypoints.
const LOW: f64 = 0.1;

/// Those of `shapes` that may still win once they have all their waypoints, and whether spare waypoints are too
/// expensive to be left out in a coarse search.
pub(super) fn promising(model: &Model, shapes: Vec<Vec<Point3>>) -> (Vec<Vec<Point3>>, bool) {
    let mut worth: Vec<(Worth, Vec<Point3>)> = shapes
        .into_iter()
        .map(|shape| {
            let waypoints = model.scenario.planner.waypoints.min(shape.len() - 2);
            let route = with_waypoints(model, shape, waypoints);
            (Worth::of(model, &route), route)
        })
        .collect();
    worth.sort_by(|(one, _), (other, _)| one.fitness.rank(&other.fitness));
    let Some((best, _)) = worth.first() else {
        return (Vec::new(), false);
    };
    let (most, low) = (
        best.fitness.cost * (1.0 + DEAR),
        best.spare > LOW * best.fitness.cost,
    );
    worth.retain(|(worth, _)| worth.fitness.cost <= most);
    (worth.into_iter().map(|(_, route)| route).collect(), low)
}

/// The value of a route with all its waypoints.
struct Worth {
    fitness: Fitness,
    /// The part of its cost that is for the waypoints that it does not have yet, each where it is cheapest.
    spare: f64,
}

impl Worth {
    fn of(model: &Model, route: &[Point3]) -> Self {
        let middles = route
            .windows(2)
            .map(|ends| nalgebra::center(&ends[0], &ends[1]));
        let least = route[1..route.len() - 1]
            .iter()
            .copied()
            .chain(middles)
            .map(|at| model.waypoint(at, model.tolerance).1)
            .fold(f64::INFINITY, f64::min);
        let mut fitness = price(model, route);
        let spare = (model.scenario.planner.waypoints + 2 - route.len()) as f64 * least;
        fitness.cost += spare;
        Self { fitness, spare }
    }
}
