//! What is wrong with a file of elevations, or with asking it for some.

use super::Format;
use crate::geometry::geodesy::LatLon;

/// Why a dataset cannot be used, or not there.
#[derive(Debug, thiserror::Error)]
pub enum DemError {
    /// The operating system's reason.
    #[error("the file cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// No reader knows the file.
    #[error(
        "the file is none of GeoTIFF, ESRI ASCII grid and SRTM .hgt (1201 x 1201 or 3601 x 3601 samples)"
    )]
    UnknownFormat,
    /// The caller says it is one format, the content another.
    #[error("the file is said to be {said}, but it is {found}")]
    OtherFormat {
        /// By the caller.
        said: Format,
        /// In the content.
        found: Format,
    },
    /// Damaged, cut off, or not what its format allows.
    #[error("the file is not a valid {format}: {reason}")]
    Malformed {
        /// The format that it claims.
        format: Format,
        /// What is wrong, and where.
        reason: String,
    },
    /// Allowed by its format, but not here.
    #[error("{found}; must be {allowed}")]
    Unsupported {
        /// What the file holds.
        found: String,
        /// What could be read.
        allowed: &'static str,
    },
    /// More than is taken.
    #[error("{what} is {value}, must be at most {limit}")]
    TooLarge {
        /// The measure.
        what: &'static str,
        /// In the file, or asked for.
        value: u64,
        /// Most allowed.
        limit: u64,
    },
    /// Neither the file nor the caller says where the elevations belong.
    #[error(
        "the file names no coordinate reference system, and its extent does not fit into degrees; state `crs`, such as EPSG:32616"
    )]
    NoCrs,
    /// A reference system that cannot be used.
    #[error("the coordinate reference system {crs} cannot be used: {reason}")]
    UnusableCrs {
        /// As given.
        crs: String,
        /// Why not.
        reason: String,
    },
    /// The caller names another reference system than the file.
    #[error("the file is in {found}, but `crs` says {said}")]
    OtherCrs {
        /// By the caller.
        said: String,
        /// In the file.
        found: String,
    },
    /// An elevation that no ground has: most often an undeclared no-data value.
    #[error(
        "row {row}, column {column} holds {value} m, must be within -12000 to 12000 m; is it a no-data value that the file does not declare?"
    )]
    Elevation {
        /// From the top, 0 the first.
        row: usize,
        /// From the left, 0 the first.
        column: usize,
        /// Metres.
        value: f64,
    },
    /// No elevation is known there: beyond the outermost samples.
    #[error("latitude {:.6}, longitude {:.6} lies outside the elevations, which reach from latitude {:.6} to {:.6} and from longitude {:.6} to {:.6}", .at.lat, .at.lon, .south_west.lat, .north_east.lat, .south_west.lon, .north_east.lon)]
    Outside {
        /// A place of those asked for.
        at: LatLon,
        /// Least latitude and longitude of the elevations.
        south_west: LatLon,
        /// Greatest; a longitude beyond 180 where they cross the antimeridian.
        north_east: LatLon,
    },
    /// A hole in the data.
    #[error("there is no elevation at latitude {:.6}, longitude {:.6}: row {row}, column {column} holds no data", .at.lat, .at.lon)]
    NoData {
        /// Where the sample stands.
        at: LatLon,
        /// From the top of the file, 0 the first.
        row: usize,
        /// From its left.
        column: usize,
    },
}

impl DemError {
    pub(super) fn malformed(format: Format, reason: impl Into<String>) -> Self {
        Self::Malformed {
            format,
            reason: reason.into(),
        }
    }
}
