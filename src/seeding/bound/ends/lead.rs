//! What first and last legs cost, for a potential to be shaped by.

use super::super::potential::{FREE, Lead, Leads};
use super::super::prices::Prices;
use super::super::wall::Wall;
use super::ends;
use super::kind::End;
use crate::geometry::Point2;
use crate::scenario::Scenario;

/// How many times as far as the steepest climb to the middle of the band takes legs are looked at,
const RUNS: f64 = 3.0;

/// but not farther than this share of the way.
const FARTHEST: f64 = 0.5;

/// The legs from both ends, places being measured from the start on.
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
            let run = RUNS * end.height / end.steepest;
            // Out of a zone in which it need not be in the band, a route may climb in many legs.
            let matters = end.ramp.is_none() && run > 0.0;
            matters.then(|| Lead {
                reach: run.min(FARTHEST * prices.direct()),
                cost: Box::new(move |at| end.leg_to(at + origin)),
            })
        })
    })
}

impl End<'_> {
    /// What a leg to `at` costs, waypoint included; infinite where it enters a core.
    fn leg_to(&self, at: Point2) -> f64 {
        let length = (at - self.from).norm();
        if length <= 0.0 {
            return self.steepness([0.0; 2], 0.0);
        }
        if self.is_blocked(at, 0.0) {
            return f64::INFINITY;
        }
        let exposed = self.exposed(at, 0.0)[0];
        self.prices.fuel * length + exposed + self.steepness([length; 2], exposed)
    }
}
