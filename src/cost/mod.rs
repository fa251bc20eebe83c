//! What a route costs and which constraints it breaks: Eq. 1-9 of the paper.
//!
//! One walk along the route, [`Model::assess`], prices it and reports every broken constraint; the
//! search sums the reports, the certificate lists them. Routes compare by Deb's rule: less total
//! violation first, then less cost.

mod altitude;
mod band;
mod constraint;
mod fuel;
mod heading;
mod threat;

pub use band::Section;
pub use constraint::{Breach, Constraint, Tolerance};
pub use heading::turns;

use crate::geometry::{Point3, Segment};
use crate::scenario::{Quadrature, Scenario};

/// The weighted terms of Eq. 1; `total` is their sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CostFigures {
    /// F.
    pub total: f64,
    /// w1 F1, Eq. 2.
    pub fuel: f64,
    /// w2 F2, Eq. 4-5.
    pub threat: f64,
    /// w3 F3, Eq. 6-7.
    pub altitude: f64,
}

/// A scenario made ready for pricing routes.
#[derive(Debug, Clone)]
pub struct Model<'s> {
    /// What is asked for.
    pub scenario: &'s Scenario,
    /// By how much a constraint may be missed.
    pub tolerance: Tolerance,
    zones: band::TerminalZones,
}

impl<'s> Model<'s> {
    /// Precompute what routes of `scenario` have in common.
    #[must_use]
    pub fn new(scenario: &'s Scenario) -> Self {
        Self {
            scenario,
            tolerance: Tolerance::of(scenario),
            zones: band::TerminalZones::of(scenario),
        }
    }

    /// Price `route` (start, free waypoints, target) and pass every constraint that it breaks by
    /// more than `tolerance` to `report`.
    pub fn assess(
        &self,
        route: &[Point3],
        quadrature: Quadrature,
        tolerance: Tolerance,
        mut report: impl FnMut(Breach),
    ) -> CostFigures {
        let (mut length, mut exposure) = (0.0, 0.0);
        let mut turns = turns(route);
        for (leg_idx, ends) in route.windows(2).enumerate() {
            let leg = Segment {
                a: ends[0],
                b: ends[1],
            };
            let turn = turns.next().expect("one turn a leg");
            length += leg.length();
            exposure += self.threats(leg_idx, &leg, quadrature, tolerance, &mut report);
            self.heights(leg_idx, &leg, tolerance, &mut report);
            self.manoeuvres(leg_idx, &leg, turn, tolerance, &mut report);
        }
        let free = &route[1..route.len() - 1];
        for (idx, waypoint) in free.iter().enumerate() {
            let amount = self.scenario.area.excess(waypoint.xy());
            if amount > tolerance.length_m {
                report(Breach::at_waypoint(Constraint::Area, idx + 1, amount));
            }
        }
        let weights = &self.scenario.weights;
        let fuel = weights.fuel * fuel::fuel(&self.scenario.vehicle, length);
        let threat = weights.threat * exposure * threat::SHARE;
        let altitude = weights.altitude * self.altitude(free);
        CostFigures {
            total: fuel + threat + altitude,
            fuel,
            threat,
            altitude,
        }
    }

    /// The figures alone.
    #[must_use]
    pub fn figures(&self, route: &[Point3], quadrature: Quadrature) -> CostFigures {
        self.assess(route, quadrature, self.tolerance, |_| {})
    }
}
