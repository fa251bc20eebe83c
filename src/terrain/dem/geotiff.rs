//! `GeoTIFF`: one band in strips or tiles, plain or packed, read block by block.
//!
//! The bytes are unpacked by `tiff-reader`, within limits on what its headers and its blocks may take.
//! Strips that are not packed are read a few rows at a time: some writers make the whole file one strip.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use geotiff_core::geokeys::{self, GeoKeyDirectory};
use geotiff_core::tags;
use tiff_reader::source::{FileSource, TiffSource};
use tiff_reader::{ByteOrder, Ifd, OpenOptions, ParseBudgets, TagValue, TiffError, TiffFile};

use super::raster::{NoData, Span, Visit};
use super::{Crs, DemError, Format, MOST_SAMPLES, SampleType};

/// Largest strip or tile that is unpacked, bytes: while it is, it is in memory three times.
const LARGEST_BLOCK: usize = 8 << 20;

/// Largest single read of a file, bytes.
const LARGEST_READ: usize = 8 << 20;

/// What headers may take. Overviews are images of their own.
const BUDGETS: ParseBudgets = ParseBudgets {
    max_ifds: 64,
    max_ifd_entries: 512,
    max_tag_value_bytes: 4 << 20,
    max_metadata_value_bytes: 8 << 20,
};

/// Rows of a plain strip are read by about so many bytes.
const PLAIN_READ: usize = 1 << 18;

/// Tags that no library names.
const GDAL_METADATA: u16 = 42112;

/// Of a whole TIFF, one that has been found right.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    columns: usize,
    rows: usize,
    /// Which image of the file.
    image: usize,
    sample: SampleType,
    no_data: Option<f64>,
    big_endian: bool,
    /// Columns and rows of a block.
    block: [usize; 2],
    /// Where each block begins and how long it is, bytes; 0 of one that is left out.
    blocks: Arc<[[u64; 2]]>,
    /// Strips, not packed.
    plain: bool,
}

/// What the headers of a file say.
pub(super) struct Headers {
    pub(super) layout: Layout,
    pub(super) sample: SampleType,
    pub(super) no_data: Option<f64>,
    /// `None` when the file names none.
    pub(super) crs: Option<Crs>,
    /// First node and step.
    pub(super) first: [f64; 2],
    pub(super) step: [f64; 2],
    pub(super) columns: usize,
    pub(super) rows: usize,
}

/// A file that is not read in large parts.
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

/// Whether a file that begins so is a TIFF.
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

/// In our words, without the path.
fn refusal(error: &TiffError) -> DemError {
    match error {
        TiffError::Io(error, _) => malformed(format!("it cannot be read: {error}")),
        error => malformed(error.to_string()),
    }
}

/// The full image: the first that is georeferenced and no overview.
fn base_image(images: &[Ifd]) -> Option<usize> {
    let reduced = |ifd: &Ifd| {
        let flags = ifd
            .tag(tags::TAG_NEW_SUBFILE_TYPE)
            .and_then(|tag| tag.value.as_u64());
        // Overviews and masks.
        flags.is_some_and(|flags| flags & 5 != 0)
    };
    images.iter().position(|ifd| {
        !reduced(ifd)
            && (ifd.tag(tags::TAG_MODEL_TRANSFORMATION).is_some()
                || ifd.tag(tags::TAG_MODEL_TIEPOINT).is_some())
    })
}

fn keys(ifd: &Ifd) -> Result<GeoKeyDirectory, DemError> {
    let Some(directory) = ifd.tag(tags::TAG_GEO_KEY_DIRECTORY) else {
        return Ok(GeoKeyDirectory::new());
    };
    let value = |tag| ifd.tag(tag).map(|tag| &tag.value);
    let doubles = match value(tags::TAG_GEO_DOUBLE_PARAMS) {
        Some(TagValue::Double(doubles)) => doubles.as_slice(),
        _ => &[],
    };
    let text = value(tags::TAG_GEO_ASCII_PARAMS)
        .and_then(TagValue::as_str)
        .unwrap_or_default();
    directory
        .value
        .as_u16_slice()
        .and_then(|directory| GeoKeyDirectory::parse(directory, doubles, text))
        .ok_or_else(|| malformed("its directory of geo keys cannot be read"))
}

