//! The readers on malformed files: nothing panics, and nothing takes long.

use noctule::geometry::geodesy::{LatLon, TangentPlane};
use noctule::geometry::{Point2, Rect};
use proptest::prelude::*;

use super::{corpus, file, open, tile};
use crate::support::patience::at_little_cost;
use crate::support::size::cases;

/// One way to damage a file.
#[derive(Debug, Clone)]
enum Harm {
    Byte(prop::sample::Index, u8),
    /// Four bytes that often are a count or an offset.
    Word(prop::sample::Index, u32),
    Cut(prop::sample::Index),
    /// Part of the file repeated elsewhere.
    Copy(prop::sample::Index, prop::sample::Index, usize),
}

fn harm() -> impl Strategy<Value = Harm> {
    use prop::sample::Index;
    let words = prop::sample::select(vec![
        0,
        1,
        2,
        8,
        0xFFFF,
        0x7FFF_FFFF,
        0x8000_0000,
        u32::MAX,
        0x4000_0000,
        0x0001_0000,
    ]);
    prop_oneof![
        4 => (any::<Index>(), any::<u8>()).prop_map(|(at, byte)| Harm::Byte(at, byte)),
        4 => (any::<Index>(), words).prop_map(|(at, word)| Harm::Word(at, word)),
        1 => any::<Index>().prop_map(Harm::Cut),
        1 => (any::<Index>(), any::<Index>(), 1..40_usize).prop_map(|(from, to, len)| Harm::Copy(from, to, len)),
    ]
}

fn spoilt(mut bytes: Vec<u8>, harms: &[Harm]) -> Vec<u8> {
    for harm in harms {
        if bytes.len() < 8 {
            break;
        }
        let len = bytes.len();
        match harm {
            Harm::Byte(at, byte) => bytes[at.index(len)] = *byte,
            Harm::Word(at, word) => {
                let at = at.index(len - 4);
                bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
            }
            Harm::Cut(at) => bytes.truncate(at.index(len)),
            Harm::Copy(from, to, count) => {
                let count = (*count).min(len);
                let part = bytes[from.index(len - count + 1)..][..count].to_vec();
                bytes[to.index(len - count + 1)..][..count].copy_from_slice(&part);
            }
        }
    }
    bytes
}

/// Uses every operation on a file.
fn use_up(name: &str, bytes: &[u8]) {
    let (_directory, path) = file(name, bytes);
    if let Ok(dataset) = open(&path) {
        let _ = dataset.survey();
        let degrees = dataset.metadata().degrees;
        let middle = LatLon {
            lat: 0.5 * (degrees.south + degrees.north),
            lon: 0.5 * (degrees.west + degrees.east),
        };
        let _ = dataset.sample(&[middle]);
        let plane = TangentPlane::at(middle, 0.0);
        let area = Rect {
            min: Point2::new(-300.0, -300.0),
            max: Point2::new(300.0, 300.0),
        };
        if let Some(covered) = dataset.covered(&plane, area)
            && let Ok(dem) = dataset.ground(&plane, covered, 50.0, 100_000)
        {
            let terrain = noctule::terrain::Terrain::Dem(dem.into());
            assert!(terrain.elevation(Point2::new(0.0, 0.0)).is_finite());
        }
    }
}

proptest! {
    #![proptest_config(cases(1_000, 100_000))]

    #[test]
    fn a_damaged_file_never_panics(which: prop::sample::Index, harms in prop::collection::vec(harm(), 1..6)) {
        let (name, bytes) = which.get(corpus());
        let bytes = spoilt(bytes.clone(), &harms);
        at_little_cost(|| use_up(name, &bytes));
    }

    #[test]
    fn random_bytes_never_panic(magic in prop::sample::select(vec!["II*\0", "MM\0*", "II+\0", "ncols 2\n", ""]), bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        at_little_cost(|| use_up("bytes", &[magic.as_bytes(), &bytes].concat()));
    }
}

#[test]
fn a_damaged_tile_never_panics() {
    let mut bytes = tile(1201, 300);
    for (idx, byte) in bytes.iter_mut().enumerate() {
        if idx % 4001 == 0 {
            *byte = u8::try_from(idx % 256).expect("a byte");
        }
    }
    at_little_cost(|| use_up("N36W085.hgt", &bytes));
    at_little_cost(|| use_up("N36W085.hgt", &bytes[..bytes.len() - 1]));
}
