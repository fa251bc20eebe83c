//! Eq. 4-5: exposure to threats along a leg, and staying out of them.

use super::{Breach, Constraint, Model, Tolerance};
use crate::geometry::{Point3, Rect, Segment};
use crate::scenario::Quadrature;
use crate::threat::Threat;

/// The factor 1/5 of Eq. 4.
pub(crate) const SHARE: f64 = 0.2;

/// Where Eq. 4 samples a leg. The paper lists four of the five points; all five are used.
pub(super) const SAMPLES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// With this many threats or fewer, all are examined.
const FEW_THREATS: usize = 16;

/// The threats whose soft zones a run of legs may reach. Where a route has thousands of legs or a scenario thousands of
/// threats, most need not be examined leg by leg.
#[derive(Debug)]
pub(super) enum Nearby {
    All(usize),
    Some(Vec<usize>),
}

impl Nearby {
    /// Number of legs examined together.
    pub(super) const RUN: usize = 32;

    /// The threats near to the legs between `points`, in order.
    pub(super) fn to(threats: &[Threat], points: &[Point3]) -> Self {
        if threats.len() <= FEW_THREATS {
            return Self::All(threats.len());
        }
        let Some(run) = Rect::around(points.iter().map(Point3::xy)) else {
            return Self::Some(Vec::new());
        };
        let near = threats.iter().enumerate().filter(|(_, threat)| {
            let extent = threat.extent();
            // Written so that rounding errs on the side of including a threat.
            run.meets(&extent.grown(1e-6 * (1.0 + extent.diagonal())))
        });
        Self::Some(near.map(|(threat_idx, _)| threat_idx).collect())
    }

    fn indices(&self) -> impl Iterator<Item = usize> + '_ {
        let (all, some): (usize, &[usize]) = match self {
            Self::All(count) => (*count, &[]),
            Self::Some(indices) => (0, indices),
        };
        (0..all).chain(some.iter().copied())
    }
}

impl Model<'_> {
    /// Sum over the `nearby` threats of the integral of `T(d)` along `leg`; entering a threat is reported.
    pub(super) fn threats(
        &self,
        leg_idx: usize,
        leg: &Segment,
        nearby: &Nearby,
        quadrature: Quadrature,
        tolerance: Tolerance,
        report: &mut impl FnMut(Breach),
    ) -> f64 {
        let mut exposure = 0.0;
        for threat_idx in nearby.indices() {
            let threat = &self.scenario.threats[threat_idx];
            let encounter = threat.encounter(leg);
            exposure += match quadrature {
                Quadrature::Integral => encounter.exposure,
                Quadrature::Paper => sampled_exposure(threat, leg),
            };
            if encounter.depth > tolerance.length_m {
                report(Breach {
                    threat: Some(threat_idx),
                    ..Breach::on_leg(Constraint::Threat, leg_idx, encounter.depth)
                });
            }
        }
        exposure
    }
}

/// The integral of Eq. 4 as printed: the mean of five samples times the leg's length.
pub(super) fn sampled_exposure(threat: &Threat, leg: &Segment) -> f64 {
    // The last sample is exactly where the leg ends, which is usually at a base or top.
    let sample = |&t: &f64| if t < 1.0 { leg.at(t) } else { leg.b };
    let sum: f64 = SAMPLES.iter().map(|t| threat.intensity(sample(t))).sum();
    sum / SAMPLES.len() as f64 * leg.length()
}
