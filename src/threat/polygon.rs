//! A simple ring: exact distance along a leg, and the integral of its soft zone.
//!
//! Seen from a moving point, the distance to a ring is the lower envelope of the distances to its
//! vertices and edges, whose squares are quadratics of the leg's parameter. [`Polygon::pieces`]
//! cuts a leg where the nearest feature changes; on each piece everything has a closed form.

use super::{hover_exposure, intensity};
use crate::geometry::{LEVEL, Point2, Quadratic, Rect, Segment};

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
    /// Squared distance to the feature.
    squared: Quadratic,
    /// Of a vertex; an edge has none.
    vertex: Option<Point2>,
}

/// A vertex or an edge seen from a leg.
#[derive(Debug, Clone, Copy)]
struct Feature {
    squared: Quadratic,
    vertex: Option<Point2>,
    /// Where the leg's points project onto the feature.
    valid: (f64, f64),
}

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
        let crossings = self.edges().filter(|(a, b)| {
            (a.y > point.y) != (b.y > point.y) && point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y)
        });
        crossings.count() % 2 == 1 && self.ring_distance(point) > 0.0
    }

    pub(super) fn intensity(&self, point: Point2) -> f64 {
        let distance = if self.contains(point) {
            0.0
        } else {
            self.ring_distance(point)
        };
        intensity(self.margin, distance)
    }

    /// Whether the box round `leg` meets the box round the soft zone.
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
        )
    }

    /// Least distance of the part `window` of `leg` to the ring, metres; where the leg enters, the
    /// greatest depth that it reaches, negative.
    pub(super) fn clearance(&self, leg: &Segment, window: (f64, f64)) -> f64 {
        let pieces = self.pieces(leg, window);
        let distance_at = |piece: &Piece, t: f64| piece.squared.at(t).max(0.0).sqrt();
        // Inside, distance grows convexly on each piece, so that its ends hold the greatest depth.
        let depth = pieces
            .iter()
            .filter(|piece| self.contains(leg.at(0.5 * (piece.t0 + piece.t1)).xy()))
            .map(|piece| distance_at(piece, piece.t0).max(distance_at(piece, piece.t1)))
            .fold(0.0, f64::max);
        if depth > 0.0 {
            return -depth;
        }
        pieces
            .iter()
            .map(|piece| piece.squared.extremes(piece.t0, piece.t1).0.max(0.0).sqrt())
            .fold(f64::INFINITY, f64::min)
    }

    /// Integral of `T` over the part `window` of `leg`: `margin - distance` outside the ring up to
    /// `margin`, `margin` inside it.
    pub(super) fn exposure(&self, leg: &Segment, window: (f64, f64)) -> f64 {
        if self.margin <= 0.0 {
            return 0.0;
        }
        if leg.horizontal_length() < LEVEL {
            return hover_exposure(leg, window, |point| self.intensity(point));
        }
        self.pieces(leg, window)
            .iter()
            .map(|piece| {
                if self.contains(leg.at(0.5 * (piece.t0 + piece.t1)).xy()) {
                    self.margin * (piece.t1 - piece.t0) * leg.length()
                } else {
                    self.piece_exposure(leg, piece)
                }
            })
            .sum()
    }

    fn piece_exposure(&self, leg: &Segment, piece: &Piece) -> f64 {
        if let Some(center) = piece.vertex {
            let corner = super::Cylinder {
                center,
                radius: 0.0,
                influence: self.margin,
            };
            return corner.exposure(leg, (piece.t0, piece.t1));
        }
        // The distance to an edge's line is linear: a trapezium, cut where it reaches the margin.
        let (d0, d1) = (
            piece.squared.at(piece.t0).max(0.0).sqrt(),
            piece.squared.at(piece.t1).max(0.0).sqrt(),
        );
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

    fn edges(&self) -> impl Iterator<Item = (Point2, Point2)> + '_ {
        let next = self.vertices.iter().cycle().skip(1);
        self.vertices.iter().copied().zip(next.copied())
    }

    fn ring_distance(&self, point: Point2) -> f64 {
        self.edges()
            .map(|(a, b)| {
                let along = b - a;
                let t = ((point - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                (point - (a + along * t)).norm_squared()
            })
            .fold(f64::INFINITY, f64::min)
            .sqrt()
    }

    /// The part `window` of `leg` in order, cut where the nearest feature of the ring changes and
    /// where the leg crosses the ring.
    fn pieces(&self, leg: &Segment, window: (f64, f64)) -> Vec<Piece> {
        let mut pieces = Vec::new();
        cut(&self.features(leg), window, &mut pieces);
        pieces
    }

    fn features(&self, leg: &Segment) -> Vec<Feature> {
        let mut features = Vec::with_capacity(2 * self.vertices.len());
        for (a, b) in self.edges() {
            features.push(Feature {
                squared: leg.squared_distance_to(a),
                vertex: Some(a),
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
        squared,
        vertex: None,
        valid,
    })
}

/// Append the pieces of `window`, in order: the nearest feature at its middle reigns over a part of
/// it, the rest is cut in turn.
fn cut(features: &[Feature], (t0, t1): (f64, f64), pieces: &mut Vec<Piece>) {
    let middle = 0.5 * (t0 + t1);
    let nearest = nearest_at(features, middle);
    let (from, to) = reign(features, nearest, middle, (t0, t1));
    if from - t0 > SHORTEST_PIECE {
        cut(features, (t0, from), pieces);
    }
    let piece = |t0, t1| Piece {
        t0,
        t1,
        squared: nearest.squared,
        vertex: nearest.vertex,
    };
    // A leg crosses an edge where the distance is 0: the vertex of the parabola.
    let touch = -nearest.squared.b / (2.0 * nearest.squared.a);
    if nearest.vertex.is_none() && touch > from && touch < to {
        pieces.push(piece(from, touch));
        pieces.push(piece(touch, to));
    } else {
        pieces.push(piece(from, to));
    }
    if t1 - to > SHORTEST_PIECE {
        cut(features, (to, t1), pieces);
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
    for rival in features {
        let ahead = rival.squared.minus(&nearest.squared);
        for root in ahead.roots().into_iter().flatten() {
            if root >= rival.valid.0 && root <= rival.valid.1 {
                shrink_to(root);
            }
        }
        // An edge takes over from its own end exactly where it becomes valid: a double root, which
        // rounding may hide.
        for t in [rival.valid.0, rival.valid.1] {
            if t.is_finite() && ahead.at(t) <= 1e-9 * (1.0 + nearest.squared.at(t)) {
                shrink_to(t);
            }
        }
    }
    (from.min(middle), to.max(middle))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;
    use proptest::prelude::*;

    fn square(margin: f64) -> Polygon {
        ring(&[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]], margin)
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
            assert!((clearance - expected).abs() < 1e-9, "{clearance} {expected}");
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
