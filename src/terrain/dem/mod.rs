//! Digital elevation models: elevation files, and the ground of a scenario cut out of one.
//!
//! A [`Dataset`] is a file whose headers have been read, but no samples. [`Dataset::survey`] reads all samples once,
//! block by block, to check an upload; [`Dataset::ground`] reads the samples under one scenario. Deliberately absent:
//! names, catalogues, uploads, and interpolation of holes: where a file has no elevation, there is no ground.

mod ascii_grid;
mod coverage;
mod crs;
mod error;
mod fit;
mod geotiff;
mod ground;
mod heights;
mod hgt;
mod lattice;
mod raster;
mod shifts;
mod slabs;
mod way;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use crs::Crs;
pub use error::DemError;
pub use ground::Dem;
pub use lattice::{Degrees, Lattice};
pub use raster::Raster;
use raster::{Span, Visit, Wanted};

use crate::geometry::Rect;
use crate::geometry::geodesy::{LatLon, TangentPlane};

/// Most samples in a file, so that reading it ends.
pub const MOST_SAMPLES: u64 = 1 << 30;

/// Most columns, and most rows, so that a row stays small.
pub const MOST_ALONG: u64 = 1 << 18;

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `GeoTIFF`, including cloud-optimised ones.
    GeoTiff,
    /// ESRI ASCII grid, `.asc`.
    AsciiGrid,
    /// SRTM tiles, `.hgt`.
    Hgt,
}

/// What is known about a file besides its content.
#[derive(Debug, Clone, Copy, Default)]
pub struct Declared<'a> {
    /// Its format; `None` means to detect it from the content.
    pub format: Option<Format>,
    /// Its reference system, such as `EPSG:32616`, for files that state none.
    pub crs: Option<&'a str>,
    /// The file's own name, where the path does not end in it; that of an SRTM tile is its position, such as
    /// `N36W085.hgt`.
    pub name: Option<&'a str>,
}

/// The type of the samples in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleType {
    /// 8 bits without sign.
    U8,
    /// 8 bits with sign.
    I8,
    /// 16 bits without sign.
    U16,
    /// 16 bits with sign.
    I16,
    /// 32 bits without sign.
    U32,
    /// 32 bits with sign.
    I32,
    /// Single precision.
    F32,
    /// Double precision; read as single, with a resolution of 0.06 mm at 1000 m.
    F64,
    /// Decimal text; read as single precision.
    Text,
}

/// What a file's headers say.
#[derive(Debug, Clone, PartialEq)]
pub struct Metadata {
    /// Format of the file.
    pub format: Format,
    /// Where the samples lie.
    pub lattice: Lattice,
    /// Bounds of the outermost samples, degrees.
    pub degrees: Degrees,
    /// Type of the samples.
    pub sample_type: SampleType,
    /// Value of a sample without data.
    pub no_data: Option<f64>,
}

/// Summary of all samples of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survey {
    /// Lowest elevation, metres; infinite when no sample has data.
    pub min: f64,
    /// Highest elevation, metres; negative infinity when no sample has data.
    pub max: f64,
    /// Samples without data, as a fraction of all.
    pub no_data_share: f64,
}

impl Survey {
    /// Whether no sample has data.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.min > self.max
    }
}

/// A file whose headers have been read and checked.
#[derive(Debug, Clone)]
pub struct Dataset {
    path: PathBuf,
    metadata: Metadata,
    reader: Reader,
}

/// How to read the samples.
#[derive(Debug, Clone)]
enum Reader {
    GeoTiff(Arc<geotiff::Layout>),
    AsciiGrid(ascii_grid::Layout),
    Hgt(hgt::Layout),
}

impl SampleType {
    /// Size of a binary sample, bytes.
    fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 | Self::Text => 4,
            Self::F64 => 8,
        }
    }
}

