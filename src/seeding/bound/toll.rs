//! The cost of passing a threat above or below, and how soon that is possible.

use super::middle::elevations;
use super::prices::Prices;
use crate::cost::Tolerance;
use crate::scenario::Scenario;
use crate::terrain::Terrain;
use crate::threat::Threat;

/// The requirements for passing a threat above or below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Toll {
    /// Least part of F3 for a waypoint beyond the threat's height.
    pub(super) altitude: f64,
    /// Least number of metres climbed and descended.
    pub(super) vertical: f64,
}

/// Greatest climb per metre seen from above, metres.
pub(super) fn steepest(scenario: &Scenario) -> f64 {
    let angle = scenario.vehicle.max_climb_deg + Tolerance::of(scenario).angle_deg;
    libm::tan(angle.min(90.0).to_radians()) * (1.0 + 1e-12)
}

/// The climb per metre seen from above, metres, from which on one more metre of climb costs this `share` of a metre
/// flown; infinite where it never does.
pub(super) fn climb_worth(share: f64) -> f64 {
    if share < 1.0 {
        share / (1.0 - share * share).sqrt()
    } else {
        f64::INFINITY
    }
}

/// Least number of metres seen from above that a route flies at the heights of `threat`, after the start and before the
/// target: what climbing or descending out of them takes, but no more than half of the straight way.
pub(super) fn stays(threat: &Threat, scenario: &Scenario) -> [f64; 2] {
    let (start, target) = (scenario.start, scenario.target);
    let half = 0.5 * (target.xy() - start.xy()).norm();
    [start.z, target.z].map(|z| {
        let (down, up) = (
            threat.base.map_or(f64::INFINITY, |base| z - base),
            threat.top.map_or(f64::INFINITY, |top| top - z),
        );
        let hair = 1e-9 * (1.0 + z.abs());
        let vertical = (down.min(up) - hair).max(0.0);
        (vertical / steepest(scenario)).min(half)
    })
}

/// From start and target, metres up to the top of `threat` and down to its base, a hair less than the real ones;
/// infinite where there is none.
pub(super) fn climbs(threat: &Threat, prices: &Prices) -> [[f64; 2]; 2] {
    prices.ends.map(|end| {
        let hair = prices.tolerance + 1e-9 * (1.0 + end.z.abs());
        [
            threat.top.map_or(f64::INFINITY, |top| top - end.z - hair),
            threat
                .base
                .map_or(f64::INFINITY, |base| end.z - base - hair),
        ]
    })
}

/// The heights in the frame that a route can reach.
pub(super) struct Heights {
    floor: f64,
    ceiling: f64,
    /// Elevation of the ground where it is level.
    level: Option<f64>,
}

impl Heights {
    pub(super) fn of(scenario: &Scenario) -> Self {
        let [low, high] = elevations(&scenario.terrain);
        let level = match &scenario.terrain {
            Terrain::Flat(flat) => Some(flat.elevation),
            Terrain::Peaks(_) | Terrain::Grid(_) | Terrain::Dem(_) => None,
        };
        let band = scenario.altitude;
        let ends = [scenario.start, scenario.target].map(|end| scenario.terrain.height_of(end));
        // Outside the terminal zones, a route keeps to the band; there are none where both ends do.
        let within = ends.iter().all(|h| (band.min..=band.max).contains(h));
        let lowest = ends.iter().fold(band.min, |low, h| low.min(*h));
        let floor = if within { band.min } else { lowest.min(0.0) };
        let ceiling = ends.iter().fold(band.max, |high, h| high.max(*h));
        let tolerance = Tolerance::of(scenario);
        let hair = 1e-3
            + 2.0 * tolerance.length_m.max(tolerance.height_m)
            + 1e-9 * (high.abs() + low.abs() + ceiling.abs());
        Self {
            floor: low + floor - hair,
            ceiling: high + ceiling + hair,
            level,
        }
    }

    /// What passing `threat` above or below requires; `None` when there is no room.
    pub(super) fn toll(&self, threat: &Threat, scenario: &Scenario) -> Option<Toll> {
        let (start, target) = (scenario.start.z, scenario.target.z);
        let weight = scenario.weights.altitude;
        let middle = scenario.altitude.middle();
        // Legs are straight: a route beyond a height has a waypoint beyond it.
        let toll = |beyond: f64, ends_beyond: bool, up: f64| {
            let nothing = Toll {
                altitude: 0.0,
                vertical: 0.0,
            };
            let Some(level) = self.level.filter(|_| !ends_beyond) else {
                return nothing;
            };
            Toll {
                altitude: weight * (up * (beyond - level - middle)).max(0.0),
                vertical: (beyond - start).abs() + (beyond - target).abs(),
            }
        };
        let over = threat.top.filter(|top| *top <= self.ceiling);
        let over = over.map(|top| toll(top, start >= top || target >= top, 1.0));
        let under = threat.base.filter(|base| *base > self.floor);
        let under = under.map(|base| toll(base, start < base || target < base, -1.0));
        match (over, under) {
            (Some(over), Some(under)) => Some(Toll {
                altitude: over.altitude.min(under.altitude),
                vertical: over.vertical.min(under.vertical),
            }),
            (over, under) => over.or(under),
        }
    }
}
