//! Missions for autopilots: a path reduced to few items, in the formats that ground stations read.

mod items;
pub(super) mod qgc;
mod reduce;
pub(super) mod wpl;

/// Options of the mission formats.
pub(super) const OPTIONS: &[&str] = &["altitude", "firmware", "landing", "takeoff", "tolerance"];
