//! How a first or last leg climbs, where that decides which threats it leads over or under: passable threats are in its
//! way while it is at their heights. The argument is section 7 of docs/BOUND.md.

use super::ramp::{Rates, climbing};

/// Number of parts into which slopes towards the middle of the band, and those away from it, are divided.
const PARTS: [usize; 2] = [8, 3];

/// How many times as steep one part is as the next.
const RATIO: f64 = 1.7;

/// Slopes beyond this are not distinguished.
const STEEP: f64 = 2.0;

/// Climb of legs per metre seen from above, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slopes {
    /// Towards the middle of the band, or away from it.
    is_towards: bool,
    least: f64,
    most: f64,
}

impl Slopes {
    /// All up to the `steepest` either way, in parts.
    pub(super) fn parts(steepest: f64) -> Vec<Self> {
        let mut parts = Vec::new();
        for (is_towards, count) in [true, false].into_iter().zip(PARTS) {
            let (mut least, mut most) = (steepest.min(STEEP), steepest);
            for idx in 0..=count {
                parts.push(Self {
                    is_towards,
                    least,
                    most,
                });
                most = least;
                least = if idx + 1 < count { least / RATIO } else { 0.0 };
            }
        }
        parts.retain(|part| part.least < part.most);
        parts
    }

    /// Whether a leg that climbs this many metres towards the middle of the band per metre seen from above is one of
    /// them.
    #[cfg(test)]
    pub(super) fn hold(&self, slope: f64) -> bool {
        self.is_towards == (slope >= 0.0) && (self.least..=self.most).contains(&slope.abs())
    }

    /// The range, metres seen from above, in which every such leg is at the heights of a threat: these end `towards`
    /// metres towards the middle of the band from where the leg begins, and `away` metres away from it; negative where
    /// it begins beyond them.
    pub(super) fn at_heights(&self, [towards, away]: [f64; 2]) -> [f64; 2] {
        let (ahead, behind) = if self.is_towards {
            (towards, away)
        } else {
            (away, towards)
        };
        let from = if behind > 0.0 {
            0.0
        } else {
            -behind / self.least
        };
        let to = if ahead > 0.0 { ahead / self.most } else { 0.0 };
        [from, to]
    }

    /// The least extra cost of a leg with a length seen from above in `lengths`, beyond its cost seen from above,
    /// waypoint included, from `height` metres off the middle of the band.
    pub(super) fn steepness(&self, lengths: [f64; 2], rates: Rates, height: f64) -> f64 {
        if self.is_towards {
            return climbing([self.least, self.most], lengths, rates, height);
        }
        let whole = rates.fuel * lengths[0] + rates.exposed;
        let slant = (1.0 + self.least * self.least).sqrt() - 1.0;
        whole * slant + rates.weight * (height + self.least * lengths[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_slope_belongs_to_a_part() {
        for steepest in [0.3, 1.0, 2.0, 11.4, 1.6e16] {
            let parts = Slopes::parts(steepest);
            assert!(parts.len() > 8 && parts.iter().all(|part| part.least < part.most));
            for idx in -50..=50 {
                let slope = steepest * f64::from(idx) / 50.0;
                assert!(parts.iter().any(|part| part.hold(slope)), "{slope}");
                assert!(parts.iter().any(|part| part.hold(1e-3 * slope)), "{slope}");
            }
        }
    }

    /// A leg that climbs by a fifth to a fourth: below a top 20 m up, above a base 10 m down, or entering from 10 m
    /// below a base.
    #[test]
    fn a_threat_counts_only_where_every_leg_is_at_its_heights() {
        let slopes = Slopes {
            is_towards: true,
            least: 0.2,
            most: 0.25,
        };
        let level = Slopes {
            least: 0.0,
            ..slopes
        };
        let away = Slopes {
            is_towards: false,
            ..slopes
        };
        let far = f64::INFINITY;
        for (slopes, heights, from, to) in [
            (slopes, [20.0, 10.0], 0.0, 80.0),
            (slopes, [20.0, -10.0], 50.0, 80.0),
            (slopes, [-20.0, 40.0], 0.0, 0.0),
            (level, [far, 10.0], 0.0, far),
            (level, [20.0, -10.0], far, 80.0),
            (away, [20.0, 10.0], 0.0, 40.0),
        ] {
            let answered = slopes.at_heights(heights).map(f64::to_bits);
            assert_eq!(answered, [from, to].map(f64::to_bits), "{heights:?}");
        }
    }
}
