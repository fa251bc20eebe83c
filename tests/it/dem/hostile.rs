//! Malformed and malicious files: each is refused for its actual fault, at little cost.

use std::process::Command;

use noctule::terrain::dem::{self, Declared, Format};

use super::tiff::{self, Tiff, Value};
use super::{deflated, file, open, tile};

/// Geo keys of degrees with a vertical reference system and, where given, a unit.
fn vertical(code: u16, unit: Option<u16>) -> Value {
    let mut keys = vec![
        1, 1, 0, 3, 1024, 0, 1, 2, 2048, 0, 1, 4326, 4096, 0, 1, code,
    ];
    if let Some(unit) = unit {
        keys[3] += 1;
        keys.extend([4099, 0, 1, unit]);
    }
    Value::Short(keys)
}

/// On a map that is said to be drawn in a unit.
fn map(code: u16, unit: u16) -> Tiff {
    let keys = vec![
        1, 1, 0, 3, 1024, 0, 1, 1, 3072, 0, 1, code, 3076, 0, 1, unit,
    ];
    let corner = vec![0.0, 0.0, 0.0, 500_000.0, 5_000_000.0, 0.0];
    Tiff::right()
        .with(tiff::KEYS, Value::Short(keys))
        .with(tiff::TIE_POINT, Value::Double(corner))
        .with(tiff::SCALE, Value::Double(vec![10.0, 10.0, 0.0]))
}

