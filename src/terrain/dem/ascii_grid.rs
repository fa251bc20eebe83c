//! ESRI ASCII grids: a header of names and numbers, then one number per sample, from the top row down.
//!
//! `xllcorner` is the edge of the first cell, `xllcenter` its centre; a sample is the elevation at the centre. `dx`
//! and `dy`, which GDAL writes when cells are not square, are accepted. A file is read as a stream of words; line
//! breaks do not matter.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use super::raster::{NoData, Span, Visit};
use super::{Crs, DemError, Format, Lattice};

/// Value of a sample without data, unless the header states another.
const DEFAULT_NO_DATA: f64 = -9999.0;

/// Longest header, bytes.
const LONGEST_HEADER: u64 = 4096;

/// What some programs put before a text to say that it is UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// What some programs put after a text to say that it ends.
const END_OF_TEXT: u8 = 0x1a;

/// Longest number, bytes.
const LONGEST_WORD: usize = 64;

/// Keywords of a header.
const KEYS: [&str; 10] = [
    "ncols",
    "nrows",
    "xllcorner",
    "xllcenter",
    "yllcorner",
    "yllcenter",
    "cellsize",
    "dx",
    "dy",
    "nodata_value",
];

/// A header.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// The bottom-left node, east and north.
    pub(super) south_west: [f64; 2],
    /// Distance between columns, and between rows, each > 0.
    pub(super) cell: [f64; 2],
    pub(super) no_data: f64,
    /// Offset of the first number, bytes.
    start: u64,
}

/// Whether a file that begins like this may be an ASCII grid.
pub(super) fn is_grid(beginning: &[u8]) -> bool {
    let beginning = beginning.strip_prefix(BYTE_ORDER_MARK).unwrap_or(beginning);
    let mut words = beginning
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty());
    words.next().is_some_and(|word| {
        KEYS.iter()
            .any(|key| word.eq_ignore_ascii_case(key.as_bytes()))
    })
}

fn malformed(reason: impl Into<String>) -> DemError {
    DemError::malformed(Format::AsciiGrid, reason)
}

/// Read the header of a file of `len` bytes.
pub(super) fn open(path: &Path, len: u64) -> Result<Layout, DemError> {
    let mut text = Vec::new();
    File::open(path)?
        .take(LONGEST_HEADER)
        .read_to_end(&mut text)?;
    let mut values = [None; KEYS.len()];
    let mark = if text.starts_with(BYTE_ORDER_MARK) {
        BYTE_ORDER_MARK.len()
    } else {
        0
    };
    let mut words = Words {
        text: &text,
        at: mark,
    };
    loop {
        let start = words.at;
        let Some(word) = words.next() else {
            return Err(malformed("it ends in its header"));
        };
        let Some(key) = KEYS.iter().position(|key| word.eq_ignore_ascii_case(key)) else {
            return finish(&values, start as u64, len, word);
        };
        if values[key].is_some() {
            return Err(malformed(format!("its header says {} twice", KEYS[key])));
        }
        let value = words.next().unwrap_or_default();
        values[key] = Some(
            value
                .parse::<f64>()
                .map_err(|_| not_a_number(KEYS[key], value))?,
        );
    }
}

fn not_a_number(key: &str, word: &str) -> DemError {
    malformed(format!("{key} is {:?}, must be a number", shown(word)))
}

/// `word`, cut off after the greatest length of a number.
fn shown(word: &str) -> String {
    word.chars().take(LONGEST_WORD).collect()
}

/// The words of a header.
struct Words<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<&'a str> {
        let rest = &self.text[self.at..];
        let from = rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let len = rest[from..]
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len() - from);
        self.at += from + len;
        Some(str::from_utf8(&rest[from..from + len]).unwrap_or("?"))
    }
}

