//! How far the ends are off the middle of the band. Over hills this is known of the lowest ground only: no ground is
//! below it, so whoever is below the middle of the band above it is below the middle of the band. The argument is
//! section 7 of docs/BOUND.md.

use crate::scenario::Scenario;
use crate::terrain::Terrain;

/// The middle of the band, seen from both ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Middle {
    /// Metres up to it from start and target, negative from above it.
    pub(super) below: [f64; 2],
    /// Whether the ground is level: otherwise the middle is at least this high, and nothing is known of what is above
    /// it.
    pub(super) is_level: bool,
    /// Elevation of the lowest ground, metres.
    pub(super) lowest: f64,
}

impl Middle {
    pub(super) fn of(scenario: &Scenario) -> Self {
        let is_level = scenario.terrain.is_flat();
        let [low, _] = elevations(&scenario.terrain);
        // Sums of peaks are rounded.
        let hair = if is_level {
            0.0
        } else {
            1e-9 * (1.0 + low.abs())
        };
        let lowest = low - hair;
        let middle = lowest + scenario.altitude.middle();
        Self {
            below: [scenario.start, scenario.target].map(|end| middle - end.z),
            is_level,
            lowest,
        }
    }

    /// Whether the waypoint next to this end is known to pay for being off the middle.
    pub(super) fn is_known(&self, end: usize) -> bool {
        self.is_level || self.below[end] > 0.0
    }

    /// Metres by which a route must at least climb or descend from either end to come to the middle.
    pub(super) fn off(&self) -> [f64; 2] {
        self.below.map(|below| {
            if self.is_level {
                below.abs()
            } else {
                below.max(0.0)
            }
        })
    }
}

/// Elevations that no ground is below or above.
pub(super) fn elevations(terrain: &Terrain) -> [f64; 2] {
    match terrain {
        Terrain::Flat(flat) => [flat.elevation; 2],
        Terrain::Peaks(peaks) => {
            let sum = |part: fn(f64) -> f64| -> f64 {
                peaks.peaks.iter().map(|peak| part(peak.height)).sum()
            };
            [
                peaks.base + sum(|height| height.min(0.0)),
                peaks.base + sum(|height| height.max(0.0)),
            ]
        }
        Terrain::Grid(grid) => {
            let nodes = grid.elevations.iter().copied();
            [
                nodes.clone().fold(f64::INFINITY, f64::min),
                nodes.fold(f64::NEG_INFINITY, f64::max),
            ]
        }
        Terrain::Dem(dem) => dem.elevations(),
    }
}
