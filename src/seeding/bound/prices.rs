//! What a bound pays for a metre.

use super::peak::Peak;
use crate::cost::{THREAT_SHARE, Tolerance, metre};
use crate::geometry::Point3;
use crate::scenario::{Quadrature, Scenario};

/// What a metre costs, and where it is flown.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prices {
    /// Of a metre, `w`.
    pub(super) fuel: f64,
    /// Of a metre in a soft zone, for each metre of its depth, `s`.
    pub(super) exposure: f64,
    /// Metres by which a feasible route may miss a limit.
    pub(super) tolerance: f64,
    pub(super) ends: [Point3; 2],
    /// Towards the middle of the band.
    peak: Option<Peak>,
}

impl Prices {
    pub(super) fn of(scenario: &Scenario) -> Self {
        let exposure = match scenario.planner.quadrature {
            Quadrature::Integral => scenario.weights.threat * THREAT_SHARE,
            // Sampled, a soft zone can be crossed for nothing.
            Quadrature::Paper => 0.0,
        };
        Self {
            fuel: metre(scenario),
            exposure,
            tolerance: Tolerance::of(scenario).length_m,
            ends: [scenario.start, scenario.target],
            peak: Peak::of(scenario),
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

    /// Least cost of a way between the ends that costs so much or more seen from above, waypoints included.
    pub(super) fn climbing_at(&self, cost: f64) -> f64 {
        let rise = self.fuel * self.rise();
        let level = (cost * cost + rise * rise).sqrt();
        let peak = self.peak.filter(|_| level.is_finite());
        peak.map_or(level, |peak| peak.least(self.fuel, cost).max(level))
    }

    /// Least cost of a way between the ends of that `length` seen from above or more, with `extra` for soft zones.
    pub(super) fn reaching(&self, length: f64, extra: f64) -> f64 {
        let level = self.climbing(length, self.rise()) + extra;
        level.max(self.climbing_at(self.fuel * length + extra))
    }

    /// What a way costs seen from above at most that costs `cost` with the rise of the ends, and a hair more.
    pub(super) fn across(&self, cost: f64) -> f64 {
        let rise = self.fuel * self.rise();
        (cost * cost - rise * rise).max(0.0).sqrt() * (1.0 + 1e-9)
    }
}
