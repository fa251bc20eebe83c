//! How far a route is from the limits of the vehicle, the band and the area, and how that changes with its waypoints.
//!
//! Each limit is a figure in metres that may not be above zero, with its derivatives by the coordinates of the up to
//! three waypoints that it is about: east, north, and height above ground.

use super::Place;
use crate::cost::Model;
use crate::geometry::{Point3, Vector2, wrap_angle};
use crate::planner::starts::steepest;
use nalgebra::Vector3;

/// Coordinates of three waypoints.
pub(super) const NEAR: usize = 9;

/// Limits are kept by this share more, for rounding.
const HAIR: f64 = 1e-9;

/// Legs of less horizontal length, as a share of the way, have no heading here.
const HEADLESS: f64 = 1e-7;

/// What is limited.
#[derive(Clone, Copy)]
pub(super) enum Limit {
    /// Metres that a leg rises beyond the steepest climb; with sign -1, metres that it sinks beyond it.
    Climb { leg: usize, sign: f64 },
    /// Metres that a leg is too short.
    Short { leg: usize },
    /// Turn at a waypoint beyond the limit, to the left; with sign -1 to the right.
    Turn { at: usize, sign: f64 },
    /// Metres of a waypoint below the least height; with sign 1 above the greatest.
    Height { at: usize, sign: f64 },
    /// Metres of a waypoint beyond the area's edge on this axis, downwards; with sign 1 upwards.
    Edge { at: usize, axis: usize, sign: f64 },
}

/// How a limit changes.
pub(super) struct Slope {
    /// The first of its waypoints.
    pub(super) first: usize,
    pub(super) gradient: [f64; NEAR],
    pub(super) curvature: [[f64; NEAR]; NEAR],
}

/// The limits of one scenario.
pub(super) struct Limits<'m, 's> {
    model: &'m Model<'s>,
    /// Metres that the vehicle may climb in a metre seen from above.
    steepest: f64,
    max_turn: f64,
    min_leg: f64,
    /// How many metres a radian of turning counts: about a leg.
    arm: f64,
    way: f64,
}

/// All limits of a route of this many points, ends included.
pub(super) fn all(points: usize) -> Vec<Limit> {
    let both = [-1.0, 1.0];
    let legs = (0..points - 1).flat_map(|leg| {
        let climbs = both.map(|sign| Limit::Climb { leg, sign });
        climbs.into_iter().chain([Limit::Short { leg }])
    });
    let free = (1..points - 1).flat_map(|at| {
        let turns = both.map(|sign| Limit::Turn { at, sign });
        let heights = both.map(|sign| Limit::Height { at, sign });
        let edges = [0, 1].map(|axis| both.map(|sign| Limit::Edge { at, axis, sign }));
        let edges = edges.into_iter().flatten();
        turns.into_iter().chain(heights).chain(edges)
    });
    legs.chain(free).collect()
}

impl<'m, 's> Limits<'m, 's> {
    pub(super) fn of(model: &'m Model<'s>, waypoints: usize) -> Self {
        let scenario = model.scenario;
        let vehicle = &scenario.vehicle;
        let way = scenario.direct();
        Self {
            model,
            steepest: steepest(scenario),
            max_turn: vehicle.max_turn() * (1.0 - HAIR),
            min_leg: vehicle.min_leg * (1.0 + HAIR),
            arm: way / (waypoints + 1) as f64,
            way,
        }
    }

    /// Metres beyond `limit`; negative within.
    pub(super) fn beyond(&self, limit: Limit, places: &[Place], route: &[Point3]) -> f64 {
        match limit {
            Limit::Climb { leg, sign } => {
                let way = route[leg + 1] - route[leg];
                sign * way.z - self.steepest * way.xy().norm()
            }
            Limit::Short { leg } => self.min_leg - (route[leg + 1] - route[leg]).norm(),
            Limit::Turn { at, sign } => {
                let [before, after] = ways(route, at);
                if self.has_no_heading(before) || self.has_no_heading(after) {
                    return -self.arm;
                }
                let heading = |way: Vector2| libm::atan2(way.y, way.x);
                let turn = wrap_angle(heading(after) - heading(before));
                self.arm * (sign * turn - self.max_turn)
            }
            Limit::Height { at, sign } => {
                let (floor, ceiling) = self.model.heights_over(route[at].xy());
                let height = places[at].at.z;
                if sign < 0.0 {
                    floor - height
                } else {
                    height - ceiling
                }
            }
            Limit::Edge { at, axis, sign } => {
                let (area, point) = (self.model.scenario.area, places[at].at);
                if sign < 0.0 {
                    area.min[axis] - point[axis]
                } else {
                    point[axis] - area.max[axis]
                }
            }
        }
    }

