//! A simple ring: exact distance along a leg, and the integral of its soft zone.
//!
//! Seen from a moving point, the distance to a ring is the lower envelope of the distances to its
//! vertices and edges, whose squares are quadratics of the leg's parameter. [`Polygon::pieces`]
//! cuts a leg where the nearest feature changes; on each piece everything has a closed form.

use super::{Cylinder, hover_exposure, intensity};
use crate::geometry::{LEVEL, Point2, Quadratic, Rect, Segment, ring};

/// A simple ring that is never entered, and a soft zone outside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    vertices: Vec<Point2>,
    margin: f64,
    extent: Rect,
}

/// The nearest feature of the ring along a part of a leg.
#[derive(Debug, Clone, Copy)]
struct Piece {
    t0: f64,
    t1: f64,
    nearest: Feature,
    /// Whether this part of the leg lies within the ring.
    inside: bool,
}

/// A vertex or an edge seen from a leg.
#[derive(Debug, Clone, Copy)]
struct Feature {
    kind: Kind,
    /// Squared distance. It tells which feature is nearer; along a leg of 100 km it is off by a
    /// square millimetre, so that no figure is taken from it.
    squared: Quadratic,
    /// Where the leg's points project onto the feature.
    valid: (f64, f64),
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    Vertex(Point2),
    /// Signed distance from the edge's line: `at_start + gain * t`.
    Edge {
        at_start: f64,
        gain: f64,
    },
}

/// Shares of a leg nearer than this are one.
const NO_TIME: f64 = 1e-9;

/// With so many features or fewer, leaving some out costs more than it saves.
const FEW_FEATURES: usize = 24;

/// Parts of a leg shorter than this share of it are not cut further.
const SHORTEST_PIECE: f64 = 1e-12;

impl Polygon {
    /// The ring through `vertices` (three or more, simple, the first not repeated), with a soft
    /// zone of width `margin` outside.
    ///
    /// # Panics
    /// Without vertices.
    #[must_use]
    pub fn new(vertices: Vec<Point2>, margin: f64) -> Self {
        let extent = Rect::around(vertices.iter().copied())
            .expect("a ring has vertices")
            .grown(margin);
        Self {
            vertices,
            margin,
            extent,
        }
    }

    /// Corners in the order of the request.
    #[must_use]
    pub fn vertices(&self) -> &[Point2] {
        &self.vertices
    }

    /// Width of the soft zone, metres.
    #[must_use]
    pub fn margin(&self) -> f64 {
        self.margin
    }

    pub(super) fn extent(&self) -> Rect {
        self.extent
    }

    /// Whether `point` is strictly inside, by the even-odd rule.
    pub(super) fn contains(&self, point: Point2) -> bool {
        ring::contains(&self.vertices, point) && self.ring_distance(point) > 0.0
    }

    pub(super) fn intensity(&self, point: Point2) -> f64 {
        let distance = if self.contains(point) {
            0.0
        } else {
            self.ring_distance(point)
        };
        intensity(self.margin, distance)
    }

    /// Whether the box round `leg` meets the box round the soft zone, and its line the soft zone.
    pub(super) fn may_reach(&self, leg: &Segment) -> bool {
        let box_of = |low: f64, high: f64, min: f64, max: f64| low <= max && high >= min;
        box_of(
            leg.a.x.min(leg.b.x),
            leg.a.x.max(leg.b.x),
            self.extent.min.x,
            self.extent.max.x,
        ) && box_of(
            leg.a.y.min(leg.b.y),
            leg.a.y.max(leg.b.y),
            self.extent.min.y,
            self.extent.max.y,
        ) && self.line_may_reach(leg)
    }

    /// Whether the ring does not lie wholly to one side of the line of `leg`, beyond the margin.
    fn line_may_reach(&self, leg: &Segment) -> bool {
        let way = leg.b.xy() - leg.a.xy();
        let reach = self.margin * way.norm();
        let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        for vertex in &self.vertices {
            let across = way.perp(&(vertex - leg.a.xy()));
            least = least.min(across);
            greatest = greatest.max(across);
        }
        least <= reach && greatest >= -reach
    }

