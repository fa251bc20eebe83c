//! The positions of a mesh's vertices: along the edges of soft zones, of cores and of the area, where these cross, and
//! evenly in between. Any vertices are valid; well-placed ones make the mesh prove more.

use super::super::wall::Wall;
use super::cells::Cells;
use super::edges::{self, Edge};
use super::spacing::Spacing;
use super::zones::Zones;
use crate::geometry::{Point2, Rect, Vector2};
use crate::seeding::outline::OutlineShape;

/// Greatest distance between vertices on a circle, as a share of its radius.
const BENT: f64 = 0.6;

/// Vertices on a circle are no closer than this share of the requested distance.
const CLOSEST: f64 = 0.4;

/// How close vertices may be where edges cross, as a share of the requested distance.
const CROSSING: f64 = 0.3;

/// The same along edges.
const ALONG: f64 = 0.45;

/// The same in between.
const BETWEEN: f64 = 0.62;

/// How close to edges vertices in between may be, as a share of the requested distance.
const BESIDE: f64 = 0.45;

/// How close to the border of the rectangle vertices that are not on it may be, as a share of how close they may be to
/// each other: triangles between them and the border would be slim, and too steep.
const INNER: f64 = 0.5;

/// Maximum number of edges whose crossings are all looked for.
const MOST_EDGES: usize = 1500;

/// Maximum number of vertices along edges.
const MOST_ALONG: usize = 6000;

/// Approximate maximum number of places along edges that are tried.
const MOST_TRIED: usize = 50_000;

/// Maximum number of cells in which the vertices placed so far are looked up.
const MOST_CELLS: usize = 60_000;

/// The vertices: first those of `ends`, then the corners of the rectangle that contains `zones`.
pub(super) fn lay(ends: [Point2; 2], zones: &Zones, spacing: &Spacing) -> Vec<Point2> {
    let rect = zones.rect();
    let side = (BETWEEN * spacing.side).max(Cells::about(rect, MOST_CELLS).side);
    let cells = Cells::new(rect, side);
    let mut laid = Laid {
        zones,
        places: Vec::new(),
        cells,
        inhabitants: vec![Vec::new(); cells.count()],
    };
    for place in ends.into_iter().chain(rect.corners()) {
        laid.add(place, 0.0);
    }
    let mut edges = edges::all(zones);
    if edges.len() <= MOST_EDGES {
        edges.sort_by(|one, other| one.extent.min.x.total_cmp(&other.extent.min.x));
        cross(&mut laid, &edges, spacing);
    }
    follow(&mut laid, &edges, spacing);
    fill(&mut laid, spacing);
    laid.places
}

/// Place vertices where edges cross, the westernmost edges first.
fn cross(laid: &mut Laid, edges: &[Edge], spacing: &Spacing) {
    for (at, one) in edges.iter().enumerate() {
        let near = edges[at + 1..]
            .iter()
            .take_while(|other| other.extent.min.x <= one.extent.max.x);
        for other in near.filter(|other| other.extent.meets(&one.extent)) {
            for place in one.crossings(other) {
                laid.add(place, CROSSING * spacing.at(place));
            }
        }
    }
}

/// Place vertices along the edges.
fn follow(laid: &mut Laid, edges: &[Edge], spacing: &Spacing) {
    let rect = laid.zones.rect();
    let mut tried = 0;
    for edge in edges {
        if laid.places.len() > MOST_ALONG || tried > MOST_TRIED {
            break;
        }
        let mut along = 0.0;
        while along < edge.length() {
            tried += 1;
            let place = edge.at(along);
            let asked = spacing.at(place);
            let step = asked.min(BENT * edge.radius()).max(CLOSEST * asked);
            let outside = rect.excess(place);
            if outside <= 0.0 && edge.is_there(place) {
                laid.add(place, ALONG * step);
            }
            // The way back to the rectangle is no shorter than this.
            along += step.max(outside);
        }
    }
}

