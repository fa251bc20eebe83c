//! Where the vertices of a mesh are: along the edges of soft zones, of cores and of the area, where these cross, and
//! evenly in between. A mesh may have any vertices; those that lie well make it prove much.

use std::f64::consts::TAU;

use super::super::super::outline::OutlineShape;
use super::super::wall::Wall;
use super::cells::Cells;
use super::spacing::Spacing;
use super::zones::Zones;
use crate::geometry::{Point2, Rect, Vector2, ring};

/// Share of the radius of a circle by which vertices on it are apart at most,
const BENT: f64 = 0.6;

/// but not closer than this share of the distance that is asked for.
const CLOSEST: f64 = 0.4;

/// How near to each other vertices may come, as shares of the distance that is asked for: where edges cross,
const CROSSING: f64 = 0.3;

/// along edges,
const ALONG: f64 = 0.45;

/// and in between.
const BETWEEN: f64 = 0.62;

/// How near vertices in between may come to edges.
const BESIDE: f64 = 0.45;

/// Edges of which all crossings are looked for, at most.
const MOST_EDGES: usize = 1500;

/// Vertices along edges, at most.
const MOST_ALONG: usize = 6000;

/// Places along edges that are tried, about, at most.
const MOST_TRIED: usize = 50_000;

/// Corners of a ring that vertices are laid along, at most.
const MOST_CORNERS: usize = 100;

/// The vertices: first those of `ends`, then the corners of the rectangle that `zones` are in.
pub(super) fn lay(ends: [Point2; 2], zones: &Zones, spacing: &Spacing) -> Vec<Point2> {
    let (rect, walls, tolerance) = (zones.rect(), zones.walls, zones.tolerance());
    let [low, high] = [rect.min, rect.max];
    let corners = [
        low,
        Point2::new(high.x, low.y),
        high,
        Point2::new(low.x, high.y),
    ];
    let mut laid = Laid {
        rect,
        zones,
        places: Vec::new(),
        cells: Cells::new(
            rect,
            (BETWEEN * spacing.side).max(Cells::about(rect, 60_000).side),
        ),
        inhabitants: Vec::new(),
    };
    laid.inhabitants = vec![Vec::new(); laid.cells.count()];
    for place in ends.into_iter().chain(corners) {
        laid.add(place, 0.0);
    }
    let mut edges: Vec<Edge> = ring::edges(&corners)
        .map(|(a, b)| Edge::new(Line::Straight(a, b)))
        .collect();
    let is_simple = |wall: &Wall| wall.corners() <= MOST_CORNERS;
    let simple =
        (walls.iter().enumerate()).filter(|(idx, wall)| zones.counts[*idx] && is_simple(wall));
    for (idx, wall) in simple {
        edges_of(wall, tolerance, &mut |line, reach| {
            edges.push(Edge {
                of: Some((idx, reach)),
                ..Edge::new(line)
            });
        });
    }
    edges.retain(|edge| edge.extent.overlaps(&rect));
    let is_on = |edge: &Edge, place: Point2| {
        // Edges of a soft zone that lie in another part of the same zone are none.
        edge.of
            .is_none_or(|(wall, reach)| walls[wall].distance(place) >= reach - tolerance)
    };
    if edges.len() <= MOST_EDGES {
        edges.sort_by(|one, other| one.extent.0.min.x.total_cmp(&other.extent.0.min.x));
        for (at, one) in edges.iter().enumerate() {
            let near = edges[at + 1..]
                .iter()
                .take_while(|other| other.extent.0.min.x <= one.extent.0.max.x);
            for other in near.filter(|other| other.extent.overlaps(&one.extent.0)) {
                for place in crossings(&one.line, &other.line).into_iter().flatten() {
                    if is_on(one, place) && is_on(other, place) {
                        laid.add(place, CROSSING * spacing.at(place));
                    }
                }
            }
        }
    }
    let mut tried = 0;
    for edge in &edges {
        if laid.places.len() > MOST_ALONG || tried > MOST_TRIED {
            break;
        }
        let length = edge.line.length();
        let mut along = 0.0;
        while along < length {
            let place = edge.line.at(along);
            tried += 1;
            let asked = spacing.at(place);
            let step = asked.min(BENT * edge.line.radius()).max(CLOSEST * asked);
            let outside = rect.excess(place);
            if outside <= 0.0 && is_on(edge, place) {
                laid.add(place, ALONG * step);
            }
            // No way back to the rectangle is shorter.
            along += step.max(outside);
        }
    }
    fill(&mut laid, spacing);
    laid.places
}

/// Between the edges, in equilateral triangles.
fn fill(laid: &mut Laid, spacing: &Spacing) {
    let (rect, tolerance) = (laid.rect, laid.zones.tolerance());
    let inner = |place: Point2| {
        let [low, high] = [place - rect.min, rect.max - place];
        low.x.min(low.y).min(high.x).min(high.y)
    };
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
                let is_beside = inner(place) < BESIDE * side
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

/// What has been laid.
struct Laid<'a> {
    rect: Rect,
    zones: &'a Zones<'a>,
    places: Vec<Point2>,
    cells: Cells,
    /// Of each cell.
    inhabitants: Vec<Vec<usize>>,
}

