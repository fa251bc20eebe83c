//! Analytic mountains in lanes: their height, and proofs that legs keep clear.
//!
//! Along a leg a peak is `g(t) = height e^-x(t)`, `x = e0 + 2 b t + s t^2`. The height above ground, and
//! its second derivative, are worked out at five points; between two of them the latter lies no farther from
//! those than an eighth of the step squared times a bound of the fourth derivative, so that every quarter of
//! the leg lies between two parabolas. That proves most legs clear; the others are measured, see `stretch.rs`.

use pulp::Simd;

use super::heights::{Heights, Inside};
use super::leg::{Leg, Point};
use super::swing::Swing;
use crate::geometry::Point2;
use crate::geometry::lane::{Lane, Mask};
use crate::terrain::{NEGLIGIBLE, Peak, Peaks};

/// Beyond this exponent a proof allows for the little that a peak lifts the ground, instead of summing.
const FAR: f64 = 12.0;

/// `e^-FAR` and what a proof's exponentials may be off by, both as a share of the height and rounded up: of the
/// value 1.2e-8, of its part in a parabola's sag another 2.2e-7.
const ALLOWED: f64 = 6.5e-6;

/// Points of a leg at which a proof looks.
const POINTS: usize = 5;
const STEP: f64 = 1.0 / (POINTS - 1) as f64;

/// Greatest squared length in spreads of a leg that may be proven clear.
const WIDEST: f64 = 16.0;

/// `e^(WIDEST STEP^2 / 4)`, rounded up: how much higher a summit may be than the nearest of the points.
const BETWEEN: f64 = 1.285;

/// Mountains, made ready for lanes.
#[derive(Debug)]
pub(super) struct Massif {
    base: f64,
    pub(super) peaks: Vec<Mountain>,
    /// How much higher or lower the ground may be than a proof's sum.
    allowed: f64,
    pub(super) swing: Swing,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Mountain {
    pub(super) center: Point2,
    pub(super) height: f64,
    /// 1 over the spreads.
    pub(super) narrowness: Point2,
    /// Farther than this from the center the exponent is beyond [`NEGLIGIBLE`].
    pub(super) end: f64,
    /// Farther than this, the exponent is beyond [`FAR`].
    reach: f64,
}

/// What is known of a leg's heights above ground.
pub(super) struct Outlook<S: Simd> {
    /// Where it is proven to keep them.
    pub(super) clear: Mask<S>,
    /// Above ground, at equal distances from one end to the other.
    pub(super) heights: [Lane<S>; POINTS],
    /// How inaccurate the heights may be, metres.
    pub(super) allowed: f64,
    /// The squared length in spreads of the narrowest peak near it.
    pub(super) widest: Lane<S>,
}

impl Massif {
    pub(super) fn of(peaks: &Peaks) -> Self {
        let mountain = |peak: &Peak| {
            let spread = peak.spread.x.max(peak.spread.y);
            // A hair more, for rounding.
            let reach = |exponent: f64| exponent.sqrt() * spread * (1.0 + 1e-9);
            Mountain {
                center: peak.center,
                height: peak.height,
                narrowness: Point2::new(1.0 / peak.spread.x, 1.0 / peak.spread.y),
                end: reach(NEGLIGIBLE),
                reach: reach(FAR),
            }
        };
        let highest = peaks.peaks.iter().map(|peak| peak.height.abs());
        Self {
            base: peaks.base,
            peaks: peaks.peaks.iter().map(mountain).collect(),
            allowed: ALLOWED * highest.sum::<f64>(),
            swing: Swing::of(peaks),
        }
    }

    /// The elevation of the ground at `point`.
    #[inline(always)]
    pub(super) fn elevation<S: Simd>(&self, point: Point<S>) -> Lane<S> {
        let mut ground = point.x.with(self.base);
        for peak in &self.peaks {
            ground = ground + peak.at(point);
        }
        ground
    }

