//! How low and how high a stretch of a leg runs above analytic mountains, in lanes.
//!
//! At equal steps a peak's `g(t) = height e^-(e0 + 2 b t + s t^2)` needs three exponentials, whatever
//! their number: each value is the one before times a ratio, each ratio the one before times
//! `e^(-2 s step^2)`. With the second derivative at both ends of a step, and a bound of the fourth,
//! it lies between two parabolas. Most steps are thereby proven to hold no extreme; the lowest sample
//! lies, nearly always, on a step or two proven to be bent one way only, and there Newton's method
//! ends where the scalar code ends. Where it does not, the stretch is left to the scalar code.

use pulp::Simd;

use super::leg::Point;
use super::peaks::{Massif, Mountain};
use crate::geometry::lane::{Lane, Mask};
use crate::terrain::NEGLIGIBLE;

/// Samples of a stretch.
const SAMPLES: usize = 9;
const STEP: f64 = 1.0 / (SAMPLES - 1) as f64;

/// Greatest squared length of a stretch in spreads of a peak near it.
pub(super) const WIDEST: f64 = 8.0;

/// `e^(WIDEST STEP^2 / 4)`, rounded up: how much higher a summit may be than the nearest sample.
const BETWEEN: f64 = 1.032;

/// An extreme is taken as found when it is proven to lie no farther off, metres; Newton's last step
/// then brings it a thousand times nearer.
const CERTAIN: f64 = 1e-8;

/// A step may hold an extreme when it may go beyond the others by more, metres.
const ACCURACY: f64 = 1e-10;

/// Newton's steps after which a stretch is left to the scalar code.
const MOST_STEPS: usize = 6;

/// A part of a leg over which the same heights are allowed.
#[derive(Clone, Copy)]
pub(super) struct Stretch<S: Simd> {
    /// Where it begins.
    pub(super) from: Point<S>,
    /// The way to its end.
    pub(super) way: Point<S>,
    pub(super) floor: Lane<S>,
    pub(super) ceiling: Lane<S>,
}

/// How far it reaches below its floor and above its ceiling, each >= 0.
pub(super) struct Beyond<S: Simd> {
    pub(super) below: Lane<S>,
    pub(super) above: Lane<S>,
    /// Where the result is not known.
    pub(super) unknown: Mask<S>,
}

/// A peak along a stretch: `height e^-(exponent + 2 half_slope t + bend t^2)`; of no height where it
/// is too far away to lift the ground.
#[derive(Clone, Copy)]
pub(super) struct Course<S: Simd> {
    height: Lane<S>,
    exponent: Lane<S>,
    half_slope: Lane<S>,
    bend: Lane<S>,
}

/// A stretch and the peaks along it.
struct Along<'a, S: Simd> {
    base: f64,
    stretch: &'a Stretch<S>,
    courses: &'a [Course<S>],
}

/// Height above ground at the samples, its second derivative, and how far this may lie beyond those
/// of both ends of a step between them.
struct Samples<S: Simd> {
    heights: [Lane<S>; SAMPLES],
    bends: [Lane<S>; SAMPLES],
    stray: Lane<S>,
}

/// The steps next to the lowest sample on which there may be something lower.
struct Bracket<S: Simd> {
    /// The lowest sample, and its number.
    least: Lane<S>,
    at: Lane<S>,
    /// Numbers of the samples between which the search goes on.
    low: Lane<S>,
    high: Lane<S>,
    /// A lower bound of the second derivative there, > 0.
    bend: Lane<S>,
    open: Mask<S>,
    unknown: Mask<S>,
}

/// Height above ground, first and second derivative.
struct Jet<S: Simd> {
    height: Lane<S>,
    slope: Lane<S>,
    bend: Lane<S>,
}

impl Massif {
    /// How far `stretch` reaches beyond its limits. What is less than `overlooked` may be taken for
    /// nothing, and what is more than `surely` for as little as is seen of it. `courses` is scratch.
    #[inline(always)]
    pub(super) fn beyond<S: Simd>(
        &self,
        stretch: &Stretch<S>,
        overlooked: f64,
        surely: f64,
        courses: &mut Vec<Course<S>>,
    ) -> Beyond<S> {
        let (samples, too_wide) = self.samples(stretch, courses);
        let zero = stretch.floor.with(0.0);
        let along = Along {
            base: self.base(),
            stretch,
            courses,
        };
        let (low, low_unknown) = samples.lowest(1.0, stretch.floor, [overlooked, surely], &along);
        let (high, high_unknown) =
            samples.lowest(-1.0, -stretch.ceiling, [overlooked, surely], &along);
        Beyond {
            below: (stretch.floor - low).max(zero),
            above: (-stretch.ceiling - high).max(zero),
            unknown: too_wide | low_unknown | high_unknown,
        }
    }

