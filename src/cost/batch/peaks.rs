//! Analytic mountains in lanes: their height at the ends of legs, and proofs that legs keep clear.
//!
//! Along a leg a peak is `g(t) = height e^-x(t)`, `x = e0 + 2 b t + s t^2`, and its second derivative
//! is between `-2 s |g|` and `2 s (2 x - 1) |g|`, the latter at most `2 s |height| 2 e^(-3/2)`. A curve keeps
//! within a step squared, an eighth of it, times such a bound of its chords. The ends of a leg alone
//! prove most legs clear; where they do not, some points between are looked at. At equal steps those
//! need two exponentials, whatever their number: each value is the one before times a ratio, each
//! ratio the one before times `e^(-2 s step^2)`.

use pulp::Simd;

use super::heights::{Breach, Heights, Inside};
use super::leg::{Leg, Point};
use crate::geometry::Point2;
use crate::geometry::lane::{Lane, Mask};
use crate::terrain::{Peak, Peaks};

/// Beyond this exponent a peak no longer lifts the ground, as in the scalar code.
const NEGLIGIBLE: f64 = 50.0;

/// Beyond this one a proof allows for the little that a peak lifts the ground, instead of summing.
const FAR: f64 = 12.0;

/// `e^-FAR`, rounded up.
const FAR_SHARE: f64 = 6.2e-6;

/// The root of [`FAR`], rounded up.
const FAR_SPREADS: f64 = 3.4642;

/// 2 e^(-3/2), rounded up: a Gaussian's greatest upward bend over its greatest downward one.
const UPWARD: f64 = 0.4463;

/// Ratios of samples are not followed beyond this exponent.
const STEEPEST: f64 = 600.0;

/// Up to this exponent of one step, `e^(y / 4)` is at most `1 + y / 4 + (y / 4)^2`.
const WIDEST_STEP: f64 = 5.0;

/// Steps of a leg that its ends do not prove clear.
const STEPS: usize = 8;
const STEP: f64 = 1.0 / STEPS as f64;

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

