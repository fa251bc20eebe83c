//! What is read from valid files.

use noctule::geometry::geodesy::{LatLon, TangentPlane};
use noctule::geometry::{Point2, Rect};
use noctule::terrain::dem::{self, Declared, Format, SampleType};
use noctule::terrain::{Terrain, dem::DemError};

use super::tiff::{self, Tiff, Value};
use super::{corpus, file, open, tile};

fn at(lat: f64, lon: f64) -> LatLon {
    LatLon { lat, lon }
}

#[test]
fn the_whole_corpus_is_read() {
    for (name, bytes) in corpus() {
        let (_directory, path) = file(name, bytes);
        let dataset = open(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        let survey = dataset
            .survey()
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        // All were cut from mountains between 236 and 1076 m.
        assert!(
            200.0 < survey.min && survey.min < survey.max && survey.max < 1100.0,
            "{name}: {survey:?}"
        );
        let metadata = dataset.metadata();
        assert!(
            metadata.degrees.north < 36.74 && metadata.degrees.south > 36.4,
            "{name}: {metadata:?}"
        );
    }
}

/// Samples hold at pixel centres for areas, and at the grid points themselves for points.
#[test]
fn pixel_areas_and_pixel_points_differ_by_half_a_cell() {
    let check = |raster_type: u16, lat: f64, lon: f64| {
        let keys = Value::Short(vec![
            1,
            1,
            0,
            3,
            1024,
            0,
            1,
            2,
            1025,
            0,
            1,
            raster_type,
            2048,
            0,
            1,
            4326,
        ]);
        let bytes = Tiff::right().with(tiff::KEYS, keys).bytes();
        let (_directory, path) = file("right.tif", &bytes);
        let dataset = open(&path).expect("it is right");
        // Half way from the first to the second column, a fifth of the way from the first to the second row.
        let found = dataset
            .sample(&[at(lat - 0.002, lon + 0.005)])
            .expect("read")[0];
        let found = found.expect("it lies between samples");
        assert!(
            (found - (0.5 + 0.2 * 4.0)).abs() < 1e-6,
            "{raster_type}: {found}"
        );
    };
    check(1, 44.995, 8.005);
    check(2, 45.0, 8.0);
}

#[test]
fn there_is_no_elevation_beyond_the_samples_or_beside_no_data() {
    let samples: Vec<f32> = (0..12_u8)
        .map(|idx| if idx == 11 { -9999.0 } else { idx.into() })
        .collect();
    let bytes = Tiff::right()
        .holding(samples.into_iter().flat_map(f32::to_le_bytes).collect())
        .with(tiff::NO_DATA, Value::Ascii("-9999"))
        .bytes();
    let (_directory, path) = file("right.tif", &bytes);
    let dataset = open(&path).expect("it is right");
    let survey = dataset.survey().expect("it is whole");
    assert_eq!((survey.min, survey.max), (0.0, 10.0));
    assert!((survey.no_data_share - 1.0 / 12.0).abs() < 1e-12);
    let places = [
        at(44.995, 8.005),
        at(44.9951, 8.005),
        at(44.995, 8.0049),
        at(44.975, 8.025),
        at(44.9749, 8.025),
        at(44.976, 8.026),
        at(44.975, 368.025),
    ];
    let found = dataset.sample(&places).expect("read");
    let known: Vec<bool> = found.iter().map(Option::is_some).collect();
    assert_eq!(known, [true, false, false, true, false, false, true]);
    assert!((found[3].expect("known") - 10.0).abs() < 1e-5);
}

#[test]
fn a_tile_is_placed_by_its_name() {
    let mut bytes = tile(1201, 100);
    // The sample in the north-west corner.
    bytes[..2].copy_from_slice(&700_i16.to_be_bytes());
    let (_directory, path) = file("upload", &bytes);
    let named = |name| {
        dem::open(
            &path,
            Declared {
                name: Some(name),
                ..Declared::default()
            },
        )
    };
    let dataset = named("S02W001.hgt").expect("it is right");
    assert_eq!(dataset.metadata().format, Format::Hgt);
    assert_eq!(dataset.metadata().sample_type, SampleType::I16);
    let found = dataset
        .sample(&[at(-1.0, -1.0), at(-1.5, -0.5)])
        .expect("read");
    assert_eq!(found, [Some(700.0), Some(100.0)]);
    assert!(matches!(
        named("jacksboro.hgt"),
        Err(DemError::Malformed { .. })
    ));
    assert!(matches!(open(&path), Err(DemError::Malformed { .. })));
}

#[test]
fn a_text_grid_outside_degrees_needs_a_reference_system() {
    let text = |x: f64, cell: f64| {
        format!(
            "NCOLS 3\nNROWS 2\nXLLCENTER {x}\nYLLCENTER 40\nCELLSIZE {cell}\n1 2 3\n4 5 -9999\n"
        )
    };
    let (_directory, path) = file("degrees.asc", text(8.0, 0.5).as_bytes());
    let dataset = open(&path).expect("it fits into degrees");
    assert_eq!(dataset.metadata().lattice.crs.to_string(), "EPSG:4326");
    assert_eq!(
        dataset
            .sample(&[at(40.0, 8.25), at(40.0, 9.0)])
            .expect("read"),
        [Some(4.5), None]
    );
    let (_directory, path) = file("metres.asc", text(500_000.0, 30.0).as_bytes());
    assert!(matches!(open(&path), Err(DemError::NoCrs)));
    let declared = |crs| {
        dem::open(
            &path,
            Declared {
                crs: Some(crs),
                ..Declared::default()
            },
        )
    };
    assert!(declared("epsg:32632").is_ok());
    assert!(matches!(
        declared("EPSG:1"),
        Err(DemError::UnusableCrs { .. })
    ));
    assert!(matches!(
        declared("+proj=utm +zone=32"),
        Err(DemError::UnusableCrs { .. })
    ));
}

/// Some editors put a mark before a text, and some programs one after it.
#[test]
fn marks_around_a_text_grid_are_no_part_of_it() {
    let text = "\u{feff}ncols 3\r\nnrows 2\r\nxllcenter 8\r\nyllcenter 40\r\ncellsize 0.5\r\n1 2 3\r\n4 5 6";
    for end in ["", "\u{1a}", "\r\n\u{1a}", "\r\n\u{1a}\u{1a}\r\n"] {
        let (_directory, path) = file("marked.asc", format!("{text}{end}").as_bytes());
        let survey = open(&path).and_then(|dataset| dataset.survey());
        let survey = survey.unwrap_or_else(|error| panic!("{end:?}: {error}"));
        assert_eq!((survey.min, survey.max), (1.0, 6.0));
    }
}

#[test]
fn ground_cut_out_of_a_file_agrees_with_its_samples() {
    let path =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/terrain/jacksboro.tif");
    let dataset = open(&path).expect("it is right");
    let middle = at(36.59, -84.25);
    let plane = TangentPlane::at(middle, 300.0);
    let area = Rect {
        min: Point2::new(-5000.0, -4000.0),
        max: Point2::new(5000.0, 4000.0),
    };
    let dem = dataset
        .ground(&plane, area, 1000.0, 100_000)
        .expect("it is covered");
    assert!((dem.extent().min.x + 6000.0).abs() < 1e-9);
    let terrain = Terrain::Dem(dem.into());
    let points = [
        Point2::new(0.0, 0.0),
        Point2::new(-4321.0, 1234.5),
        Point2::new(4999.0, -3999.0),
    ];
    let places = points.map(|point| plane.geodetic(point));
    for (point, sample) in points.iter().zip(dataset.sample(&places).expect("read")) {
        let elevation = terrain.elevation(*point);
        assert!(
            (elevation - sample.expect("known")).abs() < 2e-4,
            "{elevation} {sample:?}"
        );
    }
    // Too many samples, or too wide.
    assert!(matches!(
        dataset.ground(&plane, area, 1000.0, 10_000),
        Err(DemError::TooLarge { .. })
    ));
    let wide = area.grown(20_000.0);
    assert!(matches!(
        dataset.ground(&plane, wide, 0.0, 1_000_000),
        Err(DemError::Outside { .. })
    ));
    let covered = dataset.covered(&plane, wide).expect("some of it is");
    let ground = dataset
        .ground(&plane, covered, 0.0, 1_000_000)
        .expect("all of it is covered");
    assert_eq!(ground.extent(), covered);
    // The file reaches 14.6 to 15.4 km from the middle, and its edges are almost straight.
    let corner = plane.local(at(36.7325, -84.41333));
    assert!(
        (covered.min.x - corner.x).abs() < 120.0 && (covered.max.y - corner.y).abs() < 120.0,
        "{covered:?} {corner}"
    );
    assert!(
        dataset
            .covered(&TangentPlane::at(at(45.0, 8.0), 0.0), area)
            .is_none()
    );
}
