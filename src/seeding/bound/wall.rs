//! Threats as used by a bound: how far each may be widened for free, and which may be passed by flying over or under
//! them.

use super::prices::Prices;
use super::toll::{Heights, Toll, climbs, stays};
use crate::geometry::{Point2, Rect, Vector2, ring};
use crate::scenario::Scenario;
use crate::seeding::arc::{nearest_points, point_segment, segment_segment};
use crate::seeding::outline::{Outline, OutlineShape};
use crate::threat::{Shape, Threat};

/// A threat that covers all heights, or that costs a toll to pass above or below.
#[derive(Debug, Clone)]
pub(super) struct Wall {
    pub(super) shape: OutlineShape,
    /// How deep a feasible route may enter it, metres.
    pub(super) tolerance: f64,
    /// No route comes nearer than this, metres; 0 for a ring.
    pub(super) core: f64,
    /// End of the soft zone, metres.
    pub(super) influence: f64,
    /// Widened by this, it counts as hard for routes that do not come nearer than `dip`.
    pub(super) wide: f64,
    /// Below this distance to a disc's centre or a ring's corner the way round is so short that
    /// cutting the corner could pay; not above `core` where it never does.
    pub(super) dip: f64,
    /// Widened by this, it counts as hard for every route.
    pub(super) safe: f64,
    /// Cost of a route that passes above or below, beyond fuel for the way seen from above; `None`
    /// when there is no room.
    pub(super) toll: Option<Toll>,
    /// Least number of metres seen from above that a route flies at the wall's heights, after the start and before the
    /// target; only used for a wall that may be passed.
    pub(super) stays: [f64; 2],
    /// From the start and from the target, metres up to its top and down to its base; negative where these have been
    /// passed, infinite where there is none.
    pub(super) climbs: [[f64; 2]; 2],
    /// Whether it is a side of the area's border and no threat.
    pub(super) is_border: bool,
}

impl Wall {
    pub(super) fn new(
        threat: &Threat,
        scenario: &Scenario,
        prices: &Prices,
        heights: &Heights,
    ) -> Option<Self> {
        let toll = heights.toll(threat, scenario);
        let slack = prices.tolerance;
        let (shape, core, influence) = match &threat.shape {
            Shape::Cylinder(cylinder) => (
                OutlineShape::Disc(cylinder.center),
                (cylinder.radius - slack).max(0.0),
                cylinder.influence,
            ),
            Shape::Polygon(polygon) => (
                OutlineShape::Ring(polygon.vertices().to_vec()),
                0.0,
                polygon.margin(),
            ),
        };
        let wall = Self {
            shape,
            tolerance: slack,
            core,
            influence,
            wide: 0.0,
            dip: 0.0,
            safe: 0.0,
            toll,
            stays: stays(threat, scenario),
            climbs: climbs(threat, prices),
            is_border: false,
        };
        if let OutlineShape::Ring(ring) = &wall.shape
            && (wall.slack() >= perimeter(ring) || is_thin(ring, 2.0 * slack))
        {
            // A route may cut through: effectively no obstacle.
            return None;
        }
        Some(wall)
    }

    /// A side of the area's border, all of which lies beyond every feasible route.
    pub(super) fn side(of: &Rect) -> Self {
        Self {
            shape: OutlineShape::Ring(of.corners().into()),
            tolerance: 0.0,
            core: 0.0,
            influence: 0.0,
            wide: 0.0,
            dip: 0.0,
            safe: 0.0,
            toll: None,
            stays: [0.0; 2],
            climbs: [[f64::INFINITY; 2]; 2],
            is_border: true,
        }
    }

    /// Widen it by `most` at most.
    pub(super) fn widen(&mut self, prices: &Prices, most: f64) {
        // (w + s (I - r)) r is concave in r, so its ends decide whether it is at least w R all the way from the core to
        // R.
        let (w, s, core, influence) = (prices.fuel, prices.exposure, self.core, self.influence);
        let reach = influence.min(most).max(core);
        let at_core = (w + s * (influence - core).max(0.0)) * core / w;
        self.safe = at_core.clamp(core, reach);
        self.wide = self.safe;
        self.dip = core;
        if self.safe < reach {
            // The smaller root of (w + s (I - r)) r = w R.
            let b = w + s * influence;
            let root = b * b - 4.0 * s * w * reach;
            if s > 0.0 && root > 0.0 {
                let dip = 2.0 * w * reach / (b + root.sqrt());
                let dip = dip * (1.0 + 1e-9);
                // The greater root must not lie below R either.
                if dip < reach && b + root.sqrt() >= 2.0 * s * reach * (1.0 - 1e-12) {
                    self.wide = reach;
                    self.dip = dip.max(core);
                }
            }
        }
    }

    /// The same wall elsewhere.
    pub(super) fn moved(&self, by: Vector2) -> Self {
        let shape = match &self.shape {
            OutlineShape::Disc(center) => OutlineShape::Disc(center + by),
            OutlineShape::Ring(ring) => OutlineShape::Ring(ring.iter().map(|at| at + by).collect()),
        };
        Self {
            shape,
            ..self.clone()
        }
    }

