//! The frame that a request speaks in, and how its places lie in the local plane that is planned in.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::geometry::geodesy::{LatLon, LatLonBox, TangentPlane};
use crate::geometry::{Point2, Point3};

/// What coordinates of the request and of its result mean.
#[derive(Debug, Clone, PartialEq)]
pub enum Frame {
    /// Metres of a plane: x east, y north, z up.
    Local,
    /// Degrees on the WGS 84 ellipsoid and an altitude, planned on a plane that touches the earth.
    Wgs84(Arc<Wgs84>),
}

/// The local plane of a scenario in degrees. Its `x` and `y` are east and north, metres; `z` is the
/// altitude above the datum, not the plane's own third axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Wgs84 {
    /// What altitudes are above.
    pub datum: Datum,
    /// East and north of the middle of `area`.
    pub plane: TangentPlane,
    /// Height of mean sea level (EGM96) above the ellipsoid in the middle of `area`, metres; one
    /// figure for the whole scenario.
    pub undulation_m: f64,
    /// What the request asks free waypoints to stay in. `Scenario::area` is the greatest rectangle
    /// of the plane in it.
    pub area: LatLonBox,
    /// The degrees that the request gave for places on the plane: computed back, they would come out
    /// a rounding apart.
    written: BTreeMap<[u64; 2], LatLon>,
}

/// Places farther than this from the middle of an area in degrees are not laid onto its plane, metres.
pub(super) const MAX_REACH_M: f64 = 500e3;

/// What an altitude is above.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Datum {
    /// Mean sea level, by the EGM96 geoid.
    Msl,
    /// The WGS 84 ellipsoid.
    Ellipsoid,
}

impl Datum {
    /// As in `altitude_datum`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Msl => "msl",
            Self::Ellipsoid => "ellipsoid",
        }
    }
}

/// A place and an altitude, in degrees and metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geodetic {
    /// The place under it.
    pub place: LatLon,
    /// Above the datum.
    pub alt: f64,
}

impl Frame {
    /// The geodetic half of it, where there is one.
    #[must_use]
    pub fn wgs84(&self) -> Option<&Wgs84> {
        match self {
            Self::Local => None,
            Self::Wgs84(wgs84) => Some(wgs84),
        }
    }
}

impl Wgs84 {
    pub(super) fn new(
        datum: Datum,
        plane: TangentPlane,
        undulation_m: f64,
        area: LatLonBox,
        written: BTreeMap<[u64; 2], LatLon>,
    ) -> Self {
        Self {
            datum,
            plane,
            undulation_m,
            area,
            written,
        }
    }

    /// The place that lies at `point` of the plane: as the request wrote it, else to a few nanometres.
    #[must_use]
    pub fn place(&self, point: Point2) -> LatLon {
        let written = self.written.get(&key(point)).copied();
        written.unwrap_or_else(|| self.plane.geodetic(point))
    }

    /// `point` of the plane in the request's coordinates.
    #[must_use]
    pub fn geodetic(&self, point: Point3) -> Geodetic {
        Geodetic {
            place: self.place(point.xy()),
            alt: point.z,
        }
    }

    /// Where `geodetic` lies in the plane.
    #[must_use]
    pub fn local(&self, geodetic: Geodetic) -> Point3 {
        let point = self.plane.local(geodetic.place);
        Point3::new(point.x, point.y, geodetic.alt)
    }

    /// Whether `place` is near enough for a document of this frame to name it.
    #[must_use]
    pub fn reaches(&self, place: LatLon) -> bool {
        self.plane.origin().distance_m(place) <= MAX_REACH_M
    }

    /// An altitude of the request as metres above mean sea level.
    #[must_use]
    pub fn above_sea(&self, alt: f64) -> f64 {
        match self.datum {
            Datum::Msl => alt,
            Datum::Ellipsoid => alt - self.undulation_m,
        }
    }

    /// An altitude of the request as metres above the ellipsoid.
    #[must_use]
    pub fn above_ellipsoid(&self, alt: f64) -> f64 {
        match self.datum {
            Datum::Msl => alt + self.undulation_m,
            Datum::Ellipsoid => alt,
        }
    }
}

/// To find again what was written for a point.
pub(super) fn key(point: Point2) -> [u64; 2] {
    [point.x.to_bits(), point.y.to_bits()]
}
