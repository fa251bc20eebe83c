//! SRTM tiles: a square of big-endian 16-bit elevations without a header.
//!
//! The file name gives the position of the south-west corner: `N36W085.hgt` covers 36 to 37 degrees north and 85 to
//! 84 degrees west, with samples exactly on the edges. `S` and `W` stand for south of the equator and west of
//! Greenwich.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use super::raster::{NoData, Span, Visit};
use super::{Crs, DemError, Format, Lattice};

/// Samples along a side, for 3 and 1 arc seconds.
const SIDES: [usize; 2] = [1201, 3601];

/// Value of a sample without data.
pub(super) const NO_DATA: f64 = -32768.0;

/// Samples along a side.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    side: usize,
}

/// Whether a file of `len` bytes may be a tile.
pub(super) fn is_tile(len: u64) -> bool {
    side(len).is_some()
}

fn side(len: u64) -> Option<usize> {
    SIDES
        .into_iter()
        .find(|side| 2 * (side * side) as u64 == len)
}

/// A tile of `len` bytes named `name`.
pub(super) fn open(len: u64, name: &str) -> Result<(Layout, Lattice), DemError> {
    let malformed = |reason: String| DemError::malformed(Format::Hgt, reason);
    let side = side(len).ok_or_else(|| {
        malformed(format!(
            "it has {len} bytes, must have 2884802 (3 arc seconds) or 25934402 (1 arc second)"
        ))
    })?;
    let [lat, lon] = corner(name).ok_or_else(|| {
        malformed(format!(
            "its name is {name:?}, must say where it belongs, such as N36W085.hgt"
        ))
    })?;
    let step = 1.0 / (side - 1) as f64;
    let lattice = Lattice {
        crs: Crs::wgs84(),
        columns: side,
        rows: side,
        first: [lon, lat + 1.0],
        step: [step, -step],
    };
    Ok((Layout { side }, lattice))
}

/// Latitude and longitude of the south-west corner, from the first seven characters of a name.
fn corner(name: &str) -> Option<[f64; 2]> {
    let name = name.get(..7)?.as_bytes();
    let part = |sign: u8, digits: &[u8], [plus, minus]: [u8; 2], most: u32| {
        let sign = match sign.to_ascii_uppercase() {
            letter if letter == plus => 1.0,
            letter if letter == minus => -1.0,
            _ => return None,
        };
        if !digits.iter().all(u8::is_ascii_digit) {
            return None;
        }
        let value = digits
            .iter()
            .fold(0, |value, digit| 10 * value + u32::from(digit - b'0'));
        (value <= most).then_some(sign * f64::from(value))
    };
    let lat = part(name[0], &name[1..3], *b"NS", 90)?;
    let lon = part(name[3], &name[4..7], *b"EW", 180)?;
    (lat < 90.0 && lon < 180.0).then_some([lat, lon])
}

/// The file name that says no more than where a tile belongs: `N36W085.hgt` for `n36w085.SRTMGL1.hgt`.
pub(super) fn canonical(name: &str) -> Option<String> {
    corner(name)?;
    Some(format!("{}.hgt", name.get(..7)?.to_ascii_uppercase()))
}

impl Layout {
    pub(super) fn read(
        &self,
        path: &Path,
        span: &Span,
        visit: &mut Visit<'_>,
    ) -> Result<(), DemError> {
        let row_bytes = 2 * self.side;
        let mut file = BufReader::with_capacity(1 << 16, File::open(path)?);
        file.seek(SeekFrom::Start((span.rows.start * row_bytes) as u64))?;
        let no_data = NoData::new(Some(NO_DATA));
        let mut bytes = vec![0; row_bytes];
        let mut samples = Vec::with_capacity(span.columns.len());
        for row in span.rows.clone() {
            file.read_exact(&mut bytes)?;
            let part = &bytes[2 * span.columns.start..2 * span.columns.end];
            let values = part
                .as_chunks()
                .0
                .iter()
                .map(|pair| f64::from(i16::from_be_bytes(*pair)));
            samples.clear();
            samples.extend(values.map(|value| no_data.elevation(value)));
            visit(row, span.columns.start, &samples)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_says_where_a_tile_belongs() {
        let check = |name, expected| assert_eq!(corner(name), expected, "{name}");
        check("N36W085.hgt", Some([36.0, -85.0]));
        check("s01e179.SRTMGL1.hgt", Some([-1.0, 179.0]));
        check("N00E000", Some([0.0, 0.0]));
        check("N36W85.hgt", None);
        check("N90E000.hgt", None);
        check("W085N36.hgt", None);
        check("N3\u{e9}W085", None);
        check("", None);
    }

    #[test]
    fn a_place_has_one_name() {
        let check = |name, expected: Option<&str>| assert_eq!(canonical(name).as_deref(), expected);
        check("n36w085", Some("N36W085.hgt"));
        check("N36W085.hgt", Some("N36W085.hgt"));
        check("s01e179.SRTMGL1.hgt", Some("S01E179.hgt"));
        check("tile.hgt", None);
    }
}
