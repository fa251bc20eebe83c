//! Analytic mountains in lanes: their height at the ends of legs, and proofs that legs keep clear.
//!
//! Along a leg a peak is `g(t) = height e^-x(t)`, `x = e0 + 2 b t + s t^2`. The height above ground, and
//! its second derivative, are known at both ends and in the middle; between them the latter lies no
//! farther from those than an eighth of the step squared times a bound of the fourth derivative, so
//! that either half lies between two parabolas. That proves most legs clear; the others are measured,
//! see `stretch.rs`.

use pulp::Simd;

use super::heights::{Heights, Inside};
use super::leg::{Leg, Point};
use crate::geometry::Point2;
use crate::geometry::lane::{Lane, Mask};
use crate::terrain::{NEGLIGIBLE, Peak, Peaks};

/// Beyond this exponent a proof allows for the little that a peak lifts the ground, instead of summing.
const FAR: f64 = 12.0;

/// `e^-FAR`, rounded up.
const FAR_SHARE: f64 = 6.2e-6;

/// Greatest squared length in spreads of a leg that may be proven clear by its ends and its middle; by
/// twice as many points, that of one twice as long.
const WIDEST: f64 = 4.0;

/// `e^(WIDEST / 16)`, rounded up: how much higher a summit may be than the nearest of those points.
const BETWEEN: f64 = 1.285;

/// Mountains, made ready for lanes.
#[derive(Debug, Clone)]
pub(super) struct Massif {
    base: f64,
    pub(super) peaks: Vec<Mountain>,
    /// By how much far peaks may raise or lower the ground together.
    far: f64,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Mountain {
    pub(super) center: Point2,
    pub(super) height: f64,
    /// 1 over the spreads.
    pub(super) narrowness: Point2,
    /// Farther than this from the center the exponent is beyond [`NEGLIGIBLE`].
    pub(super) end: f64,
    /// Farther than this, beyond [`FAR`].
    reach: f64,
}

/// A peak as seen from a point: offsets in spreads, the exponent, and how high it lifts the ground.
#[derive(Clone, Copy)]
struct View<S: Simd> {
    p: Lane<S>,
    q: Lane<S>,
    exponent: Lane<S>,
    lift: Lane<S>,
}

/// All peaks from the ends of a leg; kept from leg to leg, as one ends where the next begins.
pub(super) struct Panorama<S: Simd> {
    from: Vec<View<S>>,
    to: Vec<View<S>>,
    /// Elevations of the ground at both ends.
    ground: [Lane<S>; 2],
}

/// What is known of a leg's heights above ground.
pub(super) struct Outlook<S: Simd> {
    /// Where it is proven to keep them.
    pub(super) clear: Mask<S>,
    /// Above ground at the ends and in the middle.
    pub(super) heights: [Lane<S>; 3],
    /// The squared length in spreads of the narrowest peak near it.
    pub(super) widest: Lane<S>,
}

impl<S: Simd> Panorama<S> {
    /// Of no peaks, from nowhere.
    #[inline(always)]
    pub(super) fn new(simd: S) -> Self {
        let zero = Lane::splat(simd, 0.0);
        Self {
            from: Vec::new(),
            to: Vec::new(),
            ground: [zero; 2],
        }
    }

    /// The elevation of the ground at the end.
    pub(super) fn ground(&self) -> Lane<S> {
        self.ground[1]
    }
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
        Self {
            base: peaks.base,
            peaks: peaks.peaks.iter().map(mountain).collect(),
            far: FAR_SHARE
                * peaks
                    .peaks
                    .iter()
                    .map(|peak| peak.height.abs())
                    .sum::<f64>(),
        }
    }

    /// The elevation of the ground at `point`; the same as by `look`.
    #[inline(always)]
    pub(super) fn elevation<S: Simd>(&self, point: Point<S>) -> Lane<S> {
        let mut ground = point.x.with(self.base);
        for peak in &self.peaks {
            ground = ground + peak.view(point).lift;
        }
        ground
    }

