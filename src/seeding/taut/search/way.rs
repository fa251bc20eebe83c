//! The data of a search: the strings so far, and the ways on from there.

use std::cmp::Ordering;

use super::place::Place;
use crate::geometry::Point2;
use crate::seeding::arc::{Arc, Tangent};

/// An arrival at a corner: the string so far.
pub(super) struct Step {
    pub(super) place: Place,
    /// The step before, the arc along its circle, and the straight part after that.
    pub(super) before: Option<(usize, Arc, Tangent)>,
    pub(super) length: f64,
    /// Its position, for a first guess at what lies ahead.
    pub(super) at: Point2,
    /// Ways on are known for strings up to this length.
    pub(super) reach: f64,
    /// By how much the reach grows next.
    pub(super) growth: f64,
}

/// A way on from a step that has not been checked yet, ordered by the length of the shortest string that it could
/// become, then by age. A way back to the start represents all ways beyond the step's reach.
pub(super) struct Way {
    pub(super) least: f64,
    pub(super) age: usize,
    pub(super) step: usize,
    pub(super) to: Place,
}

impl PartialEq for Way {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Way {}
impl PartialOrd for Way {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Way {
    fn cmp(&self, other: &Self) -> Ordering {
        self.least
            .total_cmp(&other.least)
            .then(self.age.cmp(&other.age))
    }
}
