//! The paper's infinite costs as constraints, each with a measured violation.

use crate::scenario::Scenario;

/// A constraint on a route.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constraint {
    /// Out of every threat.
    Threat,
    /// Within the altitude band outside the terminal zones.
    Altitude,
    /// Above ground.
    Terrain,
    /// Eq. 8.
    Turn,
    /// Eq. 9.
    Climb,
    /// No leg shorter than the vehicle's least.
    Leg,
    /// Free waypoints inside the area.
    Area,
}

impl Constraint {
    /// The name on the wire.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Threat => "threat",
            Self::Altitude => "altitude",
            Self::Terrain => "terrain",
            Self::Turn => "turn",
            Self::Climb => "climb",
            Self::Leg => "leg",
            Self::Area => "area",
        }
    }

    /// Unit of a violation.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Turn | Self::Climb => "deg",
            Self::Threat | Self::Altitude | Self::Terrain | Self::Leg | Self::Area => "m",
        }
    }
}

/// One broken constraint at one place of the route.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Breach {
    /// Which.
    pub constraint: Constraint,
    /// Index of the leg; for [`Constraint::Area`], of the waypoint.
    pub index: usize,
    /// Index of the threat, for [`Constraint::Threat`] only.
    pub threat: Option<usize>,
    /// Metres or degrees beyond the limit, > 0.
    pub amount: f64,
}

impl Breach {
    pub(super) fn on_leg(constraint: Constraint, leg_idx: usize, amount: f64) -> Self {
        Self {
            constraint,
            index: leg_idx,
            threat: None,
            amount,
        }
    }

    pub(super) fn at_waypoint(constraint: Constraint, waypoint_idx: usize, amount: f64) -> Self {
        Self::on_leg(constraint, waypoint_idx, amount)
    }
}

/// By how much a constraint may be missed and still count as kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Tolerance of lengths, metres.
    pub length_m: f64,
    /// Tolerance of heights above ground, metres.
    pub height_m: f64,
    /// Tolerance of angles, degrees.
    pub angle_deg: f64,
}

impl Tolerance {
    /// What counts as feasible: a micrometre, or a billionth of the area's diagonal; a millionth of a degree; and the
    /// accuracy of the ground.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let length_m = (1e-9 * scenario.area.diagonal()).max(1e-6);
        Self {
            length_m,
            height_m: length_m.max(scenario.terrain.tolerance()),
            angle_deg: 1e-6,
        }
    }

    /// A share of it, for a search that must end well within the limits.
    #[must_use]
    pub fn scaled(self, share: f64) -> Self {
        Self {
            length_m: self.length_m * share,
            height_m: self.height_m * share,
            angle_deg: self.angle_deg * share,
        }
    }
}
