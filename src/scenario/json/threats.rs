//! `threats`: cylinders and polygons.

use crate::geometry::Point2;
use crate::geometry::simple::{self, RingFault};
use crate::scenario::limits::Limits;
use crate::threat::{Cylinder, Polygon, Shape, Threat};

use super::chart::Chart;
use super::fault::Faults;
use super::fields::Fields;
use super::path::Path;
use super::ranges::{COORDINATE, MARGIN, RADIUS};
use super::tree::Node;
use super::value::{At, figure, name};

const CYLINDER: &[&str] = &[
    "kind",
    "name",
    "center",
    "radius",
    "influence",
    "base",
    "top",
];
const POLYGON: &[&str] = &["kind", "name", "vertices", "margin", "base", "top"];

/// The threats in document order; those that cannot be read are `None`.
pub(super) fn threats(
    at: At<'_>,
    chart: &Chart,
    limits: &Limits,
    faults: &mut Faults,
) -> Option<Vec<Option<Threat>>> {
    let len = at.len(faults)?;
    if len > limits.threats {
        faults.add(at.path, "too-many", || {
            format!(
                "threats has {len} items, must have at most {} (limit threats)",
                limits.threats
            )
        });
        return None;
    }
    let n_vertices = vertex_count(at);
    let within = n_vertices <= limits.polygon_vertices;
    if !within {
        faults.add(at.path, "too-many", || {
            format!(
                "the polygons have {n_vertices} vertices together, must have at most {} (limit polygon_vertices)",
                limits.polygon_vertices
            )
        });
    }
    Some(at.items(faults, |at, faults| threat(at, chart, within, faults)))
}

/// The number of vertices of all polygons, before any is read.
fn vertex_count(at: At<'_>) -> usize {
    let Node::Array(threats) = at.node else {
        return 0;
    };
    let count = |threat: &Node| match threat.get("vertices") {
        Some(Node::Array(vertices)) => vertices.len(),
        Some(Node::Numbers(vertices)) => vertices.len(),
        _ => 0,
    };
    threats.iter().map(count).sum()
}

/// One threat; vertices are skipped if `read_vertices` is false because there are too many.
fn threat(at: At<'_>, chart: &Chart, read_vertices: bool, faults: &mut Faults) -> Option<Threat> {
    let (kind, fields) = at.variant(&[("cylinder", CYLINDER), ("polygon", POLYGON)], faults)?;
    let name = fields.or("name", None, faults, name);
    let base = fields.nullable("base", COORDINATE, faults);
    let top = fields.nullable("top", COORDINATE, faults);
    let shape = match kind {
        "cylinder" => cylinder(&fields, chart, faults).map(Shape::Cylinder),
        "polygon" => polygon(&fields, chart, read_vertices, faults).map(Shape::Polygon),
        _ => unreachable!("a kind that the table above lacks"),
    };
    let (base, top) = (base?, top?);
    if let (Some(base), Some(top)) = (base, top)
        && base >= top
    {
        faults.add(&Path::Key(at.path, "base"), "base-above-top", || {
            format!(
                "base is {}, must be < top, which is {}",
                figure(base),
                figure(top)
            )
        });
        return None;
    }
    Some(Threat {
        name: name?,
        shape: shape?,
        base,
        top,
    })
}

fn cylinder(fields: &Fields<'_>, chart: &Chart, faults: &mut Faults) -> Option<Cylinder> {
    let center = fields.required("center", faults, |at, faults| chart.point2(at, faults));
    let radius = fields.number("radius", RADIUS, faults);
    let influence = fields.or("influence", None, faults, |at, faults| {
        at.number(RADIUS, faults).map(Some)
    });
    let radius = radius?;
    let influence = influence?.unwrap_or(radius);
    if influence < radius {
        faults.add(
            &Path::Key(fields.path, "influence"),
            "influence-below-radius",
            || {
                format!(
                    "influence is {}, must be >= radius, which is {}",
                    figure(influence),
                    figure(radius)
                )
            },
        );
        return None;
    }
    Some(Cylinder {
        center: center?,
        radius,
        influence,
    })
}

fn polygon(
    fields: &Fields<'_>,
    chart: &Chart,
    read_vertices: bool,
    faults: &mut Faults,
) -> Option<Polygon> {
    let margin = fields.number_or("margin", 0.0, MARGIN, faults);
    let vertices = fields.required("vertices", faults, |at, faults| {
        at.len(faults)?;
        if read_vertices {
            vertices(at, chart, faults)
        } else {
            None
        }
    });
    Some(Polygon::new(vertices?, margin?))
}

/// The vertices of a simple ring, without the closing one.
fn vertices(at: At<'_>, chart: &Chart, faults: &mut Faults) -> Option<Vec<Point2>> {
    let mut vertices: Vec<Point2> = at
        .items(faults, |at, faults| chart.point2(at, faults))
        .into_iter()
        .collect::<Option<_>>()?;
    if vertices.len() > 1 && vertices.first() == vertices.last() {
        vertices.pop();
    }
    let Err(found) = simple::check(&vertices) else {
        return Some(vertices);
    };
    for fault in found {
        let (code, detail) = ring_fault(fault, vertices.len());
        faults.add(at.path, code, || detail);
    }
    None
}

/// The code and the detail of the fault of a ring with so many vertices.
fn ring_fault(fault: RingFault, n_vertices: usize) -> (&'static str, String) {
    match fault {
        RingFault::TooFew => (
            "degenerate-polygon",
            format!("vertices has {n_vertices} different points, must have at least 3"),
        ),
        RingFault::Flat => (
            "degenerate-polygon",
            "vertices all lie on one line, must enclose an area".to_owned(),
        ),
        RingFault::Repeated(a, b) => (
            "degenerate-polygon",
            format!("vertices {a} and {b} are the same point, must be different"),
        ),
        RingFault::Crossing(a, b) => (
            "self-crossing-polygon",
            format!(
                "the edges from vertices {a} and {b} cross or touch, must meet nowhere but at their ends"
            ),
        ),
    }
}