    /// The elevation far from every peak.
    pub(super) fn base(&self) -> f64 {
        self.base
    }

    /// Look round from `point`, the end of a leg; the end before becomes its beginning.
    #[inline(always)]
    pub(super) fn look<S: Simd>(&self, point: Point<S>, panorama: &mut Panorama<S>) {
        std::mem::swap(&mut panorama.from, &mut panorama.to);
        panorama.to.clear();
        panorama.to.reserve(self.peaks.len());
        let mut ground = point.x.with(self.base);
        for peak in &self.peaks {
            let view = peak.view(point);
            ground = ground + view.lift;
            panorama.to.push(view);
        }
        panorama.ground = [panorama.ground[1], ground];
    }

    /// Whether a leg keeps within `heights`; `panorama` is that of its ends.
    #[inline(always)]
    pub(super) fn outlook<S: Simd>(
        &self,
        leg: &Leg<S>,
        panorama: &Panorama<S>,
        inside: &Inside<S>,
        heights: &Heights,
    ) -> Outlook<S> {
        let zero = leg.splat(0.0);
        let mut ground = leg.splat(self.base);
        let (mut bends, mut fourth, mut widest) = ([zero; 3], zero, zero);
        let mut peak_idx = 0;
        while peak_idx < self.peaks.len() {
            let peak = &self.peaks[peak_idx];
            let (a, b) = (&panorama.from[peak_idx], &panorama.to[peak_idx]);
            peak_idx += 1;
            let near = leg.near(peak.center, peak.reach);
            if !near.any() {
                continue;
            }
            let (u, v) = (near.keep(b.p - a.p), near.keep(b.q - a.q));
            let square = u * u + v * v;
            widest = widest.max(square);
            // The middle's exponent is the mean of those of the ends less `s / 4`.
            let exponent = (a.exponent + b.exponent) * 0.5 - square * 0.25;
            let near = near & exponent.lt(leg.splat(NEGLIGIBLE));
            let lift = near.keep((-near.keep(exponent)).exp() * peak.height);
            ground = ground + lift;
            let twice = square + square;
            let steepness = (a.p * u + a.q * v) * 2.0;
            let in_middle = steepness + square;
            let at_end = in_middle + square;
            bends[0] = bends[0] + a.lift * (twice - steepness * steepness);
            bends[1] = bends[1] + lift * (twice - in_middle * in_middle);
            bends[2] = bends[2] + b.lift * (twice - at_end * at_end);
            // As in `stretch.rs`.
            let highest = a.lift.abs().max(b.lift.abs()).max(lift.abs());
            let least = a.exponent.min(b.exponent).min(exponent);
            fourth = fourth + square * square * highest * (least * least * 16.0 + 12.0);
        }
        let heights_at = [
            leg.a.z - panorama.ground[0],
            leg.a.z + leg.dz * 0.5 - ground,
            leg.b.z - panorama.ground[1],
        ];
        let clear = widest.le(leg.splat(WIDEST))
            & self.keeps(heights, inside, &heights_at, &bends, fourth * BETWEEN);
        Outlook {
            clear,
            heights: heights_at,
            widest,
        }
    }
}

