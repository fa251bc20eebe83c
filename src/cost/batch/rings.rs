//! Rings in lanes: where each of their edges and corners has a part of the soft zone to itself, a leg's exposure is a
//! sum over them. Legs that touch or enter a ring are left to the scalar code, and so are those for which two features
//! may be equally near, and those that only climb.

use pulp::Simd;

use super::Pricer;
use super::leg::Leg;
use super::threats::{Span, Window, exposure_within};
use crate::cost::threat::sampled_exposure;
use crate::geometry::lane::{Lane, Mask};
use crate::geometry::{LEVEL, Point2, Rect, ring};
use crate::scenario::Quadrature;
use crate::threat::{HAIR, Polygon, Zone};

/// So many corners are looked at for each of a block of legs to see which of them enter. The scalar code has an index
/// for rings of more.
const MOST_CORNERS: usize = 96;

/// A leg this many tolerances deep in lanes is deeper than one whatever the rounding.
const SURELY: f64 = 2.0;

/// A ring between two heights.
#[derive(Debug, Clone)]
pub(super) struct Ring {
    /// Box round the soft zone.
    extent: Rect,
    /// Box round the ring itself.
    bounds: Rect,
    edges: Vec<(Point2, Point2)>,
    margin: f64,
    span: Span,
    /// `None` where every leg is left to the scalar code.
    zones: Option<Vec<Zone>>,
}

/// The part of a ring's exposure computed in lanes.
struct Settled<S: Simd> {
    exposure: Lane<S>,
    /// Where it was not.
    left: Mask<S>,
}

/// How a leg lies to the part of an edge: metres along it from its beginning, and out of the ring.
struct View<S: Simd> {
    along: Linear<S>,
    outward: Linear<S>,
}

/// `at_start + gain * t`.
#[derive(Clone, Copy)]
struct Linear<S: Simd> {
    at_start: Lane<S>,
    gain: Lane<S>,
}

impl Ring {
    pub(super) fn of(polygon: &Polygon, extent: Rect, span: Span) -> Self {
        Self {
            extent,
            bounds: polygon.bounds(),
            zones: polygon.zones().map(<[Zone]>::to_vec),
            edges: ring::edges(polygon.vertices()).collect(),
            margin: polygon.margin(),
            span,
        }
    }

    /// The exposure of the legs that neither touch nor enter the ring.
    #[inline(always)]
    fn settle<S: Simd>(
        &self,
        zones: &[Zone],
        leg: &Leg<S>,
        window: &Window<S>,
        met: Mask<S>,
    ) -> Settled<S> {
        let mut exposure = leg.splat(0.0);
        let mut left = met & !(leg.moves & window.t0.lt(window.t1));
        // As in the scalar code, which treats an edge as slightly longer.
        let touch = leg.level * 1e-8 + 1e-6;
        for zone in zones {
            let (x, y) = (leg.middle[0] - zone.center.x, leg.middle[1] - zone.center.y);
            let reach =
                leg.level * (0.5 + 1e-9) + touch + (zone.radius + self.margin) * (1.0 + 1e-9);
            let near = met & (x * x + y * y).le(reach * reach);
            if !near.any() {
                continue;
            }
            let view = View::of(leg, zone);
            left = left | (near & view.may_meet(leg, window, zone, touch));
            if zone.is_shared {
                left = left | (near & view.may_meet(leg, window, zone, touch + self.margin));
            } else if self.margin > 0.0 {
                exposure = exposure + near.keep(view.edge(leg, window, zone, self.margin));
            }
            if self.margin > 0.0 && zone.before.is_some() {
                exposure = exposure + view.corner(leg, window, zone, self.margin, met);
            }
        }
        let start = leg.at(window.t0);
        let inside = met & !left & self.in_bounds(start);
        if inside.any() {
            left = left | (inside & self.contains(start));
        }
        Settled { exposure, left }
    }

    #[inline(always)]
    fn in_bounds<S: Simd>(&self, [x, y]: [Lane<S>; 2]) -> Mask<S> {
        x.with(self.bounds.min.x).le(x)
            & x.le(x.with(self.bounds.max.x))
            & y.with(self.bounds.min.y).le(y)
            & y.le(y.with(self.bounds.max.y))
    }

    /// Where a point is inside, by the even-odd rule.
    #[inline(always)]
    fn contains<S: Simd>(&self, [x, y]: [Lane<S>; 2]) -> Mask<S> {
        let zero = x.with(0.0);
        let mut inside = x.lt(x);
        for &(a, b) in &self.edges {
            let (over_a, over_b) = (y.lt(y.with(a.y)), y.lt(y.with(b.y)));
            let spans = (over_a & !over_b) | (over_b & !over_a);
            let crossing = (y - a.y) * ((b.x - a.x) / (b.y - a.y)) + a.x;
            let crossed = spans & zero.lt(crossing - x);
            inside = (inside & !crossed) | (crossed & !inside);
        }
        inside
    }

