//! Analytic mountains.
//!
//! Along a leg each peak is a Gaussian of the distance flown. Bounds of the second derivative show which parts of a
//! leg may contain its lowest or highest point. Those parts are halved until their curvature has one sign; there
//! Newton's method finds the extreme, to a nanometre.

use super::HeightRange;
use crate::geometry::{LEVEL, Point2, Segment};

/// Mountains `base + sum height * exp(-(dx/sx)^2 - (dy/sy)^2)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Peaks {
    /// Elevation far from every peak, metres.
    pub base: f64,
    /// In the order of the request.
    pub peaks: Vec<Peak>,
}

/// One mountain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Position of the summit.
    pub center: Point2,
    /// Height above the base, metres.
    pub height: f64,
    /// `(sx, sy)`, metres, each > 0.
    pub spread: Point2,
}

/// Accuracy of extremes, metres.
const ACCURACY: f64 = 1e-9;

/// Beyond this exponent a peak no longer raises the ground: e^-36 of its height is below rounding.
pub(crate) const NEGLIGIBLE: f64 = 36.0;

/// Steepest slope of `exp(-x^2)`, sqrt(2 / e), rounded up.
const STEEPEST: f64 = 0.857_763_885;

/// Most Newton steps for an extreme; six nearly always suffice.
const MOST_STEPS: usize = 60;

/// One peak along a leg: `height * exp(-sharpness * (t - summit)^2)`.
struct Bump {
    height: f64,
    sharpness: f64,
    summit: f64,
}

/// Height above ground along a leg.
struct Profile {
    z0: f64,
    rise: f64,
    bumps: Vec<Bump>,
}

impl Peaks {
    pub(super) fn elevation(&self, point: Point2) -> f64 {
        self.base + self.peaks.iter().map(|peak| peak.at(point)).sum::<f64>()
    }

    pub(super) fn height_range(&self, leg: &Segment, window: (f64, f64)) -> HeightRange {
        self.height_range_beyond(leg, window, HeightRange::EMPTY)
    }

    /// As `height_range`, but exact only where it exceeds `band`: branch and bound until the curvature of a part has
    /// one sign, then Newton's method.
    pub(super) fn height_range_beyond(
        &self,
        leg: &Segment,
        (t0, t1): (f64, f64),
        band: HeightRange,
    ) -> HeightRange {
        let middle = self.height(leg, 0.5 * (t0 + t1));
        let change = 0.5 * (t1 - t0) * self.most_change(leg) + ACCURACY;
        if band.min + change < middle && middle + change < band.max {
            return HeightRange::of(middle);
        }
        let profile = self.profile(leg);
        let (h0, h1) = (profile.at(t0), profile.at(t1));
        let mut range = HeightRange::of(h0).join(HeightRange::of(h1));
        let mut open = vec![(t0, h0, t1, h1)];
        while let Some((t0, h0, t1, h1)) = open.pop() {
            let bend = profile.bend(t0, t1);
            let (way, half_square) = (h1 - h0, 0.5 * (t1 - t0) * (t1 - t0));
            let lowest = h0.min(h1) - sag(way, bend.max * half_square);
            let highest = h0.max(h1) + sag(way, -bend.min * half_square);
            let may_dip = lowest < range.min.min(band.min) - ACCURACY;
            let may_rise = highest > range.max.max(band.max) + ACCURACY;
            if !may_dip && !may_rise {
                continue;
            }
            if bend.min > 0.0 || bend.max < 0.0 {
                range = range.join(HeightRange::of(profile.extreme(t0, t1)));
                continue;
            }
            let middle = 0.5 * (t0 + t1);
            let height = profile.at(middle);
            range = range.join(HeightRange::of(height));
            open.push((t0, h0, middle, height));
            open.push((middle, height, t1, h1));
        }
        range
    }

    /// Height above ground at `t` of `leg`.
    fn height(&self, leg: &Segment, t: f64) -> f64 {
        let point = leg.at(t);
        point.z - self.elevation(point.xy())
    }

    /// Bound on the change of the height above ground along `leg`, metres.
    fn most_change(&self, leg: &Segment) -> f64 {
        let slopes = self.peaks.iter().map(|peak| {
            let narrow = peak.spread.x.min(peak.spread.y);
            STEEPEST * peak.height.abs() / narrow
        });
        slopes.sum::<f64>() * leg.horizontal_length() + (leg.b.z - leg.a.z).abs()
    }

