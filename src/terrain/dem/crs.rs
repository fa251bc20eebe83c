//! Coordinate reference systems by EPSG code, converted to and from WGS 84 degrees.
//!
//! Degrees of WGS 84, and of datums treated as equal to it, need no projection library. Deliberately unsupported:
//! datum shifts by grid files, which would have to be shipped.

use std::fmt;
use std::sync::Arc;

use proj4rs::Proj;

use super::{DemError, heights};
use crate::geometry::geodesy::LatLon;

/// WGS 84 as a PROJ string.
const WGS84: &str = "+proj=longlat +datum=WGS84 +no_defs";

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
        let code = name.trim().split_once(':').and_then(|(authority, code)| {
            authority
                .eq_ignore_ascii_case("EPSG")
                .then_some(code)?
                .parse()
                .ok()
        });
        let Some(code) = code else {
            return Err(DemError::UnusableCrs {
                crs: name.chars().take(80).collect(),
                reason: "it must be an EPSG code, such as EPSG:4326".into(),
            });
        };
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
            .ok_or_else(|| unusable("its definition is not known".into()))?
            .proj4;
        if heights::are_above_ellipsoid(code) {
            return Err(unusable(
                "its heights are above the ellipsoid, must be above sea level; EPSG:4326+5773 has such heights".into(),
            ));
        }
        let words: Vec<&str> = definition.split_whitespace().collect();
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
        let proj =
            |text: &str| Proj::from_proj_string(text).map_err(|error| unusable(error.to_string()));
        let own = proj(definition)?;
        if own.is_geocent() {
            return Err(unusable(
                "it is earth-centred, must be geographic or projected".into(),
            ));
        }
        Ok(Self {
            code,
            plane: Some(Arc::new(Plane {
                own,
                wgs84: proj(WGS84)?,
                degrees,
            })),
        })
    }

    /// Whether coordinates are degrees of longitude and latitude.
    #[must_use]
    pub fn is_geographic(&self) -> bool {
        self.plane.as_ref().is_none_or(|plane| plane.degrees)
    }

    /// East and north of `place`, in the system's unit; `None` outside its domain.
    pub(super) fn east_north(&self, place: LatLon) -> Option<[f64; 2]> {
        let Some(plane) = &self.plane else {
            return Some([place.lon, place.lat]);
        };
        let mut point = (place.lon.to_radians(), place.lat.to_radians(), 0.0);
        proj4rs::transform::transform(&plane.wgs84, &plane.own, &mut point).ok()?;
        let scale = |value: f64| {
            if plane.degrees {
                value.to_degrees()
            } else {
                value
            }
        };
        finite([scale(point.0), scale(point.1)])
    }

    /// The place at `[east, north]`; `None` outside the system's domain.
    pub(super) fn geodetic(&self, [east, north]: [f64; 2]) -> Option<LatLon> {
        let Some(plane) = &self.plane else {
            return finite([east, north]).map(|[lon, lat]| LatLon { lat, lon });
        };
        let scale = |value: f64| {
            if plane.degrees {
                value.to_radians()
            } else {
                value
            }
        };
        let mut point = (scale(east), scale(north), 0.0);
        proj4rs::transform::transform(&plane.own, &plane.wgs84, &mut point).ok()?;
        finite([point.0.to_degrees(), point.1.to_degrees()]).map(|[lon, lat]| LatLon { lat, lon })
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