    /// A depth that each of the `wanted` legs reaches for certain, metres; 0 where none is seen. Where a leg enters, the
    /// middle of its first part within is mostly deep.
    #[inline(always)]
    fn depth_seen<S: Simd>(&self, leg: &Leg<S>, window: &Window<S>, wanted: Mask<S>) -> Lane<S> {
        let (mut first, mut second) = (window.t1, window.t1);
        for &(a, b) in &self.edges {
            let (along, to_a) = (b - a, [-(leg.a.x - a.x), -(leg.a.y - a.y)]);
            // Where the leg's line crosses that of the edge, as shares of both, times `across`.
            let across = leg.dx * along.y - leg.dy * along.x;
            let of_leg = to_a[0] * along.y - to_a[1] * along.x;
            let of_edge = to_a[0] * leg.dy - to_a[1] * leg.dx;
            let t = of_leg / across;
            let crosses = (of_edge * (of_edge - across)).le(leg.splat(0.0))
                & window.t0.lt(t)
                & t.lt(window.t1);
            let t = crosses.select(t, window.t1);
            second = second.min(first.max(t));
            first = first.min(t);
        }
        let before = self.depth_between(leg, [window.t0, first], wanted);
        before.max(self.depth_between(leg, [first, second], wanted))
    }

    /// How deep a leg is in the ring halfway between two shares of it; 0 outside, and where it is not `wanted`.
    #[inline(always)]
    fn depth_between<S: Simd>(
        &self,
        leg: &Leg<S>,
        [from, to]: [Lane<S>; 2],
        wanted: Mask<S>,
    ) -> Lane<S> {
        let middle = leg.at((from + to) * 0.5);
        let inside = wanted & self.in_bounds(middle);
        if !inside.any() {
            return leg.splat(0.0);
        }
        (inside & self.contains(middle)).keep(self.distance(middle))
    }

    /// The distance of a point from the ring.
    #[inline(always)]
    fn distance<S: Simd>(&self, [x, y]: [Lane<S>; 2]) -> Lane<S> {
        let (zero, one) = (x.with(0.0), x.with(1.0));
        let mut least = x.with(f64::INFINITY);
        for &(a, b) in &self.edges {
            let (along, from) = (b - a, [x - a.x, y - a.y]);
            let foot = (from[0] * along.x + from[1] * along.y) * (1.0 / along.norm_squared());
            let foot = foot.clamp(zero, one);
            let off = [from[0] - foot * along.x, from[1] - foot * along.y];
            least = least.min(off[0] * off[0] + off[1] * off[1]);
        }
        least.sqrt()
    }
}

impl<S: Simd> View<S> {
    #[inline(always)]
    fn of(leg: &Leg<S>, zone: &Zone) -> Self {
        Self {
            along: Linear::along(leg, zone.a, [zone.along.x, zone.along.y]),
            outward: Linear::along(leg, zone.a, [zone.outward.x, zone.outward.y]),
        }
    }

    /// Where the part `window` of a leg may come within `reach` of the part of the edge.
    #[inline(always)]
    fn may_meet(&self, leg: &Leg<S>, window: &Window<S>, zone: &Zone, reach: Lane<S>) -> Mask<S> {
        // Seen from the leg, the ends of the part.
        let off = self.along.at_start * self.outward.gain - self.outward.at_start * self.along.gain;
        let end_off = off - self.outward.gain * zone.length;
        let aside = reach * leg.level;
        let [along, outward] = [self.along.ends(window), self.outward.ends(window)];
        !(outward[1].lt(-reach)
            | reach.lt(outward[0])
            | along[1].lt(-reach)
            | (reach + zone.length).lt(along[0])
            | off.max(end_off).lt(-aside)
            | aside.lt(off.min(end_off)))
    }

    /// Exposure beside the edge: the distance from it is linear, so that it is a trapezium, cut where the soft
    /// zone ends.
    #[inline(always)]
    fn edge(&self, leg: &Leg<S>, window: &Window<S>, zone: &Zone, margin: f64) -> Lane<S> {
        let (zero, one, margin) = (leg.splat(0.0), leg.splat(1.0), leg.splat(margin));
        let Linear { at_start, gain } = self.along;
        let (enters, leaves) = (-at_start / gain, (leg.splat(zone.length) - at_start) / gain);
        let level = gain.abs().lt(leg.splat(LEVEL));
        let beside =
            leg.splat(-HAIR).le(at_start) & at_start.le(leg.splat(zone.length + zone.overhang));
        let from = level.select(beside.select(zero, one), enters.min(leaves));
        let to = level.select(beside.select(one, zero), enters.max(leaves));
        let (from, to) = (window.t0.max(from), window.t1.min(to));
        let [d0, d1] = [from, to].map(|t| self.outward.at(t));
        let (near, far) = (d0.min(d1), d0.max(d1));
        let exposed = from.lt(to) & near.lt(margin) & zero.lt(near + far);
        let share = far.le(margin).select(one, (margin - near) / (far - near));
        let mean = margin - (near + far.min(margin)) * 0.5;
        exposed.keep(mean * share * (to - from) * leg.length)
    }

