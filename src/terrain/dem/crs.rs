//! Coordinate reference systems by EPSG code, converted to and from WGS 84 degrees.
//!
//! Degrees of WGS 84, and of datums treated as equal to it, need no projection library. Deliberately unsupported:
//! datum shifts by grid files, which would have to be shipped.

use std::fmt;
use std::sync::Arc;

use proj4rs::Proj;
use proj4rs::errors::Error;

use super::{DemError, heights, shifts};
use crate::geometry::geodesy::LatLon;

/// WGS 84 as a PROJ string.
const WGS84: &str = "+proj=longlat +datum=WGS84 +no_defs";

/// Why a code that nobody has heard of cannot be used.
const UNKNOWN: &str = "its definition is not known";

/// What helps where the library cannot use a definition.
const REWRITE: &str = "rewrite the file in another one, such as by gdalwarp -t_srs EPSG:4326";

/// A coordinate reference system.
#[derive(Clone)]
pub struct Crs {
    code: u16,
    plane: Option<Arc<Plane>>,
}

/// A system other than plain WGS 84 degrees.
struct Plane {
    own: Proj,
    wgs84: Proj,
    /// Whether its coordinates are degrees.
    degrees: bool,
    /// How far east the earth's whole circumference reaches, if that is the same at every latitude; in its own unit.
    turn: Option<f64>,
}

impl Crs {
    /// EPSG:4326.
    #[must_use]
    pub fn wgs84() -> Self {
        Self {
            code: 4326,
            plane: None,
        }
    }

    /// By name, such as `EPSG:32616`.
    ///
    /// # Errors
    /// [`DemError::UnusableCrs`] when the name is not an EPSG code, is unknown, is neither geographic nor projected,
    /// or has no known relation to WGS 84.
    pub fn parse(name: &str) -> Result<Self, DemError> {
        let unusable = |reason: &str| DemError::UnusableCrs {
            crs: name.chars().take(80).collect(),
            reason: reason.into(),
        };
        let is_number =
            |code: &&str| !code.is_empty() && code.bytes().all(|at| at.is_ascii_digit());
        let code = name
            .trim()
            .split_once(':')
            .filter(|(authority, _)| authority.eq_ignore_ascii_case("EPSG"))
            .map(|(_, code)| code)
            .filter(is_number)
            .ok_or_else(|| unusable("it must be an EPSG code, such as EPSG:4326"))?;
        let code = code.parse().map_err(|_| unusable(UNKNOWN))?;
        Self::epsg(code)
    }

    /// By EPSG code.
    ///
    /// # Errors
    /// As [`Crs::parse`].
    pub fn epsg(code: u16) -> Result<Self, DemError> {
        let unusable = |reason: String| DemError::UnusableCrs {
            crs: format!("EPSG:{code}"),
            reason,
        };
        let definition = crs_definitions::from_code(code)
            .ok_or_else(|| unusable(UNKNOWN.into()))?
            .proj4;
        if heights::are_above_ellipsoid(code) {
            return Err(unusable(
                "its heights are above the ellipsoid, must be above sea level; EPSG:4326+5773 has such heights".into(),
            ));
        }
        if let Some(reason) = shifts::refusal(code) {
            return Err(unusable(reason.into()));
        }
        let mended = shifts::mended(code);
        let words: Vec<&str> = definition
            .split_whitespace()
            .filter(|word| mended.is_none() || !word.starts_with("+towgs84="))
            .chain(mended)
            .collect();
        let says = |word: &str| words.contains(&word);
        let shift = |name: &str| words.iter().any(|word| word.starts_with(name));
        let modern = says("+datum=WGS84")
            || says("+datum=NAD83")
            || ((says("+ellps=GRS80") || says("+ellps=WGS84"))
                && !shift("+datum=")
                && words.iter().all(|word| is_null_shift(word)));
        if let Some(unit) = words.iter().find_map(|word| word.strip_prefix("+vunits="))
            && unit != "m"
        {
            return Err(unusable(format!(
                "its heights are in the unit {unit:?}, must be in metres"
            )));
        }
        let degrees = says("+proj=longlat");
        if degrees && modern && !shift("+pm=") && !shift("+axis=") {
            return Ok(Self { code, plane: None });
        }
        if !(modern || shift("+datum=") || shift("+towgs84=") || says("+nadgrids=@null")) {
            return Err(unusable("its shift to WGS 84 is not known".into()));
        }
        let proj = |text: &str| {
            Proj::from_proj_string(text).map_err(|error| {
                let reason = match error {
                    Error::NadGridNotAvailable => {
                        "its shift to WGS 84 is in a file that is not read here".to_owned()
                    }
                    error => format!("its definition cannot be read here ({error})"),
                };
                unusable(format!("{reason}; {REWRITE}"))
            })
        };
        let own = proj(&words.join(" "))?;
        if own.is_geocent() {
            return Err(unusable(
                "it is earth-centred, must be geographic or projected".into(),
            ));
        }
        let mut plane = Plane {
            own,
            wgs84: proj(WGS84)?,
            degrees,
            turn: Some(360.0),
        };
        if !degrees {
            plane.turn = plane.circumference(&words);
        }
        Ok(Self {
            code,
            plane: Some(Arc::new(plane)),
        })
    }