/// Place vertices between the edges, in equilateral triangles.
fn fill(laid: &mut Laid, spacing: &Spacing) {
    let (rect, tolerance) = (laid.zones.rect(), laid.zones.tolerance());
    for cell in 0..spacing.cells.count() {
        let side = spacing.side * spacing.wider(cell);
        let row = side * (0.75_f64).sqrt();
        let square = spacing.cells.square(cell);
        let [low, high] = [square.min - rect.min, square.max - rect.min];
        let mut j = (low.y / row).ceil();
        while j * row < high.y {
            let shift = if j % 2.0 == 0.0 { 0.0 } else { 0.5 };
            let mut i = (low.x / side - shift).ceil();
            while (i + shift) * side < high.x {
                let place = rect.min + Vector2::new((i + shift) * side, j * row);
                let is_beside = inner(&rect, place) < BESIDE * side
                    || laid
                        .zones
                        .near(place)
                        .any(|wall| is_beside(wall, place, side, tolerance));
                if !is_beside {
                    laid.add(place, BETWEEN * side);
                }
                i += 1.0;
            }
            j += 1.0;
        }
    }
}

/// How far a place is inside a rectangle.
fn inner(rect: &Rect, place: Point2) -> f64 {
    let [low, high] = [place - rect.min, rect.max - place];
    low.x.min(low.y).min(high.x).min(high.y)
}

/// The place on the border of a rectangle within `near` of another in each direction; that place itself if there is
/// none.
fn onto(rect: &Rect, place: Point2, near: f64) -> Point2 {
    let onto = |at: f64, borders: [f64; 2]| {
        let border = borders.into_iter().find(|to| (at - to).abs() <= near);
        border.unwrap_or(at)
    };
    Point2::new(
        onto(place.x, [rect.min.x, rect.max.x]),
        onto(place.y, [rect.min.y, rect.max.y]),
    )
}

/// Whether a place is near the edge of a zone or a core.
fn is_beside(wall: &Wall, place: Point2, side: f64, tolerance: f64) -> bool {
    let away = wall.distance(place);
    let least = |radius: f64| BESIDE * side.min(BENT * radius).max(CLOSEST * side);
    let is_ring = matches!(wall.shape, OutlineShape::Ring(_));
    let core = if is_ring {
        BESIDE * side
    } else {
        least(wall.core)
    };
    ((is_ring || wall.core > tolerance) && (away - wall.core).abs() < core)
        || (away - wall.influence).abs() < least(wall.influence)
}

/// The vertices placed so far.
struct Laid<'a> {
    zones: &'a Zones<'a>,
    places: Vec<Point2>,
    cells: Cells,
    /// Vertices in each cell.
    inhabitants: Vec<Vec<usize>>,
}

impl Laid<'_> {
    /// Add a vertex, unless it is outside, in a core, or nearer than `least` to another, or to the border without being
    /// on it.
    fn add(&mut self, place: Point2, least: f64) {
        let rect = self.zones.rect();
        // Start, target and corners are used as they are.
        let place = if least > 0.0 {
            onto(&rect, place, self.zones.tolerance())
        } else {
            place
        };
        let inner = inner(&rect, place);
        if inner > 0.0 && inner < INNER * least {
            return;
        }
        let is_inside = place.x.is_finite() && place.y.is_finite() && rect.contains(place);
        if !is_inside || (least > 0.0 && self.zones.is_deep(place)) {
            return;
        }
        let is_near = |cell: usize| {
            let inhabitants = self.inhabitants[cell].iter();
            inhabitants
                .map(|other| self.places[*other])
                .any(|other| (other - place).norm() < least)
        };
        if least > 0.0 && self.cells.within(place, least).any(is_near) {
            return;
        }
        self.inhabitants[self.cells.of(place)].push(self.places.len());
        self.places.push(place);
    }
}
