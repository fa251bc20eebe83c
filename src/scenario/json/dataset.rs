//! `terrain` of kind `dataset`: which dataset it is, and the ground cut out of it.

use crate::digest;
use crate::geometry::geodesy::{LatLon, TangentPlane};
use crate::geometry::{Point2, Point3, Rect};
use crate::scenario::frame::Datum;
use crate::scenario::limits::Limits;
use crate::terrain::dem::{Dataset, Degrees, DemError};
use crate::terrain::{DatasetError, Datasets, Found, Terrain};

use super::chart::{Chart, Earth};
use super::fault::Faults;
use super::fields::{Fields, hint};
use super::path::Path;
use super::tree::Node;
use super::value::{At, quote};

pub(super) const FIELDS: &[&str] = &["kind", "name", "sha256"];

/// Ground kept beyond the area where available, as a fraction of its longer side; drawings show it around the area.
const MARGIN: f64 = 0.02;
/// An area that extends beyond the data by at most this is trimmed, metres: it is probably the data's own extent.
const OVERHANG_M: f64 = 1.0;
/// Points sampled along each axis to estimate the share of an area without elevation.
const LOOKS: usize = 24;
/// Most names listed when the requested name does not exist.
const LISTED: usize = 8;

/// The dataset named by a document, found before the rest of its terrain is read.
pub(super) struct Named<'a> {
    name: &'a str,
    found: Result<Found, DatasetError>,
}

/// The ground, and the part of the area that it covers.
pub(super) type Ground = (Terrain, Rect);

impl<'a> Named<'a> {
    /// `None` when the terrain is of another kind or cannot be read; the terrain reader reports that.
    pub(super) fn of(fields: &Fields<'a>, datasets: &dyn Datasets) -> Option<Self> {
        let terrain = fields.find("terrain")?;
        let text = |name: &str| match terrain.get(name) {
            Some(Node::Text(text)) => Some(&**text),
            _ => None,
        };
        if text("kind") != Some("dataset") {
            return None;
        }
        let name = text("name")?;
        let found = datasets.find(name, text("sha256"));
        Some(Self { name, found })
    }

    /// `None` when it was not found.
    pub(super) fn dataset(&self) -> Option<&Dataset> {
        self.found.as_ref().ok().map(|found| &found.dataset)
    }
}

/// What reading `terrain` needs from the rest of the document.
pub(super) struct Site<'a> {
    pub(super) named: Option<&'a Named<'a>>,
    pub(super) datasets: &'a dyn Datasets,
    pub(super) chart: &'a Chart,
    pub(super) limits: &'a Limits,
    /// Where waypoints may be, if already known.
    pub(super) area: Option<Rect>,
    /// Whether the document gives the area.
    pub(super) area_is_given: bool,
    /// The start and the target, with their field names.
    pub(super) ends: [(&'static str, Option<Point3>); 2],
}

/// The ground under the area, from a dataset.
pub(super) fn ground(fields: &Fields<'_>, site: &Site<'_>, faults: &mut Faults) -> Option<Ground> {
    let name = fields.required("name", faults, |at, faults| {
        at.text(faults).map(str::to_owned)
    });
    let sha256 = fields.or("sha256", None, faults, |at, faults| {
        sum(at, faults).map(Some)
    });
    if let Chart::Local = site.chart {
        faults.add(&Path::Key(fields.path, "kind"), "not-applicable", || {
            "kind is dataset, must be flat, peaks or grid where frame is local: a dataset lies on the earth"
        });
        return None;
    }
    let (name, sha256) = (name?, sha256?);
    let sha256 = sha256.as_deref();
    let named = site.named.expect("a terrain with kind and name names one");
    let found = match &named.found {
        Ok(found) => found,
        Err(error) => {
            refuse(error, fields, &name, sha256, faults);
            return None;
        }
    };
    let Chart::Wgs84(earth) = site.chart else {
        return None;
    };
    let area = site.area?;
    let area = trimmed(area, &found.dataset, earth.plane());
    let margin = MARGIN * (area.max - area.min).max();
    let dataset = &found.dataset;
    let dem = match dataset.ground(earth.plane(), area, margin, site.limits.terrain_nodes) {
        Ok(dem) => dem,
        Err(error @ (DemError::Outside { .. } | DemError::NoData { .. })) => {
            gaps(&error, named, site, earth, area, faults);
            return None;
        }
        Err(DemError::TooLarge { value, limit, .. }) => {
            faults.add(&Path::Key(&Path::Root, "area"), "too-many", || {
                format!(
                    "the area lies over {value} elevations of the dataset, must lie over at most {limit} (limit terrain_nodes)"
                )
            });
            return None;
        }
        Err(error) => {
            refuse(&error.into(), fields, &name, sha256, faults);
            return None;
        }
    };
    // A mounted file may have changed while it was read.
    if let Err(error) = site.datasets.find(&name, Some(&found.sha256)) {
        refuse(&error, fields, &name, Some(&found.sha256), faults);
        return None;
    }
    let dem = match earth.datum() {
        Datum::Msl => dem,
        Datum::Ellipsoid => dem.above_ellipsoid(earth.plane().origin()),
    };
    let dem = dem.named(name, found.sha256.as_str());
    Some((Terrain::Dem(dem.into()), area))
}

fn sum(at: At<'_>, faults: &mut Faults) -> Option<String> {
    let text = at.text(faults)?;
    if digest::is_sha256(text) {
        return Some(text.to_owned());
    }
    faults.add(at.path, "unknown-value", || {
        format!("sha256 is {}, must be {}", quote(text), digest::SHA256)
    });
    None
}

/// Report why a dataset was not found.
fn refuse(
    error: &DatasetError,
    fields: &Fields<'_>,
    name: &str,
    sha256: Option<&str>,
    faults: &mut Faults,
) {
    let (field, code) = match error {
        DatasetError::Unknown { .. } => ("name", "unknown-dataset"),
        DatasetError::Replaced { .. } => ("sha256", "replaced-dataset"),
        DatasetError::Unreadable(_) => ("name", "unreadable-dataset"),
        DatasetError::Unavailable(_) => ("name", "unreachable-datasets"),
    };
    faults.add(&Path::Key(fields.path, field), code, || match error {
        DatasetError::Unknown { names } => {
            format!("name is {}, {}", quote(name), known(name, names))
        }
        DatasetError::Replaced { .. } => {
            let sha256 = sha256.unwrap_or_default();
            format!("sha256 is {}, {error}", quote(sha256))
        }
        _ => format!("name is {}, {error}", quote(name)),
    });
}

/// The names that exist, for a message.
fn known(name: &str, names: &[String]) -> String {
    if names.is_empty() {
        return "there are no datasets; --terrain-dir names a directory of them, and PUT /terrains/{name} of a service makes one"
            .to_owned();
    }
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let hint = hint(name, &names);
    let more = match names.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" or {more} more"),
    };
    let listed = &names[..names.len().min(LISTED)];
    format!("must be one of {}{more}{hint}", listed.join(", "))
}

