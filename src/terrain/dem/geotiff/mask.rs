//! The mask within a file: an image of its own that says which samples of the base image have no data.

use std::ops::Range;
use std::path::Path;

use geotiff_core::tags;
use tiff_reader::{Ifd, TiffFile};

use super::samples::{Layout, mask_layout};
use super::unsupported;
use crate::terrain::dem::DemError;
use crate::terrain::dem::raster::{Span, Wanted};

/// Fewest samples whose mask is read at once, so that the headers are not read for each row.
const AT_ONCE: usize = 1 << 22;

/// Whether an image is a mask, by its flags.
pub(super) fn is_mask(ifd: &Ifd) -> bool {
    flags(ifd) & 4 != 0
}

/// Whether an image is an overview, or the mask of one.
pub(super) fn is_reduced(ifd: &Ifd) -> bool {
    flags(ifd) & 1 != 0
}

fn flags(ifd: &Ifd) -> u64 {
    ifd.tag(tags::TAG_NEW_SUBFILE_TYPE)
        .and_then(|tag| tag.value.as_u64())
        .unwrap_or(0)
}

/// The mask of the image `base`: the first mask after it that is not an overview's.
pub(super) fn mask(file: &TiffFile, base: usize) -> Result<Option<Layout>, DemError> {
    let images = file.ifds();
    let Some(image) =
        (base + 1..images.len()).find(|idx| is_mask(&images[*idx]) && !is_reduced(&images[*idx]))
    else {
        return Ok(None);
    };
    let size = |image: usize| [images[image].width(), images[image].height()];
    let ([columns, rows], whole) = (size(image), size(base));
    if [columns, rows] != whole {
        return Err(unsupported(
            format!(
                "its mask has {columns} x {rows} samples, the image {} x {}",
                whole[0], whole[1]
            ),
            "of the same size",
        ));
    }
    mask_layout(file, image).map(Some)
}

/// Some rows of a mask, in memory.
pub(super) struct Band<'a> {
    mask: &'a Layout,
    path: &'a Path,
    /// Columns that are looked at; elsewhere nothing has data.
    columns: Range<usize>,
    wanted: Wanted<'a>,
    /// Rows up to which anything is looked at.
    last: usize,
    /// Rows in memory.
    rows: Range<usize>,
    /// A bit for each of `columns` in each of `rows`: whether the sample has data.
    shown: Vec<u64>,
}

impl<'a> Band<'a> {
    /// For reading `span`, and the rest of the blocks that it begins, up to the row `last`.
    pub(super) fn new(
        mask: &'a Layout,
        path: &'a Path,
        span: &Span,
        wanted: Wanted<'a>,
        last: usize,
    ) -> Self {
        Self {
            mask,
            path,
            columns: span.columns.clone(),
            wanted,
            last,
            rows: 0..0,
            shown: Vec::new(),
        }
    }

    /// Have the rows of a block in memory, and more.
    pub(super) fn reach(&mut self, block: Range<usize>) -> Result<(), DemError> {
        if self.rows.start <= block.start && block.end <= self.rows.end {
            return Ok(());
        }
        let width = self.columns.len();
        // To the end of the mask's own blocks, which are unpacked as a whole.
        let end = block.end.max(block.start + AT_ONCE / width.max(1));
        let end = end.next_multiple_of(self.mask.block_rows()).min(self.last);
        let rows = block.start..end;
        self.shown.clear();
        self.shown.resize((rows.len() * width).div_ceil(64), 0);
        let span = Span {
            rows: rows.clone(),
            columns: self.columns.clone(),
        };
        let (columns, shown) = (&self.columns, &mut self.shown);
        self.mask.read(
            self.path,
            &span,
            self.wanted,
            &mut |row, column, samples| {
                if !rows.contains(&row) {
                    return Ok(());
                }
                for (idx, sample) in samples.iter().enumerate() {
                    if !sample.is_nan() && columns.contains(&(column + idx)) {
                        let bit = (row - rows.start) * width + column + idx - columns.start;
                        shown[bit / 64] |= 1 << (bit % 64);
                    }
                }
                Ok(())
            },
        )?;
        self.rows = rows;
        Ok(())
    }

    /// Whether the sample at `row`, which is in memory, has data.
    pub(super) fn shows(&self, row: usize, column: usize) -> bool {
        self.columns.contains(&column) && {
            let bit = (row - self.rows.start) * self.columns.len() + column - self.columns.start;
            self.shown[bit / 64] >> (bit % 64) & 1 == 1
        }
    }
}
