//! The extra cost of a first or last leg that climbs to the middle of the band, or whose waypoint is off it. The
//! argument is section 7 of docs/BOUND.md.

use super::super::toll::climb_worth;
use super::kind::End;
use super::ramp::{Ramp, Rates};
use super::slopes::Slopes;
use crate::geometry::Point2;

/// Number of lengths of first legs that are distinguished.
const LENGTHS: u32 = 64;

impl End<'_> {
    /// The least extra cost of a leg with one of those `lengths` seen from above, `exposed` if it is the shortest,
    /// beyond its cost seen from above, waypoint included: it climbs, or its waypoint is off the middle.
    pub(super) fn steepness(&self, lengths: [f64; 2], exposed: f64, slopes: Option<Slopes>) -> f64 {
        let told = slopes.map_or(0.0, |slopes| {
            slopes.steepness(lengths, self.rates(exposed), self.height)
        });
        told.max(self.gently(lengths[1], exposed))
            .max(self.out_of_zone(lengths, exposed))
    }

    /// The same for the part before the zone round the other end: the rest is counted for that end.
    pub(super) fn before_other_zone(
        &self,
        [shortest, longest]: [f64; 2],
        exposed: f64,
        slopes: Option<Slopes>,
    ) -> f64 {
        if longest <= self.apart {
            self.steepness([shortest, longest], exposed, slopes)
        } else {
            self.out_of_zone([shortest.min(self.apart), longest], exposed)
        }
    }

    /// The same for a leg that leads out of the zone round the end; 0 where it does not, or there is no zone.
    fn out_of_zone(&self, lengths: [f64; 2], exposed: f64) -> f64 {
        let ramp = self.ramp.filter(|ramp| lengths[0] >= ramp.reach);
        ramp.map_or(0.0, |ramp| {
            ramp.steepness(lengths, self.rates(exposed), self.height, self.steepest)
        })
    }

    fn rates(&self, exposed: f64) -> Rates {
        Rates {
            fuel: self.prices.fuel,
            exposed,
            weight: self.weight,
            beyond: self.beyond,
        }
    }

    /// The same for a leg that may climb as gently as it likes; falls with `length`.
    pub(super) fn gently(&self, length: f64, exposed: f64) -> f64 {
        if length.is_infinite() {
            return 0.0;
        }
        // Climbing lengthens a leg inside soft zones as it does outside.
        let dearer = if length > 0.0 { exposed / length } else { 0.0 };
        let (w, weight) = (self.prices.fuel + dearer, self.weight);
        // Flown with the slope at which a metre of climb costs as much as a metre off the middle.
        let slope = climb_worth(weight / w).min(self.steepest);
        let climbed = (length * slope).min(self.height);
        let slant = (length * length + climbed * climbed).sqrt();
        (w * (slant - length) + weight * (self.height - climbed)).max(0.0)
    }

    /// The least extra cost of leaving the zone round the end, first waypoint included, beyond the cost seen from
    /// above, if a potential rises on that way by at most its fuel and `more`; 0 where there is no zone.
    pub(super) fn leaving(&self, more: f64) -> f64 {
        let Some(ramp) = self.ramp else {
            return 0.0;
        };
        let within = self.beginning(&ramp, ramp.reach, self.prices.fuel * ramp.reach + more);
        let run = ramp.run(self.height);
        let cut = |idx: u32| ramp.reach + (run - ramp.reach) * f64::from(idx) / f64::from(LENGTHS);
        let ranges = (0..LENGTHS).map(|idx| [cut(idx), cut(idx + 1)]);
        let farther = ranges.chain([[run, f64::INFINITY]]);
        farther
            .map(|lengths| self.before_other_zone(lengths, 0.0, None))
            .fold(within, f64::min)
    }

    /// The extra cost of the way out of the zone beyond that `rise`, with a first waypoint after at most `longest`
    /// metres, which may be beyond the zone.
    pub(super) fn beginning(&self, ramp: &Ramp, longest: f64, rise: f64) -> f64 {
        let is_within = longest <= ramp.reach;
        let rates = Rates {
            fuel: self.prices.fuel,
            exposed: 0.0,
            weight: if is_within { self.weight } else { 0.0 },
            beyond: 0.0,
        };
        ramp.leaving(rise, rates, self.height, longest * self.steepest)
    }

    /// The approximate least extra cost of a leg to any of the places along a string, beyond the cost of the string up
    /// to there.
    pub(super) fn climbing_along(&self, string: impl Iterator<Item = (Point2, f64)>) -> f64 {
        let reach = self.reach();
        let near = string.filter(|(at, _)| (at - self.from).norm() <= reach);
        let more = near.map(|(at, paid)| self.leg_to(at) - paid);
        more.fold(f64::INFINITY, f64::min).max(0.0)
    }

    /// The length from which on a leg that is `exposed` costs at most this `steepness` for climbing gently, which must
    /// not be 0.
    pub(super) fn length_of(&self, steepness: f64, exposed: f64) -> f64 {
        let (mut low, mut high) = (0.0, (self.to - self.from).norm());
        while self.gently(high, exposed) > steepness && high < 1e12 {
            (low, high) = (high, 2.0 * high);
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.gently(middle, exposed) > steepness {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }
}

#[cfg(test)]
mod tests {
    use super::super::kind::tests::check;

    #[test]
    fn a_short_leg_climbs_no_steeper_than_allowed() {
        check(|end| {
            let root = 2.0_f64.sqrt();
            assert!((end.gently(0.0, 0.0) - 100.0).abs() < 1e-9);
            assert!((end.gently(40.0, 0.0) - (20.0 * (root - 1.0) + 60.0)).abs() < 1e-9);
            assert!((end.gently(100.0, 0.0) - 50.0 * (root - 1.0)).abs() < 1e-9);
            assert!(end.gently(1000.0, 0.0) < 2.5 && end.gently(f64::INFINITY, 0.0) == 0.0);
            assert!((end.gently(end.length_of(33.0, 0.0), 0.0) - 33.0).abs() < 1e-6);
        });
    }

    #[test]
    fn climbing_costs_more_in_soft_zones() {
        check(|end| {
            // A metre costs 2 instead of 0.5, so the leg climbs until another metre of climb costs as much as a
            // metre off the middle.
            let climbed = 100.0 / 3.0_f64.sqrt();
            let slant = (1e4 + climbed * climbed).sqrt();
            let expected = 2.0 * (slant - 100.0) + 100.0 - climbed;
            assert!((end.gently(100.0, 150.0) - expected).abs() < 1e-9);
            assert!(end.gently(100.0, 150.0) > 3.0 * end.gently(100.0, 0.0));
            let length = end.length_of(33.0, 150.0);
            assert!((end.gently(length, 150.0) - 33.0).abs() < 1e-6);
        });
    }
}