/// Refuse elevations in other units than metres.
fn check_heights(ifd: &Ifd, keys: &GeoKeyDirectory) -> Result<(), DemError> {
    const METRE: u16 = 9001;
    if let Some(unit) = keys.get_short(geokeys::VERTICAL_UNITS)
        && ![METRE, 0, 32767].contains(&unit)
    {
        return Err(unsupported(
            format!("its elevations are in the unit EPSG:{unit}"),
            "metres (EPSG:9001)",
        ));
    }
    let scaled = ifd
        .tag(GDAL_METADATA)
        .and_then(|tag| tag.value.as_str())
        .is_some_and(|text| {
            [("role=\"scale\">", 1.0), ("role=\"offset\">", 0.0)]
                .iter()
                .any(|(role, neutral)| {
                    let value = text
                        .split_once(role)
                        .and_then(|(_, rest)| rest.split('<').next());
                    value.is_some_and(|value| value.trim().parse() != Ok(*neutral))
                })
        });
    if scaled {
        return Err(unsupported(
            "its samples are to be scaled or shifted (GDAL_METADATA)",
            "elevations in metres as they are",
        ));
    }
    Ok(())
}

/// Where the first node is, and how far it is to the next column and row.
fn nodes(ifd: &Ifd, keys: &GeoKeyDirectory) -> Result<([f64; 2], [f64; 2]), DemError> {
    const POINT: u16 = 2;
    let doubles = |tag| match ifd.tag(tag).map(|tag| &tag.value) {
        Some(TagValue::Double(values)) => Some(values.as_slice()),
        _ => None,
    };
    // From the corner of a pixel, where its coordinates are those of an area, to its middle.
    let middle = if keys.get_short(geokeys::GT_RASTER_TYPE) == Some(POINT) {
        0.0
    } else {
        0.5
    };
    let (first, step) = match (
        doubles(tags::TAG_MODEL_TRANSFORMATION),
        doubles(tags::TAG_MODEL_TIEPOINT),
        doubles(tags::TAG_MODEL_PIXEL_SCALE),
    ) {
        (None, Some(&[column, row, _, east, north, _]), Some(&[width, height, ..])) => (
            [
                east + (middle - column) * width,
                north - (middle - row) * height.abs(),
            ],
            [width, -height.abs()],
        ),
        (Some(&[a, b, _, east, d, e, _, north, ..]), _, _) => {
            if b != 0.0 || d != 0.0 {
                return Err(unsupported("the image is rotated", "north up"));
            }
            ([east + middle * a, north + middle * e], [a, e])
        }
        _ => {
            return Err(unsupported(
                "the image is placed by neither one tie point and a pixel scale nor a transformation",
                "one of them",
            ));
        }
    };
    if !first.iter().chain(&step).all(|value| value.is_finite()) || step[0] <= 0.0 || step[1] == 0.0
    {
        return Err(malformed(format!(
            "its pixels are {} by {} at {}, {}; must be wider than 0 and finite",
            step[0], -step[1], first[0], first[1]
        )));
    }
    Ok((first, step))
}

/// The reference system that the keys name.
fn crs(keys: &GeoKeyDirectory) -> Result<Option<Crs>, DemError> {
    const DEGREE: u16 = 9102;
    const OWN: u16 = 32767;
    let code = |key| keys.get_short(key).filter(|code| *code != 0);
    let (model, name) = match keys.get_short(geokeys::GT_MODEL_TYPE) {
        Some(1) => ("projected", code(geokeys::PROJECTED_CRS_TYPE)),
        Some(2) => {
            if let Some(unit) = code(geokeys::GEOG_ANGULAR_UNITS)
                && unit != DEGREE
            {
                return Err(unsupported(
                    format!("its coordinates are in the unit EPSG:{unit}"),
                    "degrees (EPSG:9102)",
                ));
            }
            ("geographic", code(geokeys::GEODETIC_CRS_TYPE))
        }
        Some(3) => {
            return Err(unsupported(
                "its coordinates are earth-centred",
                "geographic or projected",
            ));
        }
        _ => return Ok(None),
    };
    match name {
        Some(OWN) | None => Err(DemError::UnusableCrs {
            crs: format!("of the file, {model}"),
            reason: "it is described without an EPSG code; rewrite the file with one, such as by gdalwarp -t_srs EPSG:4326".into(),
        }),
        Some(code) => {
            let crs = Crs::epsg(code)?;
            if crs.is_geographic() == (model == "geographic") {
                Ok(Some(crs))
            } else {
                Err(malformed(format!("it says that {crs} is {model}, which it is not")))
            }
        }
    }
}

