//! Terrain of kind `dataset`: lookup, refusals, and the default area over it.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::{Arc, LazyLock};

use noctule::geometry::geodesy::undulation_m;
use noctule::scenario::limits::Limits;
use noctule::scenario::{Scenario, json};
use noctule::terrain::dem::{self, Declared, DemError};
use noctule::terrain::{DatasetError, Datasets, Found, Terrain};
use proptest::prelude::*;
use serde_json::{Value, json};
use tempfile::TempDir;

use super::{faults, read, rules};
use crate::support::elevations::ascii_grid;

/// Datasets from files made for these tests, with easily distinguished checksums.
#[derive(Debug)]
struct Fixed {
    files: BTreeMap<&'static str, (PathBuf, Option<&'static str>, String)>,
    _directory: TempDir,
}

impl Datasets for Fixed {
    fn find(&self, name: &str, sha256: Option<&str>) -> Result<Found, DatasetError> {
        match name {
            "broken" => return Err(DemError::UnknownFormat.into()),
            "away" => return Err(DatasetError::Unavailable("the disk is away".to_owned())),
            _ => {}
        }
        let Some((path, crs, found)) = self.files.get(name) else {
            let names = self.files.keys().map(ToString::to_string).collect();
            return Err(DatasetError::Unknown { names });
        };
        if sha256.is_some_and(|sha256| sha256 != found) {
            let sha256 = found.clone();
            return Err(DatasetError::Replaced { sha256 });
        }
        let declared = Declared {
            crs: *crs,
            ..Declared::default()
        };
        Ok(Found {
            sha256: found.clone(),
            dataset: dem::open(path, declared)?,
        })
    }
}

/// `hills` covers 0.4 degrees; `holes` is the same with a hole in the middle; `map` is about 30 km by 25 km of
/// UTM zone 16, three degrees west of its central meridian.
static DATASETS: LazyLock<Arc<Fixed>> = LazyLock::new(|| {
    let directory = TempDir::new().expect("a temporary directory");
    let height = |column: usize, row: usize| 200.0 + ((column * 7 + row * 11) % 40) as f64;
    let degrees = |elevation: &dyn Fn(usize, usize) -> f64| {
        ascii_grid([101, 101], [-84.5, 36.4], 0.004, elevation)
    };
    let holes = |column: usize, row: usize| {
        if column.abs_diff(50) <= 2 && row.abs_diff(50) <= 2 {
            -9999.0
        } else {
            height(column, row)
        }
    };
    let files = [
        ("hills", degrees(&height), None),
        ("holes", degrees(&holes), None),
        (
            "map",
            ascii_grid([301, 251], [190_000.0, 4_050_000.0], 100.0, height),
            Some("EPSG:32616"),
        ),
    ];
    let files = files.map(|(name, text, crs)| {
        let path = directory.path().join(format!("{name}.asc"));
        fs::write(&path, text).expect("written");
        (name, (path, crs, sum(name)))
    });
    let shipped = PathBuf::from("scenarios/terrain/jacksboro.tif");
    let shipped = ("jacksboro", (shipped, None, sum("jacksboro")));
    Arc::new(Fixed {
        files: files.into_iter().chain([shipped]).collect(),
        _directory: directory,
    })
});

fn sum(name: &str) -> String {
    format!("{:0<64}", name.len())
}

/// For the rules of all document tests.
pub(super) fn datasets() -> Arc<dyn Datasets> {
    DATASETS.clone()
}

/// A flight of 6 km over `hills`.
fn document() -> Value {
    json!({
        "frame": "wgs84",
        "start": {"lat": 36.55, "lon": -84.35, "alt": 300},
        "target": {"lat": 36.59, "lon": -84.31, "alt": 320},
        "terrain": {"kind": "dataset", "name": "hills"},
        "altitude": {"min": 50, "max": 300},
        "planner": {"smoothing": {"spacing": 50}},
    })
}

fn with(changes: &[(&str, Value)]) -> Value {
    let mut document = document();
    for (pointer, value) in changes {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        document.pointer_mut(parent).expect("it is there")[key] = value.clone();
    }
    document
}

fn area(south: f64, west: f64, north: f64, east: f64) -> Value {
    json!({"min": {"lat": south, "lon": west}, "max": {"lat": north, "lon": east}})
}

fn accepted(document: &Value) -> Scenario {
    read(&document.to_string()).unwrap_or_else(|refusal| panic!("{refusal}\n{document}"))
}

fn written(scenario: &Scenario) -> Value {
    serde_json::from_str(&json::write(scenario)).expect("JSON")
}

