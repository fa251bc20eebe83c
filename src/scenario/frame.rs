//! The coordinate frame of a request, and the mapping of its places to the local plane used for planning.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::geometry::geodesy::{LatLon, LatLonBox, TangentPlane};
use crate::geometry::geoid::Geoid;
use crate::geometry::{Point2, Point3};

/// Meaning of the coordinates in a request and its result.
#[derive(Debug, Clone, PartialEq)]
pub enum Frame {
    /// Metres of a plane: x east, y north, z up.
    Local,
    /// Degrees on the WGS 84 ellipsoid and an altitude; planning uses a plane tangent to the earth.
    Wgs84(Arc<Wgs84>),
}

/// The local plane of a scenario in degrees. Its `x` and `y` are east and north, metres; `z` is the altitude above
/// the datum, not the plane's own third axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Wgs84 {
    /// The datum of altitudes.
    pub datum: Datum,
    /// Tangent plane at the middle of `area`.
    pub plane: TangentPlane,
    /// Height of mean sea level (EGM96) above the ellipsoid at the middle of `area`, metres.
    pub undulation_m: f64,
    /// Where the request keeps free waypoints. `Scenario::area` is the largest rectangle of the plane inside it.
    pub area: LatLonBox,
    /// The degrees that the request gave for points on the plane; computed back, they would differ by rounding.
    written: BTreeMap<[u64; 2], LatLon>,
}

/// Largest distance of a place from the middle of an area in degrees, metres; the plane is not used beyond.
pub(super) const MAX_REACH_M: f64 = 500e3;

/// The reference surface of altitudes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Datum {
    /// Mean sea level, by the EGM96 geoid.
    Msl,
    /// The WGS 84 ellipsoid.
    Ellipsoid,
}

impl Datum {
    /// Every one.
    pub const ALL: [Self; 2] = [Self::Msl, Self::Ellipsoid];

    /// The name used in `altitude_datum`.
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
    /// Latitude and longitude.
    pub place: LatLon,
    /// Metres above the datum.
    pub alt: f64,
}

impl Frame {
    /// The geodetic part; `None` for a local frame.
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

    /// The place at `point` of the plane: as the request wrote it, otherwise accurate to a few nanometres.
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

    /// `geodetic` as a point of the plane.
    #[must_use]
    pub fn local(&self, geodetic: Geodetic) -> Point3 {
        let point = self.plane.local(geodetic.place);
        Point3::new(point.x, point.y, geodetic.alt)
    }

    /// Whether `place` is near enough to be used in a document of this frame.
    #[must_use]
    pub fn reaches(&self, place: LatLon) -> bool {
        self.plane.origin().distance_m(place) <= MAX_REACH_M
    }

    /// The geoid over the area, in coordinates of the plane. Takes some milliseconds, a tenth of a second for the
    /// largest areas.
    #[must_use]
    pub fn geoid(&self) -> Geoid {
        let LatLonBox { min, max } = self.area;
        let middle = self.plane.origin();
        // Parallels and meridians are curved on the plane.
        let places = [min.lat, middle.lat, max.lat].into_iter().flat_map(|lat| {
            let longitudes = [min.lon, middle.lon, max.lon];
            longitudes.map(|lon| self.plane.local(LatLon { lat, lon }))
        });
        let around = |(min, max): (Point2, Point2), at: Point2| (min.inf(&at), max.sup(&at));
        let (min, max) = places.fold((Point2::origin(), Point2::origin()), around);
        let place = |[x, y]: [f64; 2]| self.plane.geodetic(Point2::new(x, y));
        Geoid::over([min.x, min.y], [max.x, max.y], place)
    }
}

/// Key of a point in the map of written places.
pub(super) fn key(point: Point2) -> [u64; 2] {
    [point.x.to_bits(), point.y.to_bits()]
}
