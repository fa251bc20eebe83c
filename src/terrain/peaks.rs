//! Analytic mountains.
//!
//! Along a leg each peak is a Gaussian of the way flown, whose second derivative is bounded, so
//! that a leg's least and greatest height above them is found by branch and bound, to a micrometre.

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
    /// Of the summit.
    pub center: Point2,
    /// Above the base, metres.
    pub height: f64,
    /// `(sx, sy)`, metres, each > 0.
    pub spread: Point2,
}

/// Extremes are found to this many metres.
const ACCURACY: f64 = 1e-6;

/// How far they reach beyond a band, to this many: a tenth of what heights over peaks may be missed by.
const BAND_ACCURACY: f64 = 1e-4;

/// Beyond this exponent a peak no longer lifts the ground: e^-50 of it is less than 10^-21.
const NEGLIGIBLE: f64 = 50.0;

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
        let everything = HeightRange {
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
        };
        self.search(leg, window, everything, |_| ACCURACY)
    }

    /// As `height_range`, but only where it reaches beyond `band`, to 0.1 mm, or to the share
    /// `rough` of how far that is.
    pub(super) fn height_range_beyond(
        &self,
        leg: &Segment,
        window: (f64, f64),
        band: HeightRange,
        rough: f64,
    ) -> HeightRange {
        self.search(leg, window, band, |range| {
            let beyond = (band.min - range.min).max(range.max - band.max);
            BAND_ACCURACY.max(rough * beyond)
        })
    }

    /// Branch and bound for the extremes beyond `band`, as accurate as what is found asks for.
    fn search(
        &self,
        leg: &Segment,
        (t0, t1): (f64, f64),
        band: HeightRange,
        accuracy: impl Fn(HeightRange) -> f64,
    ) -> HeightRange {
        let profile = self.profile(leg);
        let (h0, h1) = (profile.at(t0), profile.at(t1));
        let mut range = HeightRange {
            min: h0.min(h1),
            max: h0.max(h1),
        };
        let mut open = vec![(t0, h0, t1, h1)];
        while let Some((t0, h0, t1, h1)) = open.pop() {
            // A curve keeps within bend * width^2 / 8 of its chord.
            let slack = profile.bend(t0, t1) * (t1 - t0) * (t1 - t0) / 8.0;
            let accuracy = accuracy(range);
            let may_dip = h0.min(h1) - slack < range.min.min(band.min) - accuracy;
            let may_rise = h0.max(h1) + slack > range.max.max(band.max) + accuracy;
            if (may_dip || may_rise) && slack > accuracy {
                let middle = 0.5 * (t0 + t1);
                let height = profile.at(middle);
                range = range.join(HeightRange {
                    min: height,
                    max: height,
                });
                open.push((t0, h0, middle, height));
                open.push((middle, height, t1, h1));
            }
        }
        range
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
            let offset = p * p + q * q - sharpness * summit * summit;
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

    /// An upper bound of the second derivative over `[t0, t1]`.
    fn bend(&self, t0: f64, t1: f64) -> f64 {
        self.bumps.iter().map(|bump| bump.bend(t0, t1)).sum()
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

    /// With x = sharpness * away^2 the second derivative is 2 sharpness (2x - 1) height e^-x: at
    /// most 2 sharpness height, and falling in size beyond x = 3/2.
    fn bend(&self, t0: f64, t1: f64) -> f64 {
        let away = self.summit - self.summit.clamp(t0, t1);
        let x = self.sharpness * away * away;
        let factor = FALL
            .iter()
            .rfind(|(from, _)| x >= *from)
            .map_or(1.0, |(_, factor)| *factor);
        2.0 * self.sharpness * self.height.abs() * factor
    }
}

/// Values of (2x - 1) e^-x, rounded up: a bound for every x from there on, without an exponential.
const FALL: [(f64, f64); 6] = [
    (1.5, 0.4463),
    (3.0, 0.2490),
    (5.0, 0.0607),
    (8.0, 0.005_04),
    (12.0, 1.42e-4),
    (20.0, 8.04e-8),
];

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

    proptest! {
        #[test]
        fn the_range_holds_every_sample_and_is_reached(
            x0 in 0.0..1000.0f64, y0 in 0.0..1000.0f64, x1 in 0.0..1000.0f64, y1 in 0.0..1000.0f64,
            z0 in 0.0..300.0f64, z1 in 0.0..300.0f64, t0 in 0.0..0.5f64, t1 in 0.5..1.0f64,
        ) {
            let peaks = range_of_hills();
            let leg = Segment { a: Point3::new(x0, y0, z0), b: Point3::new(x1, y1, z1) };
            let range = peaks.height_range(&leg, (t0, t1));
            let mut seen = HeightRange::EMPTY;
            for i in 0..=8000 {
                let point = leg.at(t0 + (t1 - t0) * f64::from(i) / 8000.0);
                let height = point.z - peaks.elevation(point.xy());
                seen = seen.join(HeightRange { min: height, max: height });
            }
            prop_assert!(range.min <= seen.min + 2e-6 && range.max >= seen.max - 2e-6, "{range:?} {seen:?}");
            prop_assert!(seen.min - range.min < 0.05 && range.max - seen.max < 0.05, "{range:?} {seen:?}");
            let band = HeightRange { min: 20.0, max: 250.0 };
            let beyond = peaks.height_range_beyond(&leg, (t0, t1), band, 0.0);
            prop_assert!(((band.min - beyond.min).max(0.0) - (band.min - range.min).max(0.0)).abs() < 2e-4);
            prop_assert!(((beyond.max - band.max).max(0.0) - (range.max - band.max).max(0.0)).abs() < 2e-4);
        }
    }
}
