//! `GeoTIFF`: one band in strips or tiles, compressed or not, read block by block.
//!
//! `tiff-reader` decodes the bytes, with limits on the size of headers and blocks. Uncompressed strips are read a few
//! rows at a time, because some writers make the whole file one strip.

mod heights;
mod lzw;
mod mask;
mod place;
mod samples;

use std::io;
use std::path::Path;
use std::sync::Arc;

use geotiff_core::tags;
use tiff_reader::source::{FileSource, TiffSource};
use tiff_reader::{Ifd, OpenOptions, ParseBudgets, TiffError, TiffFile};

use super::{Crs, DemError, Format, MOST_SAMPLES, SampleType};
use heights::check_heights;
use mask::{is_mask, is_reduced};
use place::{crs, keys, no_data, nodes};
pub(super) use samples::Layout;
use samples::layout;

/// The geo key code of what a file describes in its own words.
const OWN: u16 = 32767;

/// Largest strip or tile that is decoded, bytes; while being decoded it is in memory three times.
const LARGEST_BLOCK: usize = 8 << 20;

/// Largest single read of a file, bytes.
const LARGEST_READ: usize = 8 << 20;

/// Limits for headers. Overviews count as images of their own.
const BUDGETS: ParseBudgets = ParseBudgets {
    max_ifds: 64,
    max_ifd_entries: 512,
    max_tag_value_bytes: 4 << 20,
    max_metadata_value_bytes: 8 << 20,
};

/// The headers of a file.
pub(super) struct Headers {
    pub(super) layout: Layout,
    pub(super) sample: SampleType,
    pub(super) no_data: Option<f64>,
    /// `None` when the file states none.
    pub(super) crs: Option<Crs>,
    /// First node and step.
    pub(super) first: [f64; 2],
    pub(super) step: [f64; 2],
    pub(super) columns: usize,
    pub(super) rows: usize,
}

/// A file source that refuses large reads.
struct Guarded(FileSource);

impl TiffSource for Guarded {
    fn len(&self) -> u64 {
        self.0.len()
    }

    fn read_exact_at(&self, offset: u64, len: usize) -> Result<Vec<u8>, TiffError> {
        if len > LARGEST_READ {
            return Err(TiffError::Other(format!(
                "one part of it has {len} bytes, must have at most {LARGEST_READ}"
            )));
        }
        self.0.read_exact_at(offset, len)
    }
}

fn malformed(reason: impl Into<String>) -> DemError {
    DemError::malformed(Format::GeoTiff, reason)
}

fn unsupported(found: impl Into<String>, allowed: &'static str) -> DemError {
    DemError::Unsupported {
        found: found.into(),
        allowed,
    }
}

/// Whether a file that begins like this is a TIFF.
pub(super) fn is_tiff(beginning: &[u8]) -> bool {
    [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"]
        .iter()
        .any(|magic| beginning.starts_with(*magic))
}

/// Read the headers.
pub(super) fn open(path: &Path) -> Result<Headers, DemError> {
    let file = tiff(path)?;
    let image = base_image(file.ifds()).ok_or_else(|| {
        unsupported(
            "the TIFF holds no georeferenced image",
            "a GeoTIFF with ModelPixelScale and ModelTiepoint, or ModelTransformation",
        )
    })?;
    let ifd = &file.ifds()[image];
    let (columns, rows) = (ifd.width() as usize, ifd.height() as usize);
    if columns < 2 || rows < 2 {
        return Err(unsupported(
            format!("the image has {columns} x {rows} samples"),
            "at least 2 x 2",
        ));
    }
    let samples = (columns as u64) * (rows as u64);
    if samples > MOST_SAMPLES {
        return Err(DemError::TooLarge {
            what: "the number of samples",
            value: samples,
            limit: MOST_SAMPLES,
        });
    }
    let keys = keys(ifd)?;
    check_heights(ifd, &keys)?;
    let (first, step) = nodes(ifd, &keys)?;
    let no_data = no_data(ifd)?;
    let layout = layout(&file, image, no_data)?;
    Ok(Headers {
        sample: layout.sample,
        layout,
        no_data,
        crs: crs(&keys)?,
        first,
        step,
        columns,
        rows,
    })
}

fn tiff(path: &Path) -> Result<TiffFile, DemError> {
    let source = FileSource::open(path).map_err(|error| refusal(&error))?;
    let options = OpenOptions {
        // Each block is read once.
        block_cache_bytes: 0,
        block_cache_slots: 0,
        parse_budgets: BUDGETS,
        decode_output_bytes: LARGEST_BLOCK,
    };
    TiffFile::from_source_with_options(Arc::new(Guarded(source)), options)
        .map_err(|error| refusal(&error))
}

/// The error as a [`DemError`], without the path.
fn refusal(error: &TiffError) -> DemError {
    match error {
        TiffError::Io(error, _) => match error.raw_os_error() {
            Some(code) => DemError::Io(io::Error::from_raw_os_error(code)),
            None => malformed(format!("it cannot be read: {error}")),
        },
        error => malformed(error.to_string()),
    }
}

/// The full-resolution image: the first that is georeferenced and neither an overview nor a mask.
fn base_image(images: &[Ifd]) -> Option<usize> {
    images.iter().position(|ifd| {
        !is_reduced(ifd)
            && !is_mask(ifd)
            && (ifd.tag(tags::TAG_MODEL_TRANSFORMATION).is_some()
                || ifd.tag(tags::TAG_MODEL_TIEPOINT).is_some())
    })
}