    fn profile(&self, leg: &Segment) -> Profile {
        let flat = leg.horizontal_length() < LEVEL;
        let bumps = self.peaks.iter().filter_map(|peak| {
            let way = leg.b.xy() - leg.a.xy();
            let from = leg.a.xy() - peak.center;
            let (u, v) = (way.x / peak.spread.x, way.y / peak.spread.y);
            let (p, q) = (from.x / peak.spread.x, from.y / peak.spread.y);
            let sharpness = if flat { 0.0 } else { u * u + v * v };
            let summit = if flat {
                0.0
            } else {
                -(p * u + q * v) / sharpness
            };
            // At the summit, without cancellation.
            let across = p * v - q * u;
            let offset = if flat {
                p * p + q * q
            } else {
                across * across / sharpness
            };
            let off_leg = summit - summit.clamp(0.0, 1.0);
            (offset + sharpness * off_leg * off_leg < NEGLIGIBLE).then(|| Bump {
                height: peak.height * libm::exp(-offset),
                sharpness,
                summit,
            })
        });
        Profile {
            z0: leg.a.z - self.base,
            rise: leg.b.z - leg.a.z,
            bumps: bumps.collect(),
        }
    }
}

impl Peak {
    fn at(&self, point: Point2) -> f64 {
        let (u, v) = (
            (point.x - self.center.x) / self.spread.x,
            (point.y - self.center.y) / self.spread.y,
        );
        let exponent = u * u + v * v;
        if exponent < NEGLIGIBLE {
            self.height * libm::exp(-exponent)
        } else {
            0.0
        }
    }
}

impl Profile {
    fn at(&self, t: f64) -> f64 {
        let ground: f64 = self.bumps.iter().map(|bump| bump.at(t)).sum();
        self.z0 + self.rise * t - ground
    }

    /// First and second derivative.
    fn slope(&self, t: f64) -> (f64, f64) {
        let (mut first, mut second) = (self.rise, 0.0);
        for bump in &self.bumps {
            let (value, steepness) = (bump.at(t), 2.0 * bump.sharpness * (t - bump.summit));
            first += value * steepness;
            second += value * (2.0 * bump.sharpness - steepness * steepness);
        }
        (first, second)
    }

    /// Bounds of the second derivative over `[t0, t1]`.
    fn bend(&self, t0: f64, t1: f64) -> HeightRange {
        let mut sum = HeightRange::of(0.0);
        for bump in &self.bumps {
            let bend = bump.bend(t0, t1);
            sum.min += bend.min;
            sum.max += bend.max;
        }
        sum
    }

    /// The height of the extreme within `[t0, t1]`, over which the second derivative keeps its sign; without an
    /// extreme inside, the height at the flatter end.
    fn extreme(&self, mut t0: f64, mut t1: f64) -> f64 {
        let (slope0, slope1) = (self.slope(t0).0, self.slope(t1).0);
        if slope0 * slope1 >= 0.0 {
            return self.at(if slope0.abs() < slope1.abs() { t0 } else { t1 });
        }
        let mut t = t0 - slope0 * (t1 - t0) / (slope1 - slope0);
        for _ in 0..MOST_STEPS {
            let (slope, bend) = self.slope(t);
            if slope * slope <= ACCURACY * ACCURACY * bend.abs() {
                break;
            }
            if slope * slope0 > 0.0 {
                t0 = t;
            } else {
                t1 = t;
            }
            let next = t - slope / bend;
            t = if t0 < next && next < t1 {
                next
            } else {
                0.5 * (t0 + t1)
            };
        }
        self.at(t)
    }
}

/// How far a curve may dip below the lower of its ends, whose heights differ by `way`, when its second derivative
/// times half the square of its width is at most `bend`.
fn sag(way: f64, bend: f64) -> f64 {
    let spare = bend - way.abs();
    if spare > 0.0 {
        spare * spare / (4.0 * bend)
    } else {
        0.0
    }
}

impl Bump {
    fn at(&self, t: f64) -> f64 {
        let away = t - self.summit;
        let exponent = self.sharpness * away * away;
        if exponent < NEGLIGIBLE {
            self.height * libm::exp(-exponent)
        } else {
            0.0
        }
    }

