//! Which samples lie under a rectangle of the plane, and whether all of them exist.

use super::DemError;
use super::fit::Fit;
use super::lattice::{LOOKS, Lattice};
use super::raster::{Raster, Span};
use crate::geometry::geodesy::TangentPlane;
use crate::geometry::{Point2, Rect};

/// Extra samples read beyond the outermost needed: the edge is curved between the points checked.
const SPARE: f64 = 2.0;

/// Most rounds of shrinking a rectangle.
const ROUNDS: usize = 200;

/// Cells by which a rectangle is shrunk further, to lie just within the data.
const HAIR: f64 = 1e-3;

/// Points along the edge of `rect`, all the way round, the first not repeated.
fn edge(rect: Rect) -> impl Iterator<Item = Point2> {
    let corners = rect.corners();
    (0..4 * LOOKS).map(move |look| {
        let (a, b) = (corners[look / LOOKS], corners[(look / LOOKS + 1) % 4]);
        a + (b - a) * ((look % LOOKS) as f64 / LOOKS as f64)
    })
}

/// How far `cells` lies outside the nodes to the left, above, to the right and below; 0 inside.
fn overhang(lattice: &Lattice, cells: [f64; 2]) -> [f64; 4] {
    let [x, y] = cells;
    let (right, bottom) = ((lattice.columns - 1) as f64, (lattice.rows - 1) as f64);
    [-x, -y, x - right, y - bottom].map(|cells| cells.max(0.0))
}

fn is_inside(lattice: &Lattice, cells: [f64; 2]) -> bool {
    overhang(lattice, cells).into_iter().all(|over| over <= 0.0)
}

/// The largest part of `wanted` over the nodes of `lattice`; see [`super::Dataset::covered`].
pub(super) fn covered(lattice: &Lattice, plane: &TangentPlane, wanted: Rect) -> Option<Rect> {
    let mut rect = wanted;
    for _ in 0..ROUNDS {
        let size = rect.max - rect.min;
        if size.x <= 0.0 || size.y <= 0.0 {
            return None;
        }
        // How far each side sticks out, as a fraction of the rectangle: west, east, south, north.
        let mut out = [0.0_f64; 4];
        let cells: Vec<[f64; 2]> = edge(rect)
            .map(|point| lattice.below(plane, point))
            .collect::<Option<_>>()?;
        let at = |side: usize, look: usize| cells[(side * LOOKS + look) % (4 * LOOKS)];
        // Sides 0 to 3 are south, east, north and west; each is compared with the opposite side.
        for (side, [from, to]) in [[3, 1], [1, 3], [0, 2], [2, 0]].into_iter().enumerate() {
            for look in 0..=LOOKS {
                let (here, there) = (at(from, look), at(to, LOOKS - look));
                let (x, y) = (there[0] - here[0], there[1] - here[1]);
                let over = overhang(lattice, here);
                // Shrink by the fraction of the distance across that sticks out.
                let along = if x.abs() > y.abs() {
                    (if x > 0.0 { over[0] } else { over[2] }) / x.abs()
                } else {
                    (if y > 0.0 { over[1] } else { over[3] }) / y.abs()
                };
                out[side] = out[side].max(if along > 0.0 {
                    along + HAIR / x.abs().max(y.abs())
                } else {
                    0.0
                });
            }
        }
        if out.into_iter().all(|side| side <= 0.0) {
            let inside = cells.iter().all(|cells| is_inside(lattice, *cells));
            return inside.then_some(rect);
        }
        rect.min.x += out[0] * size.x;
        rect.max.x -= out[1] * size.x;
        rect.min.y += out[2] * size.y;
        rect.max.y -= out[3] * size.y;
    }
    None
}