/// Wrong files, and what the refusal must say.
fn cases() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    use Value::{Ascii, Double, Long, Raw, Short};
    let right = Tiff::right;
    let whole = right().bytes();
    let samples = |value: f32| right().holding(value.to_le_bytes().repeat(12)).bytes();
    let packed = |tiff: Tiff, bytes: &[u8]| {
        tiff.with(tiff::COMPRESSION, Short(vec![8]))
            .holding(deflated(bytes))
    };
    let square = |side: u32| {
        right()
            .with(tiff::WIDTH, Long(vec![side]))
            .with(tiff::HEIGHT, Long(vec![side]))
            .with(tiff::ROWS_PER_STRIP, Long(vec![side]))
    };
    let looped = Tiff { next: 8, ..right() };
    let asc = |text: &str| text.as_bytes().to_vec();
    vec![
        // Not what the name says, or empty.
        ("empty.tif", vec![], "none of GeoTIFF"),
        ("text.tif", asc("There is no elevation in here.\n"), "none of GeoTIFF"),
        ("short.hgt", tile(1200, 5), "none of GeoTIFF"),
        ("magic.tif", asc("II*\0"), "not a valid GeoTIFF"),
        ("magic-big.tif", asc("MM\0+"), "not a valid GeoTIFF"),
        // Truncated.
        ("headers-only.tif", whole[..200].to_vec(), "not a valid GeoTIFF"),
        ("cut.tif", whole[..whole.len() - 4].to_vec(), "lies beyond its end"),
        ("cut-strip.tif", right().with(tiff::COUNTS, Long(vec![40])).bytes(), "ends after 40 bytes"),
        ("far-strip.tif", right().with(tiff::OFFSETS, Long(vec![u32::MAX])).bytes(), "lies beyond its end"),
        ("half-unpacked.tif", packed(right(), &[0; 40]).bytes(), "not a valid GeoTIFF"),
        ("spoilt.tif", right().with(tiff::COMPRESSION, Short(vec![8])).bytes(), "not a valid GeoTIFF"),
        // Declared larger than they are.
        ("vast.tif", square(1 << 31).bytes(), "at most 1073741824"),
        ("wide.tif", right().with(tiff::WIDTH, Long(vec![1 << 20])).bytes(), "number of columns"),
        ("widest.tif", right().with(tiff::WIDTH, Long(vec![1 << 20])).with(tiff::OFFSETS, Long(vec![0])).bytes(), "number of columns"),
        ("bomb.tif", packed(square(16_384), &vec![0; 1 << 20]).bytes(), "the size in bytes of a packed strip"),
        ("bomb-within.tif", packed(right(), &vec![0; 20 << 20]).bytes(), "not a valid GeoTIFF"),
        ("long-tag.tif", right().with(tiff::NO_DATA, Raw(2, u32::MAX, 8)).bytes(), "not a valid GeoTIFF"),
        ("many-strips.tif", right().with(tiff::OFFSETS, Raw(4, 1 << 30, 8)).bytes(), "not a valid GeoTIFF"),
        ("loop.tif", looped.bytes(), "not a valid GeoTIFF"),
        ("empty-strips.tif", right().with(tiff::ROWS_PER_STRIP, Short(vec![0])).bytes(), "not a valid GeoTIFF"),
        ("no-columns.tif", right().with(tiff::WIDTH, Short(vec![0])).bytes(), "at least 2 x 2"),
        ("one-column.tif", right().with(tiff::WIDTH, Short(vec![1])).bytes(), "at least 2 x 2"),
        ("strips-missing.tif", right().with(tiff::ROWS_PER_STRIP, Short(vec![1])).bytes(), "of its 3 strips"),
        // Not elevations.
        ("bands.tif", right().with(tiff::BANDS, Short(vec![3])).with(tiff::BITS, Short(vec![32; 3])).bytes(), "3 bands"),
        ("half.tif", right().with(tiff::BITS, Short(vec![16])).bytes(), "bits per sample: 16"),
        ("complex.tif", right().with(tiff::SAMPLE_FORMAT, Short(vec![6])).bytes(), "not a valid GeoTIFF"),
        ("jpeg.tif", right().with(tiff::COMPRESSION, Short(vec![7])).bytes(), "scheme 7"),
        ("unknown-scheme.tif", right().with(tiff::COMPRESSION, Short(vec![34_925])).bytes(), "not a valid GeoTIFF"),
        ("infinite.tif", samples(f32::INFINITY), "inf m"),
        ("nines.tif", samples(-9999.0), "holds -9999 m, must be within -12000 to 12000 m and not -9999"),
        ("undeclared.tif", samples(-32768.0), "is it a no-data value that the file does not declare?"),
        ("scaled.tif", right().with(tiff::GDAL_METADATA, Ascii("<GDALMetadata><Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.1</Item></GDALMetadata>")).bytes(), "scaled or shifted"),
        ("feet.tif", right().with(tiff::KEYS, Short(vec![1, 1, 0, 3, 1024, 0, 1, 2, 2048, 0, 1, 4326, 4099, 0, 1, 9002])).bytes(), "EPSG:9002"),
        ("feet-by-name.tif", right().with(tiff::GDAL_METADATA, Ascii("<GDALMetadata><Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item></GDALMetadata>")).bytes(), "in the unit \"ft\""),
        ("survey-feet.tif", right().with(tiff::KEYS, vertical(6360, None)).bytes(), "the vertical reference system EPSG:6360"),
        ("depths.tif", right().with(tiff::KEYS, vertical(5715, None)).bytes(), "the vertical reference system EPSG:5715"),
        ("own-heights.tif", right().with(tiff::KEYS, vertical(32_767, Some(32_767))).bytes(), "neither an EPSG code nor a known unit"),
        ("old-heights.tif", right().with(tiff::KEYS, vertical(5103, None)).bytes(), "the vertical reference system EPSG:5103"),
        ("ellipsoid.tif", right().with(tiff::KEYS, vertical(4979, None)).bytes(), "above the ellipsoid (EPSG:4979)"),
        ("old-ellipsoid.tif", right().with(tiff::KEYS, vertical(5030, Some(9001))).bytes(), "above the ellipsoid (EPSG:5030)"),
        ("no-data.tif", right().with(tiff::NO_DATA, Ascii("none")).bytes(), "no-data value is \"none\""),
        // Without a usable position.
        ("nowhere.tif", right().without(tiff::TIE_POINT).bytes(), "not a GeoTIFF|no georeferenced image"),
        ("unscaled.tif", right().without(tiff::SCALE).bytes(), "neither one tie point and a pixel scale"),
        ("flat.tif", right().with(tiff::SCALE, Double(vec![0.0, 0.01, 0.0])).bytes(), "must be wider than 0"),
        ("lines.tif", right().with(tiff::SCALE, Double(vec![0.01, 0.0, 0.0])).bytes(), "must be wider than 0"),
        ("mirrored.tif", right().with(tiff::SCALE, Double(vec![-0.01, 0.01, 0.0])).bytes(), "must be wider than 0"),
        ("unnumbered.tif", right().with(tiff::SCALE, Double(vec![f64::NAN, 0.01, 0.0])).bytes(), "must be wider than 0"),
        ("rotated.tif", right().with(tiff::TRANSFORMATION, Double(vec![0.01, 0.002, 0.0, 8.0, 0.002, -0.01, 0.0, 45.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])).bytes(), "rotated"),
        ("beyond.tif", right().with(tiff::TIE_POINT, Double(vec![0.0, 0.0, 0.0, 8.0, 95.0, 0.0])).bytes(), "which EPSG:4326 does not"),
        ("round.tif", right().with(tiff::SCALE, Double(vec![200.0, 0.01, 0.0])).bytes(), "which EPSG:4326 does not"),
        ("no-crs.tif", right().without(tiff::KEYS).bytes(), "gdal_translate -a_srs EPSG:32616 in.asc out.tif"),
        ("own-crs.tif", right().with(tiff::KEYS, tiff::keys(1, 3072, 32_767)).bytes(), "without an EPSG code"),
        ("unknown-crs.tif", right().with(tiff::KEYS, tiff::keys(1, 3072, 9)).bytes(), "EPSG:9 cannot be used"),
        ("shifted-crs.tif", right().with(tiff::KEYS, tiff::keys(2, 2048, 4267)).bytes(), "EPSG:4267 cannot be used: its shift to WGS 84 is in a file"),
        ("mixed-crs.tif", right().with(tiff::KEYS, tiff::keys(1, 3072, 4326)).bytes(), "which it is not"),
        ("earth-centred.tif", right().with(tiff::KEYS, tiff::keys(3, 2048, 4978)).bytes(), "earth-centred"),
        ("bad-keys.tif", right().with(tiff::KEYS, Short(vec![9, 1, 0, 0])).bytes(), "geo keys"),
        ("ellipsoid-crs.tif", right().with(tiff::KEYS, tiff::keys(2, 2048, 4979)).bytes(), "its heights are above the ellipsoid"),
        ("feet-crs.tif", right().with(tiff::KEYS, tiff::keys(1, 3072, 8713)).bytes(), "its heights are in the unit \"us-ft\""),
        ("feet-map.tif", map(32_632, 9002).bytes(), "in the unit EPSG:9002, but EPSG:32632 has one of 1 m"),
        ("other-feet-map.tif", map(2264, 9002).bytes(), "in the unit EPSG:9002, but EPSG:2264"),
        // Text grids.
        ("header.asc", asc("ncols 3\nnrows 2\n"), "ends in its header"),
        ("unplaced.asc", asc("ncols 3\nnrows 2\ncellsize 1\n1 2 3 4 5 6"), "neither xllcorner nor xllcenter"),
        ("placed-twice.asc", asc("ncols 3\nnrows 2\nxllcorner 1\nxllcenter 1\nyllcorner 0\ncellsize 1\n1 2 3 4 5 6"), "both xllcorner and xllcenter"),
        ("said-twice.asc", asc("ncols 3\nncols 3\n"), "ncols twice"),
        ("no-cell.asc", asc("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 0\n1 2 3 4 5 6"), "size of a cell is 0"),
        ("infinite.asc", asc("ncols 3\nnrows 2\nxllcorner inf\nyllcorner 0\ncellsize 1\n1 2 3 4 5 6"), "must be a number"),
        ("words.asc", asc("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\ncolour red\n1 2 3 4 5 6"), "\"colour\" is neither"),
        ("fraction.asc", asc("ncols 2.5\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3 4 5 6"), "must be a whole number"),
        ("vast.asc", asc("ncols 2147483648\nnrows 2147483648\nxllcorner 0\nyllcorner 0\ncellsize 1e-9\n1 2 3"), "must be a whole number"),
        ("large.asc", asc("ncols 200000\nnrows 200000\nxllcorner 0\nyllcorner 0\ncellsize 1e-9\n1 2 3"), "too soon for"),
        ("cut.asc", asc("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n100 200 300 400 500"), "ends at row 1, column 2"),
        ("long.asc", asc("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3 4 5 6 7"), "more than 3 x 2"),
        ("not-a-number.asc", asc("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 three 4 5 6"), "holds \"three\""),
        ("endless.asc", [asc("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 "), vec![b'9'; 1 << 20]].concat(), "must hold a number"),
        // Values that are not elevations.
        ("N10E010.hgt", tile(1201, 20_000), "must be within -12000 to 12000 m"),
    ]
}