    /// Exposure before the corner where the edge begins: that to a point, between the normals of both edges.
    #[inline(always)]
    fn corner(
        &self,
        leg: &Leg<S>,
        window: &Window<S>,
        zone: &Zone,
        margin: f64,
        met: Mask<S>,
    ) -> Lane<S> {
        let near = met & leg.near(zone.a, margin);
        let Some(before) = zone.before.filter(|_| near.any()) else {
            return leg.splat(0.0);
        };
        let beyond = Linear::along(leg, zone.a, [before.x, before.y]).positive();
        let ahead = Linear {
            at_start: -self.along.at_start,
            gain: -self.along.gain,
        };
        let ahead = ahead.positive();
        let part = Window {
            t0: window.t0.max(beyond[0]).max(ahead[0]).min(leg.splat(1.0)),
            t1: window.t1.min(beyond[1]).min(ahead[1]).max(leg.splat(0.0)),
            some: window.some,
        };
        let near = near & part.t0.lt(part.t1);
        if !near.any() {
            return leg.splat(0.0);
        }
        near.keep(exposure_within(margin, leg, &part, &leg.seen_from(zone.a)))
    }
}

impl<S: Simd> Linear<S> {
    /// How far a leg is along `unit` from `origin`.
    #[inline(always)]
    fn along(leg: &Leg<S>, origin: Point2, unit: [f64; 2]) -> Self {
        Self {
            at_start: (leg.a.x - origin.x) * unit[0] + (leg.a.y - origin.y) * unit[1],
            gain: leg.dx * unit[0] + leg.dy * unit[1],
        }
    }

    #[inline(always)]
    fn at(&self, t: Lane<S>) -> Lane<S> {
        self.at_start + self.gain * t
    }

    /// The lesser and the greater of the values at the ends of the window.
    #[inline(always)]
    fn ends(&self, window: &Window<S>) -> [Lane<S>; 2] {
        let (from, to) = (self.at(window.t0), self.at(window.t1));
        [from.min(to), from.max(to)]
    }

    /// Between which `t` of the leg it is above 0, a hair above where it stays the same; none where the first is not the
    /// lesser.
    #[inline(always)]
    fn positive(&self) -> [Lane<S>; 2] {
        let (zero, one) = (self.gain.with(0.0), self.gain.with(1.0));
        let level = self.gain.with(LEVEL);
        let (rises, falls) = (level.le(self.gain), self.gain.le(-level));
        let at = -self.at_start / self.gain;
        let always = self.gain.with(HAIR).lt(self.at_start);
        [
            rises.select(at, falls.select(zero, always.select(zero, one))),
            falls.select(at, rises.select(one, always.select(one, zero))),
        ]
    }
}

impl Pricer<'_> {
    /// Add the exposure of each leg to a ring, and how deep it enters it.
    #[inline(always)]
    pub(super) fn ring<S: Simd>(
        &self,
        threat_idx: usize,
        ring: &Ring,
        leg: &Leg<S>,
        exposure: &mut Lane<S>,
        violation: &mut Lane<S>,
    ) {
        let extent = &ring.extent;
        let mut met = leg.a.x.min(leg.b.x).le(leg.splat(extent.max.x))
            & leg.splat(extent.min.x).le(leg.a.x.max(leg.b.x))
            & leg.a.y.min(leg.b.y).le(leg.splat(extent.max.y))
            & leg.splat(extent.min.y).le(leg.a.y.max(leg.b.y));
        if !met.any() {
            return;
        }
        let window = ring.span.window(leg);
        if let (Some(zones), Quadrature::Integral) = (&ring.zones, self.quadrature) {
            met = met & window.some;
            let settled = ring.settle(zones, leg, &window, met);
            *exposure = *exposure + (met & !settled.left).keep(settled.exposure);
            met = settled.left;
            if !met.any() {
                return;
            }
        }
        if self.verdict && met.any() && ring.edges.len() <= MOST_CORNERS {
            let seen = ring.depth_seen(leg, &window, met & window.some);
            let entered = seen.with(SURELY * self.tolerance.length_m).lt(seen);
            *violation = *violation + entered.keep(seen);
            met = met & !entered;
        }
        let threat = &self.model.scenario.threats[threat_idx];
        let mut depths = leg.splat(0.0);
        let crossed = met.map(|lane| {
            let segment = leg.segment(lane);
            let encounter = threat.encounter(&segment);
            let entered = encounter.depth > self.tolerance.length_m;
            depths = depths.set(lane, if entered { encounter.depth } else { 0.0 });
            match self.quadrature {
                Quadrature::Integral => encounter.exposure,
                Quadrature::Paper => sampled_exposure(threat, &segment),
            }
        });
        *exposure = *exposure + crossed;
        *violation = *violation + depths;
    }
}
