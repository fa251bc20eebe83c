//! Analytic mountains in lanes: their height at a point, and a proof that a leg keeps clear of them.
//!
//! Along a leg a peak is `g(t) = height exp(-(e0 + 2 b t + s t^2))`. At equal steps it needs three
//! exponentials, whatever their number: each value is the one before times a ratio, each ratio the
//! one before times `exp(-2 s step^2)`. Between samples a curve keeps within a step squared, an
//! eighth of it, times its second derivative of its chords, and that of a peak is at most `2 s g`
//! downwards and `2 s height 2 e^(-3/2)` upwards.

use pulp::Simd;

use super::heights::{Heights, Inside};
use super::leg::{Leg, Point};
use crate::geometry::Point2;
use crate::geometry::lane::{Lane, Mask};
use crate::terrain::Peaks;

/// Beyond this exponent a peak no longer lifts the ground, as in the scalar code.
const NEGLIGIBLE: f64 = 50.0;

/// Beyond this one a proof allows for the little that a peak lifts the ground, instead of summing.
const FAR: f64 = 12.0;

/// `e^-FAR`, rounded up.
const FAR_SHARE: f64 = 6.2e-6;

/// How far the root of [`FAR`] is, rounded up.
const FAR_SPREADS: f64 = 3.4642;

/// 2 e^(-3/2), rounded up: a Gaussian's greatest upward bend over its greatest downward one.
const UPWARD: f64 = 0.4463;

/// Ratios of samples are not followed beyond this exponent.
const STEEPEST: f64 = 600.0;

/// Up to this exponent of one step, `e^(y / 4)` is at most `1 + y / 2`.
const WIDEST_STEP: f64 = 5.0;

/// Mountains, made ready for lanes.
#[derive(Debug, Clone)]
pub(super) struct Massif {
    base: f64,
    peaks: Vec<Mountain>,
}

#[derive(Debug, Clone, Copy)]
struct Mountain {
    center: Point2,
    height: f64,
    /// 1 over the spreads.
    narrowness: Point2,
    /// Farther than this from the center the exponent is beyond [`FAR`].
    reach: f64,
}

impl Massif {
    pub(super) fn of(peaks: &Peaks) -> Self {
        let mountain = |peak: &crate::terrain::Peak| Mountain {
            center: peak.center,
            height: peak.height,
            narrowness: Point2::new(1.0 / peak.spread.x, 1.0 / peak.spread.y),
            reach: FAR_SPREADS * peak.spread.x.max(peak.spread.y),
        };
        Self {
            base: peaks.base,
            peaks: peaks.peaks.iter().map(mountain).collect(),
        }
    }

    /// The ground's elevation below `point`.
    #[inline(always)]
    pub(super) fn elevation<S: Simd>(&self, point: Point<S>) -> Lane<S> {
        let mut sum = point.x.with(self.base);
        for peak in &self.peaks {
            let u = (point.x - peak.center.x) * peak.narrowness.x;
            let v = (point.y - peak.center.y) * peak.narrowness.y;
            let exponent = u * u + v * v;
            let near = exponent.lt(exponent.with(NEGLIGIBLE));
            if near.any() {
                sum = sum + near.keep((-near.keep(exponent)).exp() * peak.height);
            }
        }
        sum
    }

    /// Where a leg is proven to keep within `heights` by its height at `STEPS` + 1 points.
    #[inline(always)]
    pub(super) fn clear<S: Simd, const STEPS: usize>(
        &self,
        leg: &Leg<S>,
        inside: &Inside<S>,
        heights: &Heights,
    ) -> Mask<S> {
        let (zero, one) = (leg.splat(0.0), leg.splat(1.0));
        let step = 1.0 / STEPS as f64;
        let mut ground = [zero; 32];
        let (mut dips, mut rises) = (zero, zero);
        let (mut raised, mut lowered) = (0.0, 0.0);
        let mut unclear = one.lt(zero);
        for peak in &self.peaks {
            let far = peak.height * FAR_SHARE;
            raised += far.max(0.0);
            lowered -= far.min(0.0);
            if !leg.may_reach(peak.center, peak.reach) {
                continue;
            }
            let p = (leg.a.x - peak.center.x) * peak.narrowness.x;
            let q = (leg.a.y - peak.center.y) * peak.narrowness.y;
            let u = leg.dx * peak.narrowness.x;
            let v = leg.dy * peak.narrowness.y;
            let (s, b, e0) = (u * u + v * v, p * u + q * v, p * p + q * q);
            let summit = (-b / s).clamp(zero, one);
            let near = (e0 + (b * 2.0 + s * summit) * summit).lt(leg.splat(FAR));
            if !near.any() {
                continue;
            }
            // A far lane follows a level peak of no height.
            let (s, b, e0) = (near.keep(s), near.keep(b), near.keep(e0));
            let bend = s * (step * step);
            let slope = (b * (2.0 * step)).abs() + bend;
            let followed = e0.le(leg.splat(STEEPEST))
                & slope.le(leg.splat(STEEPEST))
                & bend.le(leg.splat(WIDEST_STEP));
            unclear = unclear | !followed;
            let (e0, b, bend) = (followed.keep(e0), followed.keep(b), followed.keep(bend));
            let mut value = near.keep((-e0).exp() * peak.height);
            let mut ratio = (-(b * (2.0 * step) + bend)).exp();
            let change = (bend * -2.0).exp();
            let mut highest = value.abs();
            ground[0] = ground[0] + value;
            let mut sample = 1;
            while sample <= STEPS {
                value = value * ratio;
                ratio = ratio * change;
                highest = highest.max(value.abs());
                ground[sample] = ground[sample] + value;
                sample += 1;
            }
            // 2 s step^2 / 8 times the height that the second derivative is of.
            let down = bend * 0.25 * highest * (bend * 0.5 + 1.0);
            let up = near.keep(bend * (0.25 * UPWARD * peak.height.abs()));
            let (dip, rise) = if peak.height > 0.0 {
                (down, up)
            } else {
                (up, down)
            };
            (dips, rises) = (dips + dip, rises + rise);
        }
        let (dips, rises) = (dips + raised, rises + lowered);
        let mut clear = !unclear;
        let mut sample = 0;
        let mut before = leg.a.z - self.base - ground[0];
        while sample < STEPS {
            let t = [step * sample as f64, step * (sample + 1) as f64];
            let after = leg.a.z + leg.dz * t[1] - self.base - ground[sample + 1];
            let low = before.min(after) - dips;
            let high = before.max(after) + rises;
            clear = clear & heights.within(low, high, inside, t);
            before = after;
            sample += 1;
        }
        clear
    }
}