    /// The elevation far from every peak.
    pub(super) fn base(&self) -> f64 {
        self.base
    }

    /// Whether a leg keeps within `heights`.
    #[inline(always)]
    pub(super) fn outlook<S: Simd>(
        &self,
        leg: &Leg<S>,
        inside: &Inside<S>,
        heights: &Heights,
    ) -> Outlook<S> {
        let zero = leg.splat(0.0);
        let (mut ground, mut bends) = ([leg.splat(self.base); POINTS], [zero; POINTS]);
        let (mut fourth, mut widest) = (zero, zero);
        let mut peak_idx = 0;
        while peak_idx < self.peaks.len() {
            let peak = &self.peaks[peak_idx];
            peak_idx += 1;
            let near = leg.near(peak.center, peak.reach);
            if !near.any() {
                continue;
            }
            let p = (leg.a.x - peak.center.x) * peak.narrowness.x;
            let q = (leg.a.y - peak.center.y) * peak.narrowness.y;
            let (u, v) = (leg.dx * peak.narrowness.x, leg.dy * peak.narrowness.y);
            let square = near.keep(u * u + v * v);
            widest = widest.max(square);
            let height = near.keep(zero.with(peak.height));
            let twice = square + square;
            let mut steepness = near.keep((p * u + q * v) * 2.0);
            let mut exponent = p * p + q * q;
            let (mut highest, mut least) = (zero, exponent);
            // From one point to the next the exponent grows by the mean of both slopes.
            let (change, steeper) = (square * (STEP * STEP), twice * STEP);
            let mut point = 0;
            loop {
                let lift = height * (-exponent.min(zero.with(NEGLIGIBLE))).exp_roughly();
                ground[point] = ground[point] + lift;
                bends[point] = bends[point] + lift * (twice - steepness * steepness);
                highest = highest.max(lift.abs());
                least = least.min(exponent);
                point += 1;
                if point == POINTS {
                    break;
                }
                exponent = exponent + steepness * STEP + change;
                steepness = steepness + steeper;
            }
            // As in `stretch.rs`.
            fourth = fourth + square * square * highest * (least * least * 16.0 + 12.0);
        }
        let mut point = 0;
        while point < POINTS {
            ground[point] = leg.a.z + leg.dz * (STEP * point as f64) - ground[point];
            point += 1;
        }
        // A parabola over a step sags by an eighth of the step squared times its second derivative, which
        // strays from those at both ends by as much of the fourth.
        let sag = STEP * STEP / 8.0;
        let stray = fourth * (BETWEEN * sag);
        let mut clear = widest.le(leg.splat(WIDEST));
        let mut point = 0;
        while point + 1 < POINTS {
            let ends = [ground[point], ground[point + 1]];
            let most = bends[point].max(bends[point + 1]) + stray;
            let least = bends[point].min(bends[point + 1]) - stray;
            let slack = [
                most.max(zero) * sag + 2.0 * self.allowed,
                (-least).max(zero) * sag + 2.0 * self.allowed,
            ];
            let part = [point as f64 * STEP, (point + 1) as f64 * STEP];
            clear = clear & heights.within(ends, slack, inside, part);
            point += 1;
        }
        Outlook {
            clear,
            heights: ground,
            allowed: self.allowed,
            widest,
        }
    }
}

impl Mountain {
    /// How much it lifts the ground at `point`.
    #[inline(always)]
    fn at<S: Simd>(&self, point: Point<S>) -> Lane<S> {
        let p = (point.x - self.center.x) * self.narrowness.x;
        let q = (point.y - self.center.y) * self.narrowness.y;
        let exponent = p * p + q * q;
        let near = exponent.lt(exponent.with(NEGLIGIBLE));
        if near.any() {
            near.keep((-near.keep(exponent)).exp() * self.height)
        } else {
            exponent.with(0.0)
        }
    }
}