/// Read the headers of the file at `path`.
///
/// An ESRI ASCII grid without `crs` is taken to be in EPSG:4326 when its extent fits into degrees.
///
/// # Errors
/// Every [`DemError`] but [`DemError::Empty`], [`DemError::Outside`], [`DemError::NoData`] and [`DemError::Elevation`].
pub fn open(path: &Path, declared: Declared<'_>) -> Result<Dataset, DemError> {
    let len = std::fs::metadata(path)?.len();
    let format = format(path, len, declared.format)?;
    let said = declared.crs.map(Crs::parse).transpose()?;
    let own_name = path
        .file_name()
        .and_then(|name| name.to_str())
        .unwrap_or_default();
    let (reader, lattice, sample_type, no_data) = match format {
        Format::GeoTiff => {
            let headers = geotiff::open(path)?;
            let crs = agreed(said, headers.crs)?.ok_or(DemError::NoCrs)?;
            let lattice = Lattice {
                crs,
                columns: headers.columns,
                rows: headers.rows,
                first: headers.first,
                step: headers.step,
            };
            let reader = Reader::GeoTiff(Arc::new(headers.layout));
            (reader, lattice, headers.sample, headers.no_data)
        }
        Format::AsciiGrid => {
            let layout = ascii_grid::open(path, len)?;
            let lattice = layout.lattice(said.clone().unwrap_or_else(Crs::wgs84));
            let [[west, east], [south, north]] = lattice.extent();
            let fits = -180.0 <= west && east <= 180.0 && -90.0 <= south && north <= 90.0;
            if said.is_none() && !fits {
                return Err(DemError::NoCrs);
            }
            let no_data = Some(layout.no_data);
            (
                Reader::AsciiGrid(layout),
                lattice,
                SampleType::Text,
                no_data,
            )
        }
        Format::Hgt => {
            let (layout, lattice) = hgt::open(len, declared.name.unwrap_or(own_name))?;
            agreed(said, Some(lattice.crs.clone()))?;
            (
                Reader::Hgt(layout),
                lattice,
                SampleType::I16,
                Some(hgt::NO_DATA),
            )
        }
    };
    let degrees = check(format, &lattice)?;
    Ok(Dataset {
        path: path.to_owned(),
        metadata: Metadata {
            format,
            lattice,
            degrees,
            sample_type,
            no_data,
        },
        reader,
    })
}

/// The one name for the SRTM tiles of a place, of all file names that they may have; `None` if `name` is none of them.
#[must_use]
pub fn canonical_tile(name: &str) -> Option<String> {
    hgt::canonical(name)
}

/// Detect the format of a file from its content.
fn format(path: &Path, len: u64, said: Option<Format>) -> Result<Format, DemError> {
    let mut beginning = Vec::new();
    File::open(path)?.take(256).read_to_end(&mut beginning)?;
    let found = if geotiff::is_tiff(&beginning) {
        Format::GeoTiff
    } else if ascii_grid::is_grid(&beginning) {
        Format::AsciiGrid
    } else if hgt::is_tile(len) {
        Format::Hgt
    } else {
        return Err(DemError::UnknownFormat);
    };
    match said.filter(|said| *said != found) {
        Some(said) => Err(DemError::OtherFormat { said, found }),
        None => Ok(found),
    }
}

/// The reference system of a file, provided that the file's own and the declared one do not differ.
fn agreed(said: Option<Crs>, found: Option<Crs>) -> Result<Option<Crs>, DemError> {
    match (said, found) {
        (Some(said), Some(found)) if said != found => Err(DemError::OtherCrs {
            said: said.to_string(),
            found: found.to_string(),
        }),
        (said, found) => Ok(found.or(said)),
    }
}

/// Check that a lattice is small enough to read and lies on the earth; returns its extent in degrees.
fn check(format: Format, lattice: &Lattice) -> Result<Degrees, DemError> {
    let [columns, rows] = [lattice.columns, lattice.rows].map(|count| count as u64);
    for (what, value, limit) in [
        ("the number of columns", columns, MOST_ALONG),
        ("the number of rows", rows, MOST_ALONG),
        (
            "the number of samples",
            columns.saturating_mul(rows),
            MOST_SAMPLES,
        ),
    ] {
        if value > limit {
            return Err(DemError::TooLarge { what, value, limit });
        }
    }
    let [[west, east], [south, north]] = lattice.extent();
    let astray = || {
        DemError::malformed(
            format,
            format!(
                "it reaches from {west} to {east} east and from {south} to {north} north, which {} does not",
                lattice.crs
            ),
        )
    };
    if lattice.crs.is_geographic() && (east - west > 360.0 || west < -360.0 || east > 720.0) {
        return Err(astray());
    }
    lattice.degrees().ok_or_else(astray)
}

impl Dataset {
    /// What the headers say.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// Read every sample once, in bounded memory; this detects truncated and damaged files.
    ///
    /// # Errors
    /// [`DemError::Malformed`], [`DemError::Io`], [`DemError::Elevation`].
    pub fn survey(&self) -> Result<Survey, DemError> {
        let lattice = &self.metadata.lattice;
        let (mut min, mut max, mut known) = (f32::INFINITY, f32::NEG_INFINITY, 0_usize);
        self.read(&lattice.span(), Wanted::All, &mut |_, _, samples| {
            for sample in samples.iter().filter(|sample| !sample.is_nan()) {
                (min, max) = (min.min(*sample), max.max(*sample));
                known += 1;
            }
            Ok(())
        })?;
        Ok(Survey {
            min: min.into(),
            max: max.into(),
            no_data_share: 1.0 - known as f64 / (lattice.columns * lattice.rows) as f64,
        })
    }

    /// Whether `place` lies among the samples, with or without data.
    #[must_use]
    pub fn covers(&self, place: LatLon) -> bool {
        let lattice = &self.metadata.lattice;
        let cells = lattice.cells(place);
        cells.is_some_and(|cells| lattice.cell(cells).is_some())
    }

