//! Where a plan lies on the earth: local metres as degrees, and one datum's altitude as another's.

use std::sync::Arc;

use crate::geometry::Point3;
use crate::scenario::frame::{Frame, Wgs84};

/// Of a scenario in degrees.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chart(Arc<Wgs84>);

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
    pub(super) fn of(frame: &Frame) -> Option<Self> {
        match frame {
            Frame::Local => None,
            Frame::Wgs84(wgs84) => Some(Self(wgs84.clone())),
        }
    }

    /// Of a point of the local plane.
    pub(super) fn fix(&self, point: Point3) -> Fix {
        let place = self.0.place(point.xy());
        Fix {
            lat: rounded(place.lat, DEGREES),
            lon: rounded(place.lon, DEGREES),
            msl_m: rounded(self.0.above_sea(point.z), 1e3),
            ellipsoid_m: rounded(self.0.above_ellipsoid(point.z), 1e3),
        }
    }

    /// A height of the scenario's frame above mean sea level, metres.
    pub(super) fn msl_m(&self, z: f64) -> f64 {
        rounded(self.0.above_sea(z), 1e3)
    }

    /// A height of the scenario's frame above the ellipsoid, metres.
    pub(super) fn ellipsoid_m(&self, z: f64) -> f64 {
        rounded(self.0.above_ellipsoid(z), 1e3)
    }

    /// Of mean sea level above the ellipsoid, metres; one figure for the whole scenario.
    pub(super) fn undulation_m(&self) -> f64 {
        rounded(self.0.undulation_m, 1e3)
    }
}

/// `value` to the nearest `1 / parts`.
pub(super) fn rounded(value: f64, parts: f64) -> f64 {
    // Zero has no sign here.
    (value * parts).round() / parts + 0.0
}
