//! How the samples of an image are stored, and how they are read.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use tiff_reader::{ByteOrder, RasterLayout, TiffFile};

use super::lzw::{self, Lzw};
use super::mask::{Band, mask};
use super::{LARGEST_BLOCK, malformed, refusal, tiff, unsupported};
use crate::terrain::dem::raster::{NoData, Span, Visit, Wanted};
use crate::terrain::dem::{DemError, SampleType};

/// Approximate size of one read from an uncompressed strip, bytes.
const PLAIN_READ: usize = 1 << 18;

/// The layout of a TIFF that has been checked.
#[derive(Debug, Clone)]
pub(in crate::terrain::dem) struct Layout {
    columns: usize,
    rows: usize,
    /// Index of the image in the file.
    image: usize,
    pub(super) sample: SampleType,
    no_data: Option<f64>,
    big_endian: bool,
    /// Columns and rows of a block.
    block: [usize; 2],
    /// Offset and length of each block, bytes; 0 for a block that is not stored.
    blocks: Arc<[[u64; 2]]>,
    /// Uncompressed strips.
    plain: bool,
    lzw: Option<Lzw>,
    /// Says which samples have no data.
    mask: Option<Box<Layout>>,
}

/// How the samples are stored.
pub(super) fn layout(
    file: &TiffFile,
    image: usize,
    no_data: Option<f64>,
) -> Result<Layout, DemError> {
    let shape = shape(file, image)?;
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
    let mut layout = blocks(file, image, shape, sample, no_data)?;
    layout.mask = mask(file, image)?.map(Box::new);
    Ok(layout)
}

/// How a mask is stored; its samples that are 0 read as no data.
pub(super) fn mask_layout(file: &TiffFile, image: usize) -> Result<Layout, DemError> {
    let shape = shape(file, image)?;
    let bits = shape.bits_per_sample;
    if shape.samples_per_pixel != 1 || shape.sample_format != 1 || ![1, 8].contains(&bits) {
        return Err(unsupported(
            format!(
                "its mask has {} bands of {bits} bits",
                shape.samples_per_pixel
            ),
            "one band of 1 or 8 bits",
        ));
    }
    blocks(file, image, shape, SampleType::U8, Some(0.0))
}

fn shape(file: &TiffFile, image: usize) -> Result<RasterLayout, DemError> {
    let ifd = &file.ifds()[image];
    ifd.raster_layout().map_err(|error| refusal(&error))
}

/// Where the strips or tiles are.
fn blocks(
    file: &TiffFile,
    image: usize,
    shape: RasterLayout,
    sample: SampleType,
    no_data: Option<f64>,
) -> Result<Layout, DemError> {
    const PLAIN: u16 = 1;
    const JPEG: [u16; 2] = [6, 7];
    const LERC: u16 = 34887;
    let ifd = &file.ifds()[image];
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
    let plain = compression == PLAIN
        && !ifd.is_tiled()
        && ifd.fill_order() == 1
        && shape.predictor == 1
        && shape.bits_per_sample >= 8;
    let is_lzw = compression == lzw::SCHEME && ifd.fill_order() == 1 && shape.bits_per_sample >= 8;
    let lzw = is_lzw.then(|| Lzw {
        predictor: shape.predictor,
        bits: shape.bits_per_sample,
        order: file.byte_order(),
    });
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
        lzw,
        mask: None,
    })
}

/// The file from which packed strips and tiles come.
enum Source {
    Tiff(Box<TiffFile>),
    Lzw(File, Lzw),
}

impl Source {
    fn open(path: &Path, lzw: Option<Lzw>) -> Result<Self, DemError> {
        Ok(match lzw {
            Some(lzw) => Self::Lzw(File::open(path)?, lzw),
            None => Self::Tiff(Box::new(tiff(path)?)),
        })
    }
}

impl Layout {
    pub(in crate::terrain::dem) fn read(
        &self,
        path: &Path,
        span: &Span,
        wanted: Wanted<'_>,
        visit: &mut Visit<'_>,
    ) -> Result<(), DemError> {
        let Some(mask) = &self.mask else {
            return self.read_samples(path, span, wanted, visit);
        };
        let height = if self.plain { 1 } else { self.block[1] };
        let last = span.rows.end.next_multiple_of(height).min(self.rows);
        let mut band = Band::new(mask, path, span, wanted, last);
        let mut shown = Vec::new();
        self.read_samples(path, span, wanted, &mut |row, column, samples| {
            let start = row - row % height;
            band.reach(start..(start + height).min(self.rows))?;
            shown.clear();
            shown.extend(samples.iter().enumerate().map(|(idx, sample)| {
                if band.shows(row, column + idx) {
                    *sample
                } else {
                    f32::NAN
                }
            }));
            visit(row, column, &shown)
        })
    }

    /// Rows of a strip or tile.
    pub(super) fn block_rows(&self) -> usize {
        self.block[1]
    }

    /// Read the samples, whether or not a mask hides them.
    fn read_samples(
        &self,
        path: &Path,
        span: &Span,
        wanted: Wanted<'_>,
        visit: &mut Visit<'_>,
    ) -> Result<(), DemError> {
        if self.plain {
            return self.read_plain(path, span, wanted, visit);
        }
        let mut source = Source::open(path, self.lzw)?;
        let [width, height] = self.block;
        let across = self.columns.div_ceil(width);
        let mut samples = Vec::with_capacity(width.min(self.columns));
        for block_row in span.rows.start / height..span.rows.end.div_ceil(height) {
            let row = block_row * height;
            let rows = height.min(self.rows - row);
            for block_column in wanted.blocks(row..row + rows, &span.columns, width) {
                let column = block_column * width;
                let columns = width.min(self.columns - column);
                if self.is_left_out(block_row * across + block_column) {
                    samples.clear();
                    samples.resize(columns, f32::NAN);
                    (row..row + rows).try_for_each(|row| visit(row, column, &samples))?;
                    continue;
                }
                let bytes = match &mut source {
                    Source::Tiff(file) => file
                        .read_window_bytes(self.image, row, column, rows, columns)
                        .map_err(|error| refusal(&error))?,
                    Source::Lzw(file, lzw) => {
                        let block = self.blocks[block_row * across + block_column];
                        lzw.read(file, block, (rows, width * self.sample.bytes()))?
                    }
                };
                let columns_bytes = columns * self.sample.bytes();
                for (idx, bytes) in bytes.chunks_exact(bytes.len() / rows).enumerate() {
                    let bytes = &bytes[..columns_bytes];
                    self.convert(bytes, cfg!(target_endian = "big"), &mut samples);
                    visit(row + idx, column, &samples)?;
                }
            }
        }
        Ok(())
    }

    /// Read the rows of `span` from uncompressed strips.
    fn read_plain(
        &self,
        path: &Path,
        span: &Span,
        wanted: Wanted<'_>,
        visit: &mut Visit<'_>,
    ) -> Result<(), DemError> {
        let mut file = File::open(path)?;
        let row_bytes = self.columns * self.sample.bytes();
        let at_once = (PLAIN_READ / row_bytes).max(1);
        let mut bytes = Vec::new();
        let mut samples = Vec::with_capacity(self.columns);
        let mut row = span.rows.start;
        while let Some(first) = wanted.first_row(row..span.rows.end) {
            row = first;
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

    /// Whether a block is not stored, as in sparse files: it has no data.
    fn is_left_out(&self, block_idx: usize) -> bool {
        self.blocks[block_idx].contains(&0)
    }

    fn convert(&self, bytes: &[u8], big_endian: bool, samples: &mut Vec<f32>) {
        /// Decode values of one type from bytes.
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
