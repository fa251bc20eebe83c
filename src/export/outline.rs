//! Threats as maps show them: rings in degrees.

use super::chart::Chart;
use crate::geometry::geodesy::LatLon;
use crate::geometry::ring::{edges, twice_area};
use crate::geometry::{Point2, Rect};
use crate::threat::{Shape, Threat};

/// Corners of the ring that represents a circle.
const CORNERS: u32 = 72;

/// Most degrees of longitude between two corners of [`ring_in_degrees`].
const MOST_DEGREES: f64 = 30.0;

/// Edges shorter than this, metres, are not divided: one over a pole has no corners between which the degrees are few.
const SHORTEST_M: f64 = 1.0;

/// Like [`ring`], in degrees, for formats whose edges are straight in degrees. Beside a pole such an edge is far from
/// the straight one of the plane, so edges that span many degrees of longitude are divided.
pub(super) fn ring_in_degrees(chart: &Chart, threat: &Threat) -> Vec<LatLon> {
    let mut corners = Vec::new();
    for (from, to) in edges(&ring(threat)) {
        let [from, to] = [from, to].map(|at| (at, chart.place(at)));
        corners.push(from.1);
        divide(chart, from, to, &mut corners);
    }
    corners
}

/// Add the corners between two places, as many as their degrees of longitude need.
fn divide(chart: &Chart, from: (Point2, LatLon), to: (Point2, LatLon), corners: &mut Vec<LatLon>) {
    let apart = (from.1.lon - to.1.lon).abs();
    if apart.min(360.0 - apart) <= MOST_DEGREES || (from.0 - to.0).norm() < SHORTEST_M {
        return;
    }
    let middle = nalgebra::center(&from.0, &to.0);
    let middle = (middle, chart.place(middle));
    divide(chart, from, middle, corners);
    corners.push(middle.1);
    divide(chart, middle, to, corners);
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
