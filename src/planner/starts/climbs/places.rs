//! Where longer ways may lead: a few places, and the cost of each leg between two of them.

use super::super::{direction, net};
use super::Climb;
use crate::cost::Model;
use crate::geometry::{Point2, Point3, Rect, Vector2};
use crate::planner::price::pricer;
use crate::scenario::Scenario;

/// Start and target come first among the places.
pub(super) const ENDS: usize = 2;

/// Places on each side of a grid over the usable part of the area.
const ROWS: usize = 5;

/// Places around each end, as far from it as its climb takes.
const ROUND: usize = 8;

/// Number of places over which the way from start to target is just as long as both climbs.
const OVAL: usize = 16;

#[derive(Clone, Copy)]
pub(super) struct Leg {
    /// Length along the ground, metres.
    pub(super) length: f64,
    /// Heading, radians.
    pub(super) heading: f64,
    /// Cost when level; infinite where it breaks a limit.
    pub(super) cost: f64,
}

/// Start, target, and places with `room` to bend beside each, metres.
pub(super) fn places(scenario: &Scenario, climb: Climb, room: f64) -> Vec<Point2> {
    let area = &scenario.area;
    let room = Vector2::repeat(room).inf(&((area.max - area.min) * 0.25));
    let inside = Rect {
        min: area.min + room,
        max: area.max - room,
    };
    let ends = [scenario.start.xy(), scenario.target.xy()];
    let mut places = ends.to_vec();
    for (end, needed) in ends.into_iter().zip(climb.needed) {
        let about = round(ROUND).map(|at| end + at * needed);
        places.extend(about.filter(|&at| needed > 0.0 && inside.contains(at)));
    }
    let (way, sum) = (ends[1] - ends[0], climb.length());
    let (long, wide) = (0.5 * sum, 0.5 * (sum * sum - way.norm_squared()).sqrt());
    let middle = nalgebra::center(&ends[0], &ends[1]);
    let along = direction(libm::atan2(way.y, way.x));
    let across = Vector2::new(-along.y, along.x);
    let oval = round(OVAL).map(|at| middle + along * (at.x * long) + across * (at.y * wide));
    places.extend(oval.filter(|&at| inside.contains(at)));
    let reach = Vector2::repeat(long);
    let low = inside.nearest(ends[0].inf(&ends[1]) - reach);
    let high = inside.nearest(ends[0].sup(&ends[1]) + reach);
    let share = |number: usize| number as f64 / (ROWS - 1) as f64;
    for row in 0..ROWS {
        for column in 0..ROWS {
            let at = Vector2::new(share(column), share(row));
            places.push(low + (high - low).component_mul(&at));
        }
    }
    places
}

/// `count` directions, evenly spread.
fn round(count: usize) -> impl Iterator<Item = Vector2> {
    (0..count).map(move |number| direction(std::f64::consts::TAU * number as f64 / count as f64))
}

/// Every leg between `places`, at `levels` in the frame, row by row; none from a place to itself.
pub(super) fn legs(model: &Model, places: &[Point2], levels: &[f64]) -> Vec<Leg> {
    let pricer = pricer(model).verdicts();
    let count = places.len();
    let points: Vec<Point3> = places
        .iter()
        .zip(levels)
        .map(|(at, &z)| Point3::new(at.x, at.y, z))
        .collect();
    let ends: Vec<(usize, usize)> = (0..count)
        .flat_map(|a| (a + 1..count).map(move |b| (a, b)))
        .collect();
    let priced = net::priced(&points, &ends, |from, to, prices| {
        pricer.legs_at_best(from, to, prices);
    });
    let none = Leg {
        length: 0.0,
        heading: 0.0,
        cost: f64::INFINITY,
    };
    let mut legs = vec![none; count * count];
    for (&(a, b), leg) in ends.iter().zip(&priced) {
        let cost = if leg.is_feasible() {
            leg.cost
        } else {
            f64::INFINITY
        };
        let way = places[b] - places[a];
        for (from, to, way) in [(a, b, way), (b, a, -way)] {
            legs[from * count + to] = Leg {
                length: way.norm(),
                heading: libm::atan2(way.y, way.x),
                cost,
            };
        }
    }
    legs
}
