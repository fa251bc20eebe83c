//! The nearest feature of a ring along a leg.
//!
//! From a moving point, the distance to a ring is the lower envelope of the distances to its vertices and edges,
//! whose squares are quadratics of the leg's parameter. [`cut`] cuts a leg where the nearest feature changes; on each
//! piece everything has a closed form.

use nalgebra::Vector2;

use crate::geometry::{LEVEL, Point2, Quadratic, Segment, ring};
use crate::threat::Cylinder;

/// An edge of a ring, with its direction and length precomputed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Edge {
    /// Its first vertex.
    pub(super) a: Point2,
    /// Unit vector along the edge.
    pub(super) along: Vector2<f64>,
    pub(super) length: f64,
}

impl Edge {
    fn between((a, b): (Point2, Point2)) -> Self {
        let length = (b - a).norm();
        Self {
            a,
            along: (b - a) / length,
            length,
        }
    }
}

/// The edges of the ring through `vertices`.
pub(super) fn edges(vertices: &[Point2]) -> Vec<Edge> {
    ring::edges(vertices).map(Edge::between).collect()
}

/// The nearest feature of the ring along a part of a leg.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) t0: f64,
    pub(super) t1: f64,
    pub(super) nearest: Feature,
}

/// A vertex or an edge relative to a leg.
#[derive(Debug, Clone, Copy)]
pub(super) struct Feature {
    pub(super) kind: Kind,
    /// Squared distance. Used only to compare features: along a leg of 100 km its error is a square millimetre, so no
    /// result is computed from it.
    squared: Quadratic,
    /// Range of `t` in which the leg's points project onto the feature.
    valid: (f64, f64),
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Vertex(Point2),
    /// Signed distance from the edge's line, `at_start + gain * t`.
    Edge {
        at_start: f64,
        gain: f64,
    },
}

/// Leg parameters closer than this are treated as equal.
const NO_TIME: f64 = 1e-9;

/// With at most this many features, filtering them costs more than it saves.
const FEW_FEATURES: usize = 24;

/// Parts shorter than this fraction of a leg are not cut further.
const SHORTEST_PIECE: f64 = 1e-12;

/// Added to a search distance, metres, plus 1e-8 per metre of the leg, so that neither rounding nor [`NO_TIME`] hides
/// an equally near feature.
const HAIR: f64 = 1e-6;

/// The vertices and edges of a ring, relative to `leg`.
pub(super) fn features(edges: &[Edge], leg: &Segment) -> Vec<Feature> {
    let mut features = Vec::with_capacity(2 * edges.len());
    for edge in edges {
        edge.add_to(&mut features, leg);
    }
    features
}

/// Search distance, metres, that finds everything within `reach` of a line of `length`.
pub(super) fn reach(reach: f64, length: f64) -> f64 {
    reach + HAIR + 1e-8 * length
}

/// The features that come within `reach` metres of the part `window` of `leg`, and possibly others.
pub(super) fn features_near<'e>(
    edges: impl IntoIterator<Item = &'e Edge>,
    leg: &Segment,
    window: (f64, f64),
    reach: f64,
) -> Vec<Feature> {
    let (from, to) = (leg.at(window.0).xy(), leg.at(window.1).xy());
    let way = to - from;
    let length = way.norm();
    let reach = self::reach(reach, length);
    let beyond = |u: f64, v: f64, low: f64, high: f64| u.max(v) < low || u.min(v) > high;
    let edges = edges.into_iter();
    let mut features = Vec::with_capacity(2 * edges.size_hint().0);
    for edge in edges {
        let (u, v) = (from - edge.a, to - edge.a);
        let (across0, across1) = (edge.along.perp(&u), edge.along.perp(&v));
        let (along0, along1) = (edge.along.dot(&u), edge.along.dot(&v));
        // Off to one side of the line or the edge, or before or behind the edge.
        let off = u.perp(&way);
        let off_end = off - edge.length * edge.along.perp(&way);
        let far = beyond(across0, across1, -reach, reach)
            || beyond(along0, along1, -reach, edge.length + reach)
            || beyond(off, off_end, -reach * length, reach * length);
        if !far {
            edge.add_to(&mut features, leg);
        }
    }
    features
}

impl Edge {
    /// Add the edge's first vertex and the edge itself, relative to `leg`.
    fn add_to(&self, features: &mut Vec<Feature>, leg: &Segment) {
        features.push(Feature {
            kind: Kind::Vertex(self.a),
            squared: leg.squared_distance_to(self.a),
            valid: (f64::NEG_INFINITY, f64::INFINITY),
        });
        features.extend(edge_feature(leg, self));
    }
}

