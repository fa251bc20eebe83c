//! Counts the routes that a search prices, and checks the clock between them occasionally.

use super::{Stop, why_stop};
use crate::cost::batch::LANES;
use crate::scenario::Scenario;
use crate::terrain::Terrain;
use crate::threat::Threat;

/// Number of steps, each of some nanoseconds, between two checks of the clock.
const STEPS_UNWATCHED: usize = 1_000_000;

/// What a search has priced, and whether it may go on.
pub(super) struct Watch<'s> {
    scenario: &'s Scenario,
    stop: &'s dyn Stop,
    /// Evaluations between two checks of the clock; at least one block of them, which are priced side by side.
    pub(super) stride: u64,
    /// Routes priced so far.
    pub(super) evaluations: u64,
    /// Whether the run was stopped within an iteration: the rest of it is
    /// [`Fitness::WORST`](crate::optimizer::Fitness::WORST).
    pub(super) interrupted: bool,
}

impl<'s> Watch<'s> {
    pub(super) fn new(scenario: &'s Scenario, stop: &'s dyn Stop) -> Self {
        Self {
            scenario,
            stop,
            stride: (STEPS_UNWATCHED / steps(scenario)).max(LANES) as u64,
            evaluations: 0,
            interrupted: false,
        }
    }

    /// Whether the next `count` routes may be priced; if so they are counted.
    pub(super) fn may_price(&mut self, count: usize) -> bool {
        let count = count as u64;
        let since = self.evaluations % self.stride;
        // There must always be one route to deliver.
        let due = self.evaluations > 0 && (since == 0 || since + count > self.stride);
        if due && !self.interrupted {
            self.interrupted = why_stop(self.scenario, self.stop).is_some();
        }
        if !self.interrupted {
            self.evaluations += count;
        }
        !self.interrupted
    }
}

/// The approximate number of steps for pricing one route, if no threat is too far away to matter.
fn steps(scenario: &Scenario) -> usize {
    let threats: usize = scenario.threats.iter().map(Threat::effort).sum();
    let ground = match &scenario.terrain {
        Terrain::Flat(_) => 1,
        Terrain::Peaks(peaks) => 10 * (1 + peaks.peaks.len()),
        Terrain::Grid(grid) => grid.columns + grid.rows,
        Terrain::Dem(dem) => dem.raster().lattice.columns + dem.raster().lattice.rows,
    };
    (scenario.planner.waypoints + 1) * (1 + threats + ground)
}
