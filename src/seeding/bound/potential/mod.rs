//! A lower bound for routes that must cross soft zones: a potential that nowhere rises faster than the cost of a metre.
//! The argument is section 6 of docs/BOUND.md.

mod cells;
mod easing;
mod edges;
mod lead;
mod levels;
mod marching;
mod mesh;
mod priced;
mod proof;
mod sides;
mod slopes;
mod spacing;
mod vertices;
mod ways;
mod zones;

use super::WORTHWHILE;
use super::prices::Prices;
use super::wall::Wall;
use crate::geometry::{Point2, Rect, Vector2};
pub(super) use lead::{FREE, Lead, Leads};
use levels::Levels;
use mesh::Mesh;
use priced::Priced;
pub(super) use proof::Proof;
use spacing::Spacing;
pub use ways::{WaysSought, cheap_ways};
use zones::Zones;

/// Approximate number of vertices of a mesh that shows where the cheapest routes are.
const FIRST: usize = 1000;

/// Maximum number of meshes of that kind.
const MOST_MESHES: usize = 4;

/// Least number of the smallest vertex distances between start and target in the last of them.
const STEPS: f64 = 10.0;

/// Approximate number of vertices of the first mesh that proves something.
const FINE: usize = 2500;

/// Maximum number of vertices of any mesh, not counting those of the first.
const MOST_VERTICES: usize = 6000;

/// How often vertices are added, at most.
const MOST_ROUNDS: usize = 3;

/// At this share of a potential's rise, more vertices are not worthwhile.
const NEARLY: f64 = 0.993;

/// A route that costs this multiple of a string is not considered.
const BEYOND: f64 = 1.05;

/// A string this many times as expensive as what is known promises more, whatever the estimate.
const FAR: f64 = 1.5;

/// Whether there are soft zones, and prices and ends for which a potential can prove something.
pub(super) fn applies(walls: &[Wall], prices: &Prices) -> bool {
    prices.exposure > 0.0
        && prices.direct() > 1e5 * prices.tolerance
        && whole(walls).any(|wall| wall.influence > wall.core)
}

/// The walls that cover all heights.
pub(super) fn whole(walls: &[Wall]) -> impl Iterator<Item = &Wall> {
    let is_whole = |wall: &&Wall| wall.toll.is_none() && !wall.is_border;
    walls.iter().filter(is_whole)
}

/// A proof of a lower bound at the prices of fuel and soft zones, seen from above, where it `applies`; `None` where
/// that is not expected to exceed `known`, another lower bound. A string costs what is `promised`, and routes begin and
/// end with legs that cost what `leads` say.
pub(super) fn prove(
    walls: &[Wall],
    prices: &Prices,
    area: &Rect,
    (known, promised): (f64, f64),
    leads: &Leads,
    stop: &dyn Fn() -> bool,
) -> Option<Proof> {
    if promised <= WORTHWHILE * known {
        return None;
    }
    let plane = Plane::new(whole(walls).cloned(), prices, area);
    let (ends, area) = (plane.ends, plane.area.grown(2.0 * prices.tolerance));
    let (rect, cap) = region(ends, &area, prices, promised);
    let zones = Zones::new(&plane.walls, prices, rect);
    let mut spacing = Spacing::even(rect, &zones, FIRST);
    let mut extras = [0.0; 2];
    for level in 1..=MOST_MESHES {
        let vertices = vertices::lay(ends, &zones, &spacing);
        let priced = Priced::over(&vertices, &zones, &spacing, leads)?;
        let costs;
        (costs, extras) = priced.costs();
        let estimate = costs[0][1] - extras[0];
        // The first mesh is too coarse for narrow gaps, so its estimate can leak through them.
        let is_near = prices.climbing_at(estimate) < WORTHWHILE * known && promised < FAR * known;
        // Nothing leads to the target, or there is nothing to gain.
        if !estimate.is_finite() || (level == 1 && is_near) || stop() {
            return None;
        }
        let is_enough = prices.direct() > STEPS * spacing.side;
        let next = if is_enough { FINE } else { FIRST };
        spacing = spacing.finer(&priced.mesh, &costs, &zones, next);
        if is_enough {
            break;
        }
    }
    let vertices = vertices::lay(ends, &zones, &spacing);
    let steep = steepest(vertices, (&zones, &mut spacing), (leads, extras), stop)?;
    Some(Proof::new(steep, cap, (plane.origin, rect)))
}

