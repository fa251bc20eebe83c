//! Where a plan lies on the earth: converts local metres to degrees, and altitudes between datums.

use std::sync::Arc;

use crate::geometry::Point3;
use crate::scenario::frame::{Frame, Wgs84};

/// The conversion for a scenario in degrees.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chart(Arc<Wgs84>);

/// A point on the earth as the formats write it, rounded to 1 / [`DEGREES`] degrees and millimetres.
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

/// Coordinates are rounded to 1 / this degrees: 0.1 mm.
const DEGREES: f64 = 1e9;

impl Chart {
    /// `None` in a local frame.
    pub(super) fn of(frame: &Frame) -> Option<Self> {
        match frame {
            Frame::Local => None,
            Frame::Wgs84(wgs84) => Some(Self(wgs84.clone())),
        }
    }

    /// A point of the local plane on the earth.
    pub(super) fn fix(&self, point: Point3) -> Fix {
        let place = self.0.place(point.xy());
        Fix {
            lat: rounded(place.lat, DEGREES),
            lon: rounded(place.lon, DEGREES),
            msl_m: rounded(self.0.above_sea(point.z), 1e3),
            ellipsoid_m: rounded(self.0.above_ellipsoid(point.z), 1e3),
        }
    }

    /// Convert a height of the scenario's frame to metres above mean sea level.
    pub(super) fn msl_m(&self, z: f64) -> f64 {
        rounded(self.0.above_sea(z), 1e3)
    }

    /// Convert a height of the scenario's frame to metres above the ellipsoid.
    pub(super) fn ellipsoid_m(&self, z: f64) -> f64 {
        rounded(self.0.above_ellipsoid(z), 1e3)
    }

    /// Height of mean sea level above the ellipsoid, metres; one value for the whole scenario.
    pub(super) fn undulation_m(&self) -> f64 {
        rounded(self.0.undulation_m, 1e3)
    }
}

/// `value` to the nearest `1 / parts`.
pub(super) fn rounded(value: f64, parts: f64) -> f64 {
    // Adding 0 turns -0 into 0.
    (value * parts).round() / parts + 0.0
}
