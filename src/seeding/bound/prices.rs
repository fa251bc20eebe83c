//! The prices of a metre used by a bound.

use super::middle::Middle;
use super::peak::Peak;
use crate::cost::{THREAT_SHARE, Tolerance, metre};
use crate::geometry::Point3;
use crate::scenario::{Quadrature, Scenario};

/// The cost of a metre, and where it is flown.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prices {
    /// Price of a metre, `w`.
    pub(super) fuel: f64,
    /// Price of a metre in a soft zone per metre of its depth, `s`.
    pub(super) exposure: f64,
    /// Metres by which a feasible route may miss a limit.
    pub(super) tolerance: f64,
    pub(super) ends: [Point3; 2],
    pub(super) middle: Middle,
    /// The climb towards the middle of the band.
    peak: Option<Peak>,
}

impl Prices {
    pub(super) fn of(scenario: &Scenario) -> Self {
        let exposure = match scenario.planner.quadrature {
            Quadrature::Integral => scenario.weights.threat * THREAT_SHARE,
            // With sampling, a soft zone can be crossed for nothing.
            Quadrature::Paper => 0.0,
        };
        // Finding the lowest ground may take all nodes of a grid.
        let middle = Middle::of(scenario);
        Self {
            fuel: metre(scenario),
            exposure,
            tolerance: Tolerance::of(scenario).length_m,
            ends: [scenario.start, scenario.target],
            middle,
            peak: Peak::of(scenario, &middle),
        }
    }

    /// Distance of the ends seen from above, metres.
    pub(super) fn direct(&self) -> f64 {
        (self.ends[1].xy() - self.ends[0].xy()).norm()
    }

    /// Difference in height of the ends, metres.
    pub(super) fn rise(&self) -> f64 {
        (self.ends[1].z - self.ends[0].z).abs()
    }

    /// Least cost of fuel for a way of `length` metres seen from above that goes up and down by
    /// `vertical`.
    pub(super) fn climbing(&self, length: f64, vertical: f64) -> f64 {
        self.fuel * (length * length + vertical * vertical).sqrt()
    }

    /// Least cost of a way between the ends that costs at least `cost` seen from above, waypoints included.
    pub(super) fn climbing_at(&self, cost: f64) -> f64 {
        let level = self.level_at(cost);
        let peak = self.peak.filter(|_| level.is_finite());
        peak.map_or(level, |peak| peak.least(self.fuel, cost).max(level))
    }

    /// As [`Prices::climbing_at`], without waypoints.
    pub(super) fn level_at(&self, cost: f64) -> f64 {
        let rise = self.fuel * self.rise();
        (cost * cost + rise * rise).sqrt()
    }

    /// Least cost of a way between the ends at least `length` long seen from above, with `extra` for soft zones.
    pub(super) fn reaching(&self, length: f64, extra: f64) -> f64 {
        let level = self.climbing(length, self.rise()) + extra;
        level.max(self.climbing_at(self.fuel * length + extra))
    }

    /// The greatest cost seen from above of a way that costs `cost` including the rise of the ends, and a hair more.
    pub(super) fn across(&self, cost: f64) -> f64 {
        let rise = self.fuel * self.rise();
        (cost * cost - rise * rise).max(0.0).sqrt() * (1.0 + 1e-9)
    }
}
