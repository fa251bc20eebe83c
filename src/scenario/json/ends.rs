//! Whether a route can begin at the start and end at the target: apart from each other, on the
//! ground or above it, inside the area and the terrain, outside every threat.

use std::cmp::Ordering;

use crate::geometry::{Point2, Point3, Rect};
use crate::terrain::{Grid, Terrain};
use crate::threat::{Shape, Threat};

use super::fault::Faults;
use super::path::Path;
use super::ring;
use super::terrain::extent;
use super::value::{figure, metres, quote};

/// So much below ground still counts as standing on it, metres; more than digits of a decimal
/// can blur.
const SUNK_M: f64 = 0.1 + 1e-9;
/// Start and target closer than this, in space, are the same, metres.
const SAME_M: f64 = 1e-6;
/// Start and target closer than this, seen from above, give the route no direction, metres.
const ABOVE_M: f64 = 1e-3;

/// Start and target must be apart, and apart seen from above: the encoding of a route turns about
/// the line between them.
pub(super) fn check_apart(start: Point3, target: Point3, faults: &mut Faults) {
    let path = Path::Key(&Path::Root, "target");
    let (distance, horizontal) = ((target - start).norm(), (target.xy() - start.xy()).norm());
    if distance <= SAME_M {
        faults.add(&path, "target-is-start", || {
            format!(
                "target is {} m from start, must be more than {SAME_M} m away",
                metres(distance)
            )
        });
    } else if horizontal < ABOVE_M {
        faults.add(&path, "target-above-start", || {
            format!(
                "target is {} m from start seen from above, must be at least {ABOVE_M} m",
                metres(horizontal)
            )
        });
    }
}

/// The start or the target beside the ground: `name` is its field.
pub(super) fn check_ground(name: &str, end: Point3, terrain: &Terrain, faults: &mut Faults) {
    let path = Path::Key(&Path::Root, name);
    if let Terrain::Grid(grid) = terrain
        && !extent(grid).contains(end.xy())
    {
        return outside(
            &path,
            "outside-terrain",
            "the terrain grid",
            end,
            extent(grid),
            faults,
        );
    }
    let ground = elevation(terrain, end.xy());
    if ground - end.z > SUNK_M {
        faults.add(&path, "below-ground", || {
            format!(
                "{name} has z {}, must be at most 0.1 m below the ground, which is at {}",
                figure(end.z),
                metres(ground)
            )
        });
    }
}

/// The start or the target must lie in the area; whether it does.
pub(super) fn check_area(name: &str, end: Point3, area: Rect, faults: &mut Faults) -> bool {
    let contained = area.contains(end.xy());
    if !contained {
        let path = Path::Key(&Path::Root, name);
        outside(&path, "outside-area", "the area", end, area, faults);
    }
    contained
}

/// The start or the target must lie in no threat; touching one is clear.
pub(super) fn check_threats(name: &str, end: Point3, threats: &[Option<Threat>], faults: &mut Faults) {
    let mut around = threats.iter().enumerate().filter_map(|(threat_idx, threat)| {
        let threat = threat.as_ref()?;
        inside(threat, end).then_some((threat_idx, threat))
    });
    let Some((threat_idx, threat)) = around.next() else {
        return;
    };
    let more = around.count();
    let code = if name == "start" {
        "start-in-threat"
    } else {
        "target-in-threat"
    };
    faults.add(&Path::Key(&Path::Root, name), code, || {
        let named = threat
            .name
            .as_deref()
            .map(|name| format!(" ({})", quote(name)))
            .unwrap_or_default();
        let others = if more > 0 {
            format!(" and {more} more")
        } else {
            String::new()
        };
        let place = match &threat.shape {
            Shape::Cylinder(cylinder) => format!(
                "{} m from the axis of threats/{threat_idx}{named}{others}, must be >= its radius {}",
                metres((end.xy() - cylinder.center).norm()),
                figure(cylinder.radius)
            ),
            Shape::Polygon(_) => {
                format!("inside the polygon threats/{threat_idx}{named}{others}, must be outside")
            }
        };
        format!("{name} is {place}")
    });
}

fn outside(path: &Path<'_>, code: &'static str, what: &str, end: Point3, rect: Rect, faults: &mut Faults) {
    faults.add(path, code, || {
        format!(
            "{} is at ({}, {}), must lie in {what}, from ({}, {}) to ({}, {})",
            path.label(),
            figure(end.x),
            figure(end.y),
            figure(rect.min.x),
            figure(rect.min.y),
            figure(rect.max.x),
            figure(rect.max.y)
        )
    });
}

/// Whether a point is in a threat's heights and strictly inside its outline.
fn inside(threat: &Threat, point: Point3) -> bool {
    let reached =
        threat.base.is_none_or(|base| point.z >= base) && threat.top.is_none_or(|top| point.z < top);
    reached
        && match &threat.shape {
            Shape::Cylinder(cylinder) => (point.xy() - cylinder.center).norm() < cylinder.radius,
            Shape::Polygon(polygon) => inside_ring(&polygon.vertices, point.xy()),
        }
}

/// Whether a point is strictly inside a simple ring, by the parity of the edges to its right.
fn inside_ring(vertices: &[Point2], point: Point2) -> bool {
    let mut inside = false;
    for (vertex_idx, a) in vertices.iter().enumerate() {
        let b = vertices[(vertex_idx + 1) % vertices.len()];
        let side = ring::turn(*a, b, point);
        let within = |from: f64, to: f64, at: f64| from.min(to) <= at && at <= from.max(to);
        if side == Ordering::Equal && within(a.x, b.x, point.x) && within(a.y, b.y, point.y) {
            return false;
        }
        let upward = a.y <= point.y && point.y < b.y && side == Ordering::Greater;
        let downward = b.y <= point.y && point.y < a.y && side == Ordering::Less;
        inside ^= upward || downward;
    }
    inside
}

/// The ground at a place, metres.
fn elevation(terrain: &Terrain, at: Point2) -> f64 {
    match terrain {
        Terrain::Flat(flat) => flat.elevation,
        Terrain::Peaks(peaks) => peaks.peaks.iter().fold(peaks.base, |sum, peak| {
            let (dx, dy) = (
                (at.x - peak.center.x) / peak.spread.x,
                (at.y - peak.center.y) / peak.spread.y,
            );
            sum + peak.height * libm::exp(-dx * dx - dy * dy)
        }),
        Terrain::Grid(grid) => grid_elevation(grid, at),
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the grid's indices"
)]
fn grid_elevation(grid: &Grid, at: Point2) -> f64 {
    let cell = |offset: f64, nodes: usize| {
        let place = (offset / grid.cell).clamp(0.0, (nodes - 1) as f64);
        let index = (place as usize).min(nodes - 2);
        (index, place - index as f64)
    };
    let (column, u) = cell(at.x - grid.origin.x, grid.columns);
    let (row, v) = cell(at.y - grid.origin.y, grid.rows);
    let node = |row: usize, column: usize| grid.elevations[row * grid.columns + column];
    let south = node(row, column) * (1.0 - u) + node(row, column + 1) * u;
    let north = node(row + 1, column) * (1.0 - u) + node(row + 1, column + 1) * u;
    south * (1.0 - v) + north * v
}