impl Laid<'_> {
    /// One more, unless it is outside, in a core, or nearer than `least` to another.
    fn add(&mut self, place: Point2, least: f64) {
        let is_inside = place.x.is_finite() && place.y.is_finite() && self.rect.contains(place);
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

/// A line that vertices are laid along.
struct Edge {
    line: Line,
    extent: Extent,
    /// The wall that it belongs to and how far it is from its shape, unless it is one of the area.
    of: Option<(usize, f64)>,
}

impl Edge {
    fn new(line: Line) -> Self {
        Self {
            extent: line.extent(),
            line,
            of: None,
        }
    }
}

/// A rectangle round an edge.
struct Extent(Rect);

impl Extent {
    fn overlaps(&self, rect: &Rect) -> bool {
        let (one, other) = (&self.0, rect);
        one.min.x <= other.max.x
            && other.min.x <= one.max.x
            && one.min.y <= other.max.y
            && other.min.y <= one.max.y
    }
}

#[derive(Debug, Clone, Copy)]
enum Line {
    Straight(Point2, Point2),
    Circle(Point2, f64),
}

impl Line {
    fn length(&self) -> f64 {
        match self {
            Self::Straight(a, b) => (b - a).norm(),
            Self::Circle(_, radius) => TAU * radius,
        }
    }

    fn radius(&self) -> f64 {
        match self {
            Self::Straight(..) => f64::INFINITY,
            Self::Circle(_, radius) => *radius,
        }
    }

    fn at(&self, along: f64) -> Point2 {
        match self {
            Self::Straight(a, b) => a + (b - a) * (along / (b - a).norm()),
            Self::Circle(center, radius) => {
                let (sin, cos) = libm::sincos(along / radius);
                center + Vector2::new(cos, sin) * *radius
            }
        }
    }

    fn extent(&self) -> Extent {
        Extent(match self {
            Self::Straight(a, b) => Rect::around([*a, *b]).expect("two points"),
            Self::Circle(center, radius) => Rect {
                min: *center,
                max: *center,
            }
            .grown(*radius),
        })
    }
}

/// Tell the lines round a wall's core and soft zone, with how far they are from its shape: by the tolerance within
/// them, so that what is linear between their places is in them.
fn edges_of(wall: &Wall, tolerance: f64, tell: &mut dyn FnMut(Line, f64)) {
    let zone = wall.influence - 2.0 * tolerance;
    match &wall.shape {
        OutlineShape::Disc(center) => {
            let core = wall.core - 0.5 * tolerance;
            for radius in [core, zone] {
                if radius >= core && radius > tolerance {
                    tell(Line::Circle(*center, radius), radius);
                }
            }
        }
        OutlineShape::Ring(ring) => {
            // Within the ring by more than a route may enter it.
            for (a, b) in ring::edges(&inset(ring, 3.0 * tolerance)) {
                tell(Line::Straight(a, b), 0.0);
            }
            if zone > tolerance {
                for (a, b) in ring::edges(ring) {
                    tell(Line::Circle(a, zone), zone);
                    let along = b - a;
                    let out = Vector2::new(-along.y, along.x).normalize() * zone;
                    for out in [out, -out] {
                        tell(Line::Straight(a + out, b + out), zone);
                    }
                }
            }
        }
    }
}

/// The ring whose corners are moved inwards so that its edges are by so many metres within the given ones.
fn inset(ring: &[Point2], by: f64) -> Vec<Point2> {
    let twice_area: f64 = ring::edges(ring)
        .map(|(a, b)| (a - ring[0]).perp(&(b - ring[0])))
        .sum();
    let count = ring.len();
    (0..count)
        .map(|i| {
            let [before, at, after] = [
                ring[(i + count - 1) % count],
                ring[i],
                ring[(i + 1) % count],
            ];
            let left = |way: Vector2| Vector2::new(-way.y, way.x) * twice_area.signum();
            let [one, other] = [at - before, after - at].map(|way| left(way.normalize()));
            let sum = one + other;
            // A spike has no inside to speak of.
            at + sum * (2.0 * by / sum.norm_squared().max(1e-4))
        })
        .collect()
}

/// Where two lines cross.
fn crossings(one: &Line, other: &Line) -> [Option<Point2>; 2] {
    match (one, other) {
        (Line::Circle(a, p), Line::Circle(b, q)) => {
            let between = b - a;
            let apart = between.norm();
            let along = (apart * apart + p * p - q * q) / (2.0 * apart);
            let squared = p * p - along * along;
            if squared.is_nan() || squared < 0.0 {
                return [None; 2];
            }
            let unit = between / apart;
            let aside = Vector2::new(-unit.y, unit.x) * squared.sqrt();
            [
                Some(a + unit * along + aside),
                Some(a + unit * along - aside),
            ]
        }
        (Line::Circle(center, radius), Line::Straight(a, b))
        | (Line::Straight(a, b), Line::Circle(center, radius)) => {
            let way = b - a;
            let length = way.norm();
            let unit = way / length;
            let along = (center - a).dot(&unit);
            let squared = radius * radius - (a + unit * along - center).norm_squared();
            if squared.is_nan() || squared < 0.0 {
                return [None; 2];
            }
            [squared.sqrt(), -squared.sqrt()].map(|half| {
                let place = along + half;
                (0.0..=length).contains(&place).then(|| a + unit * place)
            })
        }
        (Line::Straight(a, b), Line::Straight(c, d)) => {
            let (one, other) = (b - a, d - c);
            let turn = one.perp(&other);
            let [t, u] = [(c - a).perp(&other) / turn, (c - a).perp(&one) / turn];
            let is_on = |share: f64| (0.0..=1.0).contains(&share);
            [(is_on(t) && is_on(u)).then(|| a + one * t), None]
        }
    }
}