/// The rows and columns under `area` and, where they exist, within `margin` metres around it.
///
/// # Errors
/// [`DemError::Outside`] when `area` extends beyond the nodes.
pub(super) fn span(
    lattice: &Lattice,
    plane: &TangentPlane,
    area: Rect,
    margin: f64,
) -> Result<Span, DemError> {
    for point in edge(area) {
        let inside = lattice
            .below(plane, point)
            .is_some_and(|cells| is_inside(lattice, cells));
        if !inside {
            return Err(lattice.outside(plane.geodetic(point)));
        }
    }
    let mut reach = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for cells in edge(area.grown(margin))
        .chain(edge(area))
        .filter_map(|point| lattice.below(plane, point))
    {
        for axis in 0..2 {
            reach[axis] = [
                reach[axis][0].min(cells[axis]),
                reach[axis][1].max(cells[axis]),
            ];
        }
    }
    let range = |axis: usize, count: usize| {
        let [from, to] = reach[axis];
        // Two nodes at least.
        let from = node(from - SPARE, count - 2);
        from..(node(to + SPARE + 1.0, count - 1) + 1).max(from + 2)
    };
    Ok(Span {
        rows: range(1, lattice.rows),
        columns: range(0, lattice.columns),
    })
}

/// Why `rect` does not have an elevation everywhere.
pub(super) enum Gap {
    /// It extends beyond the nodes at this point.
    Outside(Point2),
    /// A node without data, by column and row.
    NoData([usize; 2]),
}

/// The first gap under `rect`. `fit` maps the plane to columns and rows; `bend` is that of `fit`.
pub(super) fn gap(raster: &Raster, fit: &Fit, bend: f64, rect: Rect) -> Option<Gap> {
    let lattice = &raster.lattice;
    let points: Vec<Point2> = edge(rect).collect();
    let cells: Vec<[f64; 2]> = points.iter().map(|point| fit.at(*point)).collect();
    let outside = |cells: &[f64; 2]| {
        overhang(lattice, *cells)
            .into_iter()
            .any(|over| over > super::fit::EXACTNESS)
    };
    if let Some(idx) = cells.iter().position(outside) {
        return Some(Gap::Outside(points[idx]));
    }
    // Between two consecutive points, the edge deviates from the straight line by no more than this.
    let longest = (rect.max - rect.min).max() / LOOKS as f64;
    let bulge = bend * longest * longest / 8.0 + super::fit::EXACTNESS;
    let mut rows = vec![[f64::INFINITY, f64::NEG_INFINITY]; lattice.rows - 1];
    for (idx, a) in cells.iter().enumerate() {
        let b = cells[(idx + 1) % cells.len()];
        widen(&mut rows, *a, b, bulge);
    }
    for (row, [from, to]) in rows.into_iter().enumerate() {
        if from > to {
            continue;
        }
        for row in [row, row + 1] {
            for column in node(from, lattice.columns - 1)..=node(to + 1.0, lattice.columns - 1) {
                if raster.elevations[row * lattice.columns + column].is_nan() {
                    return Some(Gap::NoData([column, row]));
                }
            }
        }
    }
    None
}

/// Extend the columns spanned in each row of cells by the line from `a` to `b`, widened by `bulge` cells on either
/// side.
fn widen(rows: &mut [[f64; 2]], a: [f64; 2], b: [f64; 2], bulge: f64) {
    let (low, high) = (a[1].min(b[1]) - bulge, a[1].max(b[1]) + bulge);
    let last = rows.len() - 1;
    let (first, last) = (node(low, last), node(high, last));
    for (row, reach) in rows.iter_mut().enumerate().take(last + 1).skip(first) {
        // The part of the line within this row, extended by `bulge` at both ends.
        let share = |line: f64| {
            let share = (line - a[1]) / (b[1] - a[1]);
            if share.is_finite() {
                share.clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        let flat = (b[1] - a[1]).abs() <= 2.0 * bulge;
        let shares = if flat {
            [0.0, 1.0]
        } else {
            [share(row as f64 - bulge), share(row as f64 + 1.0 + bulge)]
        };
        for share in shares {
            let column = a[0] + (b[0] - a[0]) * share;
            *reach = [reach[0].min(column - bulge), reach[1].max(column + bulge)];
        }
    }
}

/// The node at or before `cell`, at most `last`.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the nodes first"
)]
fn node(cell: f64, last: usize) -> usize {
    cell.clamp(0.0, last as f64) as usize
}
