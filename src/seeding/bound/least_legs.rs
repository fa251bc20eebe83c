//! The least cost of legs that have a minimum length, wherever they lead. The argument is section 7 of docs/BOUND.md.

use super::prices::Prices;
use super::toll::steepest;
use crate::scenario::Scenario;

/// A lower bound for all routes because each leg has a minimum length, and waypoints before the middle of the band cost
/// something: one half of the waypoints counts on the way up from the start, the other on the way down to the target.
pub(super) fn least_legs(scenario: &Scenario, prices: &Prices) -> f64 {
    let legs = Legs {
        metre: prices.fuel,
        shortest: (scenario.vehicle.min_leg - prices.tolerance).max(0.0),
        climb: libm::hypot(steepest(scenario).recip(), 1.0).recip(),
        weight: scenario.weights.altitude,
    };
    let waypoints = scenario.planner.waypoints;
    let [start, target] = prices.middle.off();
    let between = prices.fuel * legs.shortest * waypoints.saturating_sub(1) as f64;
    legs.from(start, waypoints.div_ceil(2)) + between + legs.from(target, waypoints / 2)
}

/// Legs from an end onwards.
struct Legs {
    /// Cost of a metre of leg.
    metre: f64,
    /// Least length of each leg, metres.
    shortest: f64,
    /// Greatest climb per metre of leg, metres.
    climb: f64,
    /// Cost of a metre between a waypoint and the middle of the band.
    weight: f64,
}

impl Legs {
    /// The least cost of the first legs with `waypoints` after them, from an end this far off the middle of the band. A
    /// metre that any leg is longer than necessary brings the most waypoints closer in the first leg; and is worth it
    /// there while it brings enough of them closer.
    fn from(&self, off_middle: f64, waypoints: usize) -> f64 {
        let least = self.shortest * self.climb;
        let off = |first: f64| {
            let offs = (0..waypoints).map(|after| off_middle - first - least * after as f64);
            offs.take_while(|off| *off > 0.0).sum::<f64>()
        };
        let longest = if self.metre < self.weight * self.climb * waypoints as f64 {
            let enough = (self.metre / (self.weight * self.climb)).floor();
            (off_middle / self.climb - enough * self.shortest).max(self.shortest)
        } else {
            self.shortest
        };
        self.metre * longest + self.weight * off(longest * self.climb)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seeding::tests::scenario;

    /// The least cost in units of fuel from 70 m below the middle of the band to 30 m above it, at `weight` per
    /// metre off it, with legs of at least 40 m and climbs of at most 30 degrees.
    fn least(weight: f64, waypoints: usize) -> f64 {
        let mut scenario = scenario(r#""threats": []"#);
        let middle = scenario.altitude.middle();
        (scenario.start.z, scenario.target.z) = (middle - 70.0, middle + 30.0);
        (scenario.vehicle.min_leg, scenario.vehicle.max_climb_deg) = (40.0, 30.0);
        scenario.planner.waypoints = waypoints;
        let prices = Prices::of(&scenario);
        scenario.weights.altitude = weight * prices.fuel;
        least_legs(&scenario, &prices) / prices.fuel
    }

    #[test]
    fn the_first_leg_climbs_as_far_as_it_pays_off() {
        let check = |found: f64, expected: f64| {
            assert!((found - expected).abs() < 1e-3, "{found} {expected}");
        };
        check(least(0.0, 9), 10.0 * 40.0);
        // Each leg brings the next waypoints 20 m closer; four are off the middle, and another metre would
        // bring them closer by half a metre.
        check(
            least(0.1, 9),
            10.0 * 40.0 + 0.1 * (50.0 + 30.0 + 10.0 + 10.0),
        );
        // A longer leg pays for two or more waypoints, but not for one.
        check(least(1.0, 9), 8.0 * 40.0 + 100.0 + 20.0 + 40.0 + 10.0);
        // It pays to have no waypoint off the middle.
        check(least(3.0, 9), 8.0 * 40.0 + 140.0 + 60.0);
        // A single waypoint counts once.
        check(least(1.0, 1), 40.0 + 50.0 + 40.0);
    }

    /// No other leg lengths are cheaper.
    #[test]
    fn no_other_leg_lengths_are_cheaper() {
        for (metre, shortest, weight) in [
            (0.5, 7.0, 0.4),
            (0.5, 7.0, 3.0),
            (1.0, 0.0, 0.3),
            (0.2, 20.0, 0.1),
        ] {
            let legs = Legs {
                metre,
                shortest,
                climb: 0.3,
                weight,
            };
            let least = legs.from(50.0, 4);
            let mut nearest = f64::INFINITY;
            for lengths in 0..12_u32.pow(4) {
                let longer = |leg: u32| 15.0 * f64::from(lengths / 12_u32.pow(leg) % 12);
                let (mut off, mut cost) = (50.0_f64, 0.0);
                for leg in 0..4 {
                    off -= 0.3 * (shortest + longer(leg));
                    let must = if leg == 0 { shortest } else { 0.0 };
                    cost += metre * (must + longer(leg)) + weight * off.max(0.0);
                }
                nearest = nearest.min(cost);
            }
            assert!(
                least <= nearest + 1e-9 && least > nearest - 15.0 * metre,
                "{least} {nearest}"
            );
        }
    }
}
