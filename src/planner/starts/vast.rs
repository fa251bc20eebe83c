//! Scenes in which even single legs take long to price, and how often to look, among them, whether there is time left.

use crate::cost::batch::LANES;
use crate::scenario::Scenario;
use crate::terrain::Terrain;
use crate::threat::Threat;

/// With fewer legs than this between two checks, a scene is vast: that of 400 ring corners is, or of 4,000 peaks.
const VAST: usize = 1_000;

/// Number of threats, ring corners and peaks, counted for each leg priced, between two checks whether to stop: the net
/// of an ordinary scene takes so little time that it pays even where time is over.
const MET_UNWATCHED: usize = 4_000_000;

/// Legs between two checks whether to stop.
pub(super) fn legs_unwatched(scenario: &Scenario) -> usize {
    let peaks = match &scenario.terrain {
        Terrain::Peaks(peaks) => peaks.peaks.len(),
        Terrain::Flat(_) | Terrain::Grid(_) | Terrain::Dem(_) => 0,
    };
    let met = peaks + scenario.threats.iter().map(Threat::effort).sum::<usize>();
    (MET_UNWATCHED / met.max(1))
        .next_multiple_of(LANES)
        .max(LANES)
}

/// Whether so much may be met that even single routes take long to price.
pub(in crate::planner) fn is_vast(scenario: &Scenario) -> bool {
    legs_unwatched(scenario) < VAST
}

/// Looks now and then whether there is time left.
pub(super) struct Watch<'p> {
    is_over: &'p dyn Fn() -> bool,
    /// Legs between two looks at most.
    pub(super) most_unwatched: usize,
    /// Legs since it looked last.
    unwatched: usize,
    /// Whether there was no time for all of them.
    pub(super) is_broken_off: bool,
}

impl<'p> Watch<'p> {
    pub(super) fn new(scenario: &Scenario, is_over: &'p dyn Fn() -> bool) -> Self {
        Self {
            is_over,
            most_unwatched: legs_unwatched(scenario),
            unwatched: 0,
            is_broken_off: false,
        }
    }

    /// Whether so many legs more may be looked at.
    pub(super) fn may_go_on(&mut self, legs: usize) -> bool {
        self.unwatched += legs;
        if self.unwatched > self.most_unwatched {
            self.is_broken_off |= (self.is_over)();
            self.unwatched = legs;
        }
        !self.is_broken_off
    }
}
