//! A dataset as clients see it.

use serde::Serialize;

use crate::catalogue::Entry;
use crate::geometry::geodesy::wrapped;
use crate::http::time::Time;
use crate::terrain::dem::{Degrees, Format};

/// Names of the formats.
pub(super) const FORMATS: [(&str, Format); 3] = [
    ("geotiff", Format::GeoTiff),
    ("asc", Format::AsciiGrid),
    ("hgt", Format::Hgt),
];

/// A dataset as clients see it.
#[derive(Debug, Serialize)]
pub(super) struct TerrainDocument {
    name: String,
    sha256: Option<String>,
    bytes: u64,
    format: &'static str,
    crs: String,
    columns: usize,
    rows: usize,
    cell: Pair,
    extent: Corners<Pair>,
    area: Corners<Place>,
    min: Option<f64>,
    max: Option<f64>,
    no_data_share: Option<f64>,
    uploaded_at: Option<Time>,
    mounted: bool,
    in_use: u64,
}

/// In units of the reference system.
#[derive(Debug, Serialize)]
struct Pair {
    x: f64,
    y: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct Place {
    lat: f64,
    lon: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct Corners<T> {
    min: T,
    max: T,
}

impl TerrainDocument {
    /// `in_use` is the number of plans queued or running over it.
    pub(super) fn new(entry: Entry, in_use: u64) -> Self {
        let mounted = entry.is_mounted();
        let lattice = &entry.metadata.lattice;
        let [[west, east], [south, north]] = lattice.extent();
        let found = FORMATS.iter();
        let mut found = found.filter(|(_, format)| *format == entry.metadata.format);
        let (format, _) = found.next().expect("every format has a name");
        let finite = |value: f64| value.is_finite().then_some(value);
        Self {
            name: entry.name,
            sha256: entry.sha256,
            bytes: entry.bytes,
            format,
            crs: lattice.crs.to_string(),
            columns: lattice.columns,
            rows: lattice.rows,
            cell: Pair {
                x: lattice.step[0],
                y: lattice.step[1].abs(),
            },
            extent: Corners {
                min: Pair { x: west, y: south },
                max: Pair { x: east, y: north },
            },
            area: Corners::of(entry.metadata.degrees),
            min: entry.survey.and_then(|survey| finite(survey.min)),
            max: entry.survey.and_then(|survey| finite(survey.max)),
            no_data_share: entry.survey.map(|survey| survey.no_data_share),
            uploaded_at: entry.uploaded_ms.map(Time),
            mounted,
            in_use,
        }
    }
}

impl Corners<Place> {
    /// In the form in which a scenario gives an area.
    pub(super) fn of(degrees: Degrees) -> Self {
        let place = |lat: f64, lon: f64| Place {
            lat,
            lon: wrapped(lon),
        };
        Self {
            min: place(degrees.south, degrees.west),
            max: place(degrees.north, degrees.east),
        }
    }
}
