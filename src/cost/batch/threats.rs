//! Eq. 4-5 in lanes: discs in closed form, rings in `rings.rs`.

use pulp::Simd;

use super::Pricer;
use super::index::Index;
use super::leg::{Leg, Sight};
use super::rings::Ring;
use crate::cost::threat::SAMPLES;
use crate::geometry::LEVEL;
use crate::geometry::lane::{Lane, Mask};
use crate::scenario::{Quadrature, Scenario};
use crate::threat::{Cylinder, Shape, Threat};

/// With this many threats or fewer, all are examined.
const FEW_THREATS: usize = 6;

/// Twice the line integral of 1 / d is a logarithm of a quotient that grows without end as the
/// distance falls; beyond this the distance squared, its factor, is lost in rounding.
const LARGEST_QUOTIENT: f64 = 1e18;

/// The threats of a scenario, made ready for lanes.
#[derive(Debug)]
pub(super) struct Threats {
    all: Vec<Outline>,
    /// Set where there are many.
    index: Option<Index>,
}

#[derive(Debug)]
enum Outline {
    Disc(Disc),
    Ring(Ring),
}

#[derive(Debug, Clone, Copy)]
struct Disc {
    outline: Cylinder,
    span: Span,
}

/// The heights that a threat reaches over, infinite where it has no limit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    base: f64,
    top: f64,
    limited: bool,
}

/// The part of each leg between the heights of a threat.
#[derive(Clone, Copy)]
pub(super) struct Window<S: Simd> {
    pub(super) t0: Lane<S>,
    pub(super) t1: Lane<S>,
    /// Where there is such a part.
    pub(super) some: Mask<S>,
}

impl Threats {
    pub(super) fn of(scenario: &Scenario) -> Self {
        let outline = |threat: &Threat| match &threat.shape {
            Shape::Cylinder(cylinder) => Outline::Disc(Disc {
                outline: *cylinder,
                span: Span::of(threat),
            }),
            Shape::Polygon(polygon) => {
                Outline::Ring(Ring::of(polygon, threat.extent(), Span::of(threat)))
            }
        };
        let many = scenario.threats.len() > FEW_THREATS;
        Self {
            all: scenario.threats.iter().map(outline).collect(),
            index: many.then(|| Index::of(scenario.threats.iter().map(Threat::extent))),
        }
    }
}