    /// The samples, and where a peak is too narrow for them.
    #[inline(always)]
    fn samples<S: Simd>(
        &self,
        stretch: &Stretch<S>,
        courses: &mut Vec<Course<S>>,
    ) -> (Samples<S>, Mask<S>) {
        let (from, way) = (&stretch.from, &stretch.way);
        let zero = from.x.with(0.0);
        let half = (way.x * way.x + way.y * way.y).sqrt() * 0.5;
        let middle = [from.x + way.x * 0.5, from.y + way.y * 0.5];
        let mut ground = [zero.with(self.base()); SAMPLES];
        let mut bends = [zero; SAMPLES];
        let mut fourth = zero;
        let mut too_wide = zero.lt(zero);
        courses.clear();
        let mut peak_idx = 0;
        while peak_idx < self.peaks.len() {
            let peak = &self.peaks[peak_idx];
            peak_idx += 1;
            let away = [middle[0] - peak.center.x, middle[1] - peak.center.y];
            let reach = half + peak.end;
            let near = (away[0] * away[0] + away[1] * away[1]).le(reach * reach);
            if !near.any() {
                continue;
            }
            let (course, least, wide) = peak.course(stretch, near);
            too_wide = too_wide | wide;
            let first = course.half_slope * (2.0 * STEP);
            let square = course.bend * (STEP * STEP);
            let mut value = course.height * (-course.exponent).exp();
            let mut ratio = (-(first + square)).exp();
            let change = (square * -2.0).exp();
            let twice = course.bend * 2.0;
            let mut steepness = course.half_slope * 2.0;
            let steeper = twice * STEP;
            let mut highest = value.abs();
            let mut sample = 0;
            loop {
                ground[sample] = ground[sample] + value;
                bends[sample] = bends[sample] + value * (twice - steepness * steepness);
                if sample + 1 == SAMPLES {
                    break;
                }
                sample += 1;
                value = value * ratio;
                ratio = ratio * change;
                steepness = steepness + steeper;
                highest = highest.max(value.abs());
            }
            // With x the exponent, the fourth derivative is 4 s^2 (4 x^2 - 12 x + 3) e^-x of the height:
            // of the greatest value no more than 12 + 16 x^2 times s^2, x that of this value.
            let share = least * least * 16.0 + 12.0;
            fourth = fourth + course.bend * course.bend * highest * share;
            courses.push(course);
        }
        let mut heights = ground;
        let mut sample = 0;
        while sample < SAMPLES {
            heights[sample] = from.z + way.z * (STEP * sample as f64) - ground[sample];
            sample += 1;
        }
        let samples = Samples {
            heights,
            bends,
            stray: fourth * (BETWEEN * STEP * STEP / 8.0),
        };
        (samples, too_wide)
    }
}

impl Mountain {
    /// Along `stretch` where it is `near`; its least exponent there, and where it is too narrow.
    #[inline(always)]
    fn course<S: Simd>(
        &self,
        stretch: &Stretch<S>,
        near: Mask<S>,
    ) -> (Course<S>, Lane<S>, Mask<S>) {
        let zero = stretch.floor.with(0.0);
        let p = (stretch.from.x - self.center.x) * self.narrowness.x;
        let q = (stretch.from.y - self.center.y) * self.narrowness.y;
        let (u, v) = (
            stretch.way.x * self.narrowness.x,
            stretch.way.y * self.narrowness.y,
        );
        let (bend, half_slope) = (u * u + v * v, p * u + q * v);
        let exponent = p * p + q * q;
        let summit = (-half_slope / bend).clamp(zero, zero.with(1.0));
        let least = exponent + (half_slope * 2.0 + bend * summit) * summit;
        let near = near & least.lt(zero.with(NEGLIGIBLE));
        let wide = near & zero.with(WIDEST).lt(bend);
        let near = near & bend.le(zero.with(WIDEST));
        let course = Course {
            height: near.keep(zero.with(self.height)),
            exponent: near.keep(exponent),
            half_slope: near.keep(half_slope),
            bend: near.keep(bend),
        };
        (course, near.keep(least), wide)
    }
}

impl<S: Simd> Along<'_, S> {
    /// At `t`.
    #[inline(always)]
    fn jet(&self, t: Lane<S>) -> Jet<S> {
        let Stretch { from, way, .. } = self.stretch;
        let mut jet = Jet {
            height: from.z + way.z * t - self.base,
            slope: way.z,
            bend: t.with(0.0),
        };
        let mut course_idx = 0;
        while course_idx < self.courses.len() {
            let course = &self.courses[course_idx];
            course_idx += 1;
            let along = course.bend * t;
            let exponent = course.exponent + (course.half_slope * 2.0 + along) * t;
            let value = course.height * (-exponent).exp();
            let steepness = (course.half_slope + along) * 2.0;
            jet.height = jet.height - value;
            jet.slope = jet.slope + value * steepness;
            jet.bend = jet.bend + value * (course.bend * 2.0 - steepness * steepness);
        }
        jet
    }
}

/// Each of `lanes` times `factor`.
#[inline(always)]
fn times<S: Simd, const N: usize>(mut lanes: [Lane<S>; N], factor: f64) -> [Lane<S>; N] {
    let mut idx = 0;
    while idx < N {
        lanes[idx] = lanes[idx] * factor;
        idx += 1;
    }
    lanes
}

