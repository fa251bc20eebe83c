//! The default area over terrain with an edge: a box of degrees that a dataset or a grid covers.

use crate::geometry::geodesy::{LatLon, LatLonBox, TangentPlane, wrapped};
use crate::geometry::{Point2, Rect, Vector2};
use crate::terrain::dem::Degrees;

use super::chart::Earth;
use super::dataset::Named;
use super::fields::Fields;
use super::sketch::{self, GRAIN, down, up};
use super::tree::Node;

/// Points along each side of a rectangle at which its place on the earth is looked up.
const LOOKS: usize = 24;
/// Most rounds of fitting a box of degrees into the data.
const ROUNDS: usize = 8;

/// The part of `wanted` that has data, as the default area; all of it where that would cut off one of `ends`.
pub(super) fn over_dataset(
    named: &Named<'_>,
    wanted: LatLonBox,
    ends: &[LatLon],
    earth: impl Fn(LatLonBox) -> Earth,
) -> LatLonBox {
    let Some(dataset) = named.dataset() else {
        return wanted;
    };
    let mut fitted = cut(wanted, dataset.metadata().degrees);
    for _ in 0..ROUNDS {
        let Some(area) = fitted.filter(|area| ends.iter().all(|end| area.contains(*end))) else {
            return wanted;
        };
        let earth = earth(area);
        let rect = earth.rect();
        match dataset.covered(earth.plane(), rect) {
            Some(covered) if covered == rect => return area,
            Some(covered) => fitted = inside(covered, earth.plane()),
            None => return wanted,
        }
    }
    wanted
}

/// The default area over a terrain grid: the box of degrees inside it. `None` when the terrain is no grid or cannot
/// be read, is too wide for a plane, or does not contain all `ends`; other readers report that.
pub(super) fn over_grid(
    fields: &Fields<'_>,
    ends: &[LatLon],
    earth: impl Fn(LatLonBox) -> Earth,
) -> Option<LatLonBox> {
    let terrain = fields.find("terrain")?;
    if !matches!(terrain.get("kind"), Some(Node::Text(kind)) if &**kind == "grid") {
        return None;
    }
    let origin = sketch::place(terrain.get("origin")?)?;
    let figure = |name: &str| sketch::number(terrain.get(name)?);
    let cell = figure("cell")?;
    let size = Vector2::new(
        cell * (figure("columns")? - 1.0),
        cell * (figure("rows")? - 1.0),
    );
    if !(size.min() > 0.0 && size.max() <= sketch::MAX_WIDTH_M) {
        return None;
    }
    // Start with a plane near the grid and the box of the grid's extent on it.
    let mut fitted = boxed(
        [origin.lat, origin.lon],
        [origin.lat + 1.0 / GRAIN, origin.lon + 1.0 / GRAIN],
    )?;
    for round in 0..ROUNDS {
        let earth = earth(fitted);
        let min = earth.plane().local(origin);
        let extent = Rect {
            min,
            max: min + size,
        };
        let rect = earth.rect();
        let within = extent.contains(rect.min) && extent.contains(rect.max);
        if round > 0 && within && ends.iter().all(|end| fitted.contains(*end)) {
            return Some(fitted);
        }
        fitted = inside(extent, earth.plane()).filter(|fitted| {
            fitted.max.lat.abs().max(fitted.min.lat.abs()) < sketch::MAX_LATITUDE
        })?;
    }
    None
}

/// The intersection of `wanted` and the data; `None` if it is empty.
fn cut(wanted: LatLonBox, data: Degrees) -> Option<LatLonBox> {
    let (west, width) = (wanted.min.lon, wanted.width());
    // Whole turns that bring it nearest to the data.
    let away = f64::midpoint(data.west, data.east) - (west + width / 2.0);
    let turns = 360.0 * (away / 360.0).round();
    let (west, east) = (west + turns, west + width + turns);
    let from = |wanted: f64, data: f64| {
        if wanted >= data { wanted } else { up(data) }
    };
    let to = |wanted: f64, data: f64| {
        if wanted <= data { wanted } else { down(data) }
    };
    boxed(
        [from(wanted.min.lat, data.south), from(west, data.west)],
        [to(wanted.max.lat, data.north), to(east, data.east)],
    )
}

/// A box of degrees inside a rectangle of the plane.
fn inside(rect: Rect, plane: &TangentPlane) -> Option<LatLonBox> {
    let middle = plane.geodetic(nalgebra::center(&rect.min, &rect.max)).lon;
    let size = rect.max - rect.min;
    let edge = |look: usize| (look as f64 / LOOKS as f64).min(1.0);
    let at = |x: f64, y: f64| {
        let place = plane.geodetic(Point2::new(
            rect.min.x + x * size.x,
            rect.min.y + y * size.y,
        ));
        // Degrees east of the middle, so that the antimeridian needs no special case.
        [place.lat, wrapped(place.lon - middle)]
    };
    let mut min = [f64::NEG_INFINITY; 2];
    let mut max = [f64::INFINITY; 2];
    for look in (0..=LOOKS).map(edge) {
        min = [min[0].max(at(look, 0.0)[0]), min[1].max(at(0.0, look)[1])];
        max = [max[0].min(at(look, 1.0)[0]), max[1].min(at(1.0, look)[1])];
    }
    boxed(
        [up(min[0]), up(middle + min[1])],
        [down(max[0]), down(middle + max[1])],
    )
}

/// The box from the south-west to the north-east corner, `[lat, lon]`; `None` if it is empty.
fn boxed([south, west]: [f64; 2], [north, east]: [f64; 2]) -> Option<LatLonBox> {
    let corner = |lat: f64, lon: f64| LatLon {
        lat,
        lon: wrapped(lon),
    };
    (south < north && west < east).then(|| LatLonBox {
        min: corner(south, west),
        max: corner(north, east),
    })
}