    /// Whether coordinates are degrees of longitude and latitude.
    #[must_use]
    pub fn is_geographic(&self) -> bool {
        self.plane.as_ref().is_none_or(|plane| plane.degrees)
    }

    /// The length of the unit of coordinates on a map, metres; `None` for degrees.
    pub(super) fn metres(&self) -> Option<f64> {
        let plane = self.plane.as_ref().filter(|plane| !plane.degrees)?;
        Some(plane.own.to_meter())
    }

    /// How far east of a place the same place lies once more: 360 degrees, or the width of the whole earth on a map
    /// whose meridians are straight, parallel and evenly spaced. `None` on all other maps.
    pub(super) fn turn(&self) -> Option<f64> {
        self.plane.as_ref().map_or(Some(360.0), |plane| plane.turn)
    }

    /// East and north of `place`, in the system's unit; `None` outside its domain.
    pub(super) fn east_north(&self, place: LatLon) -> Option<[f64; 2]> {
        let Some(plane) = &self.plane else {
            return Some([place.lon, place.lat]);
        };
        plane.east_north(place)
    }

    /// The place at `[east, north]`; `None` outside the system's domain.
    pub(super) fn geodetic(&self, [east, north]: [f64; 2]) -> Option<LatLon> {
        let Some(plane) = &self.plane else {
            return finite([east, north]).map(|[lon, lat]| LatLon { lat, lon });
        };
        plane.geodetic([east, north])
    }
}

impl Plane {
    fn east_north(&self, place: LatLon) -> Option<[f64; 2]> {
        let mut point = (place.lon.to_radians(), place.lat.to_radians(), 0.0);
        proj4rs::transform::transform(&self.wgs84, &self.own, &mut point).ok()?;
        let scale = |value: f64| {
            if self.degrees {
                value.to_degrees()
            } else {
                value
            }
        };
        finite([scale(point.0), scale(point.1)])
    }

    fn geodetic(&self, [east, north]: [f64; 2]) -> Option<LatLon> {
        let scale = |value: f64| {
            if self.degrees {
                value.to_radians()
            } else {
                value
            }
        };
        let mut point = (scale(east), scale(north), 0.0);
        proj4rs::transform::transform(&self.own, &self.wgs84, &mut point).ok()?;
        finite([point.0.to_degrees(), point.1.to_degrees()]).map(|[lon, lat]| LatLon { lat, lon })
    }

    /// [`Crs::turn`] of a map with the definition `words`.
    fn circumference(&self, words: &[&str]) -> Option<f64> {
        let middle = words
            .iter()
            .find_map(|word| word.strip_prefix("+lon_0="))
            .map_or(Some(0.0), |lon| lon.parse::<f64>().ok())?;
        let east = |lat: f64, degrees: f64| {
            let lon = (middle + degrees + 180.0).rem_euclid(360.0) - 180.0;
            Some(self.east_north(LatLon { lat, lon })?[0])
        };
        let quarter = east(0.0, 90.0)? - east(0.0, 0.0)?;
        for lat in [-60.0, 0.0, 60.0] {
            for degrees in [-135.0, -45.0, 45.0, 135.0] {
                let expected = quarter * degrees / 90.0;
                let found = east(lat, degrees)? - east(0.0, 0.0)?;
                // A tenth of a metre; a shift of datum bends meridians by more.
                if (found - expected).abs() > 1e-8 * quarter.abs() {
                    return None;
                }
            }
        }
        (quarter > 0.0).then_some(4.0 * quarter)
    }
}