/// The scene seen from above, with the start as origin, where places are rounded least.
struct Plane {
    /// Position of the start.
    origin: Vector2,
    walls: Vec<Wall>,
    ends: [Point2; 2],
    area: Rect,
}

impl Plane {
    fn new(walls: impl Iterator<Item = Wall>, prices: &Prices, area: &Rect) -> Self {
        let origin = prices.ends[0].xy().coords;
        Self {
            origin,
            walls: walls.map(|wall| wall.moved(-origin)).collect(),
            ends: prices.ends.map(|end| end.xy() - origin),
            area: Rect {
                min: area.min - origin,
                max: area.max - origin,
            },
        }
    }
}

/// The potential over the first two of `vertices` that rises most, with more vertices where the triangles are too large
/// for their rise.
fn steepest(
    mut vertices: Vec<Point2>,
    (zones, spacing): (&Zones, &mut Spacing),
    (leads, extras): (&Leads, [f64; 2]),
    stop: &dyn Fn() -> bool,
) -> Option<(Mesh, Vec<f64>, Levels)> {
    let mut best: Option<(Priced, Vec<f64>, Levels)> = None;
    for round in 0..=MOST_ROUNDS {
        let Some(priced) = Priced::over(&vertices, zones, spacing, leads) else {
            break;
        };
        let potential = priced.potential(extras);
        let rise = potential[1] - potential[0];
        // Nothing leads to the target.
        if !(rise > 0.0 && rise.is_finite()) {
            break;
        }
        let levels = priced.levels(&potential);
        let proven = levels.total();
        // The first of these meshes shows whether those before it were too coarse for gaps.
        let is_held_down = round == 0 && spacing.raise(rise + extras[0] + extras[1]);
        let room = MOST_VERTICES.saturating_sub(vertices.len());
        let is_enough = room == 0 || proven >= NEARLY * rise;
        let is_last = round == MOST_ROUNDS || (is_enough && !is_held_down) || stop();
        if !is_last {
            vertices.extend(priced.between(&potential).into_iter().take(room));
        }
        if best
            .as_ref()
            .is_none_or(|(_, _, other)| proven > other.total())
        {
            best = Some((priced, potential, levels));
        }
        if is_last {
            break;
        }
    }
    let (priced, potential, levels) = best?;
    if stop() {
        return Some((priced.mesh, potential, levels));
    }
    let mut eased = potential.clone();
    priced.ease(&mut eased, easing::MANY);
    let levels_eased = priced.levels(&eased);
    Some(if levels_eased.total() > levels.total() {
        (priced.mesh, eased, levels_eased)
    } else {
        (priced.mesh, potential, levels)
    })
}

/// The region in which routes are considered, and the least cost of one that leaves it: all of the area, or the part
/// with all ways whose fuel alone does not cost more than is `promised`.
fn region(ends: [Point2; 2], area: &Rect, prices: &Prices, promised: f64) -> (Rect, f64) {
    let direct = prices.direct();
    let longest = (BEYOND * promised / prices.fuel).max(1.5 * direct);
    if !longest.is_finite() {
        return (*area, f64::INFINITY);
    }
    // Half of the rectangle round the ellipse whose foci are the ends.
    let across_squared = longest * longest - direct * direct;
    let along = ends[1] - ends[0];
    let half = [along.x, along.y].map(|extent| 0.5 * (across_squared + extent * extent).sqrt());
    let middle = nalgebra::center(&ends[0], &ends[1]);
    let rect = Rect {
        min: Point2::new(
            area.min.x.max(middle.x - half[0]),
            area.min.y.max(middle.y - half[1]),
        ),
        max: Point2::new(
            area.max.x.min(middle.x + half[0]),
            area.max.y.min(middle.y + half[1]),
        ),
    };
    (rect, prices.fuel * longest)
}

#[cfg(test)]
mod tests;
