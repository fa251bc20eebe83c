//! Threats as maps show them: rings in degrees.

use super::chart::Chart;
use crate::geometry::geodesy::{LatLon, wrapped};
use crate::geometry::ring::{edges, twice_area};
use crate::geometry::{Point2, Rect};
use crate::terrain::{HeightRange, Terrain};
use crate::threat::{Shape, Threat};

/// Corners of the ring that represents a circle.
const CORNERS: u32 = 72;

/// Most degrees of longitude between two corners of [`ring_in_degrees`].
const MOST_DEGREES: f64 = 30.0;

/// How far an edge that is straight in degrees may be from one that is straight on the plane, metres.
const APART_M: f64 = 0.1;

/// Edges shorter than this, metres, are not divided: one over a pole has no corners between which the degrees are few.
const SHORTEST_M: f64 = 1.0;

/// A corner on the plane and in degrees.
type Corner = (Point2, LatLon);

/// Like [`ring`], in degrees, for formats whose edges are straight in degrees. A long one, or one beside a pole, is far
/// from the straight one of the plane, so such edges are divided; those of a circle, which are near it only, beside a
/// pole alone.
pub(super) fn ring_in_degrees(chart: &Chart, threat: &Threat) -> Vec<LatLon> {
    let most_m = match threat.shape {
        Shape::Cylinder(_) => f64::INFINITY,
        Shape::Polygon(_) => APART_M,
    };
    let mut corners = Vec::new();
    for (from, to) in edges(&ring(threat)) {
        let [from, to] = [from, to].map(|at| (at, chart.place(at)));
        corners.push(from.1);
        divide(chart, from, to, most_m, &mut corners);
    }
    corners
}

/// Add the corners between two others, until those in degrees are at most `most_m` away from the plane's.
fn divide(chart: &Chart, from: Corner, to: Corner, most_m: f64, corners: &mut Vec<LatLon>) {
    if (from.0 - to.0).norm() < SHORTEST_M {
        return;
    }
    let middle = nalgebra::center(&from.0, &to.0);
    let middle = (middle, chart.place(middle));
    let east = wrapped(to.1.lon - from.1.lon);
    let straight = LatLon {
        lat: f64::midpoint(from.1.lat, to.1.lat),
        lon: wrapped(from.1.lon + east / 2.0),
    };
    if east.abs() <= MOST_DEGREES && straight.distance_m(middle.1) <= most_m {
        return;
    }
    divide(chart, from, middle, most_m, corners);
    corners.push(middle.1);
    divide(chart, middle, to, most_m, corners);
}

/// The outline of `threat` on the local plane, counter-clockwise seen from above, without repeated first corner. A
/// circle's corners lie on the circle.
pub(super) fn ring(threat: &Threat) -> Vec<Point2> {
    match &threat.shape {
        Shape::Cylinder(cylinder) => circle(cylinder.center, cylinder.radius),
        Shape::Polygon(polygon) => counterclockwise(polygon.vertices()),
    }
}

/// Where a threat's base and top are converted to another datum.
pub(super) fn middle(threat: &Threat) -> Point2 {
    let Rect { min, max } = threat.extent();
    nalgebra::center(&min, &max)
}

/// A threat without base or top is shown from the lowest to so far above the highest ground below it at least, metres.
const OVER_GROUND_M: f64 = 10.0;

/// Corners of a ring at most below which the ground is looked at.
const LOOKED_AT: usize = 12;

/// Heights in the frame between which a threat without base or top would not vanish in the ground below it.
pub(super) fn over_ground(terrain: &Terrain, threat: &Threat) -> (f64, f64) {
    let ring = ring(threat);
    let step = ring.len().div_ceil(LOOKED_AT);
    let places = ring.into_iter().step_by(step).chain([middle(threat)]);
    let ground = places.map(|at| HeightRange::of(terrain.elevation(at)));
    let ground = ground.fold(HeightRange::EMPTY, HeightRange::join);
    (ground.min, ground.max + OVER_GROUND_M)
}

/// Display name of the threat at `index`.
pub(super) fn name(threat: &Threat, index: usize) -> String {
    threat
        .name
        .clone()
        .unwrap_or_else(|| format!("threat {index}"))
}

fn circle(center: Point2, radius: f64) -> Vec<Point2> {
    let corner = |step: u32| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(step) / f64::from(CORNERS));
        center + radius * nalgebra::Vector2::new(cos, sin)
    };
    (0..CORNERS).map(corner).collect()
}

fn counterclockwise(vertices: &[Point2]) -> Vec<Point2> {
    let mut corners = vertices.to_vec();
    if twice_area(vertices) < 0.0 {
        corners.reverse();
    }
    corners
}
