//! A few samples of a file: only the blocks that hold them are read.

use noctule::geometry::geodesy::LatLon;

use super::masks::{Blocks, DEFLATE, OF_FULL_RESOLUTION, image, mask};
use super::tiff::{self, Tiff, Value};
use super::{file, open};

const SIDE: usize = 64;

/// An image whose blocks are cut to a byte, but for the first and the last.
fn cut_between(stored: (Blocks, u16), value: impl Fn(usize, usize) -> u8) -> Tiff {
    let (blocks, compression) = stored;
    let mut image = image([SIDE, SIDE], blocks, 8, compression, value);
    for (tag, value) in &mut image.tags {
        if let (tiff::COUNTS | tiff::TILE_COUNTS, Value::Long(counts)) = (*tag, value) {
            let last = counts.len() - 1;
            counts[1..last].fill(1);
        }
    }
    image
}

#[test]
fn blocks_without_a_wanted_sample_are_not_read() {
    let elevation = |row: usize, column: usize| u8::try_from(row + column).expect("a small image");
    // Between the samples 2 and 3, and between 60 and 61, both ways.
    let places = [(44.997, 8.003), (44.939, 8.061)].map(|(lat, lon)| LatLon { lat, lon });
    let stored = [
        (Blocks::Strips(8), 1),
        (Blocks::Strips(8), DEFLATE),
        (Blocks::Tiles(16), DEFLATE),
    ];
    for base in stored {
        let plain = cut_between(base, elevation).bytes();
        let hidden = cut_between(base, elevation)
            .followed_by(mask(cut_between(stored[2], |_, _| 255), OF_FULL_RESOLUTION));
        for bytes in [plain, hidden] {
            let (_directory, path) = file("sparse.tif", &bytes);
            let dataset = open(&path).expect("its headers are right");
            dataset.survey().expect_err("most blocks are cut");
            let sampled = dataset.sample(&places).expect("the two needed are whole");
            for (sample, expected) in sampled.into_iter().zip([5.0, 121.0]) {
                let off = sample.expect("it has data") - expected;
                assert!(off.abs() < 1e-6, "{base:?}: {off}");
            }
        }
    }
}
