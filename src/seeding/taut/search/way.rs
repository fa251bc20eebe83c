//! What a search keeps: how far strings have come, and the ways on from there.

use std::cmp::Ordering;

use super::place::Place;
use crate::geometry::Point2;
use crate::seeding::arc::{Arc, Tangent};

/// An arrival at a corner: the string so far.
pub(super) struct Step {
    pub(super) place: Place,
    /// From which step, along which arc of its circle, then straight.
    pub(super) before: Option<(usize, Arc, Tangent)>,
    pub(super) length: f64,
    /// Where it is, for a first guess at what lies ahead.
    pub(super) at: Point2,
    /// Ways on are known as far as strings up to this length are concerned.
    pub(super) reach: f64,
    /// By how much the reach grows next.
    pub(super) growth: f64,
}

/// A way on from a step that has not been checked yet, ordered by the length of the shortest string
/// that it could become, then by age. Back to the start stands for all ways beyond the step's reach.
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
