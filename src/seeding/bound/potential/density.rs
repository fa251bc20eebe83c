//! What a metre costs in each triangle of a mesh, so that the mean over a cell is nowhere more than
//! what it costs in the cell's middle.

use super::super::super::outline::OutlineShape;
use super::super::prices::Prices;
use super::super::wall::Wall;
use super::mesh::{Mesh, REACH};
use crate::geometry::{Point2, ring};

/// How a mesh is priced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// So that a potential proves something.
    Proven,
    /// As it is in the middle of each triangle: for an estimate.
    Estimated,
}

/// Distances to edges or discs that are measured for one mesh; what is beyond counts as fuel alone.
const MOST_DISTANCES: usize = 3_000_000;

/// Set the limits of the triangles of `mesh`, which are those that are not 0, by `walls`.
pub(super) fn price(mesh: &mut Mesh, walls: &[Wall], prices: &Prices, kind: Kind) {
    let side = mesh.side;
    for limit in &mut mesh.limits {
        if *limit > 0.0 {
            *limit = prices.fuel * side;
        }
    }
    let share = prices.exposure * side;
    let reach = match kind {
        Kind::Proven => 2.0 * REACH * side,
        Kind::Estimated => 0.0,
    };
    let mut distances = 0;
    for wall in walls {
        let (center, radius) = wall.circle();
        let is_convex = wall.is_convex();
        let near: Vec<usize> = mesh
            .near(center, radius + wall.influence)
            .filter(|triangle| mesh.limits[*triangle] > 0.0)
            .collect();
        distances += near.len() * wall.centers().len();
        if distances > MOST_DISTANCES {
            break;
        }
        for triangle in near {
            let away = wall.distance(mesh.middle(triangle));
            // A route may enter rings by the tolerance, and places are rounded by far less.
            let depth = wall.influence - away - prices.tolerance;
            // The mean over a cell of a concave depth is at most that in its middle; at the edge of the zone,
            // where depths end at 0, the rise is twice as steep and begins further in.
            let counted = if is_convex {
                depth.min(2.0 * (depth - reach))
            } else {
                depth - reach
            };
            if counted > 0.0 {
                mesh.limits[triangle] += share * counted;
            }
        }
    }
    for wall in walls {
        leave_out_core(mesh, wall, prices, kind);
    }
}

/// Take the triangles out of the mesh that no cell of a point of a route meets.
fn leave_out_core(mesh: &mut Mesh, wall: &Wall, prices: &Prices, kind: Kind) {
    let (center, radius) = wall.circle();
    let reach = mesh.side * REACH * (1.0 + 1e-9);
    let near: Vec<usize> = mesh
        .near(center, radius + wall.core)
        .filter(|triangle| mesh.limits[*triangle] > 0.0)
        .collect();
    for triangle in near {
        let is_within = |point: Point2, by: f64| match &wall.shape {
            OutlineShape::Disc(center) => (point - center).norm() <= wall.core - by,
            // All of a triangle is nearer than a reach to one of its corners.
            OutlineShape::Ring(ring) => {
                ring::contains(ring, point)
                    && ring::distance(ring, point) >= 2.0 * (by + prices.tolerance)
            }
        };
        let is_out = match kind {
            Kind::Proven => mesh
                .corners(triangle)
                .iter()
                .all(|corner| is_within(mesh.at(*corner), reach)),
            Kind::Estimated => is_within(mesh.middle(triangle), 0.0),
        };
        if is_out {
            mesh.limits[triangle] = 0.0;
        }
    }
}