/// Height above ground between samples: no more than this below or above their chords.
#[derive(Clone, Copy)]
struct Slack<S: Simd> {
    dip: Lane<S>,
    rise: Lane<S>,
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
        let mountain = |peak: &Peak| Mountain {
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

    /// The elevation of the ground at `point`; the same as by `look`.
    #[inline(always)]
    pub(super) fn elevation<S: Simd>(&self, point: Point<S>) -> Lane<S> {
        let mut ground = point.x.with(self.base);
        for peak in &self.peaks {
            ground = ground + peak.view(point).lift;
        }
        ground
    }

    /// Look round from `point`, the end of a leg; the end before becomes its beginning.
    #[inline(always)]
    pub(super) fn look<S: Simd>(&self, point: Point<S>, panorama: &mut Panorama<S>) {
        std::mem::swap(&mut panorama.from, &mut panorama.to);
        panorama.to.clear();
        let mut ground = point.x.with(self.base);
        for peak in &self.peaks {
            let view = peak.view(point);
            ground = ground + view.lift;
            panorama.to.push(view);
        }
        panorama.ground = [panorama.ground[1], ground];
    }

    /// Where a leg is proven to keep within `heights`, and by how much it is seen not to where it is
    /// not; `panorama` is that of its ends.
    #[inline(always)]
    pub(super) fn clear<S: Simd>(
        &self,
        leg: &Leg<S>,
        panorama: &Panorama<S>,
        inside: &Inside<S>,
        heights: &Heights,
    ) -> (Mask<S>, Lane<S>) {
        let clear = self.clear_by_ends(leg, panorama, inside, heights);
        if !(!clear).any() {
            return (clear, leg.splat(0.0));
        }
        let clear = clear | self.clear_by_middle(leg, panorama, inside, heights);
        if !(!clear).any() {
            return (clear, leg.splat(0.0));
        }
        let (by_steps, breach) = self.clear_by_steps(leg, panorama, inside, heights);
        (clear | by_steps, breach)
    }

    /// The ends of the leg, and the chord between them.
    #[inline(always)]
    fn clear_by_ends<S: Simd>(
        &self,
        leg: &Leg<S>,
        panorama: &Panorama<S>,
        inside: &Inside<S>,
        heights: &Heights,
    ) -> Mask<S> {
        let zero = leg.splat(0.0);
        let mut slack = Slack {
            dip: zero,
            rise: zero,
        };
        let mut unclear = zero.lt(zero);
        for (peak, (a, b)) in self
            .peaks
            .iter()
            .zip(panorama.from.iter().zip(&panorama.to))
        {
            let (u, v) = (b.p - a.p, b.q - a.q);
            let bend = u * u + v * v;
            let highest = a.lift.abs().max(b.lift.abs());
            let farthest = a.exponent.max(b.exponent);
            let wide = leg.splat(WIDEST_STEP).lt(bend);
            if wide.any() {
                if leg.may_reach(peak.center, peak.reach) {
                    unclear = unclear | wide;
                } else {
                    slack = slack.with(peak.far());
                }
            }
            let bend = (!wide).keep(bend);
            slack = slack.and(peak.slack(bend, highest, farthest));
        }
        let h0 = leg.a.z - panorama.ground[0];
        let h1 = leg.b.z - panorama.ground[1];
        heights.within([h0, h1], slack.both(), inside, [0.0, 1.0]) & !unclear
    }

    /// The middle of the leg as well. Its exponent is the mean of those of the ends less `s / 4`.
    #[inline(always)]
    fn clear_by_middle<S: Simd>(
        &self,
        leg: &Leg<S>,
        panorama: &Panorama<S>,
        inside: &Inside<S>,
        heights: &Heights,
    ) -> Mask<S> {
        let zero = leg.splat(0.0);
        let mut ground = leg.splat(self.base);
        let mut slack = Slack {
            dip: zero,
            rise: zero,
        };
        let mut unclear = zero.lt(zero);
        for (peak, (a, b)) in self
            .peaks
            .iter()
            .zip(panorama.from.iter().zip(&panorama.to))
        {
            if !leg.may_reach(peak.center, peak.reach) {
                slack = slack.with(peak.far());
                continue;
            }
            let (u, v) = (b.p - a.p, b.q - a.q);
            let bend = (u * u + v * v) * 0.25;
            let exponent = (a.exponent + b.exponent) * 0.5 - bend;
            let near = exponent.lt(leg.splat(NEGLIGIBLE));
            let lift = near.keep((-near.keep(exponent)).exp() * peak.height);
            ground = ground + lift;
            let wide = leg.splat(WIDEST_STEP).lt(bend);
            unclear = unclear | wide;
            let highest = a.lift.abs().max(b.lift.abs()).max(lift.abs());
            let farthest = a.exponent.max(b.exponent);
            slack = slack.and(peak.slack((!wide).keep(bend), highest, farthest));
        }
        let h0 = leg.a.z - panorama.ground[0];
        let h1 = leg.b.z - panorama.ground[1];
        let middle = leg.a.z + leg.dz * 0.5 - ground;
        let slack = slack.both();
        heights.within([h0, middle], slack, inside, [0.0, 0.5])
            & heights.within([middle, h1], slack, inside, [0.5, 1.0])
            & !unclear
    }

    /// Some points of the leg, and the chords between them; with the greatest breach at the points.
    #[inline(always)]
    fn clear_by_steps<S: Simd>(
        &self,
        leg: &Leg<S>,
        panorama: &Panorama<S>,
        inside: &Inside<S>,
        heights: &Heights,
    ) -> (Mask<S>, Lane<S>) {
        let (zero, one) = (leg.splat(0.0), leg.splat(1.0));
        let mut ground = [leg.splat(self.base); STEPS + 1];
        let mut slack = Slack {
            dip: zero,
            rise: zero,
        };
        let mut unclear = one.lt(zero);
        for (peak, (a, b)) in self
            .peaks
            .iter()
            .zip(panorama.from.iter().zip(&panorama.to))
        {
            slack = slack.with(peak.far());
            if !leg.may_reach(peak.center, peak.reach) {
                continue;
            }
            let (u, v) = (b.p - a.p, b.q - a.q);
            let (s, half_slope) = (u * u + v * v, a.p * u + a.q * v);
            let summit = (-half_slope / s).clamp(zero, one);
            let least = a.exponent + (half_slope * 2.0 + s * summit) * summit;
            let near = least.lt(leg.splat(FAR));
            let bend = s * (STEP * STEP);
            let slope = half_slope * (2.0 * STEP);
            let followed = a.exponent.lt(leg.splat(NEGLIGIBLE))
                & slope.abs().le(leg.splat(STEEPEST))
                & bend.le(leg.splat(WIDEST_STEP));
            unclear = unclear | (near & !followed);
            // Other lanes follow a level peak of no height.
            let near = near & followed;
            let (bend, slope) = (near.keep(bend), near.keep(slope));
            let mut value = near.keep(a.lift);
            let mut ratio = (-(slope + bend)).exp();
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
            let farthest = a.exponent.max(b.exponent);
            slack = slack.and(peak.slack(bend, highest, farthest));
        }
        let mut clear = !unclear;
        let mut before = leg.a.z - ground[0];
        let mut seen = Breach::none(zero);
        let mut sample = 0;
        while sample < STEPS {
            let (t0, t1) = (STEP * sample as f64, STEP * (sample + 1) as f64);
            let after = leg.a.z + leg.dz * t1 - ground[sample + 1];
            clear = clear & heights.within([before, after], slack.both(), inside, [t0, t1]);
            seen = heights.breach(after, inside, t1, seen);
            before = after;
            sample += 1;
        }
        // What is not followed is not seen.
        (clear, (!unclear).keep(seen.sum()))
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

    /// How far a leg lies from its chords for the sake of this peak, in steps whose squared length
    /// in spreads is `bend`, at most [`WIDEST_STEP`]: `highest` is the greatest of the samples'
    /// lifts, `farthest` no less than the greatest exponent.
    #[inline(always)]
    fn slack<S: Simd>(&self, bend: Lane<S>, highest: Lane<S>, farthest: Lane<S>) -> Slack<S> {
        // Between samples a summit may rise by e^(bend / 4).
        let quarter = bend * 0.25;
        let summit = highest * (quarter * quarter + quarter + 1.0);
        let upward = (summit * (farthest * 2.0 - 1.0).max(bend.with(0.0)))
            .min(bend.with(UPWARD * self.height.abs()));
        let (down, up) = (quarter * summit, quarter * upward);
        // A mountain bends the height above ground the other way round, a pit as itself.
        if self.height > 0.0 {
            Slack {
                dip: down,
                rise: up,
            }
        } else {
            Slack {
                dip: up,
                rise: down,
            }
        }
    }

    /// What it may lift or lower the ground where it is far.
    fn far(&self) -> [f64; 2] {
        let far = FAR_SHARE * self.height;
        [far.max(0.0), (-far).max(0.0)]
    }
}

impl<S: Simd> Slack<S> {
    #[inline(always)]
    fn both(self) -> [Lane<S>; 2] {
        [self.dip, self.rise]
    }

    #[inline(always)]
    fn and(self, other: Self) -> Self {
        Self {
            dip: self.dip + other.dip,
            rise: self.rise + other.rise,
        }
    }

    #[inline(always)]
    fn with(self, [dip, rise]: [f64; 2]) -> Self {
        Self {
            dip: self.dip + dip,
            rise: self.rise + rise,
        }
    }
}
