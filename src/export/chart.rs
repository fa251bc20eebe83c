//! Where a plan lies on the earth: converts local metres to degrees, and altitudes between datums.

use std::sync::{Arc, OnceLock};

use crate::geometry::geodesy::LatLon;
use crate::geometry::geoid::Geoid;
use crate::geometry::{Point2, Point3};
use crate::scenario::frame::{Datum, Frame, Wgs84};

/// The conversion for a scenario in degrees.
pub(super) struct Chart {
    frame: Arc<Wgs84>,
    /// Needed only for altitudes of the other datum.
    geoid: OnceLock<Geoid>,
}

/// Coordinates are rounded to 1 / this degrees: 0.1 mm.
const DEGREES: f64 = 1e9;

impl Chart {
    /// `None` in a local frame.
    pub(super) fn of(frame: &Frame) -> Option<Self> {
        match frame {
            Frame::Local => None,
            Frame::Wgs84(wgs84) => Some(Self {
                frame: wgs84.clone(),
                geoid: OnceLock::new(),
            }),
        }
    }

    /// A point of the local plane in degrees as the formats write them, rounded to 1 / [`DEGREES`]; longitudes in
    /// -180..=180.
    pub(super) fn place(&self, point: Point2) -> LatLon {
        let place = self.frame.place(point);
        LatLon {
            lat: rounded(place.lat, DEGREES),
            lon: rounded(place.lon, DEGREES),
        }
    }

    /// Height of a point above mean sea level (EGM96), metres.
    pub(super) fn above_sea(&self, point: Point3) -> f64 {
        match self.frame.datum {
            Datum::Msl => point.z,
            Datum::Ellipsoid => point.z - self.geoid_m(point.xy()),
        }
    }

    /// The same, to the millimetre.
    pub(super) fn msl_m(&self, point: Point3) -> f64 {
        rounded(self.above_sea(point), 1e3)
    }

    /// Height of a point above the WGS 84 ellipsoid, to the millimetre.
    pub(super) fn ellipsoid_m(&self, point: Point3) -> f64 {
        let height = match self.frame.datum {
            Datum::Msl => point.z + self.geoid_m(point.xy()),
            Datum::Ellipsoid => point.z,
        };
        rounded(height, 1e3)
    }

    /// Height of mean sea level above the ellipsoid at a point, to the millimetre.
    pub(super) fn undulation_m(&self, point: Point2) -> f64 {
        rounded(self.geoid_m(point), 1e3)
    }

    fn geoid_m(&self, point: Point2) -> f64 {
        let geoid = self.geoid.get_or_init(|| self.frame.geoid());
        geoid.height_m([point.x, point.y])
    }
}

/// `value` to the nearest `1 / parts`.
pub(super) fn rounded(value: f64, parts: f64) -> f64 {
    // Adding 0 turns -0 into 0.
    (value * parts).round() / parts + 0.0
}
