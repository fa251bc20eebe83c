//! Parts of a ring's soft zone that belong to a single edge or corner.
//!
//! There the distance from the ring is the distance from that feature, so exposure is a sum over features. This does
//! not hold near a reflex corner or where a part of the ring is close to another.

use nalgebra::Vector2;

use super::{Polygon, nearest};
use crate::geometry::{LEVEL, Point2, Segment, ring};
use crate::threat::Cylinder;

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

/// The zones of the simple ring through `vertices`, `margin` wide; `None` if no part belongs to one feature.
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

impl Polygon {
    /// Exposure of the part `(from, to)` of `leg`, which is not vertical and lies outside the ring, as a sum over
    /// edges and corners; `None` if it may reach a shared zone.
    pub(super) fn exposure_outside(&self, leg: &Segment, (from, to): (f64, f64)) -> Option<f64> {
        let ends = [leg.at(from).xy(), leg.at(to).xy()];
        let way = ends[1] - ends[0];
        let reach = nearest::reach(self.margin, way.norm());
        let beyond = |[u, v]: [f64; 2], low: f64, high: f64| u.max(v) < low || u.min(v) > high;
        let mut exposure = 0.0;
        for zone in self.zones.as_ref()? {
            let seen = ends.map(|end| end - zone.a);
            let along = seen.map(|end| end.dot(&zone.along));
            let outward = seen.map(|end| end.dot(&zone.outward));
            if beyond(along, -reach, zone.length + reach) || beyond(outward, -reach, reach) {
                continue;
            }
            if zone.is_shared {
                return None;
            }
            // Fractions of the part, from 0 to 1.
            let beside = clip(along, [0.0, zone.length], [HAIR, zone.overhang]);
            exposure += self.beside_edge(outward, beside) * (to - from) * leg.length();
            if let Some(before) = zone.before {
                let past = clip(
                    seen.map(|end| end.dot(&before)),
                    [0.0, f64::INFINITY],
                    [-HAIR; 2],
                );
                let ahead = clip(along, [f64::NEG_INFINITY, 0.0], [-HAIR; 2]);
                let (enters, leaves) = (past[0].max(ahead[0]), past[1].min(ahead[1]));
                if enters < leaves {
                    let corner = Cylinder {
                        center: zone.a,
                        radius: 0.0,
                        influence: self.margin,
                    };
                    let at = |share: f64| from + (to - from) * share;
                    exposure += corner.exposure(leg, (at(enters), at(leaves)));
                }
            }
        }
        Some(exposure)
    }

    /// Integral of `T` between two fractions of a line along which the distance from an edge changes linearly. A leg in
    /// line with the next side goes on behind the edge's line, along that side, which pays for it there.
    fn beside_edge(&self, outward: [f64; 2], beside: [f64; 2]) -> f64 {
        let [start, end] = outward;
        let away = |[enters, leaves]: [f64; 2]| {
            [enters, leaves].map(|share| start + (end - start) * share)
        };
        let [d0, d1] = away(beside);
        let [enters, leaves] = if d0.min(d1) < -HAIR {
            let before = clip(outward, [0.0, f64::INFINITY], [0.0; 2]);
            [beside[0].max(before[0]), beside[1].min(before[1])]
        } else {
            beside
        };
        if enters >= leaves {
            return 0.0;
        }
        let [d0, d1] = away([enters, leaves]);
        self.mean_intensity(d0, d1) * (leaves - enters)
    }
}

/// The fractions, 0 to 1, between which a value going linearly from `start` to `end` lies within `[low, high]`, widened
/// by `hairs` for a value that stays the same; an empty range if the first is not less than the second.
fn clip([start, end]: [f64; 2], [low, high]: [f64; 2], hairs: [f64; 2]) -> [f64; 2] {
    let gain = end - start;
    if gain.abs() < LEVEL {
        return if start >= low - hairs[0] && start <= high + hairs[1] {
            [0.0, 1.0]
        } else {
            [1.0, 0.0]
        };
    }
    let (one, other) = ((low - start) / gain, (high - start) / gain);
    [one.min(other).max(0.0), one.max(other).min(1.0)]
}
