//! The border of the area as four walls without soft zones: where a threat reaches over it, nothing passes on that
//! side. The argument is section 3 of docs/BOUND.md.

use super::prices::Prices;
use super::wall::Wall;
use crate::geometry::{Point2, Rect};
use crate::seeding::outline::OutlineShape;

/// Thickness of these walls, as a share of the area's diagonal. They reach twice as far beyond its corners, so that each
/// crosses its neighbours.
const THICKNESS: f64 = 0.02;

/// The border of `area`, if a threat reaches over it; otherwise strings need not know it.
pub(super) fn border(threats: &[Wall], area: &Rect, prices: &Prices) -> Vec<Wall> {
    // No feasible route comes farther.
    let inside = area.grown(2.0 * prices.tolerance);
    if !threats.iter().any(|wall| reaches_over(wall, &inside)) {
        return Vec::new();
    }
    let thick = THICKNESS * area.diagonal();
    let (near, far) = (inside.grown(thick), inside.grown(2.0 * thick));
    let sides = [
        (far.min.x, near.min.y, far.max.x, inside.min.y),
        (inside.max.x, far.min.y, near.max.x, far.max.y),
        (far.min.x, inside.max.y, far.max.x, near.max.y),
        (near.min.x, far.min.y, inside.min.x, far.max.y),
    ];
    let side = |(west, south, east, north)| Rect {
        min: Point2::new(west, south),
        max: Point2::new(east, north),
    };
    sides.map(|sides| Wall::side(&side(sides))).into()
}

/// Whether the hard part of `threat` lies on both sides of the border.
fn reaches_over(threat: &Wall, inside: &Rect) -> bool {
    match &threat.shape {
        OutlineShape::Disc(center) => {
            let within = inside.grown(-threat.core);
            !within.contains(*center) && inside.excess(*center) < threat.core
        }
        OutlineShape::Ring(ring) => {
            let extent = Rect::around(ring.iter().copied());
            extent.is_some_and(|extent| extent.meets(inside))
                && ring.iter().any(|corner| !inside.contains(*corner))
        }
    }
}