/// Refusals specific to datasets: the document, the pointer, the code and the detail.
pub(super) fn cases() -> Vec<(String, &'static str, &'static str, &'static str)> {
    let hole = area(36.5, -84.4, 36.7, -84.2);
    [
        (
            with(&[("/frame", "local".into()), ("/start", json!({"x": 0, "y": 0, "z": 300})), ("/target", json!({"x": 900, "y": 0, "z": 300}))]),
            "/terrain/kind",
            "not-applicable",
            "kind is dataset, must be flat, peaks or grid where frame is local: a dataset lies on the earth",
        ),
        (
            with(&[("/terrain/name", "hils".into())]),
            "/terrain/name",
            "unknown-dataset",
            "name is \"hils\", must be one of hills, holes, jacksboro, map, did you mean hills?",
        ),
        (
            with(&[("/terrain/sha256", format!("{:0<64}", 7).into())]),
            "/terrain/sha256",
            "replaced-dataset",
            "sha256 is \"7000000000000000000000000000000000000000\"..., this content is no longer kept; the name now stands for \
             5000000000000000000000000000000000000000000000000000000000000000",
        ),
        (
            with(&[("/terrain/sha256", "abc".into())]),
            "/terrain/sha256",
            "unknown-value",
            "sha256 is \"abc\", must be 64 hexadecimal digits in lower case",
        ),
        (
            with(&[("/terrain/name", "broken".into())]),
            "/terrain/name",
            "unreadable-dataset",
            "name is \"broken\", it cannot be read: the file is none of GeoTIFF, ESRI ASCII grid and SRTM .hgt \
             (1201 x 1201 or 3601 x 3601 samples)",
        ),
        (
            with(&[("/terrain/name", "away".into())]),
            "/terrain/name",
            "unreachable-datasets",
            "name is \"away\", the datasets cannot be reached: the disk is away",
        ),
        (
            with(&[
                ("/terrain/name", "holes".into()),
                ("/target/lat", json!(36.57)),
                ("/target/lon", json!(-84.33)),
                ("/area", hole),
            ]),
            "/area",
            "no-elevation",
            "there is no elevation at latitude 36.608000, longitude -84.308000: row 48, column 48 holds no data; \
             less than 1 % of the area has no elevation in \"holes\", must have one everywhere",
        ),
        (
            with(&[("/area", area(36.5, -84.6, 36.7, -84.2))]),
            "/area",
            "area-outside-terrain",
            "latitude 36.500001, longitude -84.599484 lies outside the elevations, which reach from latitude 36.400000 to 36.800000 \
             and from longitude -84.500000 to -84.100000; 25 % of the area has no elevation in \"hills\", must have one everywhere",
        ),
        (
            with(&[("/start/lon", json!(-84.52))]),
            "/start",
            "outside-terrain",
            "start is at lat 36.550000, lon -84.520000, must lie in the dataset \"hills\", from lat 36.400000, lon -84.500000 \
             to lat 36.800000, lon -84.100000",
        ),
        (
            with(&[("/terrain/name", "holes".into()), ("/target", json!({"lat": 36.6, "lon": -84.3, "alt": 300}))]),
            "/target",
            "no-elevation",
            "target is at lat 36.600000, lon -84.300000, where the dataset \"holes\" holds no elevation",
        ),
    ]
    .into_iter()
    .map(|(document, pointer, code, detail)| (document.to_string(), pointer, code, detail))
    .collect()
}

#[test]
fn an_accepted_dataset_is_pinned_by_its_checksum() {
    let scenario = accepted(&document());
    let Terrain::Dem(dem) = &scenario.terrain else {
        panic!("another terrain: {:?}", scenario.terrain)
    };
    assert_eq!(dem.name(), "hills");
    let written = written(&scenario);
    assert_eq!(
        written["terrain"],
        json!({"kind": "dataset", "name": "hills", "sha256": sum("hills")})
    );
    let again = accepted(&written);
    assert_eq!(again, scenario);
    assert_eq!(json::write(&again), json::write(&scenario));
}

#[test]
fn elevations_are_above_sea_level_whatever_the_altitude_datum() {
    let above_sea = accepted(&document());
    let above_ellipsoid = accepted(&with(&[("/altitude_datum", "ellipsoid".into())]));
    let earth = above_sea.frame.wgs84().expect("degrees");
    let lifts = [above_sea.start, above_sea.target].map(|end| {
        let place = earth.place(end.xy());
        let elevation = |scenario: &Scenario| {
            let plane = &scenario.frame.wgs84().expect("degrees").plane;
            scenario.terrain.elevation(plane.local(place))
        };
        let lift = elevation(&above_ellipsoid) - elevation(&above_sea);
        let geoid_m = undulation_m(place);
        assert!((lift - geoid_m).abs() < 1e-3, "{lift} for {geoid_m}");
        lift
    });
    assert!(
        lifts[0] < -30.0 && (lifts[0] - lifts[1]).abs() > 0.01,
        "{lifts:?}"
    );
}