    /// Distance to the ring, metres, negative inside.
    pub(super) fn distance(&self, point: Point2) -> f64 {
        let distance = self.ring_distance(point);
        if self.contains(point) {
            -distance
        } else {
            distance
        }
    }

    /// Least distance of the part `window` of `leg` to the ring, metres; where the leg enters, the
    /// greatest depth that it reaches, negative.
    pub(super) fn clearance(&self, leg: &Segment, window: (f64, f64)) -> f64 {
        clearance_of(&self.pieces(leg, window), leg)
    }

    /// Integral of `T` over the part `window` of `leg`: `margin - distance` outside the ring up to
    /// `margin`, `margin` inside it.
    #[cfg(test)]
    fn exposure(&self, leg: &Segment, window: (f64, f64)) -> f64 {
        self.encounter(leg, window).1
    }

    /// Clearance and exposure of the part `window` of `leg`.
    pub(super) fn encounter(&self, leg: &Segment, window: (f64, f64)) -> (f64, f64) {
        let pieces = self.pieces(leg, window);
        let clearance = clearance_of(&pieces, leg);
        let exposure = if self.margin <= 0.0 {
            0.0
        } else if leg.horizontal_length() < LEVEL {
            hover_exposure(leg, window, |point| self.intensity(point))
        } else {
            pieces
                .iter()
                .map(|piece| self.piece_exposure(leg, piece))
                .sum()
        };
        (clearance, exposure)
    }

    fn piece_exposure(&self, leg: &Segment, piece: &Piece) -> f64 {
        if piece.inside {
            return self.margin * (piece.t1 - piece.t0) * leg.length();
        }
        if let Kind::Vertex(center) = piece.nearest.kind {
            let corner = Cylinder {
                center,
                radius: 0.0,
                influence: self.margin,
            };
            return corner.exposure(leg, (piece.t0, piece.t1));
        }
        // The distance to an edge's line is linear: a trapezium, cut where it reaches the margin.
        let (d0, d1) = piece.end_distances(leg);
        let (near, far) = (d0.min(d1), d0.max(d1));
        if near >= self.margin {
            return 0.0;
        }
        let share = if far <= self.margin {
            1.0
        } else {
            (self.margin - near) / (far - near)
        };
        let mean = self.margin - 0.5 * (near + far.min(self.margin));
        mean * share * (piece.t1 - piece.t0) * leg.length()
    }

    fn ring_distance(&self, point: Point2) -> f64 {
        ring::distance(&self.vertices, point)
    }

    /// The part `window` of `leg` in order, cut where the nearest feature of the ring changes and
    /// where the leg crosses the ring.
    fn pieces(&self, leg: &Segment, window: (f64, f64)) -> Vec<Piece> {
        let mut pieces = Vec::new();
        cut(
            &self.features(leg),
            window,
            leg.horizontal_length(),
            &mut pieces,
        );
        let hair = 1e-6 * (1.0 + leg.horizontal_length());
        let (mut inside, mut at_ring) = (false, true);
        for piece in &mut pieces {
            let (d0, d1) = piece.end_distances(leg);
            // Only where it meets the ring does a leg change sides.
            if at_ring || d0 < hair {
                inside = self.contains(leg.at(0.5 * (piece.t0 + piece.t1)).xy());
            }
            piece.inside = inside;
            at_ring = d1 < hair;
        }
        pieces
    }

    fn features(&self, leg: &Segment) -> Vec<Feature> {
        let mut features = Vec::with_capacity(2 * self.vertices.len());
        for (a, b) in ring::edges(&self.vertices) {
            features.push(Feature {
                kind: Kind::Vertex(a),
                squared: leg.squared_distance_to(a),
                valid: (f64::NEG_INFINITY, f64::INFINITY),
            });
            features.extend(edge_feature(leg, a, b));
        }
        features
    }
}