    /// Bounds of the second derivative of the height above it. With x = sharpness * away^2 that is 2 sharpness height
    /// (1 - 2x) e^-x, which falls from x = 0 to x = 3/2 and rises to 0 beyond.
    fn bend(&self, t0: f64, t1: f64) -> HeightRange {
        let exponent = |t: f64| self.sharpness * (t - self.summit) * (t - self.summit);
        let nearest = exponent(self.summit.clamp(t0, t1));
        if nearest >= NEGLIGIBLE {
            return HeightRange::of(0.0);
        }
        let farthest = exponent(t0).max(exponent(t1));
        let share = |x: f64| HeightRange::of((1.0 - 2.0 * x) * libm::exp(-x));
        let mut shares = share(nearest).join(share(farthest));
        if nearest < 1.5 && farthest > 1.5 {
            shares = shares.join(share(1.5));
        }
        let most = 2.0 * self.sharpness * self.height;
        HeightRange::of(shares.min * most).join(HeightRange::of(shares.max * most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;
    use proptest::prelude::*;

    fn range_of_hills() -> Peaks {
        let peak = |height, x, y, sx, sy| Peak {
            center: Point2::new(x, y),
            height,
            spread: Point2::new(sx, sy),
        };
        Peaks {
            base: 10.0,
            peaks: vec![
                peak(220.0, 350.0, 400.0, 90.0, 70.0),
                peak(-50.0, 500.0, 500.0, 80.0, 20.0),
            ],
        }
    }

    #[test]
    fn the_summit_is_base_and_height() {
        let peaks = Peaks {
            base: 10.0,
            peaks: vec![range_of_hills().peaks[0]],
        };
        assert!((peaks.elevation(Point2::new(350.0, 400.0)) - 230.0).abs() < 1e-12);
        let one_spread = peaks.elevation(Point2::new(440.0, 400.0));
        assert!((one_spread - (10.0 + 220.0 / std::f64::consts::E)).abs() < 1e-9);
    }

    /// Needles, mesas and pits; legs of zero length, vertical legs, and legs across a summit.
    #[test]
    fn extremes_are_found_over_peaks_of_every_size() {
        let check = |spread: f64, height: f64, a: [f64; 3], b: [f64; 3]| {
            let peaks = Peaks {
                base: 0.0,
                peaks: vec![Peak {
                    center: Point2::new(0.0, 0.0),
                    height,
                    spread: Point2::new(spread, spread),
                }],
            };
            let leg = Segment {
                a: Point3::from(a),
                b: Point3::from(b),
            };
            let range = peaks.height_range(&leg, (0.0, 1.0));
            let mut seen = HeightRange::EMPTY;
            let shares = (0..=20_000).map(|i| f64::from(i) / 20_000.0);
            for point in shares.map(|t| leg.at(t)) {
                let height = point.z - peaks.elevation(point.xy());
                seen = seen.join(HeightRange::of(height));
            }
            assert!(range.min <= seen.min + 1e-9 && range.max >= seen.max - 1e-9);
            let between = 1e-4 * height.abs();
            assert!(seen.min - range.min <= between && range.max - seen.max <= between);
        };
        for spread in [1.0, 80.0, 1e4, 1e6] {
            for height in [250.0, -250.0] {
                check(spread, height, [-40.0, 0.0, 100.0], [60.0, 0.0, 120.0]);
                check(spread, height, [-40.0, 0.3, 100.0], [60.0, -0.2, 100.0]);
                check(spread, height, [5.0, 5.0, 100.0], [5.0, 5.0, 120.0]);
                check(spread, height, [5.0, 5.0, 100.0], [5.0, 5.0, 100.0]);
                check(spread, height, [5.0, 5.0, 100.0], [5.0, 5.0 + 1e-10, 100.0]);
            }
        }
    }

    /// The summit is 2 m beside a leg of 1000 km.
    #[test]
    fn a_needle_beside_a_long_leg_keeps_its_height() {
        let needle = Peak {
            center: Point2::new(0.0, 0.0),
            height: 2000.0,
            spread: Point2::new(1.0, 1.0),
        };
        let peaks = Peaks {
            base: 0.0,
            peaks: vec![needle],
        };
        let at = |along: f64| Point3::new(0.6 * along - 1.6, 0.8 * along + 1.2, 100.0);
        let leg = Segment {
            a: at(-3e5),
            b: at(7e5),
        };
        let range = peaks.height_range(&leg, (0.0, 1.0));
        let expected = 100.0 - 2000.0 * libm::exp(-4.0);
        assert!((range.min - expected).abs() < 1e-7, "{range:?} {expected}");
    }

    proptest! {
        #[test]
        fn the_range_holds_every_sample_and_is_reached(
            x0 in 0.0..1000.0f64, y0 in 0.0..1000.0f64, x1 in 0.0..1000.0f64, y1 in 0.0..1000.0f64,
            z0 in 0.0..300.0f64, z1 in 0.0..300.0f64, t0 in 0.0..0.5f64, t1 in 0.5..1.0f64, size in 0..3_usize,
        ) {
            let peaks = range_of_hills();
            let (a, way) = (Point3::new(x0, y0, z0), Point3::new(x1, y1, z1));
            let leg = Segment { a, b: a + (way - a) * [1.0, 0.1, 0.005][size] };
            let range = peaks.height_range(&leg, (t0, t1));
            let mut seen = HeightRange::EMPTY;
            for i in 0..=8000 {
                let point = leg.at(t0 + (t1 - t0) * f64::from(i) / 8000.0);
                let height = point.z - peaks.elevation(point.xy());
                seen = seen.join(HeightRange { min: height, max: height });
            }
            prop_assert!(range.min <= seen.min + 1e-9 && range.max >= seen.max - 1e-9, "{range:?} {seen:?}");
            prop_assert!(seen.min - range.min < 0.05 && range.max - seen.max < 0.05, "{range:?} {seen:?}");
            let band = HeightRange { min: 20.0, max: 250.0 };
            let beyond = peaks.height_range_beyond(&leg, (t0, t1), band);
            prop_assert!(((band.min - beyond.min).max(0.0) - (band.min - range.min).max(0.0)).abs() < 2e-9);
            prop_assert!(((beyond.max - band.max).max(0.0) - (range.max - band.max).max(0.0)).abs() < 2e-9);
        }
    }
}
