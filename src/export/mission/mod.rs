//! Plans that autopilots fly: a path as few items, in the formats that ground stations read.

mod items;
pub(super) mod qgc;
mod reduce;
pub(super) mod wpl;

/// What a mission's format lets a caller choose.
pub(super) const OPTIONS: &[&str] = &["altitude", "firmware", "landing", "takeoff", "tolerance"];
