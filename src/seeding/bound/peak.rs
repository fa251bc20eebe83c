//! The cost of waypoints having to be at the middle of the band, where both ends are below it or above it: the route
//! climbs towards it, or all waypoints stay off it. The argument is section 7 of docs/BOUND.md.

use super::middle::Middle;
use super::toll::{climb_worth, steepest};
use crate::scenario::Scenario;

/// Both ends on one side of the middle of the band.
#[derive(Debug, Clone, Copy)]
pub(super) struct Peak {
    /// Metres between each end and the middle.
    off_middle: [f64; 2],
    /// Cost of a metre by which all waypoints are off the middle.
    weight: f64,
    /// Greatest climb per metre seen from above, metres.
    steepest: f64,
}

impl Peak {
    /// `None` where nothing can be proven: with ends on different sides of the middle, over hills with one above it, or
    /// where heights cost nothing.
    pub(super) fn of(scenario: &Scenario, middle: &Middle) -> Option<Self> {
        let weight = scenario.weights.altitude * scenario.planner.waypoints as f64;
        let is_known =
            middle.below[0] * middle.below[1] > 0.0 && middle.is_known(0) && weight > 0.0;
        is_known.then(|| Self {
            off_middle: middle.off(),
            weight,
            steepest: steepest(scenario),
        })
    }

    /// Least cost of a way that costs at least `across` seen from above, waypoints included, where a metre costs
    /// `fuel`: over all distances off the middle that the waypoint nearest to it may have.
    pub(super) fn least(&self, fuel: f64, across: f64) -> f64 {
        let [one, other] = self.off_middle;
        // Convex in the climb: up to some slope, two more metres are worth having all waypoints one metre closer. Where
        // the way has to be longer for that, each costs the same.
        let share = 0.5 * self.weight / fuel;
        let steep = libm::hypot(self.steepest.recip(), 1.0);
        let best = if share < steep {
            across / fuel * climb_worth(share).min(self.steepest)
        } else {
            f64::INFINITY
        };
        let climbed = best.clamp((one - other).abs(), one + other);
        let off = 0.5 * (one + other - climbed);
        let climbing = fuel * climbed;
        libm::hypot(across.max(climbing / self.steepest), climbing) + self.weight * off
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::super::tests::scenario;
    use super::*;

    /// From 100 m below the middle and back down, with climbs of up to 45 degrees.
    fn peak(weight: f64) -> Peak {
        Peak {
            off_middle: [100.0, 100.0],
            weight,
            steepest: 1.0,
        }
    }

    #[test]
    fn the_climb_to_the_middle_is_made_only_where_it_pays_off() {
        let check = |weight: f64, across: f64, expected: f64| {
            let found = peak(weight).least(0.5, across);
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        };
        check(50.0, 1000.0, libm::hypot(1000.0, 100.0));
        // Ten metres of climb pay off.
        check(0.01, 1000.0, libm::hypot(1000.0, 10.0) + 0.9);
        // No room to climb that high without a longer way.
        check(50.0, 60.0, 100.0 * 2.0_f64.sqrt());
    }

    proptest! {
        /// No route over level ground with waypoints at those heights costs less.
        #[test]
        fn no_climb_and_descent_is_cheaper(
            heights in prop::collection::vec(-40.0..200.0f64, 1..6),
            longer in prop::collection::vec(1.0..4.0f64, 6),
            (ends, weight, climb) in ([-50.0..90.0f64, -50.0..90.0f64], 0.01..3.0f64, 10.0..70.0f64),
        ) {
            let mut scenario = scenario(r#""threats": []"#);
            (scenario.start.z, scenario.target.z) = (ends[0], ends[1]);
            (scenario.altitude.min, scenario.altitude.max) = (0.0, 200.0);
            (scenario.weights.altitude, scenario.planner.waypoints) = (weight, heights.len());
            scenario.vehicle.max_climb_deg = climb;
            let peak = Peak::of(&scenario, &Middle::of(&scenario)).expect("both are below the middle");
            let all: Vec<f64> = [ends[0]].iter().chain(&heights).chain(&ends[1..]).copied().collect();
            let tangent = libm::tan(climb.to_radians());
            let (mut across, mut flown) = (0.0, 0.0);
            for (leg, longer) in all.windows(2).zip(longer) {
                let climbed = (leg[1] - leg[0]).abs();
                let length = climbed / tangent * longer;
                across += length;
                flown += libm::hypot(length, climbed);
            }
            let off: f64 = heights.iter().map(|height| (height - 100.0).abs()).sum();
            let cost = 0.5 * flown + weight * off;
            let least = peak.least(0.5, 0.5 * across);
            prop_assert!(least <= cost * (1.0 + 1e-9), "{least} {cost}");
        }
    }
}
