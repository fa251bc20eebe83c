//! Masks within a file: what they hide has no data.

use noctule::geometry::geodesy::LatLon;

use super::tiff::{self, Tiff, Value};
use super::{deflated, file, open};
use Value::{Long, Short};

pub(super) const DEFLATE: u16 = 8;
pub(super) const OF_FULL_RESOLUTION: u16 = 4;
const OF_AN_OVERVIEW: u16 = 5;

/// Whether the mask of the tests shows a sample.
fn shows(row: usize, column: usize) -> bool {
    !(3 * row + 5 * column).is_multiple_of(7)
}

/// How an image of the tests is stored.
#[derive(Debug, Clone, Copy)]
pub(super) enum Blocks {
    /// Of so many rows.
    Strips(usize),
    /// Squares of so many samples on a side, deflated.
    Tiles(usize),
}

/// An image of `size` columns and rows in blocks; `value` is a sample, `bits` its size.
pub(super) fn image(
    size: [usize; 2],
    blocks: Blocks,
    bits: u16,
    compression: u16,
    value: impl Fn(usize, usize) -> u8,
) -> Tiff {
    let [columns, rows] = size;
    let [width, height] = match blocks {
        Blocks::Strips(height) => [columns, height],
        Blocks::Tiles(side) => [side, side],
    };
    let row = |row: usize, from: usize| -> Vec<u8> {
        let samples: Vec<u8> = (from..from + width)
            .map(|column| {
                if row < rows && column < columns {
                    value(row, column)
                } else {
                    0
                }
            })
            .collect();
        match bits {
            1 => samples
                .chunks(8)
                .map(|bits| {
                    let bit = |(idx, bit): (usize, &u8)| bit << (7 - idx);
                    bits.iter().enumerate().map(bit).sum()
                })
                .collect(),
            _ => samples,
        }
    };
    let (mut data, mut offsets, mut counts) = (Vec::new(), Vec::new(), Vec::new());
    for top in (0..rows).step_by(height) {
        for left in (0..columns).step_by(width) {
            let bottom = match blocks {
                Blocks::Strips(_) => (top + height).min(rows),
                Blocks::Tiles(_) => top + height,
            };
            let plain: Vec<u8> = (top..bottom).flat_map(|at| row(at, left)).collect();
            let block = match compression {
                DEFLATE => deflated(&plain),
                _ => plain,
            };
            offsets.push(tiff::DATA + u32::try_from(data.len()).expect("a small file"));
            counts.push(u32::try_from(block.len()).expect("a small file"));
            data.extend(block);
        }
    }
    let long = |value: usize| Long(vec![u32::try_from(value).expect("a small image")]);
    let tiff = Tiff::right()
        .with(tiff::WIDTH, long(columns))
        .with(tiff::HEIGHT, long(rows))
        .with(tiff::BITS, Short(vec![bits]))
        .with(tiff::SAMPLE_FORMAT, Short(vec![1]))
        .with(tiff::SCALE, Value::Double(vec![0.001, 0.001, 0.0]))
        .with(tiff::COMPRESSION, Short(vec![compression]));
    let tiff = match blocks {
        Blocks::Strips(height) => tiff
            .with(tiff::ROWS_PER_STRIP, long(height))
            .with(tiff::OFFSETS, Long(offsets))
            .with(tiff::COUNTS, Long(counts)),
        Blocks::Tiles(side) => tiff
            .without(tiff::ROWS_PER_STRIP)
            .without(tiff::OFFSETS)
            .without(tiff::COUNTS)
            .with(tiff::TILE_WIDTH, long(side))
            .with(tiff::TILE_HEIGHT, long(side))
            .with(tiff::TILE_OFFSETS, Long(offsets))
            .with(tiff::TILE_COUNTS, Long(counts)),
    };
    Tiff { data, ..tiff }
}

/// The same as a mask.
pub(super) fn mask(tiff: Tiff, subfile: u16) -> Tiff {
    tiff.with(tiff::SUBFILE, Long(vec![subfile.into()]))
        .with(tiff::PHOTOMETRIC, Short(vec![4]))
        .without(tiff::KEYS)
        .without(tiff::SCALE)
        .without(tiff::TIE_POINT)
}