    /// The elevations at `places`, metres, bilinear; `None` outside the samples and next to one without data. Reads
    /// the file once, and only those of its blocks that are needed.
    ///
    /// # Errors
    /// As [`Dataset::survey`].
    pub fn sample(&self, places: &[LatLon]) -> Result<Vec<Option<f64>>, DemError> {
        let lattice = &self.metadata.lattice;
        let cells: Vec<_> = places
            .iter()
            .map(|place| lattice.cells(*place).and_then(|cells| lattice.cell(cells)))
            .collect();
        let mut nodes = BTreeSet::new();
        for ([column, row], _) in cells.iter().flatten() {
            for node in [
                [*row, *column],
                [*row, column + 1],
                [row + 1, *column],
                [row + 1, column + 1],
            ] {
                nodes.insert(node);
            }
        }
        let Some(span) = span(nodes.iter()) else {
            return Ok(vec![None; places.len()]);
        };
        let mut known = BTreeMap::new();
        self.read(&span, Wanted::Some(&nodes), &mut |row, column, samples| {
            for node in nodes.range([row, column]..[row, column + samples.len()]) {
                known.insert(*node, samples[node[1] - column]);
            }
            Ok(())
        })?;
        let elevation = |([column, row], [x, y]): ([usize; 2], [f64; 2])| {
            let at = |row, column| f64::from(known[&[row, column]]);
            let along = |row| at(row, column) + x * (at(row, column + 1) - at(row, column));
            let (above, below) = (along(row), along(row + 1));
            let elevation = above + y * (below - above);
            (!elevation.is_nan()).then_some(elevation)
        };
        Ok(cells
            .into_iter()
            .map(|cell| cell.and_then(elevation))
            .collect())
    }

    /// The largest part of `wanted` (metres on `plane`) over the file's samples, with or without data; `None` if
    /// there is none. Used as the default area.
    #[must_use]
    pub fn covered(&self, plane: &TangentPlane, wanted: Rect) -> Option<Rect> {
        coverage::covered(&self.metadata.lattice, plane, wanted)
    }

    /// Read the ground under `area` (metres on `plane`) from the file, with `margin` metres more on each side where
    /// there are data, for legs that leave the area. At most `most_nodes` samples are kept.
    ///
    /// # Errors
    /// [`DemError::Outside`] and [`DemError::NoData`] when not every point of `area` has an elevation,
    /// [`DemError::TooLarge`], or as [`Dataset::survey`].
    ///
    /// # Panics
    /// When `area` or `margin` are not finite, or reach so far that they leave the plane's side of the earth.
    pub fn ground(
        &self,
        plane: &TangentPlane,
        area: Rect,
        margin: f64,
        most_nodes: usize,
    ) -> Result<Dem, DemError> {
        let lattice = &self.metadata.lattice;
        let span = coverage::span(lattice, plane, area, margin)?;
        let nodes = span.rows.len() * span.columns.len();
        if nodes > most_nodes {
            return Err(DemError::TooLarge {
                what: "the number of samples under the area",
                value: nodes as u64,
                limit: most_nodes as u64,
            });
        }
        let mut raster = Raster::new(lattice, &span);
        self.read(&span, Wanted::All, &mut |row, column, samples| {
            raster.keep(row, column, samples);
            Ok(())
        })?;
        Dem::new(raster, plane, area, margin)
    }

    /// Read the `wanted` samples of `span`, and possibly others.
    fn read(&self, span: &Span, wanted: Wanted<'_>, visit: &mut Visit<'_>) -> Result<(), DemError> {
        let mut checked = |row: usize, column: usize, samples: &[f32]| {
            raster::check_elevations(row, column, samples)?;
            visit(row, column, samples)
        };
        match &self.reader {
            Reader::GeoTiff(layout) => layout.read(&self.path, span, wanted, &mut checked),
            Reader::AsciiGrid(layout) => layout.read(&self.path, span, &mut checked),
            Reader::Hgt(layout) => layout.read(&self.path, span, &mut checked),
        }
    }
}

/// The rows and columns that contain all `nodes`, each given as row and column; `None` if there are none.
fn span<'a>(nodes: impl Iterator<Item = &'a [usize; 2]>) -> Option<Span> {
    nodes.fold(None, |span, [row, column]| {
        let Span { rows, columns } = span.unwrap_or(Span {
            rows: *row..row + 1,
            columns: *column..column + 1,
        });
        Some(Span {
            rows: rows.start.min(*row)..rows.end.max(row + 1),
            columns: columns.start.min(*column)..columns.end.max(column + 1),
        })
    })
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::GeoTiff => "GeoTIFF",
            Self::AsciiGrid => "ESRI ASCII grid",
            Self::Hgt => "SRTM .hgt",
        })
    }
}
