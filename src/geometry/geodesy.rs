//! Conversion between the WGS 84 ellipsoid and a local tangent plane.
//!
//! `sguaba` converts to and from the earth-centred frame, using `libm`, so that the same degrees give the same metres
//! on every platform.

use nalgebra::{Matrix3, Vector3};
use sguaba::Coordinate;
use sguaba::systems::{Ecef, Wgs84};
use uom::si::angle::degree;
use uom::si::f64::{Angle, Length};
use uom::si::length::meter;

use super::Point2;

/// A place on the earth, degrees: latitude in -90..=90 positive north, longitude in -180..=180 positive east.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatLon {
    /// Latitude.
    pub lat: f64,
    /// Longitude.
    pub lon: f64,
}

/// The area between two parallels and two meridians. `min.lon` is its western and `max.lon` its eastern limit; the
/// latter is smaller if the box crosses the antimeridian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatLonBox {
    /// South-west corner.
    pub min: LatLon,
    /// North-east corner.
    pub max: LatLon,
}

impl LatLon {
    /// Metres to another place on a sphere of the earth's mean radius; accurate to half a percent.
    #[must_use]
    pub fn distance_m(self, other: Self) -> f64 {
        const MEAN_RADIUS_M: f64 = 6_371_008.8;
        let (lat, other_lat) = (self.lat.to_radians(), other.lat.to_radians());
        let half = |angle: f64| {
            let sine = libm::sin(angle / 2.0);
            sine * sine
        };
        let lon = (other.lon - self.lon).to_radians();
        let chord = half(other_lat - lat) + libm::cos(lat) * libm::cos(other_lat) * half(lon);
        2.0 * MEAN_RADIUS_M * libm::asin(chord.sqrt().min(1.0))
    }
}

impl LatLonBox {
    /// Width in degrees of longitude, above 0 and at most 360.
    #[must_use]
    pub fn width(&self) -> f64 {
        let width = self.max.lon - self.min.lon;
        if width > 0.0 { width } else { width + 360.0 }
    }

    /// The centre of the box, in degrees.
    #[must_use]
    pub fn middle(&self) -> LatLon {
        LatLon {
            lat: f64::midpoint(self.min.lat, self.max.lat),
            lon: wrapped(self.min.lon + self.width() / 2.0),
        }
    }

    /// Whether `place` lies inside or on the edge, whichever way its longitude is written: 180 and -180 degrees are the
    /// same meridian. Longitudes are compared, not their differences, so that nothing is rounded on the edge.
    #[must_use]
    pub fn contains(&self, place: LatLon) -> bool {
        let (west, east) = (self.min.lon, self.max.lon);
        let east = if east > west { east } else { east + 360.0 };
        let is_between = |lon: f64| (west..=east).contains(&lon);
        let turned = [place.lon - 360.0, place.lon, place.lon + 360.0];
        (self.min.lat..=self.max.lat).contains(&place.lat) && turned.into_iter().any(is_between)
    }
}

/// A longitude wrapped into -180..=180 degrees.
#[must_use]
pub fn wrapped(lon: f64) -> f64 {
    if (-180.0..=180.0).contains(&lon) {
        lon
    } else {
        lon - 360.0 * (lon / 360.0).round()
    }
}

/// Iterations of [`TangentPlane::geodetic`]; each scales the error by the plane's tilt squared, 1/4000 at 100 km.
const ROUNDS: usize = 6;

/// An east-north plane through one point of the earth, perpendicular to the ellipsoid's normal there.
///
/// A place is mapped at the plane's own height above the ellipsoid, whatever its actual height: everything above a
/// place has the same `x` and `y`, and metres are true at that height, in the middle. The plane's own third axis is
/// not used; heights stay altitudes.
#[derive(Debug, Clone, PartialEq)]
pub struct TangentPlane {
    origin: LatLon,
    height_m: f64,
    /// Of the origin, earth-centred.
    center: Vector3<f64>,
    /// Rows: east, north and up at the origin, earth-centred.
    axes: Matrix3<f64>,
}

impl TangentPlane {
    /// The plane tangent at `origin`, `height_m` metres above the ellipsoid.
    #[must_use]
    pub fn at(origin: LatLon, height_m: f64) -> Self {
        let (lat, lon) = (origin.lat.to_radians(), origin.lon.to_radians());
        let (sin_lat, cos_lat) = libm::sincos(lat);
        let (sin_lon, cos_lon) = libm::sincos(lon);
        Self {
            origin,
            height_m,
            center: earth_centred(origin, height_m),
            axes: Matrix3::new(
                -sin_lon,
                cos_lon,
                0.0,
                -sin_lat * cos_lon,
                -sin_lat * sin_lon,
                cos_lat,
                cos_lat * cos_lon,
                cos_lat * sin_lon,
                sin_lat,
            ),
        }
    }

    /// The tangent point.
    #[must_use]
    pub fn origin(&self) -> LatLon {
        self.origin
    }

    /// Height of the tangent point, metres above the ellipsoid.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        self.height_m
    }

    /// A place on the plane, metres east and north of the origin.
    #[must_use]
    pub fn local(&self, place: LatLon) -> Point2 {
        let enu = self.axes * (earth_centred(place, self.height_m) - self.center);
        Point2::new(enu.x, enu.y)
    }

    /// The place that [`TangentPlane::local`] maps to `point`, to a micrometre within a thousand kilometres of the
    /// origin.
    #[must_use]
    pub fn geodetic(&self, point: Point2) -> LatLon {
        let mut up = 0.0;
        let mut place = self.origin;
        for _ in 0..ROUNDS {
            let enu = Vector3::new(point.x, point.y, up);
            let (reached, height) = on_earth(self.center + self.axes.tr_mul(&enu));
            place = reached;
            up += self.height_m - height;
        }
        place
    }
}

