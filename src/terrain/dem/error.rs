//! What can be wrong with an elevation file or with a request for its elevations.

use std::io;

use super::Format;
use crate::geometry::geodesy::LatLon;

/// Why a dataset cannot be used, or not at some place.
#[derive(Debug, thiserror::Error)]
pub enum DemError {
    /// The operating system's error; not a source, because the message has all of it.
    #[error("the file cannot be read: {0}")]
    Io(io::Error),
    /// The format is not recognised.
    #[error(
        "the file is none of GeoTIFF, ESRI ASCII grid and SRTM .hgt (1201 x 1201 or 3601 x 3601 samples)"
    )]
    UnknownFormat,
    /// The caller declares one format, but the content is another.
    #[error("the file is said to be {said}, but it is {found}")]
    OtherFormat {
        /// Declared by the caller.
        said: Format,
        /// Found in the content.
        found: Format,
    },
    /// Damaged, truncated, or not allowed by its format.
    #[error("the file is not a valid {format}: {reason}")]
    Malformed {
        /// The format of the file.
        format: Format,
        /// What is wrong, and where.
        reason: String,
    },
    /// Allowed by its format, but not supported here.
    #[error("{found}; must be {allowed}")]
    Unsupported {
        /// What the file holds.
        found: String,
        /// What is supported.
        allowed: &'static str,
    },
    /// Above a limit.
    #[error("{what} is {value}, must be at most {limit}")]
    TooLarge {
        /// The quantity.
        what: &'static str,
        /// Its value in the file or in the request.
        value: u64,
        /// The greatest value allowed.
        limit: u64,
    },
    /// Neither the file nor the caller states the coordinate reference system.
    #[error(
        "the file names no coordinate reference system, such as EPSG:32616, or EPSG:4326 for degrees; state it as `crs` (?crs=EPSG:32616 of an upload), or write a file that names it: gdal_translate -a_srs EPSG:32616 in.asc out.tif"
    )]
    NoCrs,
    /// A reference system that cannot be used.
    #[error("the coordinate reference system {crs} cannot be used: {reason}")]
    UnusableCrs {
        /// As given.
        crs: String,
        /// Why it cannot be used.
        reason: String,
    },
    /// The caller declares another reference system than the file.
    #[error("the file is in {found}, but `crs` says {said}")]
    OtherCrs {
        /// Declared by the caller.
        said: String,
        /// Found in the file.
        found: String,
    },
    /// An impossible elevation: most often an undeclared no-data value.
    #[error(
        "row {row}, column {column} holds {value} m, must be within -12000 to 12000 m and not -9999; is it a no-data value that the file does not declare?"
    )]
    Elevation {
        /// From the top, starting at 0.
        row: usize,
        /// From the left, starting at 0.
        column: usize,
        /// Metres.
        value: f64,
    },
    /// There is nothing in the file that could be used.
    #[error("the file holds no elevation: none of its {columns} x {rows} samples has data")]
    Empty {
        /// Samples from left to right.
        columns: usize,
        /// From top to bottom.
        rows: usize,
    },
    /// No elevation is known there: it is beyond the outermost samples.
    #[error("latitude {:.6}, longitude {:.6} lies outside the elevations, which reach from latitude {:.6} to {:.6} and from longitude {:.6} to {:.6}", .at.lat, .at.lon, .south_west.lat, .north_east.lat, .south_west.lon, .north_east.lon)]
    Outside {
        /// One of the places requested.
        at: LatLon,
        /// Least latitude and longitude of the elevations.
        south_west: LatLon,
        /// Greatest latitude and longitude; the longitude exceeds 180 where they cross the antimeridian.
        north_east: LatLon,
    },
    /// A hole in the data.
    #[error("there is no elevation at latitude {:.6}, longitude {:.6}: row {row}, column {column} holds no data", .at.lat, .at.lon)]
    NoData {
        /// Position of the sample.
        at: LatLon,
        /// From the top of the file, starting at 0.
        row: usize,
        /// From the left, starting at 0.
        column: usize,
    },
}

impl From<io::Error> for DemError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl DemError {
    /// Whether the file may be readable later as it is: the operating system fails, and not because there is no file.
    #[must_use]
    pub(crate) fn is_passing(&self) -> bool {
        matches!(self, Self::Io(error)
            if error.raw_os_error().is_some() && error.kind() != io::ErrorKind::NotFound)
    }

    pub(super) fn malformed(format: Format, reason: impl Into<String>) -> Self {
        Self::Malformed {
            format,
            reason: reason.into(),
        }
    }
}