/// The line through `a` and `b` as seen from `leg`, valid where the leg projects between them.
fn edge_feature(leg: &Segment, a: Point2, b: Point2) -> Option<Feature> {
    let length = (b - a).norm();
    let along = (b - a) / length;
    let (origin, way) = (leg.a.xy() - a, leg.b.xy() - leg.a.xy());
    // Distance from the line and way along it, both linear in t.
    let (across0, across1) = (origin.perp(&along), way.perp(&along));
    let (along0, along1) = (origin.dot(&along), way.dot(&along));
    let valid = if along1.abs() < LEVEL {
        (along0 >= 0.0 && along0 <= length).then_some((f64::NEG_INFINITY, f64::INFINITY))?
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
    fn end_distances(&self, leg: &Segment) -> (f64, f64) {
        (
            self.nearest.distance(leg, self.t0),
            self.nearest.distance(leg, self.t1),
        )
    }

    fn least_distance(&self, leg: &Segment) -> f64 {
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

fn clearance_of(pieces: &[Piece], leg: &Segment) -> f64 {
    // Inside, distance grows convexly on each piece, so that its ends hold the greatest depth.
    let depth = pieces
        .iter()
        .filter(|piece| piece.inside)
        .map(|piece| piece.end_distances(leg))
        .fold(0.0, |depth: f64, (d0, d1)| depth.max(d0).max(d1));
    if depth > 0.0 {
        return -depth;
    }
    pieces
        .iter()
        .map(|piece| piece.least_distance(leg))
        .fold(f64::INFINITY, f64::min)
}

/// Append the pieces of `window` of a leg of horizontal `length`, in order: the nearest feature at
/// its middle reigns over a part of it, the rest is cut in turn.
fn cut(features: &[Feature], (t0, t1): (f64, f64), length: f64, pieces: &mut Vec<Piece>) {
    let middle = 0.5 * (t0 + t1);
    let nearest = nearest_at(features, middle);
    let kept;
    let features = if features.len() > FEW_FEATURES {
        // At either end the nearest feature is half the window farther at most, and every other
        // half the window nearer.
        let reach = nearest.squared.at(middle).max(0.0).sqrt() + (t1 - t0) * length;
        let reach = reach * reach * (1.0 + 1e-9) + 1e-9 * (1.0 + length * length);
        let may_reign = |feature: &&Feature| {
            feature.valid.0 <= t1 && feature.valid.1 >= t0 && feature.squared.at(middle) <= reach
        };
        kept = features
            .iter()
            .filter(may_reign)
            .copied()
            .collect::<Vec<_>>();
        &kept[..]
    } else {
        features
    };
    let (from, to) = reign(features, nearest, middle, (t0, t1));
    if from - t0 > SHORTEST_PIECE {
        cut(features, (t0, from), length, pieces);
    }
    let mut push = |t0, t1| {
        pieces.push(Piece {
            t0,
            t1,
            nearest: *nearest,
            inside: false,
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
        cut(features, (to, t1), length, pieces);
    }
}

fn nearest_at(features: &[Feature], t: f64) -> &Feature {
    features
        .iter()
        .filter(|feature| feature.valid.0 <= t && t <= feature.valid.1)
        .min_by(|f, g| f.squared.at(t).total_cmp(&g.squared.at(t)))
        .expect("vertices are valid everywhere")
}

/// The largest part of `window` round `middle` in which `nearest` stays the nearest.
fn reign(features: &[Feature], nearest: &Feature, middle: f64, window: (f64, f64)) -> (f64, f64) {
    let (mut from, mut to) = (window.0.max(nearest.valid.0), window.1.min(nearest.valid.1));
    let mut shrink_to = |t: f64| {
        if t < middle {
            from = from.max(t);
        } else if t > middle {
            to = to.min(t);
        }
    };
    let (mut ends_here, mut begins_here) = (false, false);
    for rival in features {
        let ahead = rival.squared.minus(&nearest.squared);
        for root in ahead.roots().into_iter().flatten() {
            if root < rival.valid.0 || root > rival.valid.1 {
                continue;
            }
            if (root - middle).abs() > NO_TIME {
                shrink_to(root);
                continue;
            }
            // Both are as near at the middle: the slope tells on which side the rival is nearer.
            let slope = 2.0 * ahead.a * root + ahead.b;
            ends_here |= slope < 0.0 || (slope == 0.0 && ahead.a < 0.0);
            begins_here |= slope > 0.0 || (slope == 0.0 && ahead.a < 0.0);
        }
        // An edge takes over from its own end exactly where it becomes valid: a double root, which
        // rounding may hide.
        for t in [rival.valid.0, rival.valid.1] {
            if t.is_finite() && ahead.at(t) <= 1e-9 * (1.0 + nearest.squared.at(t)) {
                shrink_to(t);
            }
        }
    }
    (
        if begins_here {
            middle
        } else {
            from.min(middle)
        },
        if ends_here { middle } else { to.max(middle) },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;
    use proptest::prelude::*;

    fn square(margin: f64) -> Polygon {
        ring(
            &[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]],
            margin,
        )
    }

    fn ring(vertices: &[[f64; 2]], margin: f64) -> Polygon {
        Polygon::new(vertices.iter().map(|&v| Point2::from(v)).collect(), margin)
    }

    fn leg(a: [f64; 3], b: [f64; 3]) -> Segment {
        Segment {
            a: Point3::from(a),
            b: Point3::from(b),
        }
    }

    #[test]
    fn clearance_is_exact_and_signed() {
        let check = |a, b, expected: f64| {
            let clearance = square(0.0).clearance(&leg(a, b), (0.0, 1.0));
            assert!(
                (clearance - expected).abs() < 1e-9,
                "{clearance} {expected}"
            );
        };
        check([-5.0, 13.0, 0.0], [15.0, 13.0, 0.0], 3.0);
        check([-5.0, 5.0, 0.0], [15.0, 5.0, 0.0], -5.0);
        check([-5.0, 9.0, 0.0], [15.0, 9.0, 0.0], -1.0);
        check([13.0, 14.0, 0.0], [20.0, 30.0, 0.0], 5.0);
        // Along an edge and through a corner: touching is not entering.
        check([-5.0, 10.0, 0.0], [15.0, 10.0, 0.0], 0.0);
        check([-5.0, 5.0, 0.0], [5.0, -5.0, 0.0], 0.0);
        check([4.0, 4.0, 0.0], [4.0, 4.0, 9.0], -4.0);
    }

    /// Across the square at mid-height: two ramps of the margin outside and 10 m inside.
    #[test]
    fn exposure_across() {
        let exposure = square(2.0).exposure(&leg([-20.0, 5.0, 0.0], [30.0, 5.0, 0.0]), (0.0, 1.0));
        assert!((exposure - (2.0 + 2.0 + 20.0)).abs() < 1e-9, "{exposure}");
    }

    /// The middle of the leg is as far from both walls of a bay; beyond it the other wall is nearer.
    #[test]
    fn a_tie_at_the_middle_is_seen() {
        let bay = ring(
            &[
                [-10.0, -5.0],
                [10.0, -5.0],
                [10.0, 20.0],
                [5.0, 20.0],
                [5.0, 0.0],
                [-5.0, 0.0],
                [-5.0, 20.0],
                [-10.0, 20.0],
            ],
            5.0,
        );
        let across = leg([-4.0, 10.0, 0.0], [4.0, 10.0, 0.0]);
        let (clearance, exposure) = bay.encounter(&across, (0.0, 1.0));
        assert!((clearance - 1.0).abs() < 1e-9, "{clearance}");
        // T falls from 4 m to 0 at the middle and rises again.
        assert!((exposure - 16.0).abs() < 1e-9, "{exposure}");
    }

    fn star() -> Polygon {
        ring(
            &[
                [0.0, 20.0],
                [4.0, 5.0],
                [20.0, 4.0],
                [6.0, -4.0],
                [10.0, -20.0],
                [-2.0, -6.0],
                [-18.0, -9.0],
                [-6.0, 3.0],
            ],
            7.0,
        )
    }

    /// 100 km along an edge, half a millimetre within and without.
    #[test]
    fn a_long_leg_is_measured_as_exactly_as_a_short_one() {
        let strip = ring(&[[-1e5, 0.0], [2e5, 0.0], [2e5, 1e4], [-1e5, 1e4]], 0.0);
        for away in [-5e-4, 5e-4, 1e-6, -1e-6] {
            let (sin, cos) = (0.5 * away, away);
            let clearance = strip.clearance(&leg([0.0, -sin, 0.0], [1e5, -cos, 0.0]), (0.0, 1.0));
            let expected = if away < 0.0 { away } else { sin };
            assert!(
                (clearance - expected).abs() < 1e-9,
                "{clearance} {expected}"
            );
        }
        let corner = ring(&[[5e4, 0.0], [6e4, 1e4], [4e4, 1e4]], 0.0);
        let clearance = corner.clearance(&leg([0.0, -1e-4, 0.0], [1e5, -1e-4, 0.0]), (0.0, 1.0));
        assert!((clearance - 1e-4).abs() < 1e-9, "{clearance}");
    }

    /// A ring of 20 000 vertices along a leg took minutes once.
    #[test]
    fn a_ring_of_many_vertices_agrees_with_sums() {
        let vertices = (0..20_000).map(|corner| {
            let angle = std::f64::consts::TAU * f64::from(corner) / 20_000.0;
            let away = if corner % 2 == 0 { 1000.0 } else { 900.0 };
            Point2::new(away * libm::cos(angle), away * libm::sin(angle))
        });
        let flower = Polygon::new(vertices.collect(), 200.0);
        for (a, b) in [
            ([-2000.0, 1100.0, 0.0], [2000.0, 900.0, 0.0]),
            ([-2000.0, 10.0, 0.0], [1500.0, 300.0, 0.0]),
        ] {
            let leg = leg(a, b);
            let (clearance, exposure) = flower.encounter(&leg, (0.0, 1.0));
            let steps = 400;
            let points = (0..steps).map(|i| leg.at((f64::from(i) + 0.5) / f64::from(steps)).xy());
            let (mut sum, mut signed) = (0.0, f64::INFINITY);
            for point in points {
                sum += flower.intensity(point) * leg.length() / f64::from(steps);
                signed = signed.min(flower.distance(point));
            }
            assert!(
                (exposure - sum).abs() < 0.01 * (1.0 + sum),
                "{exposure} {sum}"
            );
            assert!((clearance - signed).abs() < 10.0, "{clearance} {signed}");
        }
    }

    proptest! {
        #[test]
        fn a_concave_ring_agrees_with_sums(
            a in prop::array::uniform3(-30.0..30.0f64), b in prop::array::uniform3(-30.0..30.0f64),
            t0 in 0.0..0.4f64, t1 in 0.6..1.0f64,
        ) {
            let (star, leg) = (star(), leg(a, b));
            let steps = 20_000;
            let points = (0..steps).map(|i| leg.at(t0 + (t1 - t0) * (f64::from(i) + 0.5) / f64::from(steps)).xy());
            let (mut sum, mut signed) = (0.0, f64::INFINITY);
            for point in points {
                sum += star.intensity(point);
                let distance = star.ring_distance(point);
                signed = signed.min(if star.contains(point) { -distance } else { distance });
            }
            sum *= leg.length() * (t1 - t0) / f64::from(steps);
            let exposure = star.exposure(&leg, (t0, t1));
            prop_assert!((exposure - sum).abs() <= 2e-4 * (1.0 + sum), "{exposure} {sum}");
            let clearance = star.clearance(&leg, (t0, t1));
            prop_assert!((clearance - signed).abs() <= leg.length() / f64::from(steps), "{clearance} {signed}");
            if !star.may_reach(&leg) {
                prop_assert!(exposure.abs() < 1e-12);
            }
        }

        #[test]
        fn pieces_cover_the_window_in_order(
            a in prop::array::uniform3(-30.0..30.0f64), b in prop::array::uniform3(-30.0..30.0f64),
        ) {
            let pieces = star().pieces(&leg(a, b), (0.1, 0.9));
            prop_assert!((pieces[0].t0 - 0.1).abs() < 1e-9);
            prop_assert!((pieces[pieces.len() - 1].t1 - 0.9).abs() < 1e-9);
            for pair in pieces.windows(2) {
                prop_assert!((pair[0].t1 - pair[1].t0).abs() < 1e-9);
            }
        }
    }
}
