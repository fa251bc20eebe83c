//! Parts of a ring's soft zone that belong to a single edge or corner, for pricing in lanes.
//!
//! There the distance from the ring is the distance from that feature, so exposure is a sum over features. This does
//! not hold near a reflex corner or where a part of the ring is close to another.

use nalgebra::Vector2;

use crate::geometry::{Point2, ring};

/// Non-convex rings with more vertices than this have no zones.
const MOST_VERTICES: usize = 256;

/// A point this near to an edge's line, metres, counts as on it: beyond the line is the inside of the ring. A leg this
/// near to the line on which the zones of an edge and of a corner meet, and parallel to it, counts as beside the edge,
/// and for the edge alone.
pub(crate) const HAIR: f64 = 1e-6;

/// Sine of the angle between edges that are in line.
const IN_LINE: f64 = 1e-13;

/// A part of an edge, usually all of it, and the part of the soft zone to which it is nearest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Zone {
    /// Start of the part.
    pub(crate) a: Point2,
    /// Unit vector along it.
    pub(crate) along: Vector2<f64>,
    pub(crate) length: f64,
    /// Unit vector out of the ring.
    pub(crate) outward: Vector2<f64>,
    /// How far beyond its end a leg parallel to `outward` may be, metres, to count as beside it; below 0 where the next
    /// edge goes on in line, which has that leg for its own.
    pub(crate) overhang: f64,
    /// Direction of the previous edge, if the corner at `a` is nearest to a part of its own.
    pub(crate) before: Option<Vector2<f64>>,
    /// Whether something else may be as near as this part or its corner.
    pub(crate) is_shared: bool,
    /// Circle around the part.
    pub(crate) center: Point2,
    pub(crate) radius: f64,
}

/// The edges of a ring, with the direction outwards.
struct Sides<'r> {
    vertices: &'r [Point2],
    edges: Vec<Side>,
    margin: f64,
    is_convex: bool,
}

struct Side {
    a: Point2,
    b: Point2,
    along: Vector2<f64>,
    outward: Vector2<f64>,
    length: f64,
}

/// The zones of the simple ring through `vertices`, `margin` wide; `None` for one with notches and
/// so many corners that its parts take too long to find.
pub(super) fn zones(vertices: &[Point2], is_convex: bool, margin: f64) -> Option<Vec<Zone>> {
    let sides = Sides::of(vertices, is_convex, margin);
    if !sides.is_convex && vertices.len() > MOST_VERTICES {
        return None;
    }
    let mut zones = Vec::new();
    for idx in 0..vertices.len() {
        sides.add_zones(idx, &mut zones);
    }
    Some(zones)
}

impl<'r> Sides<'r> {
    fn of(vertices: &'r [Point2], is_convex: bool, margin: f64) -> Self {
        let turning = ring::twice_area(vertices).signum();
        let edge = |(a, b): (Point2, Point2)| {
            let along = (b - a).normalize();
            let outward = Vector2::new(along.y, -along.x) * turning;
            Side {
                a,
                b,
                along,
                outward,
                length: (b - a).norm(),
            }
        };
        Self {
            vertices,
            edges: ring::edges(vertices).map(edge).collect(),
            margin,
            is_convex,
        }
    }

    fn before(&self, idx: usize) -> &Side {
        &self.edges[(idx + self.edges.len() - 1) % self.edges.len()]
    }

    fn after(&self, idx: usize) -> &Side {
        &self.edges[(idx + 1) % self.edges.len()]
    }

    /// Whether the corner at the beginning of edge `idx` is convex.
    fn points_outwards(&self, idx: usize) -> bool {
        self.is_convex || self.before(idx).outward.dot(&self.edges[idx].along) <= 0.0
    }

    fn add_zones(&self, idx: usize, zones: &mut Vec<Zone>) {
        let edge = &self.edges[idx];
        let next = (idx + 1) % self.edges.len();
        // Beside a reflex corner, the other edge is equally near from some distance on.
        let off = |inwards: bool, other: &Side| {
            if inwards {
                // Tangent of half the angle between the edges, outside.
                let (cos, sin) = (
                    edge.along.dot(&other.along),
                    edge.along.perp(&other.along).abs(),
                );
                self.margin * sin / (1.0 + cos).max(1e-9) * (1.0 + 1e-9) + 1e-6
            } else {
                0.0
            }
        };
        let from = off(!self.points_outwards(idx), self.before(idx));
        let to = edge.length - off(!self.points_outwards(next), self.after(idx));
        let part = |from: f64, to: f64, is_shared: bool| Zone {
            a: edge.a + edge.along * from,
            along: edge.along,
            length: to - from,
            outward: edge.outward,
            overhang: HAIR,
            before: None,
            is_shared,
            center: edge.a + edge.along * (0.5 * (from + to)),
            radius: 0.5 * (to - from),
        };
        let first = zones.len();
        if from >= to || !self.is_alone(idx) {
            zones.push(part(0.0, edge.length, true));
        } else {
            if from > 0.0 {
                zones.push(part(0.0, from, true));
            }
            zones.push(part(from, to, false));
            if to < edge.length {
                zones.push(part(to, edge.length, true));
            }
        }
        if edge.along.perp(&self.after(idx).along).abs() < IN_LINE
            && let Some(last) = zones.last_mut()
        {
            last.overhang = -HAIR;
        }
        if self.points_outwards(idx) {
            if self.is_corner_alone(idx) {
                zones[first].before = Some(self.before(idx).along);
            } else {
                zones.push(part(0.0, 0.0, true));
            }
        }
    }

    /// Whether, beside edge `idx`, nothing but its neighbours can be as near as the edge.
    fn is_alone(&self, idx: usize) -> bool {
        let edge = &self.edges[idx];
        let neighbours = [
            (idx + self.edges.len() - 1) % self.edges.len(),
            idx,
            (idx + 1) % self.edges.len(),
        ];
        self.is_convex
            || (0..self.edges.len())
                .filter(|other| !neighbours.contains(other))
                .all(|other| {
                    let other = &self.edges[other];
                    is_behind(edge, other) || self.is_far(edge, other)
                })
    }

    /// Whether, before the corner at the beginning of edge `idx`, nothing can be as near as the corner.
    fn is_corner_alone(&self, idx: usize) -> bool {
        let (before, edge) = (self.before(idx), &self.edges[idx]);
        let corner = self.vertices[idx];
        self.is_convex
            || self.edges.iter().all(|other| {
                let ends = [other.a, other.b];
                (is_behind(before, other) && is_behind(edge, other))
                    || ring::distance(&ends, corner) > self.widest()
            })
    }

    fn is_far(&self, one: &Side, other: &Side) -> bool {
        // Edges of a simple ring do not cross, so the nearest point is at an end of one of them.
        let (ends, others) = ([one.a, one.b], [other.a, other.b]);
        others
            .iter()
            .map(|end| ring::distance(&ends, *end))
            .chain(ends.iter().map(|end| ring::distance(&others, *end)))
            .all(|distance| distance > self.widest())
    }

    /// Features farther apart than this have no part of the soft zone in common.
    fn widest(&self) -> f64 {
        2.0 * self.margin * (1.0 + 1e-9) + 1e-6
    }
}

/// Whether `other` lies on the inner side of the line of `edge`.
fn is_behind(edge: &Side, other: &Side) -> bool {
    [other.a, other.b]
        .iter()
        .all(|end| edge.outward.dot(&(end - edge.a)) <= 1e-9)
}
