//! Where a plan lies on the earth: local metres as degrees, and one datum's altitude as another's.

use crate::geometry::Point3;
use crate::geometry::geodesy::{LatLon, TangentPlane};
use crate::scenario::Scenario;

/// Of a scenario in degrees.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chart {
    plane: TangentPlane,
    /// Of mean sea level above the ellipsoid, metres, one figure for the whole scenario.
    undulation_m: f64,
    /// Whether the scenario's altitudes are above mean sea level, else above the ellipsoid.
    above_sea: bool,
}

/// A point on the earth as the formats want it, rounded to [`DEGREES`] and millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fix {
    /// Degrees north.
    pub(super) lat: f64,
    /// Degrees east, -180..=180.
    pub(super) lon: f64,
    /// Above mean sea level (EGM96), metres.
    pub(super) msl_m: f64,
    /// Above the WGS 84 ellipsoid, metres.
    pub(super) ellipsoid_m: f64,
}

/// Parts of a degree that coordinates are rounded to: 0.1 mm.
const DEGREES: f64 = 1e9;

impl Chart {
    /// `None` in a local frame.
    pub(super) fn of(_: &Scenario) -> Option<Self> {
        None
    }

    /// Of a point in the scenario's frame.
    pub(super) fn fix(&self, point: Point3) -> Fix {
        let LatLon { lat, lon } = self.plane.geodetic(point.xy());
        Fix {
            lat: rounded(lat, DEGREES),
            lon: rounded(lon, DEGREES),
            msl_m: rounded(self.msl_m(point.z), 1e3),
            ellipsoid_m: rounded(self.ellipsoid_m(point.z), 1e3),
        }
    }

    /// A height of the scenario's frame above mean sea level, metres.
    pub(super) fn msl_m(&self, z: f64) -> f64 {
        if self.above_sea {
            z
        } else {
            z - self.undulation_m
        }
    }

    /// A height of the scenario's frame above the ellipsoid, metres.
    pub(super) fn ellipsoid_m(&self, z: f64) -> f64 {
        if self.above_sea {
            z + self.undulation_m
        } else {
            z
        }
    }

    /// Of mean sea level above the ellipsoid, metres.
    pub(super) fn undulation_m(&self) -> f64 {
        self.undulation_m
    }
}

/// `value` to the nearest `1 / parts`.
pub(super) fn rounded(value: f64, parts: f64) -> f64 {
    // Zero has no sign here.
    (value * parts).round() / parts + 0.0
}