    /// Whether `point` lies in the part added by widening, where it is not a dip.
    pub(super) fn is_around(&self, point: Point2) -> bool {
        let away = self.distance(point);
        away > self.core && away >= self.dip && away < self.wide
    }

    /// Metres to its shape before it is widened, 0 within a ring: the distance that its soft zone is based on.
    pub(super) fn distance(&self, point: Point2) -> f64 {
        self.shape.distance(point)
    }

    /// Distance of a straight way to its shape.
    pub(super) fn distance_to_way(&self, (a, b): (Point2, Point2)) -> f64 {
        match &self.shape {
            OutlineShape::Disc(center) => point_segment(*center, a, b),
            OutlineShape::Ring(ring) if ring::contains(ring, a) => 0.0,
            OutlineShape::Ring(ring) => ring::edges(ring)
                .map(|edge| segment_segment(edge, (a, b)))
                .fold(f64::INFINITY, f64::min),
        }
    }

    /// The place at distance `radius` from its shape, straight out through `point`, which lies outside the shape.
    pub(super) fn out(&self, point: Point2, radius: f64) -> Point2 {
        let nearest = match &self.shape {
            OutlineShape::Disc(center) => *center,
            OutlineShape::Ring(ring) => ring::edges(ring)
                .map(|edge| nearest_points(edge, (point, point)).0)
                .min_by(|one, other| (one - point).norm().total_cmp(&(other - point).norm()))
                .unwrap_or(point),
        };
        nearest + (point - nearest).normalize() * radius
    }

    /// Number of corners of a ring; of the border, none can be reached.
    pub(super) fn corners(&self) -> usize {
        match &self.shape {
            OutlineShape::Ring(ring) if !self.is_border => ring.len(),
            _ => 0,
        }
    }

    /// Number of circles that a string may bend round.
    pub(super) fn bends(&self) -> usize {
        match &self.shape {
            OutlineShape::Disc(_) => 1,
            OutlineShape::Ring(_) => self.corners(),
        }
    }

    /// A circle round its shape.
    pub(super) fn circle(&self) -> (Point2, f64) {
        let centers = match &self.shape {
            OutlineShape::Disc(center) => return (*center, 0.0),
            OutlineShape::Ring(ring) => ring,
        };
        let sum: Vector2 = centers.iter().map(|center| center.coords).sum();
        let middle = Point2::from(sum / centers.len() as f64);
        let away = centers.iter().map(|center| (center - middle).norm());
        (middle, away.fold(0.0, f64::max))
    }

    /// Whether the distance to its shape is convex.
    pub(super) fn is_convex(&self) -> bool {
        match &self.shape {
            OutlineShape::Disc(_) => true,
            OutlineShape::Ring(ring) => ring::is_convex(ring),
        }
    }

    /// The wall widened by `radius`.
    pub(super) fn outline(&self, radius: f64) -> Outline {
        Outline {
            shape: self.shape.clone(),
            radius,
            core: self.core,
        }
    }

    /// Centres of the circles that bound the widened wall: for a disc its own, for a ring those of its corners.
    pub(super) fn centers(&self) -> &[Point2] {
        match &self.shape {
            OutlineShape::Disc(center) => std::slice::from_ref(center),
            OutlineShape::Ring(ring) => ring,
        }
    }

    /// Metres by which a string may be shorter because a route may enter by the tolerance: for a disc this is already
    /// part of the core; for a ring it is twice the way into each of its corners.
    pub(super) fn slack(&self) -> f64 {
        let OutlineShape::Ring(ring) = &self.shape else {
            return 0.0;
        };
        let count = ring.len();
        (0..count)
            .map(|i| {
                let (before, at, after) = (
                    ring[(i + count - 1) % count],
                    ring[i],
                    ring[(i + 1) % count],
                );
                let (one, other) = ((before - at).normalize(), (after - at).normalize());
                // sin of half the angle between the edges.
                let half = 0.5 * (one - other).norm();
                2.0 * self.tolerance / half
            })
            .sum()
    }
}

/// Whether two edges of `ring` that have no corner in common come within `least` metres of each other.
fn is_thin(ring: &[Point2], least: f64) -> bool {
    let count = ring.len();
    let low = |edge: &(usize, Point2, Point2)| edge.1.x.min(edge.2.x);
    let mut edges: Vec<_> = (0..count)
        .map(|i| (i, ring[i], ring[(i + 1) % count]))
        .collect();
    edges.sort_by(|one, other| low(one).total_cmp(&low(other)));
    edges.iter().enumerate().any(|(at, one)| {
        let (highest_x, y) = (one.1.x.max(one.2.x), [one.1.y, one.2.y]);
        let after = edges[at + 1..].iter();
        after
            .take_while(|other| low(other) <= highest_x + least)
            .filter(|other| {
                other.1.y.min(other.2.y) <= y[0].max(y[1]) + least
                    && other.1.y.max(other.2.y) >= y[0].min(y[1]) - least
            })
            .filter(|other| (one.0 + 1) % count != other.0 && (other.0 + 1) % count != one.0)
            .any(|other| {
                let (p, q) = nearest_points((one.1, one.2), (other.1, other.2));
                (q - p).norm() <= least
            })
    })
}

fn perimeter(ring: &[Point2]) -> f64 {
    ring::edges(ring).map(|(a, b)| (b - a).norm()).sum()
}