/// Earth-centred coordinates, metres, of a place at `height_m` above the ellipsoid.
fn earth_centred(place: LatLon, height_m: f64) -> Vector3<f64> {
    let wgs84 = Wgs84::builder()
        .latitude(Angle::new::<degree>(place.lat.clamp(-90.0, 90.0)))
        .expect("a latitude between the poles")
        .longitude(Angle::new::<degree>(place.lon))
        .altitude(Length::new::<meter>(height_m))
        .build();
    let [x, y, z] = Coordinate::<Ecef>::from_wgs84(&wgs84).to_cartesian();
    Vector3::new(x.get::<meter>(), y.get::<meter>(), z.get::<meter>())
}

/// The place of earth-centred coordinates, and its height above the ellipsoid.
fn on_earth(point: Vector3<f64>) -> (LatLon, f64) {
    let ecef = Coordinate::<Ecef>::builder()
        .x(Length::new::<meter>(point.x))
        .y(Length::new::<meter>(point.y))
        .z(Length::new::<meter>(point.z))
        .build();
    let wgs84 = ecef.to_wgs84();
    let place = LatLon {
        lat: wgs84.latitude().get::<degree>(),
        lon: wgs84.longitude().get::<degree>(),
    };
    (place, wgs84.altitude().get::<meter>())
}

/// Height of the EGM96 geoid (mean sea level) above the ellipsoid at `place`, metres, rounded to a micrometre: below
/// that its sum of harmonics depends on the platform.
#[must_use]
pub fn undulation_m(place: LatLon) -> f64 {
    let exact = egm96::egm96_compute_altitude_offset(place.lat, place.lon);
    (exact * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const JACKSBORO: LatLon = LatLon {
        lat: 36.59,
        lon: -84.25,
    };

    #[test]
    fn agrees_with_proj() {
        const CASES: [(f64, f64, f64, f64); 4] = [
            (36.59, -84.25, 0.0, 0.0),
            (36.7, -84.1, 13_404.636_542_1, 12_217.837_889_3),
            (37.4, -83.6, 57_554.569_603_5, 90_087.669_874_1),
            (35.9, -85.0, -67_709.282_786_1, -76_302.451_239_5),
        ];
        // PROJ 9.5.1, +proj=topocentric after +proj=cart, heights of both ends 300 m.
        let plane = TangentPlane::at(JACKSBORO, 300.0);
        for (lat, lon, x, y) in CASES {
            let local = plane.local(LatLon { lat, lon });
            assert!(
                (local.x - x).abs() < 1e-6 && (local.y - y).abs() < 1e-6,
                "{local}"
            );
        }
    }

    proptest! {
        #[test]
        fn a_place_comes_back(lat in -90.0..90.0f64, lon in -180.0..180.0f64, height in -400.0..9000.0f64,
                              x in -1e5..1e5f64, y in -1e5..1e5f64) {
            let plane = TangentPlane::at(LatLon { lat, lon }, height);
            let point = Point2::new(x, y);
            let back = plane.local(plane.geodetic(point));
            prop_assert!((back - point).norm() < 1e-6, "{back} {point}");
        }
    }

    #[test]
    fn a_box_contains_its_edge_however_that_is_written() {
        let check = |[west, east]: [f64; 2], within: &[f64], beyond: &[f64]| {
            let corner = |lat, lon| LatLon { lat, lon };
            let area = LatLonBox {
                min: corner(10.0, west),
                max: corner(11.0, east),
            };
            for (lons, expected) in [(within, true), (beyond, false)] {
                for lon in lons {
                    let contained = area.contains(corner(10.5, *lon));
                    assert_eq!(contained, expected, "{lon} in {west} to {east}");
                }
            }
            assert!(!area.contains(corner(9.9, within[0])));
        };
        check([-180.0, -179.9], &[180.0, -180.0, -179.9], &[179.9, -179.8]);
        check([179.9, 180.0], &[179.9, 180.0, -180.0], &[-179.9, 179.8]);
        check(
            [179.9, -179.9],
            &[179.9, 180.0, -180.0, -179.9],
            &[179.8, -179.8, 0.0],
        );
        check([180.0, -179.9], &[180.0, -180.0, -179.9], &[179.9, -179.8]);
        check([179.9, -180.0], &[179.9, 180.0, -180.0], &[-179.9, 179.8]);
        check(
            [-84.1, -84.0],
            &[-84.1, -84.0],
            &[-84.11, -83.99, 180.0, -180.0],
        );
        check([-180.0, 180.0], &[-180.0, 0.0, 180.0], &[]);
    }

    #[test]
    fn the_geoid_is_where_it_was_surveyed() {
        // GeographicLib's GeoidEval, egm96-5, within its error of a few centimetres.
        for (lat, lon, height) in [
            (36.59, -84.25, -31.0),
            (0.0, 0.0, 17.16),
            (90.0, 0.0, 13.61),
        ] {
            let here = undulation_m(LatLon { lat, lon });
            assert!((here - height).abs() < 1.0, "{lat} {lon}: {here}");
        }
    }
}
