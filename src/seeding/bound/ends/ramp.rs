//! A leg that leaves the zone round an end outside the band is in the band from there on: it is as steep as that
//! requires, however long it is. The argument is section 7 of docs/BOUND.md.

use super::super::middle::Middle;
use super::super::toll::climb_worth;
use crate::cost::Tolerance;
use crate::scenario::{AltitudeBand, Scenario};

/// The zone round an end that lies below the band or above it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ramp {
    /// Metres from the end within which a route may be outside the band.
    pub(super) reach: f64,
    /// Least climb towards the band, per metre seen from above, of a leg that leads beyond the zone.
    slope: f64,
}

/// The cost of a metre of leg, and of a metre off the middle of the band.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rates {
    pub(super) fuel: f64,
    /// Cost of the soft zones along the shortest leg.
    pub(super) exposed: f64,
    /// On this side of it, and beyond it.
    pub(super) weight: f64,
    pub(super) beyond: f64,
}

impl Ramp {
    /// For both ends; none where they are within the band, where leaving one zone may be entering the other, or where
    /// the ground may fall away by as much as the band is high.
    pub(super) fn round(scenario: &Scenario, middle: &Middle) -> [Option<Self>; 2] {
        let ends = [scenario.start, scenario.target];
        let heights = ends.map(|end| scenario.terrain.height_of(end));
        let outside = heights.map(|height| beyond(scenario.altitude, height));
        // A hair wider than the real zones.
        let allowed = scenario.vehicle.steepest();
        let reaches = outside.map(|outside| 2.0 * outside / allowed * (1.0 + 1e-9));
        let apart = (scenario.target.xy() - scenario.start.xy()).norm();
        if reaches[0] + reaches[1] >= apart {
            return [None; 2];
        }
        // What is within tolerance counts as within the band.
        let overlooked = 2.0 * Tolerance::of(scenario).height_m;
        [0, 1].map(|end| {
            let out = if middle.is_level {
                outside[end]
            } else {
                outside[end].min(middle.lowest + scenario.altitude.min - ends[end].z)
            };
            let climbed = out - overlooked;
            (climbed > 0.0).then(|| Self {
                reach: reaches[end],
                slope: climbed / reaches[end],
            })
        })
    }

    /// The least extra cost of the way out of the zone, with the first waypoint, beyond the `rise` on it of a potential
    /// that rises by no more than the cost of the way seen from above: at most `highest` metres above the end on that
    /// way, and cheapest at `height`.
    pub(super) fn leaving(&self, rise: f64, rates: Rates, height: f64, highest: f64) -> f64 {
        let Rates { fuel, weight, .. } = rates;
        let across = rise.max(fuel * self.reach);
        // Convex in the climb to the waypoint: climb as long as a metre of climb costs less than a metre off the
        // middle.
        let best = across / fuel * climb_worth(weight / fuel);
        let out = self.reach * self.slope;
        let waypoint = best.max(out).min(height).min(highest);
        let climbed = waypoint.max(out);
        libm::hypot(across, fuel * climbed) - rise + weight * (height - waypoint).max(0.0)
    }

    /// Metres seen from above in which a leg that leaves the zone climbs at least this height.
    pub(super) fn run(&self, height: f64) -> f64 {
        self.reach.max(height / self.slope)
    }

    /// The least extra cost of a leg that leaves the zone, with a length seen from above in `lengths`, beyond its cost
    /// seen from above: from `height` metres off the middle of the band, with at most the `steepest` climb.
    pub(super) fn steepness(
        &self,
        lengths: [f64; 2],
        rates: Rates,
        height: f64,
        steepest: f64,
    ) -> f64 {
        climbing([self.slope, steepest], lengths, rates, height)
    }
}

/// The least extra cost of a leg with a length seen from above in `lengths`, and a slope in `slopes` towards the middle
/// of the band, beyond its cost seen from above: from `height` metres off the middle.
pub(super) fn climbing(
    [gentlest, steepest]: [f64; 2],
    [shortest, longest]: [f64; 2],
    rates: Rates,
    height: f64,
) -> f64 {
    let whole = rates.fuel * shortest + rates.exposed;
    // Convex in the climb: where a climb of all metres costs what it saves off the middle, unless that is reached
    // before, or it must be more.
    let best = climb_worth(rates.weight * longest / whole);
    let climb = best.min(height / longest).max(gentlest).min(steepest);
    let below = if longest.is_finite() {
        height - climb * longest
    } else {
        0.0
    };
    let off_middle = (rates.weight * below).max(rates.beyond * (climb * shortest - height));
    whole * ((1.0 + climb * climb).sqrt() - 1.0) + off_middle.max(0.0)
}