    /// How `limit` changes with the waypoints.
    pub(super) fn slope(&self, limit: Limit, places: &[Place], route: &[Point3]) -> Slope {
        match limit {
            Limit::Climb { leg, sign } => {
                let way = (route[leg + 1] - route[leg]).xy();
                let length = way.norm().max(HEADLESS * self.way);
                let along = way / length;
                let away = -self.steepest * along;
                let mut slope = Slope::of_leg(leg, Vector3::new(away.x, away.y, sign), places);
                let along = Vector3::new(along.x, along.y, 0.0);
                slope.stretch(along, 2, -self.steepest / length);
                slope
            }
            Limit::Short { leg } => {
                let way = route[leg + 1] - route[leg];
                let length = way.norm().max(HEADLESS * self.way);
                let along = way / length;
                let mut slope = Slope::of_leg(leg, -along, places);
                slope.stretch(along, 3, -1.0 / length);
                slope
            }
            Limit::Turn { at, sign } => self.turn(at, sign, route),
            Limit::Height { at, sign } => {
                let mut slope = Slope::from(at);
                slope.gradient[2] = sign;
                slope
            }
            Limit::Edge { at, axis, sign } => {
                let mut slope = Slope::from(at);
                slope.gradient[axis] = sign;
                slope
            }
        }
    }

    /// For the heading of a way (x, y) with r its length: the gradient is (-y, x) / r², the second derivatives are 2xy
    /// / r⁴, (y² - x²) / r⁴ and -2xy / r⁴.
    fn turn(&self, at: usize, sign: f64, route: &[Point3]) -> Slope {
        let mut slope = Slope::from(at - 1);
        for (way_idx, way) in ways(route, at).into_iter().enumerate() {
            let squared = way.norm_squared();
            let factor = self.arm * sign * if way_idx == 0 { -1.0 } else { 1.0 };
            let by = [-way.y / squared, way.x / squared];
            let (twist, squared) = (2.0 * way.x * way.y, squared * squared);
            let cross = (way.y * way.y - way.x * way.x) / squared;
            let second = [[twist / squared, cross], [cross, -twist / squared]];
            for i in 0..2 {
                for (end, toward) in [(way_idx, -1.0), (way_idx + 1, 1.0)] {
                    slope.gradient[3 * end + i] += factor * toward * by[i];
                    for (j, second) in second[i].iter().enumerate() {
                        for (other, against) in [(way_idx, -1.0), (way_idx + 1, 1.0)] {
                            slope.curvature[3 * end + i][3 * other + j] +=
                                factor * toward * against * second;
                        }
                    }
                }
            }
        }
        slope
    }

    fn has_no_heading(&self, way: Vector2) -> bool {
        way.norm() < HEADLESS * self.way
    }
}

impl Slope {
    fn from(first: usize) -> Self {
        Self {
            first,
            gradient: [0.0; NEAR],
            curvature: [[0.0; NEAR]; NEAR],
        }
    }

    /// Of a figure that changes by `change` with the leg's end, east, north and up, and against it with its beginning.
    fn of_leg(leg: usize, change: Vector3<f64>, places: &[Place]) -> Self {
        let mut slope = Self::from(leg);
        for (end, toward) in [(0, -1.0), (1, 1.0)] {
            // Heights are above ground, which rises with the way.
            let ground = places[leg + end].slope;
            for axis in 0..2 {
                slope.gradient[3 * end + axis] = toward * (change[axis] + change.z * ground[axis]);
            }
            slope.gradient[3 * end + 2] = toward * change.z;
        }
        slope
    }

    /// Add the second derivatives of a length along `along`, by the first `axes` coordinates of its ends, times `factor`.
    fn stretch(&mut self, along: Vector3<f64>, axes: usize, factor: f64) {
        for i in 0..axes {
            for j in 0..axes {
                let aside = if i == j { 1.0 } else { 0.0 } - along[i] * along[j];
                for (one, other, sign) in [(0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)] {
                    self.curvature[3 * one + i][3 * other + j] += factor * sign * aside;
                }
            }
        }
    }
}

/// Into a waypoint and out of it, seen from above.
fn ways(route: &[Point3], at: usize) -> [Vector2; 2] {
    [
        (route[at] - route[at - 1]).xy(),
        (route[at + 1] - route[at]).xy(),
    ]
}