fn no_data(ifd: &Ifd) -> Result<Option<f64>, DemError> {
    let Some(tag) = ifd.tag(tags::TAG_GDAL_NODATA) else {
        return Ok(None);
    };
    let text = tag.value.as_str().unwrap_or_default();
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
    match text.parse() {
        Ok(value) => Ok(Some(value)),
        Err(_) => Err(malformed(format!(
            "its no-data value is {:?}, must be a number",
            text.chars().take(40).collect::<String>()
        ))),
    }
}

/// How the samples are stored.
fn layout(file: &TiffFile, image: usize, no_data: Option<f64>) -> Result<Layout, DemError> {
    const PLAIN: u16 = 1;
    const JPEG: [u16; 2] = [6, 7];
    const LERC: u16 = 34887;
    let ifd = &file.ifds()[image];
    let shape = ifd.raster_layout().map_err(|error| refusal(&error))?;
    if shape.samples_per_pixel != 1 {
        return Err(unsupported(
            format!("the image has {} bands", shape.samples_per_pixel),
            "one band of elevations",
        ));
    }
    let sample = match (shape.sample_format, shape.bits_per_sample) {
        (1, 8) => SampleType::U8,
        (1, 16) => SampleType::U16,
        (1, 32) => SampleType::U32,
        (2, 8) => SampleType::I8,
        (2, 16) => SampleType::I16,
        (2, 32) => SampleType::I32,
        (3, 32) => SampleType::F32,
        (3, 64) => SampleType::F64,
        (_, bits) => {
            return Err(unsupported(
                format!("its samples have {bits} bits"),
                "8, 16 or 32 as integers, or 32 or 64 as floats",
            ));
        }
    };
    let compression = ifd.compression();
    if JPEG.contains(&compression) || compression == LERC {
        return Err(unsupported(
            format!("it is compressed by TIFF scheme {compression}"),
            "none, LZW, deflate, PackBits or zstd",
        ));
    }
    let (block, offsets, counts) = if ifd.is_tiled() {
        let sides = [ifd.tile_width(), ifd.tile_height()].map(|side| side.unwrap_or(0) as usize);
        (sides, ifd.tile_offsets(), ifd.tile_byte_counts())
    } else {
        let rows = (ifd.rows_per_strip() as usize).min(shape.height);
        (
            [shape.width, rows],
            ifd.strip_offsets(),
            ifd.strip_byte_counts(),
        )
    };
    if block.contains(&0) {
        return Err(malformed("its strips or tiles are empty"));
    }
    let (offsets, counts) = (offsets.unwrap_or_default(), counts.unwrap_or_default());
    let expected = shape.width.div_ceil(block[0]) * shape.height.div_ceil(block[1]);
    if offsets.len() != expected || counts.len() != expected {
        return Err(malformed(format!(
            "it lists {} places and {} lengths of its {expected} strips or tiles",
            offsets.len(),
            counts.len()
        )));
    }
    let plain =
        compression == PLAIN && !ifd.is_tiled() && ifd.fill_order() == 1 && shape.predictor == 1;
    let bytes = block[0]
        .saturating_mul(block[1])
        .saturating_mul(shape.bytes_per_sample);
    if bytes > LARGEST_BLOCK && !plain {
        return Err(DemError::TooLarge {
            what: "the size in bytes of a packed strip or of a tile",
            value: bytes as u64,
            limit: LARGEST_BLOCK as u64,
        });
    }
    let len = file.source().len();
    let blocks: Vec<[u64; 2]> = offsets
        .into_iter()
        .zip(counts)
        .map(|(offset, count)| [offset, count])
        .collect();
    if let Some(idx) = blocks
        .iter()
        .position(|[offset, count]| offset.saturating_add(*count) > len)
    {
        return Err(malformed(format!(
            "its strip or tile {idx} lies beyond its end at {len} bytes"
        )));
    }
    Ok(Layout {
        columns: shape.width,
        rows: shape.height,
        image,
        sample,
        no_data,
        big_endian: file.byte_order() == ByteOrder::BigEndian,
        block,
        blocks: blocks.into(),
        plain,
    })
}

