//! Threats that can be passed above or below.

use crate::cost::Model;
use crate::geometry::{Point2, Point3, Segment};
use crate::scenario::Scenario;
use crate::threat::Threat;

/// Whether the altitude band reaches above the top of `threat`, or below its base, somewhere over it.
pub(super) fn passable(scenario: &Scenario, threat: &Threat) -> bool {
    let (lowest, highest) = heights(scenario, threat);
    threat.top.is_some_and(|top| top <= highest) || threat.base.is_some_and(|base| base > lowest)
}

/// The least and the greatest height in the frame at which a route may pass over the middle and the corners of the box
/// around `threat`.
fn heights(scenario: &Scenario, threat: &Threat) -> (f64, f64) {
    let extent = threat.extent();
    let middle = nalgebra::center(&extent.min, &extent.max);
    let corners = [
        middle,
        extent.min,
        extent.max,
        Point2::new(extent.min.x, extent.max.y),
        Point2::new(extent.max.x, extent.min.y),
    ];
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    for at in corners {
        let ground = scenario.terrain.elevation(scenario.area.nearest(at));
        lowest = lowest.min(ground + scenario.altitude.min);
        highest = highest.max(ground + scenario.altitude.max);
    }
    (lowest, highest)
}

/// Raise, or lower, the free waypoints of legs that run through passable threats until they pass.
pub(super) fn lift(model: &Model, route: &mut [Point3]) {
    let scenario = model.scenario;
    let last = route.len() - 1;
    for threat in scenario
        .threats
        .iter()
        .filter(|threat| passable(scenario, threat))
    {
        let (lowest, highest) = heights(scenario, threat);
        for leg_idx in 0..last {
            let leg = Segment {
                a: route[leg_idx],
                b: route[leg_idx + 1],
            };
            if threat
                .clearance(&leg)
                .is_none_or(|clearance| clearance >= 0.0)
            {
                continue;
            }
            let z = match (threat.top, threat.base) {
                (Some(top), _) if top <= highest => top,
                (_, Some(base)) if base > lowest => base - 1e-3,
                _ => continue,
            };
            for idx in [leg_idx, leg_idx + 1] {
                if idx > 0 && idx < last {
                    route[idx].z = z;
                }
            }
        }
    }
}
