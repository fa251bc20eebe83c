//! Exposure outside a ring: the sum over the cells that a leg passes.

use nalgebra::Vector2;

use super::Polygon;
use super::cells::Feature;
use super::nearest::{self, Edge};
use super::zones::HAIR;
use crate::geometry::{LEVEL, Point2, Quadratic, Segment};

/// A part of a leg, seen from above. Places on it are shares of it, from 0 to 1.
struct Part {
    ends: [Point2; 2],
    way: Vector2<f64>,
}

/// Where on a part a feature is the nearest.
struct Reign {
    from: f64,
    to: f64,
    /// Where others are nearer.
    gaps: Vec<[f64; 2]>,
}

impl Part {
    /// The squared distance from the line of `edge`.
    fn squared_from_line(&self, edge: &Edge) -> Quadratic {
        let (across, gain) = (
            edge.along.perp(&(self.ends[0] - edge.a)),
            edge.along.perp(&self.way),
        );
        Quadratic {
            a: gain * gain,
            b: 2.0 * across * gain,
            c: across * across,
        }
    }

    /// The squared distance from `vertex`.
    fn squared_from(&self, vertex: Point2) -> Quadratic {
        let seen = self.ends[0] - vertex;
        Quadratic {
            a: self.way.norm_squared(),
            b: 2.0 * seen.dot(&self.way),
            c: seen.norm_squared(),
        }
    }

    /// Where it is beside `edge`. A leg at right angles to both of them where they meet is beside the `next` one.
    fn beside(&self, edge: &Edge, next: &Edge) -> [f64; 2] {
        let along = |edge: &Edge| self.ends.map(|end| (end - edge.a).dot(&edge.along));
        let [own, on] = [along(edge), along(next)];
        let is_level = |[start, end]: [f64; 2]| (end - start).abs() < LEVEL;
        let meets_both = is_level(own)
            && is_level(on)
            && own[0] > edge.length - HAIR
            && (-HAIR..=next.length + HAIR).contains(&on[0]);
        if meets_both {
            return NOWHERE;
        }
        clip(own, [0.0, edge.length], [HAIR; 2])
    }

    fn squared(&self, feature: Feature, polygon: &Polygon) -> Quadratic {
        match feature {
            Feature::Vertex(idx) => self.squared_from(polygon.vertices[idx]),
            Feature::Edge(idx) => self.squared_from_line(&polygon.edges[idx]),
        }
    }
}

impl Reign {
    /// Take away where `rival` is nearer, which is `ahead` less far by squares, between two places.
    fn lose(&mut self, ahead: &Quadratic, [from, to]: [f64; 2], loses_ties: bool) {
        let (mut from, to) = (self.from.max(from), self.to.min(to));
        if from >= to || ahead.stays_above(0.0, (from, to)) {
            return;
        }
        for end in ahead.roots().into_iter().flatten().chain([to]) {
            let end = end.min(to);
            if end <= from {
                continue;
            }
            // The sign does not change in between, and is the opposite one where the other feature's reign is asked for.
            let ahead = ahead.at(0.5 * (from + end));
            if ahead < 0.0 || (ahead <= 0.0 && loses_ties) {
                self.gaps.push([from, end]);
            }
            from = end;
        }
    }

    /// Call `found` with each of the places between which nothing else is nearer.
    fn parts(&mut self, mut found: impl FnMut(f64, f64)) {
        self.gaps
            .sort_unstable_by(|one, other| one[0].total_cmp(&other[0]));
        let mut from = self.from;
        for [begins, ends] in &self.gaps {
            if *begins > from {
                found(from, *begins);
            }
            from = from.max(*ends);
        }
        if self.to > from {
            found(from, self.to);
        }
    }
}

impl Polygon {
    /// Exposure of the part `(from, to)` of `leg`, which is not vertical and lies outside the ring; `edges` are those
    /// within the margin of it, and possibly others. `None`, here and below, where too much reaches into a cell that it
    /// passes.
    pub(super) fn exposure_outside(
        &self,
        edges: &[usize],
        leg: &Segment,
        (from, to): (f64, f64),
    ) -> Option<f64> {
        let ends = [leg.at(from).xy(), leg.at(to).xy()];
        let part = Part {
            way: ends[1] - ends[0],
            ends,
        };
        let reach = nearest::reach(self.margin, part.way.norm());
        let beyond = |[u, v]: [f64; 2], low: f64, high: f64| u.max(v) < low || u.min(v) > high;
        let (mut beside, mut before) = (0.0, 0.0);
        for &idx in edges {
            let edge = &self.edges[idx];
            let seen = ends.map(|end| end - edge.a);
            let along = seen.map(|end| end.dot(&edge.along));
            let away = seen.map(|end| end.dot(&self.cells.outward(edge)));
            if beyond(along, -reach, edge.length + reach) || beyond(away, -reach, reach) {
                continue;
            }
            beside += self.exposure_beside(idx, &part, away)?;
            let corner = self.corner(edge.a);
            let at = |share: f64| from + (to - from) * share;
            let found = |enters, leaves| before += corner.exposure(leg, (at(enters), at(leaves)));
            self.before_corner(idx, &part, along, found)?;
        }
        Some(beside * (to - from) * leg.length() + before)
    }