#[test]
fn masked_samples_have_no_data_however_image_and_mask_are_stored() {
    let size = [45, 40];
    let stored = [
        (Blocks::Strips(1), 1),
        (Blocks::Strips(7), DEFLATE),
        (Blocks::Strips(40), 1),
        (Blocks::Tiles(16), DEFLATE),
        (Blocks::Tiles(32), 1),
    ];
    for (base_blocks, base_compression) in stored {
        for (blocks, compression) in stored {
            for bits in [1, 8] {
                let base = image(size, base_blocks, 8, base_compression, |row, column| {
                    u8::try_from(row + column).expect("a small image")
                });
                let all = if bits == 1 { 1 } else { 255 };
                let hiding = image(size, blocks, bits, compression, |row, column| {
                    all * u8::from(shows(row, column))
                });
                let bytes = base.followed_by(mask(hiding, OF_FULL_RESOLUTION));
                let (_directory, path) = file("masked.tif", &bytes);
                let case = format!("{base_blocks:?} under {bits} bits in {blocks:?}");
                let dataset = open(&path).unwrap_or_else(|error| panic!("{case}: {error}"));
                let survey = dataset.survey().expect("it is whole");
                let hidden = (0..40)
                    .flat_map(|row| (0..45).map(move |column| shows(row, column)))
                    .filter(|shown| !shown)
                    .count();
                let share = hidden as f64 / (45.0 * 40.0);
                assert!(
                    (survey.no_data_share - share).abs() < 1e-12,
                    "{case}: {survey:?}"
                );
                // The middle of each cell, in a window of the file.
                let cells: Vec<[usize; 2]> = (17..35)
                    .flat_map(|row| (20..44).map(move |column| [row, column]))
                    .collect();
                let places: Vec<LatLon> = cells
                    .iter()
                    .map(|[row, column]| LatLon {
                        lat: 45.0 - 0.001 * (*row as f64 + 1.0),
                        lon: 8.0 + 0.001 * (*column as f64 + 1.0),
                    })
                    .collect();
                for ([row, column], found) in
                    cells.iter().zip(dataset.sample(&places).expect("read"))
                {
                    let known = shows(*row, *column)
                        && shows(*row, column + 1)
                        && shows(row + 1, *column)
                        && shows(row + 1, column + 1);
                    let expected = known.then_some((row + column + 1) as f64);
                    assert_eq!(
                        found.map(f64::round),
                        expected,
                        "{case}: row {row}, column {column}"
                    );
                }
            }
        }
    }
}

/// Too many samples for one go.
#[test]
fn a_large_mask_is_read_in_parts() {
    let size = [2000, 6000];
    for (base_blocks, blocks) in [
        (Blocks::Strips(1000), Blocks::Tiles(512)),
        (Blocks::Tiles(512), Blocks::Strips(700)),
    ] {
        let base = image(size, base_blocks, 8, DEFLATE, |_, _| 100);
        let hiding = image(size, blocks, 1, DEFLATE, |row, column| {
            u8::from(row / 1000 == column / 400)
        });
        let bytes = base.followed_by(mask(hiding, OF_FULL_RESOLUTION));
        let (_directory, path) = file("masked.tif", &bytes);
        let survey = open(&path).and_then(|dataset| dataset.survey());
        let survey = survey.expect("it is right");
        let share = 1.0 - 5.0 / 30.0;
        assert!((survey.no_data_share - share).abs() < 1e-12, "{survey:?}");
    }
}

/// What is hidden may hold anything, and a mask of an overview hides nothing.
#[test]
fn only_the_mask_of_full_resolution_counts() {
    let value = |row, column| if row == 1 && column == 2 { 200 } else { 10 };
    let base = || image([4, 3], Blocks::Strips(3), 8, 1, value);
    let hiding = |size, subfile, bits| {
        let hiding = image(size, Blocks::Strips(3), bits, 1, |row, column| {
            u8::from(value(row, column) == 10)
        });
        mask(hiding, subfile)
    };
    let check = |hiding: Tiff, expected: Result<f64, &str>| {
        let (_directory, path) = file("masked.tif", &base().followed_by(hiding));
        match (open(&path).and_then(|dataset| dataset.survey()), expected) {
            (Ok(survey), Ok(max)) => assert!((survey.max - max).abs() < 1e-9, "{survey:?}"),
            (Err(error), Err(reason)) => {
                assert!(error.to_string().contains(reason), "{error}");
            }
            (found, expected) => panic!("{found:?}, expected {expected:?}"),
        }
    };
    check(hiding([4, 3], OF_FULL_RESOLUTION, 1), Ok(10.0));
    check(hiding([2, 2], OF_AN_OVERVIEW, 1), Ok(200.0));
    check(
        hiding([5, 3], OF_FULL_RESOLUTION, 1),
        Err("its mask has 5 x 3 samples, the image 4 x 3; must be of the same size"),
    );
    check(
        hiding([4, 3], OF_FULL_RESOLUTION, 8).with(tiff::BITS, Short(vec![2])),
        Err("its mask has 1 bands of 2 bits; must be one band of 1 or 8 bits"),
    );
}
