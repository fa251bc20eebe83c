//! A simple ring: exact distance along a leg, and the integral of its soft zone.
//!
//! The integral is found in three ways. Many legs at once, in lanes, are priced by the parts of the soft zone that belong
//! to one feature alone ([`zones`]). A single leg is priced by the cells that were found once for the ring ([`cells`],
//! [`exposure`]), and cut where its nearest feature changes ([`nearest`]) where too much reaches into a cell.

mod cells;
mod depth;
mod exposure;
mod index;
mod nearest;
mod zones;

use super::{Cylinder, hover_exposure, intensity};
use crate::geometry::{LEVEL, Point2, Rect, Segment, ring};
pub(crate) use zones::{HAIR, Zone};

use cells::Cells;
use index::Index;
use nearest::{Crossing, Edge, Feature, Kind, Piece, cut};

/// A point nearer to a ring than this lies on it, metres.
const ON_THE_RING: f64 = 1e-6;

/// A simple ring that must not be entered, and a soft zone outside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    vertices: Vec<Point2>,
    edges: Vec<Edge>,
    /// Spatial index; `None` if there are few vertices.
    index: Option<Index>,
    is_convex: bool,
    /// `None` for a ring with notches and too many corners to find them.
    zones: Option<Vec<Zone>>,
    /// Which part of the soft zone belongs to which edge and corner.
    cells: Box<Cells>,
    margin: f64,
    /// Box around the ring itself.
    bounds: Rect,
    /// Box around the soft zone.
    extent: Rect,
}

impl Polygon {
    /// The ring through `vertices` (three or more, simple, the first not repeated), with a soft zone of width
    /// `margin` outside.
    ///
    /// # Panics
    /// Without vertices.
    #[must_use]
    pub fn new(vertices: Vec<Point2>, margin: f64) -> Self {
        let bounds = Rect::around(vertices.iter().copied()).expect("a ring has vertices");
        let edges = nearest::edges(&vertices);
        let is_convex = ring::is_convex(&vertices);
        Self {
            is_convex,
            zones: zones::zones(&vertices, is_convex, margin),
            cells: Box::new(Cells::of(&vertices)),
            extent: bounds.grown(margin),
            index: Index::of(&vertices),
            bounds,
            vertices,
            edges,
            margin,
        }
    }

    /// Vertices in the order of the request.
    #[must_use]
    pub fn vertices(&self) -> &[Point2] {
        &self.vertices
    }

    /// Width of the soft zone, metres.
    #[must_use]
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// Which part of the soft zone belongs to which edge and corner, where known.
    pub(crate) fn zones(&self) -> Option<&[Zone]> {
        self.zones.as_deref()
    }

    /// The box around the ring without its soft zone.
    pub(crate) fn bounds(&self) -> Rect {
        self.bounds
    }

    pub(super) fn extent(&self) -> Rect {
        self.extent
    }

    /// Whether `point` is strictly inside, by the even-odd rule.
    pub(super) fn contains(&self, point: Point2) -> bool {
        self.bounds.contains(point)
            && match &self.index {
                Some(index) => index.contains(&self.vertices, point),
                None => ring::contains(&self.vertices, point),
            }
            && self.ring_distance(point) > 0.0
    }

    pub(super) fn intensity(&self, point: Point2) -> f64 {
        let distance = if self.contains(point) {
            0.0
        } else {
            self.ring_distance(point)
        };
        intensity(self.margin, distance)
    }

    /// The shares of `leg` between which lies all of it that is within the ring; `None` if it stays outside. An end on the
    /// ring counts as within.
    pub(super) fn span(&self, leg: &Segment) -> Option<(f64, f64)> {
        let [a, b] = [leg.a.xy(), leg.b.xy()];
        let ends = [(a, 0.0), (b, 1.0)];
        let inside = ends
            .into_iter()
            .filter(|(end, _)| self.distance(*end) <= ON_THE_RING);
        let crossed = ring::edges(&self.vertices).filter_map(|edge| ring::crossing((a, b), edge));
        let shares = inside.map(|(_, share)| share).chain(crossed);
        shares.fold(None, |span, share| {
            let (from, to) = span.unwrap_or((share, share));
            Some((from.min(share), to.max(share)))
        })
    }

    /// Whether the box around `leg` intersects the box around the soft zone.
    pub(super) fn may_reach(&self, leg: &Segment) -> bool {
        leg.bounds().meets(&self.extent)
    }

