//! `altitude`, `vehicle` and `weights`.

use crate::scenario::{AltitudeBand, Vehicle, Weights};

use super::fault::Faults;
use super::ranges::{ALTITUDE, CLIMB, FUEL, MIN_LEG, SPEED, TURN, WEIGHT};
use super::value::{At, figure};

const DEFAULT_MAX_TURN_DEG: f64 = 60.0;
const DEFAULT_MAX_CLIMB_DEG: f64 = 45.0;
const DEFAULT_CRUISE_SPEED: f64 = 15.0;
/// With this a metre costs 1.
const DEFAULT_FUEL_PER_KM: f64 = 1000.0;
/// The weights of a document that gives none.
pub(super) const DEFAULT_WEIGHTS: Weights = Weights {
    fuel: 1.0,
    threat: 1.0,
    altitude: 1.0,
};

/// Greatest room for climbing, metres, so that the area stays within the range of coordinates.
const MOST_ROOM_M: f64 = 1e7;

/// A vehicle whose shortest leg may still depend on the rest of the document.
#[derive(Debug, Clone, Copy)]
pub(super) struct VehicleDraft {
    max_turn_deg: f64,
    pub(super) max_climb_deg: f64,
    min_leg: Option<f64>,
    cruise_speed: f64,
    fuel_per_km: f64,
}

/// The vehicle of a document that gives none.
pub(super) const DEFAULT: VehicleDraft = VehicleDraft {
    max_turn_deg: DEFAULT_MAX_TURN_DEG,
    max_climb_deg: DEFAULT_MAX_CLIMB_DEG,
    min_leg: None,
    cruise_speed: DEFAULT_CRUISE_SPEED,
    fuel_per_km: DEFAULT_FUEL_PER_KM,
};

impl VehicleDraft {
    /// Fill in the default shortest leg: `distance / (10 (N + 1))`, with `distance` from start to target in metres
    /// (3-D) and `waypoints` N.
    pub(super) fn finish(self, distance: f64, waypoints: usize) -> Vehicle {
        Vehicle {
            max_turn_deg: self.max_turn_deg,
            max_climb_deg: self.max_climb_deg,
            min_leg: self
                .min_leg
                .unwrap_or(distance / (10.0 * (waypoints + 1) as f64)),
            cruise_speed: self.cruise_speed,
            fuel_per_km: self.fuel_per_km,
        }
    }
}

/// Padding of a default area, metres, that lets a route over `distance_m` climb and descend by `climb_m` in total at
/// no more than `max_climb_deg` (default if `None`): 0 if the straight line is long enough, else half of the ground
/// distance needed, to fly out and back.
pub(super) fn climbing_room(climb_m: f64, distance_m: f64, max_climb_deg: Option<f64>) -> f64 {
    let max_climb_deg = max_climb_deg.unwrap_or(DEFAULT_MAX_CLIMB_DEG);
    let over_ground = climb_m / libm::tan(max_climb_deg.to_radians());
    if over_ground > distance_m {
        (0.5 * over_ground).min(MOST_ROOM_M)
    } else {
        0.0
    }
}

/// Total metres climbed and descended from one height to another by way of the `middle` of the altitude band over
/// each, all in one frame.
pub(super) fn climb_through(ends: [f64; 2], middle: [f64; 2]) -> f64 {
    let by_the_middle = (middle[0] - ends[0]).abs() + (middle[1] - ends[1]).abs();
    by_the_middle.max((ends[1] - ends[0]).abs())
}

/// `{"max_turn_deg", "max_climb_deg", "min_leg", "cruise_speed", "fuel_per_km"}`, all optional.
pub(super) fn vehicle(at: At<'_>, faults: &mut Faults) -> Option<VehicleDraft> {
    let fields = at.fields(
        &[
            "max_turn_deg",
            "max_climb_deg",
            "min_leg",
            "cruise_speed",
            "fuel_per_km",
        ],
        faults,
    )?;
    let max_turn_deg = fields.number_or("max_turn_deg", DEFAULT_MAX_TURN_DEG, TURN, faults);
    let max_climb_deg = fields.number_or("max_climb_deg", DEFAULT_MAX_CLIMB_DEG, CLIMB, faults);
    let min_leg = fields.or("min_leg", None, faults, |at, faults| {
        at.number(MIN_LEG, faults).map(Some)
    });
    let cruise_speed = fields.number_or("cruise_speed", DEFAULT_CRUISE_SPEED, SPEED, faults);
    let fuel_per_km = fields.number_or("fuel_per_km", DEFAULT_FUEL_PER_KM, FUEL, faults);
    Some(VehicleDraft {
        max_turn_deg: max_turn_deg?,
        max_climb_deg: max_climb_deg?,
        min_leg: min_leg?,
        cruise_speed: cruise_speed?,
        fuel_per_km: fuel_per_km?,
    })
}

/// `{"min", "max"}`, metres above ground, `min < max`.
pub(super) fn altitude(at: At<'_>, faults: &mut Faults) -> Option<AltitudeBand> {
    let fields = at.fields(&["min", "max"], faults)?;
    let min = fields.number("min", ALTITUDE, faults);
    let max = fields.number("max", ALTITUDE, faults);
    let (min, max) = (min?, max?);
    if min < max {
        return Some(AltitudeBand { min, max });
    }
    faults.add(at.path, "empty-altitude-band", || {
        format!(
            "altitude runs from {} to {}, must have min < max",
            figure(min),
            figure(max)
        )
    });
    None
}

/// `{"fuel", "threat", "altitude"}`, each 1 unless given.
pub(super) fn weights(at: At<'_>, faults: &mut Faults) -> Option<Weights> {
    let fields = at.fields(&["fuel", "threat", "altitude"], faults)?;
    let fuel = fields.number_or("fuel", DEFAULT_WEIGHTS.fuel, WEIGHT, faults);
    let threat = fields.number_or("threat", DEFAULT_WEIGHTS.threat, WEIGHT, faults);
    let altitude = fields.number_or("altitude", DEFAULT_WEIGHTS.altitude, WEIGHT, faults);
    Some(Weights {
        fuel: fuel?,
        threat: threat?,
        altitude: altitude?,
    })
}