impl<S: Simd> Samples<S> {
    /// The least height, of those turned round by `sign`, or something above `limit` less `overlooked` if it
    /// is, or something below that less `surely`; and where it is not known.
    #[inline(always)]
    fn lowest(
        &self,
        sign: f64,
        limit: Lane<S>,
        [overlooked, surely]: [f64; 2],
        along: &Along<S>,
    ) -> (Lane<S>, Mask<S>) {
        let bar = limit - overlooked;
        let (heights, bends) = (times(self.heights, sign), times(self.bends, sign));
        let (mut least, mut most, mut sample) = (heights[0], bends[0], 1);
        while sample < SAMPLES {
            (least, most) = (least.min(heights[sample]), most.max(bends[sample]));
            sample += 1;
        }
        // Below its lower end a parabola sags by no more than an eighth of its bend.
        let sag = (most + self.stray).max(bar.with(0.0)) * (STEP * STEP / 8.0);
        let sure = least.lt(limit - surely);
        if !((least - sag).lt(bar) & !sure).any() {
            return (least, bar.lt(bar));
        }
        let bracket = self.bracket(&heights, &bends, bar);
        let unknown = bracket.unknown & !sure;
        let (mut least, mut open) = (bracket.least, bracket.open & !bracket.unknown & !sure);
        if !open.any() {
            return (least, unknown);
        }
        let (low, high) = (bracket.low * STEP, bracket.high * STEP);
        let mut t = (bracket.start(&heights) * STEP).clamp(low, high);
        let mut step = 0;
        while step < MOST_STEPS && open.any() {
            step += 1;
            let jet = along.jet(t);
            let (slope, bend) = (jet.slope * sign, jet.bend * sign);
            let (zero, square) = (slope.with(0.0), slope * slope);
            let at_end = (t.le(low) & zero.le(slope)) | (high.le(t) & slope.le(zero));
            let found = at_end | square.le(bracket.bend * (2.0 * CERTAIN));
            let height = jet.height * sign - at_end.select(zero, square / bend * 0.5);
            least = (open & found).select(least.min(height), least);
            open = open & !found;
            t = (t - slope / bend).clamp(low, high);
        }
        (least, unknown | open)
    }

    #[inline(always)]
    fn bracket(
        &self,
        heights: &[Lane<S>; SAMPLES],
        bends: &[Lane<S>; SAMPLES],
        bar: Lane<S>,
    ) -> Bracket<S> {
        let (mut least, mut at) = (heights[0], bar.with(0.0));
        let mut sample = 1;
        while sample < SAMPLES {
            let lower = heights[sample].lt(least);
            least = lower.select(heights[sample], least);
            at = lower.select(bar.with(sample as f64), at);
            sample += 1;
        }
        let bar = least.min(bar) - ACCURACY;
        let never = bar.lt(bar);
        let mut bracket = Bracket {
            least,
            at,
            low: at,
            high: at,
            bend: bar.with(f64::INFINITY),
            open: never,
            unknown: never,
        };
        let mut step = 0;
        while step + 1 < SAMPLES {
            let (first, last) = (heights[step], heights[step + 1]);
            let most = bends[step].max(bends[step + 1]) + self.stray;
            // Below the lower end a parabola sags by (k - d)^2 / 4k, k its bend and d its way, so by no
            // more than a quarter of k - d.
            let spare = (most * (0.5 * STEP * STEP) - (last - first).abs()).max(bar.with(0.0));
            let open = (first.min(last) - spare * 0.25).lt(bar);
            if open.any() {
                bracket.widen(step, open, bends[step].min(bends[step + 1]) - self.stray);
            }
            step += 1;
        }
        bracket
    }
}

impl<S: Simd> Bracket<S> {
    /// By `step` where it is `open`, if it is next to the lowest sample and its second derivative,
    /// at least `bend`, positive.
    #[inline(always)]
    fn widen(&mut self, step: usize, open: Mask<S>, bend: Lane<S>) {
        let (before, after) = (bend.with(step as f64), bend.with((step + 1) as f64));
        let left = self.at.le(after) & after.le(self.at);
        let right = self.at.le(before) & before.le(self.at);
        let good = open & (left | right) & bend.with(0.0).lt(bend);
        self.low = (good & left).select(before, self.low);
        self.high = (good & right).select(after, self.high);
        self.bend = good.select(self.bend.min(bend), self.bend);
        self.open = self.open | good;
        self.unknown = self.unknown | (open & !good);
    }

    /// Where to begin: the vertex of the parabola through the lowest sample and its neighbours.
    #[inline(always)]
    fn start(&self, heights: &[Lane<S>; SAMPLES]) -> Lane<S> {
        let zero = self.at.with(0.0);
        let (mut start, mut sample) = (self.at, 1);
        while sample + 1 < SAMPLES {
            let (before, here) = (heights[sample - 1], heights[sample]);
            let after = heights[sample + 1];
            let number = zero.with(sample as f64);
            let vertex = number + (before - after) / ((before - here * 2.0 + after) * 2.0);
            let chosen = self.at.le(number) & number.le(self.at);
            start = chosen.select(vertex, start);
            sample += 1;
        }
        start
    }
}