#[test]
fn the_default_area_is_clipped_to_the_data() {
    // A kilometre from the corner of the data.
    let corner = with(&[
        ("/start", json!({"lat": 36.41, "lon": -84.49, "alt": 300})),
        ("/target", json!({"lat": 36.45, "lon": -84.43, "alt": 300})),
    ]);
    let area = &written(&accepted(&corner))["area"];
    assert_eq!(area["min"], json!({"lat": 36.4, "lon": -84.5}));
    assert!(area["max"]["lat"].as_f64().expect("a number") > 36.46);
    // A flight in the middle of the data gets the same area as over flat ground.
    let flat = with(&[("/terrain", json!({"kind": "flat", "elevation": 100}))]);
    assert_eq!(
        written(&accepted(&document()))["area"],
        written(&accepted(&flat))["area"]
    );
}

#[test]
fn a_given_area_may_be_the_extent_of_the_data() {
    let DatasetArea {
        south,
        west,
        north,
        east,
    } = dataset_area("hills");
    let whole = with(&[("/area", area(south, west, north, east))]);
    assert_eq!(accepted(&written(&accepted(&whole))), accepted(&whole));
}

/// The extent of a dataset, degrees.
struct DatasetArea {
    south: f64,
    west: f64,
    north: f64,
    east: f64,
}

fn dataset_area(name: &str) -> DatasetArea {
    let found = DATASETS.find(name, None).expect("it is there");
    let degrees = found.dataset.metadata().degrees;
    DatasetArea {
        south: degrees.south,
        west: degrees.west,
        north: degrees.north,
        east: degrees.east,
    }
}

#[test]
fn an_area_over_too_many_elevations_is_refused_unless_already_accepted() {
    let mut rules = rules();
    rules.limits = Limits {
        terrain_nodes: 100,
        ..Limits::default()
    };
    let text = document().to_string();
    let refusal = json::read(text.as_bytes(), &rules, 1).expect_err("too many");
    let refusal = refusal.to_string();
    assert!(
        refusal.starts_with("/area: the area lies over "),
        "{refusal}"
    );
    assert!(
        refusal.ends_with(
            " elevations of the dataset, must lie over at most 100 (limit terrain_nodes) [too-many]"
        ),
        "{refusal}"
    );
    // An accepted document is read whatever the limit is.
    json::read_accepted(&json::write(&accepted(&document())), &rules).expect("it was accepted");
}

#[test]
fn faults_of_both_ends_and_of_the_area_are_reported_separately() {
    let outside = with(&[
        ("/start/lon", json!(-84.52)),
        ("/target/lon", json!(-84.08)),
        ("/area", area(36.5, -84.53, 36.7, -84.07)),
    ]);
    let found = faults(&outside.to_string());
    let found: Vec<_> = found
        .iter()
        .map(|fault| (&*fault.pointer, fault.code))
        .collect();
    assert_eq!(
        found,
        [
            ("/start", "outside-terrain"),
            ("/target", "outside-terrain"),
            ("/area", "area-outside-terrain")
        ]
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases / 4, ..ProptestConfig::default() })]

    /// Anywhere in the data, including near its edges: an accepted document reads back to the same bits.
    #[test]
    fn an_accepted_document_reads_back_to_the_same_bits(
        from in [0.0..1.0f64, 0.0..1.0f64], to in [0.0..1.0f64, 0.0..1.0f64], which in 0..3usize, ellipsoid: bool,
    ) {
        let name = ["hills", "holes", "map"][which];
        let DatasetArea { south, west, north, east } = dataset_area(name);
        let place = |share: [f64; 2]| json!({
            "lat": south + share[0] * (north - south), "lon": west + share[1] * (east - west), "alt": 260,
        });
        let document = with(&[
            ("/start", place(from)), ("/target", place(to)), ("/terrain/name", name.into()),
            ("/altitude_datum", if ellipsoid { "ellipsoid" } else { "msl" }.into()),
        ]);
        // Most routes in the middle of the map are accepted, and all routes over the hills except at their
        // edges: meridians converge by 0.26 % of the hills' width, so a box around two places near an edge may
        // extend beyond the hills.
        let margin = if name == "map" { 0.2 } else { 0.003 };
        let inner = |share: [f64; 2]| share.iter().all(|share| (margin..1.0 - margin).contains(share));
        // The area has room of a quarter of the distance around both ends; more than that is kept between
        // them and the hole, which reaches from 0.47 to 0.53 of the extent.
        let room = 0.05 + 0.5 * ((from[0] - to[0]).abs() + (from[1] - to[1]).abs());
        let is_clear = name != "holes" || (0..2).any(|axis| {
            let (least, most) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
            most + room < 0.47 || least - room > 0.53
        });
        match read(&document.to_string()) {
            Ok(scenario) => {
                let text = json::write(&scenario);
                let again = read(&text);
                prop_assert!(again.is_ok(), "{} is refused: {again:?}", text);
                prop_assert_eq!(json::write(&again.expect("just looked")), text);
            }
            Err(refusal) => {
                let whole = inner(from) && inner(to) && is_clear;
                let expected = refusal.to_string().contains("target-") ;
                prop_assert!(!whole || expected, "{refusal}\n{document}");
            }
        }
    }
}
