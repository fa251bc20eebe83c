//! Greatest depth of a leg inside a ring.

use std::cell::Cell;

use super::Polygon;
use super::nearest::{self, Edge, cut};
use crate::geometry::Segment;

impl Polygon {
    /// Greatest distance from the ring along the part `(from, to)` of `leg`, which lies inside, metres.
    pub(super) fn depth(&self, leg: &Segment, (from, to): (f64, f64)) -> f64 {
        let middle = self.ring_distance(leg.at(0.5 * (from + to)).xy());
        if self.is_convex {
            return self.highest(leg, (from, to)).max(middle);
        }
        // Upper bound of the distance from the ring: the leg would have to lead straight away from it.
        let length = leg.horizontal_length();
        let reach = middle + 0.5 * (to - from) * length;
        let features = self.features_near(leg, (from, to), reach);
        let depth = Cell::new(middle);
        if !features.is_empty() {
            // Near the ring, distances along a long leg are less exact than elsewhere.
            let deeper = |distance: f64| nearest::reach(distance, 10.0 * length) > depth.get();
            // Distance is convex on each piece, so its maximum is at an end.
            cut(&features, (from, to), length, &deeper, &mut |piece| {
                let (d0, d1) = piece.end_distances(leg);
                depth.set(depth.get().max(d0).max(d1));
            });
        }
        depth.get()
    }

    /// As `depth`, for a convex ring: the depth is the least distance from the edges' lines. Its maximum lies where a
    /// line that the leg leaves and one that it approaches are equally far, and no other is nearer.
    fn highest(&self, leg: &Segment, (from, to): (f64, f64)) -> f64 {
        let way = leg.b.xy() - leg.a.xy();
        let line = |edge: &Edge| Line {
            at_start: edge.along.perp(&(leg.a.xy() - edge.a)),
            gain: edge.along.perp(&way),
        };
        let (mut t, mut highest) = (0.5 * (from + to), 0.0_f64);
        // The middle is on the same side of all lines.
        let side: f64 = self.edges.iter().map(|edge| line(edge).at(t)).sum();
        let line = |edge: &Edge| line(edge).times(side.signum());
        let (mut leaves, mut nears): (Option<Line>, Option<Line>) = (None, None);
        // Every iteration but the last finds another line.
        for _ in 0..self.edges.len() + 2 {
            let lines = self.edges.iter().map(line);
            let Some(line) = lines.min_by(|one, other| one.at(t).total_cmp(&other.at(t))) else {
                break;
            };
            highest = highest.max(line.at(t));
            if line.gain > 0.0 {
                leaves = Some(line);
            } else {
                nears = Some(line);
            }
            let next = match (&leaves, &nears) {
                (Some(one), Some(other)) => one.meets(other).clamp(from, to),
                (Some(_), None) => to,
                _ => from,
            };
            // Converged: this is the maximum, or the end of the part is.
            if (next - t).abs() <= 1e-15 || !next.is_finite() {
                break;
            }
            t = next;
        }
        highest
    }
}

/// Signed distance from an edge's line along a leg: `at_start + gain * t`.
#[derive(Debug, Clone, Copy)]
struct Line {
    at_start: f64,
    gain: f64,
}

impl Line {
    fn at(&self, t: f64) -> f64 {
        self.at_start + self.gain * t
    }

    fn times(self, factor: f64) -> Self {
        Self {
            at_start: self.at_start * factor,
            gain: self.gain * factor,
        }
    }

    fn meets(&self, other: &Self) -> f64 {
        (other.at_start - self.at_start) / (self.gain - other.gain)
    }
}