fn finite(pair: [f64; 2]) -> Option<[f64; 2]> {
    pair.iter().all(|value| value.is_finite()).then_some(pair)
}

/// Whether a word of a definition implies no shift from WGS 84. GRS 80 and WGS 84 differ by a tenth of a millimetre.
fn is_null_shift(word: &str) -> bool {
    word.strip_prefix("+towgs84=")
        .is_none_or(|shift| shift.split(',').all(|part| part.parse() == Ok(0.0)))
        && !word.starts_with("+nadgrids=")
}

impl PartialEq for Crs {
    fn eq(&self, other: &Self) -> bool {
        self.code == other.code
    }
}

impl fmt::Display for Crs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "EPSG:{}", self.code)
    }
}

impl fmt::Debug for Crs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where PROJ 9.5 puts places in systems whose definitions were wrong, and in some whose definitions never were.
    #[test]
    fn places_lie_where_proj_puts_them() {
        for (code, lon, lat, expected) in [
            (2039, 35.0, 32.0, [200_137.81, 656_336.67]),
            // The registry has a shift of its own for this plane, the opposite of the other one's.
            (6991, 35.0, 32.0, [200_137.81, 656_336.67]),
            (3844, 25.0, 46.0, [500_120.37, 500_031.31]),
            (31_281, 10.5, 47.3, [12_628.81, 5_240_143.28]),
            (31_290, 16.0, 48.2, [725_310.17, 5_340_231.53]),
            (5562, 24.0, 49.8, [4_716_084.68, 5_523_049.3]),
            (3912, 14.5, 46.0, [461_642.64, 95_212.0]),
            (30_731, 3.0, 30.0, [500_068.96, 3_318_479.5]),
            (2059, 54.0, 32.0, [783_411.85, 3_544_542.68]),
            (24_047, 100.0, 15.0, [608_027.57, 1_658_216.04]),
            (27_700, -2.0, 54.0, [400_097.65, 455_996.5]),
            (28_992, 5.0, 52.0, [128_410.09, 445_806.51]),
            (31_256, 16.0, 48.2, [-24_689.83, 340_231.53]),
        ] {
            let crs = Crs::epsg(code).expect("it is known");
            let found = crs.east_north(LatLon { lat, lon }).expect("it is near");
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 0.05,
                    "EPSG:{code}: {found} {expected}"
                );
            }
        }
        let crs = Crs::epsg(4688).expect("it is known");
        let place = LatLon {
            lat: -10.48,
            lon: -138.65,
        };
        let [lon, lat] = crs.east_north(place).expect("it is near");
        assert!(
            (lon + 138.648_404_5).abs() < 5e-7 && (lat + 10.480_935_7).abs() < 5e-7,
            "{lon} {lat}"
        );
    }

    #[test]
    fn a_name_is_refused_for_its_form_or_for_its_code() {
        let form = "must be an EPSG code";
        for (name, reason) in [
            ("EPSG:1", UNKNOWN),
            ("EPSG:99999", UNKNOWN),
            ("EPSG:99999999999999999999", UNKNOWN),
            ("EPSG:", form),
            ("EPSG:4326+5773", form),
            ("4326", form),
            ("OGC:84", form),
        ] {
            let error = Crs::parse(name).expect_err("it is refused").to_string();
            assert!(error.contains(reason), "{error}");
        }
        assert!(Crs::parse(" epsg:4326 ").is_ok());
    }

    #[test]
    fn systems_that_are_not_known_well_enough_are_refused() {
        for (code, reason) in [
            (5514, "is not known well enough"),
            (2319, "is not known well enough"),
            (31_277, "is not known well enough"),
            (3973, "is not known well enough"),
            (4807, "its coordinates are in grads"),
            (4979, "above the ellipsoid"),
            (8713, "in the unit \"us-ft\""),
            (
                4267,
                "in a file that is not read here; rewrite the file in another one",
            ),
            (26_716, "such as by gdalwarp -t_srs EPSG:4326"),
            (27_200, "(Projection not found); rewrite the file"),
        ] {
            let error = Crs::epsg(code).expect_err("it is refused").to_string();
            assert!(error.contains(reason), "{error}");
        }
    }
}
