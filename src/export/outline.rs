//! Threats as maps show them: rings in degrees.

use crate::geometry::Point2;
use crate::geometry::ring::twice_area;
use crate::threat::{Shape, Threat};

/// Corners of the ring that represents a circle.
const CORNERS: u32 = 72;

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
    match &threat.shape {
        Shape::Cylinder(cylinder) => cylinder.center,
        Shape::Polygon(polygon) => {
            let bounds = polygon.bounds();
            nalgebra::center(&bounds.min, &bounds.max)
        }
    }
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
