//! The cost of first and last legs, used to shape a potential.

use super::super::potential::{FREE, Lead, Leads};
use super::super::prices::Prices;
use super::super::wall::Wall;
use super::ends;
use super::kind::End;
use super::threats::Climb;
use crate::geometry::Point2;
use crate::scenario::Scenario;

/// Legs are considered up to this multiple of the distance of the steepest climb to the middle of the band.
const RUNS: f64 = 3.0;

/// Legs are considered no farther than this share of the way.
const FARTHEST: f64 = 0.5;

/// The legs from both ends, with the start as origin.
pub(in super::super) fn leads<'a>(
    scenario: &Scenario,
    prices: &'a Prices,
    (walls, radii): (&'a [Wall], &'a [Option<f64>]),
    stop: &'a dyn Fn() -> bool,
) -> Leads<'a> {
    let origin = prices.ends[0].xy().coords;
    let ends = ends(scenario, prices, (walls, radii), stop);
    ends.map_or(FREE, |ends| {
        ends.map(|end| {
            let reach = end.reach();
            // Out of a zone in which it need not be in the band, a route may climb in many legs.
            let matters = end.ramp.is_none() && reach > 0.0;
            matters.then(|| Lead {
                reach,
                cost: Box::new(move |at| end.leg_to(at + origin)),
            })
        })
    })
}

impl End<'_> {
    /// How far legs matter, metres seen from above.
    pub(super) fn reach(&self) -> f64 {
        (RUNS * self.height / self.steepest).min(FARTHEST * self.prices.direct())
    }

    /// The cost of a leg to `at`, waypoint included; infinite where it enters a core.
    pub(super) fn leg_to(&self, at: Point2) -> f64 {
        if self.is_blocked(at, 0.0, Climb::Any) {
            return f64::INFINITY;
        }
        let length = (at - self.from).norm();
        let exposed = self.exposed(at, 0.0, Climb::Any)[0];
        self.prices.fuel * length + exposed + self.steepness([length; 2], exposed, None)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::super::tests::among;
    use super::super::super::{potential, string, widening};
    use super::super::over;
    use super::*;

    /// From 85 m below the middle of the band to 44 m above it, among 36 discs with overlapping soft zones: the
    /// legs at the ends go elsewhere than the cheapest ways seen from above.
    #[test]
    fn a_potential_that_considers_the_first_legs_proves_more() {
        let mut scenario = among((0..36).map(|idx| {
            let (column, row) = (f64::from(idx % 6), f64::from(idx / 6));
            let aside = 40.0 * (row % 2.0);
            [
                100.0 + 150.0 * column + aside,
                120.0 + 140.0 * row,
                35.0,
                90.0,
            ]
        }));
        (scenario.start.z, scenario.target.z) = (15.0, 144.0);
        let prices = Prices::of(&scenario);
        let walls = widening::walls(&scenario, &prices);
        let radii = string::cores(&walls);
        let proven = |leads: &Leads| {
            let known = (0.0, 4000.0);
            let proof = potential::prove(&walls, &prices, &scenario.area, known, leads, &|| false);
            let proof = proof.expect("soft zones must be crossed");
            let across = proof.total();
            [across, over(proof, &scenario, &prices, &walls, &|| false)]
        };
        let [across, free] = proven(&FREE);
        let [across_with, with] = proven(&leads(&scenario, &prices, (&walls, &radii), &|| false));
        // The best known route has 30 waypoints.
        assert!(with > 1.005 * free && with <= 1492.740, "{free} {with}");
        // The bound on the way seen from above is hardly lower.
        assert!(across_with > 0.985 * across, "{across} {across_with}");
    }
}