/// The line of `edge` relative to `leg`, valid where the leg projects onto the edge.
fn edge_feature(leg: &Segment, edge: &Edge) -> Option<Feature> {
    let Edge { a, along, length } = *edge;
    let (origin, way) = (leg.a.xy() - a, leg.b.xy() - leg.a.xy());
    // Distance from the line and position along it, both linear in t.
    let (across0, across1) = (origin.perp(&along), way.perp(&along));
    let (along0, along1) = (origin.dot(&along), way.dot(&along));
    let valid = if along1.abs() < LEVEL {
        // As a crossing, the edge counts as slightly longer.
        let is_beside = along0 >= -LEVEL && along0 <= length + LEVEL;
        is_beside.then_some((f64::NEG_INFINITY, f64::INFINITY))?
    } else {
        let (u, v) = (-along0 / along1, (length - along0) / along1);
        (u.min(v), u.max(v))
    };
    let squared = Quadratic {
        a: across1 * across1,
        b: 2.0 * across0 * across1,
        c: across0 * across0,
    };
    Some(Feature {
        kind: Kind::Edge {
            at_start: across0,
            gain: across1,
        },
        squared,
        valid,
    })
}

impl Feature {
    /// Distance at `t`, where the feature is valid.
    fn distance(&self, leg: &Segment, t: f64) -> f64 {
        match self.kind {
            Kind::Vertex(vertex) => (leg.at(t).xy() - vertex).norm(),
            Kind::Edge { at_start, gain } => (at_start + gain * t).abs(),
        }
    }
}

impl Piece {
    pub(super) fn end_distances(&self, leg: &Segment) -> (f64, f64) {
        (
            self.nearest.distance(leg, self.t0),
            self.nearest.distance(leg, self.t1),
        )
    }

    pub(super) fn least_distance(&self, leg: &Segment) -> f64 {
        match self.nearest.kind {
            Kind::Vertex(center) => {
                let corner = Cylinder {
                    center,
                    radius: 0.0,
                    influence: 0.0,
                };
                corner.clearance(leg, (self.t0, self.t1))
            }
            // Pieces are cut where a leg crosses an edge.
            Kind::Edge { .. } => {
                let (d0, d1) = self.end_distances(leg);
                d0.min(d1)
            }
        }
    }
}

/// Where a leg crosses an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    pub(super) t: f64,
    /// Whether the leg certainly gets from one side of the ring to the other there: rounding would have to move it
    /// farther than [`DOUBT`] to miss the edge, or to change places with what comes before or after.
    pub(super) is_sure: bool,
}

/// Rounding moves a crossing by less than this across the edge, metres.
const DOUBT: f64 = 1e-7;

/// Where in `window` the leg crosses edges, in order; an edge counts as slightly longer than it is.
pub(super) fn crossings(features: &[Feature], window: (f64, f64)) -> Vec<Crossing> {
    // With the distance to the nearer end of the edge, and what rounding may make of both.
    let mut crossings: Vec<(f64, f64, f64)> = features
        .iter()
        .filter_map(|feature| match feature.kind {
            Kind::Edge { at_start, gain } => {
                let (t, (from, to)) = (-at_start / gain, feature.valid);
                let doubt = 10.0 * NO_TIME + DOUBT / gain.abs();
                let room = (t - from).min(to - t);
                (room >= -NO_TIME).then_some((t, room, doubt))
            }
            Kind::Vertex(_) => None,
        })
        .filter(|&(t, ..)| t > window.0 && t < window.1)
        .collect();
    crossings.sort_by(|(one, ..), (other, ..)| one.total_cmp(other));
    let apart = |idx: usize| {
        let ends = (crossings[idx].0 - window.0).min(window.1 - crossings[idx].0);
        let from =
            |other: usize| (crossings[idx].0 - crossings[other].0).abs() - crossings[other].2;
        let before = idx.checked_sub(1).map_or(f64::INFINITY, from);
        let after = (idx + 1 < crossings.len()).then(|| from(idx + 1));
        ends.min(before).min(after.unwrap_or(f64::INFINITY))
    };
    let crossing = |(idx, &(t, room, doubt)): (usize, &(f64, f64, f64))| Crossing {
        t,
        is_sure: room.is_finite() && room.min(apart(idx)) > doubt,
    };
    crossings.iter().enumerate().map(crossing).collect()
}