impl Massif {
    /// As the `outlook`, at twice as many points: where a leg, a part of which is near a peak for which it is
    /// too long, or which comes near a limit, is proven to keep its heights all the same.
    #[inline(always)]
    pub(super) fn closer_outlook<S: Simd>(
        &self,
        leg: &Leg<S>,
        panorama: &Panorama<S>,
        outlook: &Outlook<S>,
        inside: &Inside<S>,
        heights: &Heights,
    ) -> Mask<S> {
        let zero = leg.splat(0.0);
        let mut ground = [leg.splat(self.base); 2];
        let (mut bends, mut fourth) = ([zero; 5], zero);
        let mut peak_idx = 0;
        while peak_idx < self.peaks.len() {
            let peak = &self.peaks[peak_idx];
            let (a, b) = (&panorama.from[peak_idx], &panorama.to[peak_idx]);
            peak_idx += 1;
            let near = leg.near(peak.center, peak.reach);
            if !near.any() {
                continue;
            }
            let (u, v) = (near.keep(b.p - a.p), near.keep(b.q - a.q));
            let square = u * u + v * v;
            // Half way between two points the exponent is the mean of theirs less `s / 4` times the square
            // of the way between them, so that the peak is the root of their product times a power.
            let fold = (square * (1.0 / 16.0)).exp();
            let twofold = fold * fold;
            let sign = peak.height.signum();
            let (first, last) = (near.keep(a.lift * sign), near.keep(b.lift * sign));
            let middle = (first * last).sqrt() * (twofold * twofold);
            let quarters = [
                (first * middle).sqrt() * fold,
                (middle * last).sqrt() * fold,
            ];
            let lifts = [first, quarters[0], middle, quarters[1], last];
            let twice = square + square;
            let mut steepness = (a.p * u + a.q * v) * 2.0;
            let mut highest = zero;
            let mut point = 0;
            while point < 5 {
                let bend = lifts[point] * (twice - steepness * steepness);
                bends[point] = bends[point] + bend * sign;
                highest = highest.max(lifts[point]);
                steepness = steepness + twice * 0.25;
                point += 1;
            }
            ground[0] = ground[0] + quarters[0] * sign;
            ground[1] = ground[1] + quarters[1] * sign;
            // As in `stretch.rs`; the exponent is the least at the highest point.
            let mean = (a.exponent + b.exponent) * 0.5 - square * 0.25;
            let least = a.exponent.min(b.exponent).min(mean);
            fourth = fourth + square * square * highest * (least * least * 16.0 + 12.0);
        }
        let [from, middle, to] = [outlook.heights[0], outlook.heights[1], outlook.heights[2]];
        let heights_at = [
            from,
            leg.a.z + leg.dz * 0.25 - ground[0],
            middle,
            leg.a.z + leg.dz * 0.75 - ground[1],
            to,
        ];
        outlook.widest.le(leg.splat(4.0 * WIDEST))
            & self.keeps(heights, inside, &heights_at, &bends, fourth * BETWEEN)
    }

    /// Whether legs keep within `heights`, being at those given, with those second derivatives, at points of
    /// equal distance, and a fourth derivative of at most so much.
    #[inline(always)]
    fn keeps<S: Simd, const N: usize>(
        &self,
        heights: &Heights,
        inside: &Inside<S>,
        heights_at: &[Lane<S>; N],
        bends: &[Lane<S>; N],
        fourth: Lane<S>,
    ) -> Mask<S> {
        let zero = fourth.with(0.0);
        let step = 1.0 / (N - 1) as f64;
        // A parabola over a step sags by so much of its second derivative, which strays from those at both
        // ends by as much of the fourth.
        let sag = step * step / 8.0;
        let stray = fourth * sag;
        let mut clear = zero.le(zero);
        let mut point = 0;
        while point + 1 < N {
            let ends = [heights_at[point], heights_at[point + 1]];
            let most = bends[point].max(bends[point + 1]) + stray;
            let least = bends[point].min(bends[point + 1]) - stray;
            let slack = [
                most.max(zero) * sag + 2.0 * self.far,
                (-least).max(zero) * sag + 2.0 * self.far,
            ];
            let part = [point as f64 * step, (point + 1) as f64 * step];
            clear = clear & heights.within(ends, slack, inside, part);
            point += 1;
        }
        clear
    }
}

impl Mountain {
    #[inline(always)]
    fn view<S: Simd>(&self, point: Point<S>) -> View<S> {
        let p = (point.x - self.center.x) * self.narrowness.x;
        let q = (point.y - self.center.y) * self.narrowness.y;
        let exponent = p * p + q * q;
        let near = exponent.lt(exponent.with(NEGLIGIBLE));
        let lift = if near.any() {
            near.keep((-near.keep(exponent)).exp() * self.height)
        } else {
            exponent.with(0.0)
        };
        View {
            p,
            q,
            exponent,
            lift,
        }
    }
}