    /// Mean of `T` in the cell beside edge `idx`, times the share of the part that lies in it. A leg in line with the
    /// next side goes on behind the edge's line, along that side, which pays for it there.
    fn exposure_beside(&self, idx: usize, part: &Part, away: [f64; 2]) -> Option<f64> {
        let edge = &self.edges[idx];
        let mut window = part.beside(edge, self.edge_after(idx));
        let height = |share: f64| away[0] + (away[1] - away[0]) * share;
        if height(window[0]).min(height(window[1])) < -HAIR {
            let above = clip(away, [0.0, f64::INFINITY], [0.0; 2]);
            window = [window[0].max(above[0]), window[1].min(above[1])];
        }
        let mut exposure = 0.0;
        if window[0] < window[1] {
            let found = |enters, leaves| {
                exposure += self.mean_intensity(height(enters), height(leaves)) * (leaves - enters);
            };
            self.reign(Feature::Edge(idx), part, window, found)?;
        }
        Some(exposure)
    }

    /// Call `found` with the places of a part between which the corner at the beginning of edge `idx` is the nearest.
    fn before_corner(
        &self,
        idx: usize,
        part: &Part,
        along: [f64; 2],
        found: impl FnMut(f64, f64),
    ) -> Option<()> {
        let before = self.edge_before(idx);
        let past = part
            .ends
            .map(|end| (end - self.edges[idx].a).dot(&before.along));
        let past = clip(past, [0.0, f64::INFINITY], [-HAIR; 2]);
        let ahead = clip(along, [f64::NEG_INFINITY, 0.0], [-HAIR; 2]);
        let window = [past[0].max(ahead[0]), past[1].min(ahead[1])];
        if window[0] < window[1] {
            self.reign(Feature::Vertex(idx), part, window, found)?;
        }
        Some(())
    }

    /// Call `found` with the places within `window` of a part between which `feature` is the nearest.
    fn reign(
        &self,
        feature: Feature,
        part: &Part,
        [from, to]: [f64; 2],
        found: impl FnMut(f64, f64),
    ) -> Option<()> {
        let own = part.squared(feature, self);
        let is_above = |top: f64| own.stays_above(top * top, (from, to));
        // Many cells are never needed.
        if is_above(self.margin) {
            return Some(());
        }
        let cell = match feature {
            Feature::Edge(idx) => Some(self.beside(idx)),
            Feature::Vertex(idx) => self.before(idx),
        };
        let Some(cell) = cell.filter(|cell| !is_above(cell.top)) else {
            return Some(());
        };
        let mut reign = Reign {
            from,
            to,
            gaps: Vec::new(),
        };
        // Distances are convex: the greatest is at an end.
        let most = own.at(from).max(own.at(to));
        for rival in cell.rivals.as_ref()? {
            if rival.from > 0.0 && rival.from * rival.from > most {
                continue;
            }
            let within = match rival.feature {
                Feature::Vertex(_) => [from, to],
                Feature::Edge(idx) => part.beside(&self.edges[idx], self.edge_after(idx)),
            };
            let ahead = part.squared(rival.feature, self).minus(&own);
            reign.lose(&ahead, within, rival.feature < feature);
        }
        reign.parts(found);
        Some(())
    }
}

/// An empty range.
const NOWHERE: [f64; 2] = [1.0, 0.0];

/// The fractions, 0 to 1, between which a value going linearly from `start` to `end` lies within `[low, high]`, widened
/// by `hairs` for a value that stays the same; an empty range if the first is not less than the second.
fn clip([start, end]: [f64; 2], [low, high]: [f64; 2], hairs: [f64; 2]) -> [f64; 2] {
    let gain = end - start;
    if gain.abs() < LEVEL {
        return if start >= low - hairs[0] && start <= high + hairs[1] {
            [0.0, 1.0]
        } else {
            NOWHERE
        };
    }
    let (one, other) = ((low - start) / gain, (high - start) / gain);
    [one.min(other).max(0.0), one.max(other).min(1.0)]
}
