//! Eq. 4-5: exposure to threats along a leg, and keeping out of them.

use super::{Breach, Constraint, Model, Tolerance};
use crate::geometry::Segment;
use crate::scenario::Quadrature;
use crate::threat::Threat;

/// The factor 1/5 of Eq. 4.
pub(super) const SHARE: f64 = 0.2;

/// Where Eq. 4 samples a leg. The paper lists four of the five points; all five are used.
const SAMPLES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

impl Model<'_> {
    /// Sum over the threats of the integral of `T(d)` along `leg`; entering a threat is reported.
    pub(super) fn threats(
        &self,
        leg_idx: usize,
        leg: &Segment,
        quadrature: Quadrature,
        tolerance: Tolerance,
        report: &mut impl FnMut(Breach),
    ) -> f64 {
        let mut exposure = 0.0;
        for (threat_idx, threat) in self.scenario.threats.iter().enumerate() {
            let encounter = threat.encounter(leg);
            exposure += match quadrature {
                Quadrature::Integral => encounter.exposure,
                Quadrature::Paper => sampled_exposure(threat, leg),
            };
            let depth = encounter.clearance.map_or(0.0, |clearance| -clearance);
            if depth > tolerance.length_m {
                report(Breach {
                    threat: Some(threat_idx),
                    ..Breach::on_leg(Constraint::Threat, leg_idx, depth)
                });
            }
        }
        exposure
    }
}

/// The integral of Eq. 4 as printed: the mean of five samples times the leg's length.
fn sampled_exposure(threat: &Threat, leg: &Segment) -> f64 {
    let sum: f64 = SAMPLES.iter().map(|&t| threat.intensity(leg.at(t))).sum();
    sum / SAMPLES.len() as f64 * leg.length()
}