/// The layout from the header's `values`; `word` is the first number after them.
fn finish(
    values: &[Option<f64>; KEYS.len()],
    start: u64,
    len: u64,
    word: &str,
) -> Result<Layout, DemError> {
    if word.len() > LONGEST_WORD || word.parse::<f64>().is_err() {
        return Err(malformed(format!(
            "{:?} is neither a word of its header nor a number",
            shown(word)
        )));
    }
    let value = |key: &str| {
        let idx = KEYS
            .iter()
            .position(|known| *known == key)
            .expect("it is a key");
        values[idx]
    };
    let required =
        |key: &str| value(key).ok_or_else(|| malformed(format!("its header does not say {key}")));
    let count = |key: &str| {
        let count = required(key)?;
        let whole = count.fract() == 0.0 && (2.0..=1e9).contains(&count);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "it was just looked at"
        )]
        whole.then_some(count as usize).ok_or_else(|| {
            malformed(format!(
                "{key} is {count}, must be a whole number from 2 to 1000000000"
            ))
        })
    };
    let (columns, rows) = (count("ncols")?, count("nrows")?);
    let size = |key: &str| match value(key).or(value("cellsize")) {
        Some(size) if size > 0.0 && size.is_finite() => Ok(size),
        Some(size) => Err(malformed(format!(
            "the size of a cell is {size}, must be > 0"
        ))),
        None => Err(malformed("its header does not say cellsize")),
    };
    let cell = [size("dx")?, size("dy")?];
    let place = |axis: usize, [corner, center]: [&str; 2]| {
        let place = match (value(corner), value(center)) {
            (Some(edge), None) => edge + 0.5 * cell[axis],
            (None, Some(middle)) => middle,
            (Some(_), Some(_)) => {
                return Err(malformed(format!(
                    "its header says both {corner} and {center}"
                )));
            }
            (None, None) => {
                return Err(malformed(format!(
                    "its header says neither {corner} nor {center}"
                )));
            }
        };
        if place.is_finite() {
            Ok(place)
        } else {
            Err(malformed(format!("{corner} is {place}, must be a number")))
        }
    };
    let south_west = [
        place(0, ["xllcorner", "xllcenter"])?,
        place(1, ["yllcorner", "yllcenter"])?,
    ];
    // Each number takes at least one digit and a separator.
    let least = 2 * (columns as u64).saturating_mul(rows as u64) - 1;
    if len - start < least {
        return Err(malformed(format!(
            "it ends after {len} bytes, too soon for {columns} x {rows} numbers"
        )));
    }
    Ok(Layout {
        columns,
        rows,
        south_west,
        cell,
        no_data: value("nodata_value").unwrap_or(DEFAULT_NO_DATA),
        start,
    })
}

impl Layout {
    /// Where the samples lie, in `crs`.
    pub(super) fn lattice(&self, crs: Crs) -> Lattice {
        let [width, height] = self.cell;
        let [west, south] = self.south_west;
        Lattice {
            crs,
            columns: self.columns,
            rows: self.rows,
            first: [west, south + height * (self.rows - 1) as f64],
            step: [width, -height],
        }
    }

    pub(super) fn read(
        &self,
        path: &Path,
        span: &Span,
        visit: &mut Visit<'_>,
    ) -> Result<(), DemError> {
        let mut file = File::open(path)?;
        file.seek(SeekFrom::Start(self.start))?;
        let mut numbers = Numbers {
            file: BufReader::with_capacity(1 << 16, file),
            word: Vec::with_capacity(LONGEST_WORD),
        };
        let no_data = NoData::new(Some(self.no_data));
        let mut samples = Vec::with_capacity(span.columns.len());
        // Numbers after the last row are detected only when that row is read.
        for row in 0..span.rows.end {
            samples.clear();
            for column in 0..self.columns {
                if !numbers.advance()? {
                    return Err(malformed(format!("it ends at row {row}, column {column}")));
                }
                if span.rows.contains(&row) && span.columns.contains(&column) {
                    samples.push(no_data.elevation(numbers.value(row, column)?));
                }
            }
            if span.rows.contains(&row) {
                visit(row, span.columns.start, &samples)?;
            }
        }
        if span.rows.end == self.rows && numbers.advance()? {
            return Err(malformed(format!(
                "it holds more than {} x {} numbers",
                self.columns, self.rows
            )));
        }
        Ok(())
    }
}

/// Whether a byte separates numbers.
fn is_blank(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == END_OF_TEXT
}

/// The words of a file, one at a time.
struct Numbers {
    file: BufReader<File>,
    word: Vec<u8>,
}

impl Numbers {
    /// Move to the next word, if there is one; only the beginning of a long one is kept.
    fn advance(&mut self) -> Result<bool, DemError> {
        self.word.clear();
        loop {
            let buffer = self.file.fill_buf()?;
            if buffer.is_empty() {
                return Ok(!self.word.is_empty());
            }
            let skipped = if self.word.is_empty() {
                buffer
                    .iter()
                    .position(|byte| !is_blank(*byte))
                    .unwrap_or(buffer.len())
            } else {
                0
            };
            let rest = &buffer[skipped..];
            let end = rest.iter().position(|byte| is_blank(*byte));
            let part = &rest[..end.unwrap_or(rest.len())];
            // One byte more than allowed, so that the word is recognised as too long.
            let room = (LONGEST_WORD + 1).saturating_sub(self.word.len());
            self.word.extend_from_slice(&part[..part.len().min(room)]);
            let used = skipped + part.len();
            let done = end.is_some() && !self.word.is_empty();
            self.file.consume(used);
            if done {
                return Ok(true);
            }
        }
    }

    fn value(&self, row: usize, column: usize) -> Result<f64, DemError> {
        let word = str::from_utf8(&self.word).unwrap_or("?");
        let value = if self.word.len() > LONGEST_WORD {
            None
        } else {
            word.parse().ok()
        };
        value.ok_or_else(|| {
            malformed(format!(
                "row {row}, column {column} holds {:?}, must hold a number",
                shown(word)
            ))
        })
    }
}