impl Layout {
    pub(super) fn read(
        &self,
        path: &Path,
        span: &Span,
        visit: &mut Visit<'_>,
    ) -> Result<(), DemError> {
        if self.plain {
            return self.read_plain(path, span, visit);
        }
        let file = tiff(path)?;
        let [width, height] = self.block;
        let across = self.columns.div_ceil(width);
        let mut samples = Vec::with_capacity(width.min(self.columns));
        for block_row in span.rows.start / height..span.rows.end.div_ceil(height) {
            for block_column in span.columns.start / width..span.columns.end.div_ceil(width) {
                let [row, column] = [block_row * height, block_column * width];
                let rows = height.min(self.rows - row);
                let columns = width.min(self.columns - column);
                if self.is_left_out(block_row * across + block_column) {
                    samples.clear();
                    samples.resize(columns, f32::NAN);
                    (row..row + rows).try_for_each(|row| visit(row, column, &samples))?;
                    continue;
                }
                let bytes = file
                    .read_window_bytes(self.image, row, column, rows, columns)
                    .map_err(|error| refusal(&error))?;
                for (idx, bytes) in bytes
                    .chunks_exact(columns * self.sample.bytes())
                    .enumerate()
                {
                    self.convert(bytes, cfg!(target_endian = "big"), &mut samples);
                    visit(row + idx, column, &samples)?;
                }
            }
        }
        Ok(())
    }

    /// Of strips that are not packed, the rows asked for.
    fn read_plain(&self, path: &Path, span: &Span, visit: &mut Visit<'_>) -> Result<(), DemError> {
        let mut file = File::open(path)?;
        let row_bytes = self.columns * self.sample.bytes();
        let at_once = (PLAIN_READ / row_bytes).max(1);
        let mut bytes = Vec::new();
        let mut samples = Vec::with_capacity(self.columns);
        let mut row = span.rows.start;
        while row < span.rows.end {
            let strip = row / self.block[1];
            let strip_start = strip * self.block[1];
            let end = span.rows.end.min(strip_start + self.block[1]);
            let rows = at_once.min(end - row);
            if self.is_left_out(strip) {
                samples.clear();
                samples.resize(self.columns, f32::NAN);
                (row..row + rows).try_for_each(|row| visit(row, 0, &samples))?;
                row += rows;
                continue;
            }
            let [offset, count] = self.blocks[strip];
            let from = ((row - strip_start) * row_bytes) as u64;
            let len = rows * row_bytes;
            if from + len as u64 > count {
                return Err(malformed(format!(
                    "its strip {strip} ends after {count} bytes, in row {row}"
                )));
            }
            file.seek(SeekFrom::Start(offset + from))?;
            bytes.resize(len, 0);
            file.read_exact(&mut bytes)?;
            for (idx, bytes) in bytes.chunks_exact(row_bytes).enumerate() {
                self.convert(bytes, self.big_endian, &mut samples);
                visit(row + idx, 0, &samples)?;
            }
            row += rows;
        }
        Ok(())
    }

    /// Whether a block is not stored, as sparse files do: there are no data.
    fn is_left_out(&self, block_idx: usize) -> bool {
        self.blocks[block_idx].contains(&0)
    }

    fn convert(&self, bytes: &[u8], big_endian: bool, samples: &mut Vec<f32>) {
        /// Values of one type, by its constructors out of bytes.
        macro_rules! values {
            ($type:ty) => {{
                let no_data = NoData::new(self.no_data);
                let words = bytes.as_chunks().0.iter();
                let value = |word: &[u8; size_of::<$type>()]| {
                    if big_endian {
                        <$type>::from_be_bytes(*word)
                    } else {
                        <$type>::from_le_bytes(*word)
                    }
                };
                samples.extend(words.map(|word| no_data.elevation(f64::from(value(word)))));
            }};
        }
        samples.clear();
        match self.sample {
            SampleType::U8 => values!(u8),
            SampleType::I8 => values!(i8),
            SampleType::U16 => values!(u16),
            SampleType::I16 => values!(i16),
            SampleType::U32 => values!(u32),
            SampleType::I32 => values!(i32),
            SampleType::F32 | SampleType::Text => values!(f32),
            SampleType::F64 => values!(f64),
        }
    }
}