    /// Distance from the ring, metres, negative inside.
    pub(super) fn distance(&self, point: Point2) -> f64 {
        let distance = self.ring_distance(point);
        if self.contains(point) {
            -distance
        } else {
            distance
        }
    }

    /// Least distance of the part `window` of `leg` from the ring, metres; if the leg enters, minus the greatest
    /// depth.
    pub(super) fn clearance(&self, leg: &Segment, window: (f64, f64)) -> f64 {
        let (depth, _) = self.encounter(leg, window);
        if depth > 0.0 {
            return -depth;
        }
        let features = self.features(leg, window);
        let (length, mut least) = (leg.horizontal_length(), f64::INFINITY);
        cut(&features, window, length, &|_| true, &mut |piece| {
            least = least.min(piece.least_distance(leg));
        });
        least
    }

    /// Integral of `T` over the part `window` of `leg`: `margin - distance` outside the ring up to
    /// `margin`, `margin` inside it.
    #[cfg(test)]
    fn exposure(&self, leg: &Segment, window: (f64, f64)) -> f64 {
        self.encounter(leg, window).1
    }

    /// Depth of the part `window` of `leg` inside the ring, 0 if it does not enter, and its exposure. Features
    /// farther away than the width of the soft zone are skipped.
    pub(super) fn encounter(&self, leg: &Segment, window: (f64, f64)) -> (f64, f64) {
        if window.0 >= window.1 {
            // A single point, for example of a leg that just reaches the base.
            let depth = -self.distance(leg.at(window.0).xy());
            return (depth.max(0.0), 0.0);
        }
        let edges = self.edges_near(leg, window, self.margin);
        let near = edges.iter().map(|&edge| &self.edges[edge]);
        let near = nearest::features_near(near, leg, window, 0.0);
        let length = leg.horizontal_length();
        let is_exposed = self.margin > 0.0 && length >= LEVEL && !edges.is_empty();
        let (mut depth, mut exposure) = (0.0_f64, 0.0);
        for ((from, to), is_inside) in self.sides(leg, &near, window) {
            if is_inside {
                depth = depth.max(self.depth(leg, (from, to)));
                exposure += self.margin * (to - from) * leg.length();
            } else if is_exposed && to > from {
                let near;
                let edges = if (from, to) == window {
                    &edges
                } else {
                    near = self.edges_near(leg, (from, to), self.farthest(leg, (from, to), window));
                    &near
                };
                exposure += self
                    .exposure_outside(edges, leg, (from, to))
                    .unwrap_or_else(|| self.exposure_among(edges, leg, (from, to)));
            }
        }
        if length < LEVEL && self.margin > 0.0 {
            exposure = hover_exposure(leg, window, |point| self.intensity(point));
        }
        (depth, exposure)
    }

    /// The parts of the part `window` of `leg` between its crossings of the edges among `near`, in order, and whether each
    /// is inside.
    fn sides(
        &self,
        leg: &Segment,
        near: &[Feature],
        window: (f64, f64),
    ) -> Vec<((f64, f64), bool)> {
        // Inside and outside are not decided by the nearest feature: where edges are nearly in line, rounding may
        // pick the wrong one beside a vertex, and miss the crossing.
        let end = Crossing {
            t: window.1,
            is_sure: false,
        };
        let (mut from, mut known) = (window.0, None);
        let side = |Crossing { t, is_sure }: Crossing| {
            let part = (std::mem::replace(&mut from, t), t);
            let middle = || leg.at(0.5 * (part.0 + part.1)).xy();
            let is_inside = known.unwrap_or_else(|| self.contains(middle()));
            // To ask the whole ring again takes long where a leg crosses hundreds of edges.
            known = is_sure.then_some(!is_inside);
            (part, is_inside)
        };
        let crossings = nearest::crossings(near, window);
        crossings.into_iter().chain([end]).map(side).collect()
    }

    /// No point of the part `(from, to)` of `leg` is farther from the ring, metres, or it is outside the soft zone: within
    /// `window`, parts end where the leg crosses the ring.
    fn farthest(&self, leg: &Segment, (from, to): (f64, f64), window: (f64, f64)) -> f64 {
        let way = (to - from) * leg.horizontal_length();
        let crossed = [from > window.0, to < window.1];
        let from_ring = match crossed {
            [true, true] => 0.5 * way,
            [false, false] => f64::INFINITY,
            _ => way,
        };
        self.margin
            .min(from_ring + HAIR + 1e-8 * leg.horizontal_length())
    }