/// The pieces of `window` of a leg of horizontal `length`, in order: the feature nearest to its middle is nearest on
/// a part of it; the rest is cut recursively. Parts on which nothing is farther from the ring than a distance that is not
/// `wanted` may be left out.
pub(super) fn cut(
    features: &[Feature],
    (t0, t1): (f64, f64),
    length: f64,
    wanted: &impl Fn(f64) -> bool,
    found: &mut impl FnMut(Piece),
) {
    let middle = 0.5 * (t0 + t1);
    let mut first = nearest_at(features, middle);
    let nearest = &features[first];
    let away = nearest.squared.at(middle).max(0.0).sqrt();
    if !wanted(away + 0.5 * (t1 - t0) * length) {
        return;
    }
    let mut kept = Vec::new();
    let features = if features.len() > FEW_FEATURES {
        // At either end the nearest feature is at most half the window farther away, and any other at most half the
        // window nearer.
        let reach = away + (t1 - t0) * length;
        let reach = reach * reach * (1.0 + 1e-9) + 1e-9 * (1.0 + length * length);
        let may_reign = |feature: &&Feature| {
            feature.valid.0 <= t1 && feature.valid.1 >= t0 && feature.squared.at(middle) <= reach
        };
        let (before, others) = features.split_at(first);
        kept.reserve(features.len());
        kept.extend(before.iter().filter(may_reign));
        first = kept.len();
        kept.extend(others.iter().filter(may_reign));
        &kept[..]
    } else {
        features
    };
    let (from, to) = reign(features, first, middle, (t0, t1));
    if from - t0 > SHORTEST_PIECE {
        cut(features, (t0, from), length, wanted, found);
    }
    let mut push = |t0, t1| {
        found(Piece {
            t0,
            t1,
            nearest: *nearest,
        });
    };
    match nearest.kind {
        // A leg crosses an edge where the distance is 0.
        Kind::Edge { at_start, gain } if -at_start / gain > from && -at_start / gain < to => {
            push(from, -at_start / gain);
            push(-at_start / gain, to);
        }
        _ => push(from, to),
    }
    if t1 - to > SHORTEST_PIECE {
        cut(features, (to, t1), length, wanted, found);
    }
}

/// The index of the nearest of `features` at `t`.
fn nearest_at(features: &[Feature], t: f64) -> usize {
    let mut nearest = (f64::INFINITY, None);
    for (idx, feature) in features.iter().enumerate() {
        let squared = feature.squared.at(t);
        if squared < nearest.0 && feature.valid.0 <= t && t <= feature.valid.1 {
            nearest = (squared, Some(idx));
        }
    }
    nearest.1.expect("vertices are valid everywhere")
}

/// The largest part of `window` around `middle` in which the feature `first` stays the nearest.
fn reign(features: &[Feature], first: usize, middle: f64, window: (f64, f64)) -> (f64, f64) {
    let nearest = &features[first];
    let mut reign = Reign {
        from: window.0.max(nearest.valid.0),
        to: window.1.min(nearest.valid.1),
        middle,
        ends_here: false,
        begins_here: false,
    };
    // What lies beside it along the ring mostly ends its reign; others are then told at a glance.
    let beside = first.saturating_sub(BESIDE)..features.len().min(first + BESIDE + 1);
    for rival in features[beside].iter().chain(features) {
        reign.meet(rival, nearest);
    }
    reign.bounds()
}

/// Features on either side of the nearest that are compared with it first.
const BESIDE: usize = 2;

/// A part of a leg, around its `middle`, in which one feature is the nearest.
struct Reign {
    from: f64,
    to: f64,
    middle: f64,
    ends_here: bool,
    begins_here: bool,
}

impl Reign {
    /// Shrink where `rival` is nearer than `nearest`.
    fn meet(&mut self, rival: &Feature, nearest: &Feature) {
        let part = (
            rival.valid.0.max(self.from - NO_TIME),
            rival.valid.1.min(self.to + NO_TIME),
        );
        let ahead = rival.squared.minus(&nearest.squared);
        // What decides further down, and rounding, lies within this.
        let size = nearest.squared.size() + rival.squared.size();
        if part.0 > part.1 || ahead.stays_above(1e-9 * (1.0 + size), part) {
            return;
        }
        for root in ahead.roots().into_iter().flatten() {
            if root < rival.valid.0 || root > rival.valid.1 {
                continue;
            }
            if (root - self.middle).abs() > NO_TIME {
                self.shrink_to(root);
                continue;
            }
            // Equally near at the middle: the slope shows on which side the rival is nearer.
            let slope = 2.0 * ahead.a * root + ahead.b;
            self.ends_here |= slope < 0.0 || (slope == 0.0 && ahead.a < 0.0);
            self.begins_here |= slope > 0.0 || (slope == 0.0 && ahead.a < 0.0);
        }
        // An edge takes over from its own end exactly where it becomes valid: a double root, which rounding may hide.
        for (t, takes_over) in [(rival.valid.0, true), (rival.valid.1, false)] {
            if !t.is_finite() || ahead.at(t) > 1e-9 * (1.0 + nearest.squared.at(t)) {
                continue;
            }
            if (t - self.middle).abs() > NO_TIME {
                self.shrink_to(t);
            } else {
                // The slope of a double root is rounding.
                self.ends_here |= takes_over;
                self.begins_here |= !takes_over;
            }
        }
    }

    fn shrink_to(&mut self, t: f64) {
        if t < self.middle {
            self.from = self.from.max(t);
        } else if t > self.middle {
            self.to = self.to.min(t);
        }
    }

    fn bounds(&self) -> (f64, f64) {
        (
            if self.begins_here {
                self.middle
            } else {
                self.from.min(self.middle)
            },
            if self.ends_here {
                self.middle
            } else {
                self.to.max(self.middle)
            },
        )
    }
}