/// Report where elevations are missing, and for how much of the area.
fn gaps(
    error: &DemError,
    named: &Named<'_>,
    site: &Site<'_>,
    earth: &Earth,
    area: Rect,
    faults: &mut Faults,
) {
    let Ok(Found { dataset, .. }) = &named.found else {
        return;
    };
    let ends = site.ends.iter();
    let ends: Vec<(&str, LatLon)> = ends
        .filter_map(|(name, end)| Some((*name, earth.place((*end)?.xy()))))
        .collect();
    let share = |i: usize| i as f64 / (LOOKS - 1) as f64;
    let size = area.max - area.min;
    let looks = (0..LOOKS * LOOKS).map(|look| {
        let (x, y) = (share(look % LOOKS), share(look / LOOKS));
        let point = Point2::new(area.min.x + x * size.x, area.min.y + y * size.y);
        earth.plane().geodetic(point)
    });
    let places: Vec<LatLon> = ends.iter().map(|(_, end)| *end).chain(looks).collect();
    let Ok(elevations) = dataset.sample(&places) else {
        faults.add(&Path::Key(&Path::Root, "area"), "no-elevation", || {
            error.to_string()
        });
        return;
    };
    let (below_ends, below_area) = elevations.split_at(ends.len());
    let mut ends_are_known = true;
    for ((name, end), elevation) in ends.iter().zip(below_ends) {
        if elevation.is_none() {
            missing(name, *end, named.name, dataset, faults);
            ends_are_known = false;
        }
    }
    // A default area contains the ends, so gaps below them are not reported twice.
    if site.area_is_given || ends_are_known {
        let code = match error {
            DemError::Outside { .. } => "area-outside-terrain",
            _ => "no-elevation",
        };
        let unknown = below_area.iter().filter(|known| known.is_none()).count();
        faults.add(&Path::Key(&Path::Root, "area"), code, || {
            let area = if site.area_is_given {
                "the area"
            } else {
                "the area, by default the box round everything as far as the dataset reaches,"
            };
            let percent = match 100 * unknown / below_area.len() {
                0 => "less than 1".to_owned(),
                percent => percent.to_string(),
            };
            format!(
                "{error}; {percent} % of {area} has no elevation in {}, must have one everywhere",
                quote(named.name)
            )
        });
    }
}

/// Report that there is no elevation below the start or the target.
pub(super) fn missing(end: &str, at: LatLon, name: &str, dataset: &Dataset, faults: &mut Faults) {
    let path = Path::Key(&Path::Root, end);
    let place = format!("lat {:.6}, lon {:.6}", at.lat, at.lon);
    if dataset.covers(at) {
        faults.add(&path, "no-elevation", || {
            format!(
                "{end} is at {place}, where the dataset {} holds no elevation",
                quote(name)
            )
        });
        return;
    }
    faults.add(&path, "outside-terrain", || {
        let Degrees { west, south, east, north } = dataset.metadata().degrees;
        format!(
            "{end} is at {place}, must lie in the dataset {}, from lat {south:.6}, lon {west:.6} to lat {north:.6}, lon {east:.6}",
            quote(name)
        )
    });
}

/// `area` trimmed to the data, where it extends beyond by at most [`OVERHANG_M`].
fn trimmed(area: Rect, dataset: &Dataset, plane: &TangentPlane) -> Rect {
    let near = |a: Point2, b: Point2| (a - b).amax() <= OVERHANG_M;
    match dataset.covered(plane, area) {
        Some(covered) if near(covered.min, area.min) && near(covered.max, area.max) => covered,
        _ => area,
    }
}
