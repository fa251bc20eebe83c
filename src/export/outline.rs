//! Threats as maps show them: rings in degrees.

use super::chart::{Chart, Fix};
use crate::geometry::ring::twice_area;
use crate::geometry::{Point2, Point3};
use crate::threat::{Shape, Threat};

/// Corners of the ring that represents a circle.
const CORNERS: u32 = 72;

/// The outline of `threat`, counter-clockwise seen from above, without repeated first corner, at height `z` of the
/// scenario's frame. A circle's corners lie on the circle.
pub(super) fn ring(chart: &Chart, threat: &Threat, z: f64) -> Vec<Fix> {
    let corners = match &threat.shape {
        Shape::Cylinder(cylinder) => circle(cylinder.center, cylinder.radius),
        Shape::Polygon(polygon) => counterclockwise(polygon.vertices()),
    };
    let fix = |corner: Point2| chart.fix(Point3::new(corner.x, corner.y, z));
    corners.into_iter().map(fix).collect()
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