    /// Exposure of the part `part` of `leg`, which is outside the ring and has these `edges` near it.
    fn exposure_among(&self, edges: &[usize], leg: &Segment, part: (f64, f64)) -> f64 {
        let near = edges.iter().map(|&edge| &self.edges[edge]);
        let features = nearest::features_near(near, leg, part, self.margin);
        let mut exposure = 0.0;
        if !features.is_empty() {
            let length = leg.horizontal_length();
            cut(&features, part, length, &|_| true, &mut |piece| {
                exposure += self.piece_exposure(leg, &piece);
            });
        }
        exposure
    }

    /// The edges, in order, that come within `reach` metres of the part `window` of `leg`, and possibly others.
    fn edges_near(&self, leg: &Segment, window: (f64, f64), reach: f64) -> Vec<usize> {
        let (from, to) = (leg.at(window.0).xy(), leg.at(window.1).xy());
        self.edges_beside(from, to, nearest::reach(reach, (to - from).norm()))
    }

    /// The edges, in order, that come within `reach` metres of the box around two points, and possibly others.
    fn edges_beside(&self, from: Point2, to: Point2, reach: f64) -> Vec<usize> {
        if let Some(index) = &self.index {
            return index.near(&self.vertices, from, to, reach);
        }
        let (low, high, reach) = (from.inf(&to), from.sup(&to), reach + HAIR);
        let off =
            |a: f64, b: f64, low: f64, high: f64| a.max(b) < low - reach || a.min(b) > high + reach;
        let meets = |(_, (a, b)): &(usize, (Point2, Point2))| {
            !off(a.x, b.x, low.x, high.x) && !off(a.y, b.y, low.y, high.y)
        };
        let edges = ring::edges(&self.vertices).enumerate();
        edges.filter(meets).map(|(idx, _)| idx).collect()
    }

    /// The vertices and edges that come within `reach` metres of the part `window` of `leg`, and possibly others.
    fn features_near(&self, leg: &Segment, window: (f64, f64), reach: f64) -> Vec<Feature> {
        let edges = self.edges_near(leg, window, reach);
        let edges = edges.into_iter().map(|edge| &self.edges[edge]);
        nearest::features_near(edges, leg, window, reach)
    }

    /// The features that may be nearest somewhere on the part `window` of `leg`.
    fn features(&self, leg: &Segment, window: (f64, f64)) -> Vec<Feature> {
        if self.index.is_none() {
            return nearest::features(&self.edges, leg);
        }
        // Upper bound of the distance from the ring: the leg would have to lead straight away from it.
        let (from, to) = (leg.at(window.0).xy(), leg.at(window.1).xy());
        let middle = self.ring_distance(nalgebra::center(&from, &to));
        self.features_near(leg, window, middle + 0.5 * (to - from).norm())
    }

    /// Exposure of a piece outside the ring.
    fn piece_exposure(&self, leg: &Segment, piece: &Piece) -> f64 {
        if let Kind::Vertex(center) = piece.nearest.kind {
            return self.corner(center).exposure(leg, (piece.t0, piece.t1));
        }
        // The distance from an edge's line is linear.
        let (d0, d1) = piece.end_distances(leg);
        self.mean_intensity(d0, d1) * (piece.t1 - piece.t0) * leg.length()
    }

    /// What stands for a vertex: a disc of radius 0.
    fn corner(&self, center: Point2) -> Cylinder {
        Cylinder {
            center,
            radius: 0.0,
            influence: self.margin,
        }
    }

    /// Mean of `T` along a line on which the distance changes linearly from `d0` to `d1`: a trapezium, cut off at the
    /// margin.
    fn mean_intensity(&self, d0: f64, d1: f64) -> f64 {
        let (near, far) = (d0.min(d1), d0.max(d1));
        if near >= self.margin {
            return 0.0;
        }
        let share = if far <= self.margin {
            1.0
        } else {
            (self.margin - near) / (far - near)
        };
        (self.margin - 0.5 * (near + far.min(self.margin))) * share
    }

    fn ring_distance(&self, point: Point2) -> f64 {
        match &self.index {
            Some(index) => index.distance(&self.vertices, point),
            None => ring::distance(&self.vertices, point),
        }
    }
}

#[cfg(test)]
mod tests;