impl Pricer<'_> {
    /// Add the exposure of each leg and how deep it enters threats.
    #[inline(always)]
    pub(super) fn threats<S: Simd>(
        &self,
        leg: &Leg<S>,
        exposure: &mut Lane<S>,
        violation: &mut Lane<S>,
    ) {
        let threats = &self.scene.threats;
        match &threats.index {
            None => {
                for threat_idx in 0..threats.all.len() {
                    self.threat(threat_idx, leg, exposure, violation);
                }
            }
            Some(Index::Few(sets)) => {
                let places = sets.places(leg);
                for word in 0..sets.n_words {
                    for threat_idx in sets.near::<S>(&places, word) {
                        self.threat(threat_idx, leg, exposure, violation);
                    }
                }
            }
            Some(Index::Many(many)) => {
                let (words, places) = (many.words.places(leg), many.threats.places(leg));
                for block in 0..many.words.n_words {
                    for word in many.words.near::<S>(&words, block) {
                        for bit in many.threats.near::<S>(&places, word) {
                            self.threat(many.order[bit], leg, exposure, violation);
                        }
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn threat<S: Simd>(
        &self,
        threat_idx: usize,
        leg: &Leg<S>,
        exposure: &mut Lane<S>,
        violation: &mut Lane<S>,
    ) {
        match &self.scene.threats.all[threat_idx] {
            Outline::Disc(disc) => self.disc(disc, leg, exposure, violation),
            Outline::Ring(ring) => self.ring(threat_idx, ring, leg, exposure, violation),
        }
    }

    #[inline(always)]
    fn disc<S: Simd>(
        &self,
        disc: &Disc,
        leg: &Leg<S>,
        exposure: &mut Lane<S>,
        violation: &mut Lane<S>,
    ) {
        let outline = &disc.outline;
        if !leg.may_reach(outline.center, outline.influence) {
            return;
        }
        let (zero, one) = (leg.splat(0.0), leg.splat(1.0));
        let sight = leg.seen_from(outline.center);
        let reach = leg.splat(outline.influence * outline.influence);
        let near = sight.least_squared_distance(zero, one).le(reach);
        if !near.any() {
            return;
        }
        let window = disc.span.window(leg);
        let near = near & window.some;
        let nearest = sight.least_squared_distance(window.t0, window.t1);
        let entered = near & nearest.lt(leg.splat(outline.radius * outline.radius));
        if entered.any() {
            let depth = leg.splat(outline.radius) - nearest.sqrt();
            let entered = entered & leg.splat(self.tolerance.length_m).lt(depth);
            *violation = *violation + entered.keep(depth);
        }
        let crossed = match self.quadrature {
            Quadrature::Integral if (!leg.moves).any() => leg.moves.select(
                exposure_within(outline.influence, leg, &window, &sight),
                disc.hover_exposure(leg, &window, &sight),
            ),
            Quadrature::Integral => exposure_within(outline.influence, leg, &window, &sight),
            Quadrature::Paper => disc.sampled_exposure(leg, &sight),
        };
        *exposure = *exposure + near.keep(crossed);
    }
}

impl Span {
    fn of(threat: &Threat) -> Self {
        Self {
            base: threat.base.unwrap_or(f64::NEG_INFINITY),
            top: threat.top.unwrap_or(f64::INFINITY),
            limited: threat.base.is_some() || threat.top.is_some(),
        }
    }

    /// As `Segment::between_heights`.
    #[inline(always)]
    pub(super) fn window<S: Simd>(&self, leg: &Leg<S>) -> Window<S> {
        let (zero, one) = (leg.splat(0.0), leg.splat(1.0));
        if !self.limited {
            return Window {
                t0: zero,
                t1: one,
                some: zero.le(one),
            };
        }
        let (low, high) = (leg.a.z.min(leg.b.z), leg.a.z.max(leg.b.z));
        let (base, top) = (leg.splat(self.base), leg.splat(self.top));
        let some = low.lt(top) & base.le(high);
        let at_base = (base - leg.a.z) / leg.dz;
        let at_top = (top - leg.a.z) / leg.dz;
        let (climbs, sinks) = (zero.lt(leg.dz), leg.dz.lt(zero));
        let enter = climbs.select(at_base, sinks.select(at_top, zero)).max(zero);
        let leave = climbs.select(at_top, sinks.select(at_base, one)).min(one);
        Window {
            t0: enter.min(one),
            t1: leave.max(zero),
            some: some & enter.le(leave),
        }
    }
}

impl Disc {
    /// As `exposure_within`, of legs that only climb.
    #[inline(always)]
    fn hover_exposure<S: Simd>(
        &self,
        leg: &Leg<S>,
        window: &Window<S>,
        sight: &Sight<S>,
    ) -> Lane<S> {
        let middle = (window.t0 + window.t1) * 0.5;
        self.intensity(sight, middle) * leg.length * (window.t1 - window.t0)
    }

    /// As `cost::threat::sampled_exposure`.
    #[inline(always)]
    fn sampled_exposure<S: Simd>(&self, leg: &Leg<S>, sight: &Sight<S>) -> Lane<S> {
        let mut sum = leg.splat(0.0);
        for t in SAMPLES {
            let z = if t < 1.0 {
                leg.a.z + leg.dz * t
            } else {
                leg.b.z
            };
            let reached = leg.splat(self.span.base).le(z) & z.lt(leg.splat(self.span.top));
            sum = sum + reached.keep(self.intensity(sight, leg.splat(t)));
        }
        sum * (1.0 / SAMPLES.len() as f64) * leg.length
    }

    /// `T(d)` of Eq. 5 at `t`, whatever the height.
    #[inline(always)]
    fn intensity<S: Simd>(&self, sight: &Sight<S>, t: Lane<S>) -> Lane<S> {
        let distance = sight.squared_distance(t).sqrt();
        (t.with(self.outline.influence) - distance).max(t.with(0.0))
    }
}

/// As `Cylinder::exposure` of a soft zone that ends `influence` metres from a point, of legs that move. The difference of the two asinh is one
/// logarithm: with `d0`, `d1` the distances of the ends of a chord of length `c` from the axis,
/// the integral of `1 / d` along it is `ln((d0 + d1 + c) / (d0 + d1 - c))`.
#[inline(always)]
pub(super) fn exposure_within<S: Simd>(
    influence: f64,
    leg: &Leg<S>,
    window: &Window<S>,
    sight: &Sight<S>,
) -> Lane<S> {
    let zero = leg.splat(0.0);
    let across = (sight.x * leg.dy - sight.y * leg.dx) * leg.inverse;
    let across_square = across * across;
    let half_square = leg.splat(influence * influence) - across_square;
    let half_chord = half_square.max(zero).sqrt();
    let s0 = ((window.t0 - sight.foot) * leg.level).max(-half_chord);
    let s1 = ((window.t1 - sight.foot) * leg.level).min(half_chord);
    let chord = s1 - s0;
    let d0 = (across_square + s0 * s0).sqrt();
    let d1 = (across_square + s1 * s1).sqrt();
    let (over, under) = (d0 + d1 + chord, d0 + d1 - chord);
    let logarithm = over.ln_over(under.max(over * (1.0 / LARGEST_QUOTIENT)));
    let logarithm = leg
        .splat(LEVEL)
        .le(across.abs())
        .keep(across_square * logarithm);
    // Of a leg that grazes the zone less is left than what rounding takes; no zone pays.
    let integral = (chord * influence - (s1 * d1 - s0 * d0 + logarithm) * 0.5).max(zero);
    (zero.lt(half_square) & s0.lt(s1)).keep(integral * (leg.length * leg.inverse))
}