#[test]
fn each_wrong_file_is_refused_for_its_fault() {
    let mut faults = Vec::new();
    for (name, bytes, expected) in cases() {
        let (_directory, path) = file(name, &bytes);
        let refusal = match open(&path).and_then(|dataset| dataset.survey()) {
            Ok(survey) => format!("{survey:?}"),
            Err(refusal) => refusal.to_string(),
        };
        let said = expected.split('|').any(|part| refusal.contains(part));
        let own_path = path.to_str().expect("UTF-8");
        if !said || refusal.len() > 400 || refusal.contains(own_path) {
            faults.push(format!("{name}: {refusal:?}, expected {expected:?}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A program limited to 160 MB of address space, code and stacks included, refuses all of them.
#[test]
#[cfg(target_os = "linux")]
fn wrong_files_are_refused_in_little_memory() {
    for (name, bytes, _) in cases() {
        let (_directory, path) = file(name, &bytes);
        let output = Command::new("sh")
            .args([
                "-c",
                "ulimit -v 160000 && exec \"$0\" terrain info \"$1\"",
                env!("CARGO_BIN_EXE_noctule"),
            ])
            .arg(&path)
            .output()
            .expect("a shell");
        let reason = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {reason}");
        assert!(!reason.contains("panicked"), "{name}: {reason}");
        assert!(reason.contains(name), "{reason}");
    }
}

#[test]
fn stated_heights_in_metres_above_sea_level_are_read() {
    use Value::Ascii;
    let unit = |text: &'static str| Tiff::right().with(tiff::GDAL_METADATA, Ascii(text)).bytes();
    let keyed = |code, unit| Tiff::right().with(tiff::KEYS, vertical(code, unit)).bytes();
    let files = [
        keyed(5703, None),
        keyed(3855, Some(9001)),
        keyed(5773, Some(32_767)),
        keyed(32_767, Some(9001)),
        keyed(5103, Some(9001)),
        keyed(0, None),
        unit("<Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">m</Item>"),
        unit("<Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">Metre</Item>"),
        unit("<Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\"></Item>"),
    ];
    for (idx, bytes) in files.iter().enumerate() {
        let (_directory, path) = file("right.tif", bytes);
        if let Err(error) = open(&path) {
            panic!("file {idx}: {error}");
        }
    }
}

/// Its own unit is stated, or no model is.
#[test]
fn stated_reference_systems_are_read() {
    let keyed = |keys: Vec<u16>| Tiff::right().with(tiff::KEYS, Value::Short(keys));
    let mut on_map = map(32_632, 0);
    on_map = on_map.with(
        tiff::KEYS,
        Value::Short(vec![1, 1, 0, 1, 3072, 0, 1, 32_632]),
    );
    for (tiff, expected) in [
        (map(32_632, 9001), "EPSG:32632"),
        (map(2264, 9003), "EPSG:2264"),
        (on_map, "EPSG:32632"),
        (keyed(vec![1, 1, 0, 1, 2048, 0, 1, 4258]), "EPSG:4258"),
    ] {
        let (_directory, path) = file("right.tif", &tiff.bytes());
        let dataset = open(&path).unwrap_or_else(|error| panic!("{expected}: {error}"));
        assert_eq!(dataset.metadata().lattice.crs.to_string(), expected);
    }
}

#[test]
fn a_declared_format_or_reference_system_must_match_the_file() {
    let (_directory, path) = file("right.tif", &Tiff::right().bytes());
    let declared = |format, crs| {
        let declared = Declared {
            format: Some(format),
            crs,
            name: None,
        };
        dem::open(&path, declared)
            .map(|_| ())
            .map_err(|error| error.to_string())
    };
    assert_eq!(declared(Format::GeoTiff, None), Ok(()));
    assert_eq!(declared(Format::GeoTiff, Some("EPSG:4326")), Ok(()));
    let refusal = declared(Format::AsciiGrid, None).expect_err("it is no text");
    assert_eq!(
        refusal,
        "the file is said to be ESRI ASCII grid, but it is GeoTIFF"
    );
    let refusal = declared(Format::GeoTiff, Some("EPSG:32632")).expect_err("it is in degrees");
    assert_eq!(
        refusal,
        "the file is in EPSG:4326, but `crs` says EPSG:32632"
    );
}
