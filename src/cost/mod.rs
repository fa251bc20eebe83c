//! What a route costs and which constraints it breaks: Eq. 1-9 of the paper.
//!
//! One walk along the route, [`Model::assess`], prices it and reports every broken constraint; the
//! search sums the reports, the certificate lists them. Routes compare by Deb's rule: less total
//! violation first, then less cost.

mod altitude;
mod band;
pub mod batch;
mod constraint;
mod fuel;
mod heading;
#[cfg(test)]
mod tests;
mod threat;

pub use band::Section;
pub use constraint::{Breach, Constraint, Tolerance};
pub use fuel::metre;
pub use heading::turns;
pub(crate) use threat::SHARE as THREAT_SHARE;

use std::sync::{Arc, OnceLock};

use crate::geometry::{Point3, Segment};
use crate::scenario::{Quadrature, Scenario};
use batch::Scene;
use threat::Nearby;

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
    /// The scenario.
    pub scenario: &'s Scenario,
    /// By how much a constraint may be missed.
    pub tolerance: Tolerance,
    zones: band::TerminalZones,
    /// Made when the first pricer asks for it; shared by all copies of the model.
    scene: Arc<OnceLock<Arc<Scene>>>,
}

impl<'s> Model<'s> {
    /// Precompute what all routes of `scenario` share.
    #[must_use]
    pub fn new(scenario: &'s Scenario) -> Self {
        Self {
            scenario,
            tolerance: Tolerance::of(scenario),
            zones: band::TerminalZones::of(scenario),
            scene: Arc::default(),
        }
    }

    /// Price `route` (start, free waypoints, target) and pass every constraint that it breaks by
    /// more than `tolerance` to `report`.
    ///
    /// # Panics
    /// With fewer than two points.
    pub fn assess(
        &self,
        route: &[Point3],
        quadrature: Quadrature,
        tolerance: Tolerance,
        mut report: impl FnMut(Breach),
    ) -> CostFigures {
        let (mut length, mut exposure) = (0.0, 0.0);
        let mut turns = turns(route);
        let mut nearby = Nearby::All(0);
        for (leg_idx, ends) in route.windows(2).enumerate() {
            if leg_idx % Nearby::RUN == 0 {
                let run = &route[leg_idx..route.len().min(leg_idx + Nearby::RUN + 1)];
                nearby = Nearby::to(&self.scenario.threats, run);
            }
            let leg = Segment {
                a: ends[0],
                b: ends[1],
            };
            let turn = turns.next().expect("one turn a leg");
            length += leg.length();
            exposure += self.threats(leg_idx, &leg, &nearby, quadrature, tolerance, &mut report);
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

    /// Price one leg by itself: its violation beyond `tolerance`, its fuel and its exposure. Turns and waypoints, which
    /// depend on more than its two ends, are not included.
    #[must_use]
    pub fn leg(
        &self,
        a: Point3,
        b: Point3,
        quadrature: Quadrature,
        tolerance: Tolerance,
    ) -> (f64, f64) {
        let leg = Segment { a, b };
        let nearby = Nearby::to(&self.scenario.threats, &[a, b]);
        let mut violation = 0.0;
        let mut report = |breach: Breach| violation += breach.amount;
        let exposure = self.threats(0, &leg, &nearby, quadrature, tolerance, &mut report);
        self.heights(0, &leg, tolerance, &mut report);
        self.manoeuvres(0, &leg, 0.0, tolerance, &mut report);
        let weights = &self.scenario.weights;
        let fuel = weights.fuel * fuel::fuel(&self.scenario.vehicle, leg.length());
        (violation, fuel + weights.threat * exposure * threat::SHARE)
    }

    /// Price one free waypoint by itself: how far it lies outside the area, beyond `tolerance`, and
    /// its altitude cost.
    #[must_use]
    pub fn waypoint(&self, point: Point3, tolerance: Tolerance) -> (f64, f64) {
        let ground = self.scenario.terrain.elevation(point.xy());
        self.waypoint_above(point, ground, tolerance)
    }

    /// As [`Model::waypoint`], where the elevation of the ground below `point` is known.
    #[must_use]
    pub fn waypoint_above(&self, point: Point3, ground: f64, tolerance: Tolerance) -> (f64, f64) {
        let outside = self.scenario.area.excess(point.xy());
        let violation = if outside > tolerance.length_m {
            outside
        } else {
            0.0
        };
        (
            violation,
            self.scenario.weights.altitude * self.off_middle(point, ground),
        )
    }

    /// The cost figures alone.
    #[must_use]
    pub fn figures(&self, route: &[Point3], quadrature: Quadrature) -> CostFigures {
        self.assess(route, quadrature, self.tolerance, |_| {})
    }
}