/// Metres outside the band.
fn beyond(band: AltitudeBand, height: f64) -> f64 {
    (band.min - height).max(height - band.max).max(0.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// No leg within those lengths, and no climb that leaves the zone, costs less.
        #[test]
        fn no_leg_out_of_the_zone_is_cheaper_than_stated(
            (shortest, more) in (1.0..500.0f64, prop_oneof![Just(0.0), 0.0..500.0f64, Just(f64::INFINITY)]),
            (length, climb) in (0.0..1.0f64, 0.0..1.0f64),
            (fuel, exposed, weight) in (0.01..2.0f64, prop_oneof![Just(0.0), 0.0..300.0f64], 0.01..3.0f64),
            (height, slope) in (1.0..300.0f64, 0.05..0.6f64),
        ) {
            let longest = shortest + more;
            let ramp = Ramp { reach: 1.0, slope };
            let rates = Rates { fuel, exposed, weight, beyond: weight };
            let steepest = 2.0 * slope;
            let least = ramp.steepness([shortest, longest], rates, height, steepest);
            let length = shortest + length * more.min(2000.0);
            let climb = slope + climb * (steepest - slope);
            let slant = (1.0 + climb * climb).sqrt() - 1.0;
            let cost = (fuel * length + exposed) * slant + weight * (height - climb * length).abs();
            prop_assert!(least <= cost * (1.0 + 1e-12), "{least} {cost}");
        }
    }

    proptest! {
        /// No way out of the zone with a waypoint on it costs less, however the potential rises along it.
        #[test]
        fn no_way_out_with_a_waypoint_is_cheaper_than_stated(
            (reach, slope, off) in (1.0..500.0f64, 0.05..0.6f64, 0.0..200.0f64),
            (at, climb, detour, higher) in (0.0..1.0f64, 0.0..1.0f64, 0.0..200.0f64, 0.0..100.0f64),
            (fuel, weight) in (0.01..2.0f64, prop_oneof![Just(0.0), 0.01..3.0f64]),
            (most, share) in (0.0..3.0f64, 0.0..1.0f64),
        ) {
            let (ramp, rates) = (Ramp { reach, slope }, Rates { fuel, exposed: 0.0, weight, beyond: weight });
            let (out, across) = (reach * slope, reach + detour);
            let (height, rise) = (out + off, most * fuel * reach);
            let (before, highest) = (at * across, at * across * 2.0 * slope);
            let (climbed, left) = (climb * highest, out + higher);
            let least = ramp.leaving(rise, rates, height, highest);
            let flown = libm::hypot(before, climbed) + libm::hypot(across - before, left - climbed);
            let rise = share * rise.min(fuel * across);
            let cost = fuel * flown - rise + weight * (height - climbed).abs();
            prop_assert!(least <= cost + 1e-9 * (1.0 + cost.abs() + rise), "{least} {cost}");
        }
    }

    /// From 60 m below the band, with climbs of 45 degrees: leaving the zone it climbs half a metre per metre,
    /// so it passes the middle, 160 m above, after 320 m.
    #[test]
    fn a_long_leg_overshoots_the_middle() {
        let ramp = Ramp {
            reach: 120.0,
            slope: 0.5,
        };
        let rates = Rates {
            fuel: 0.5,
            exposed: 0.0,
            weight: 1.0,
            beyond: 1.0,
        };
        let cost = |length: f64| ramp.steepness([length, length], rates, 160.0, 1.0);
        let slant = 1.25_f64.sqrt() - 1.0;
        assert!((cost(320.0) - 160.0 * slant).abs() < 1e-9);
        assert!((cost(420.0) - (210.0 * slant + 50.0)).abs() < 1e-9);
        assert!(cost(240.0) > cost(320.0));
        assert!(ramp.steepness([320.0, f64::INFINITY], rates, 160.0, 1.0) <= cost(320.0));
    }
}
