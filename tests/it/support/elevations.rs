//! Elevation files made for a test.

use std::io::{self, Write};

/// An ESRI ASCII grid; `elevation` takes column and row, both from the south-west.
pub(crate) fn ascii_grid(
    [columns, rows]: [usize; 2],
    [west, south]: [f64; 2],
    cell: f64,
    elevation: impl Fn(usize, usize) -> f64,
) -> String {
    let mut text = format!(
        "ncols {columns}\nnrows {rows}\nxllcenter {west}\nyllcenter {south}\ncellsize {cell}\nNODATA_value -9999\n"
    );
    for row in (0..rows).rev() {
        let line: Vec<String> = (0..columns)
            .map(|column| elevation(column, row).to_string())
            .collect();
        text += &line.join(" ");
        text.push('\n');
    }
    text
}

/// A plain `GeoTIFF` of 16-bit integers in EPSG:4326 with one strip, written row by row so that it can be any
/// size. `elevation` takes column and row from the north-west.
pub(crate) fn write_tiff(
    out: &mut impl Write,
    [columns, rows]: [u32; 2],
    [west, north]: [f64; 2],
    cell: f64,
    elevation: impl Fn(u32, u32) -> i16,
) -> io::Result<()> {
    const N_TAGS: u16 = 13;
    const SHORT: u16 = 3;
    const LONG: u16 = 4;
    const DOUBLE: u16 = 12;
    // The directory, then values that do not fit into it, then the samples.
    let beyond = 8 + 2 + 12 * u32::from(N_TAGS) + 4;
    let (scale, tie, keys) = (beyond, beyond + 24, beyond + 72);
    let samples = keys + 32;
    let mut head: Vec<u8> = b"II*\0\x08\0\0\0".to_vec();
    head.extend(N_TAGS.to_le_bytes());
    for (tag, kind, count, value) in [
        (256, LONG, 1, columns),
        (257, LONG, 1, rows),
        (258, SHORT, 1, 16),
        (259, SHORT, 1, 1),
        (262, SHORT, 1, 1),
        (273, LONG, 1, samples),
        (277, SHORT, 1, 1),
        (278, LONG, 1, rows),
        (279, LONG, 1, 2 * columns * rows),
        (339, SHORT, 1, 2),
        (33550, DOUBLE, 3, scale),
        (33922, DOUBLE, 6, tie),
        (34735, SHORT, 16, keys),
    ] {
        let (tag, count): (u16, u32) = (tag, count);
        head.extend(tag.to_le_bytes());
        head.extend(kind.to_le_bytes());
        head.extend(count.to_le_bytes());
        head.extend(value.to_le_bytes());
    }
    head.extend([0; 4]);
    for number in [cell, cell, 0.0, 0.0, 0.0, 0.0, west, north, 0.0] {
        head.extend(number.to_le_bytes());
    }
    // Three keys: geographic model, pixel is point, EPSG:4326.
    for key in [
        1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 2, 2048, 0, 1, 4326_u16,
    ] {
        head.extend(key.to_le_bytes());
    }
    out.write_all(&head)?;
    for row in 0..rows {
        let line: Vec<u8> = (0..columns)
            .flat_map(|column| elevation(column, row).to_le_bytes())
            .collect();
        out.write_all(&line)?;
    }
    Ok(())
}
