//! How a document writes places: in metres of the local frame, or in degrees that are mapped to a plane.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::geometry::geodesy::{LatLon, LatLonBox, TangentPlane, undulation_m};
use crate::geometry::{Point2, Point3, Rect};
use crate::scenario::frame::{self, Datum, Frame, MAX_REACH_M, Wgs84};

use super::dataset::Named;
use super::fault::Faults;
use super::fields::Fields;
use super::fitted::{over_dataset, over_grid};
use super::path::Path;
use super::ranges::{COORDINATE, LATITUDE, LONGITUDE};
use super::sketch;
use super::value::{At, figure};

/// Reads the places of one document.
#[derive(Debug)]
pub(super) enum Chart {
    Local,
    Wgs84(Box<Earth>),
    /// Degrees without a plane, because the area or the datum is invalid.
    Degrees,
    /// The frame is unknown, so places cannot be read; everything else still can.
    Unknown,
}

/// The plane of a document in degrees, and the degrees in which its places were given.
#[derive(Debug)]
pub(super) struct Earth {
    datum: Datum,
    plane: TangentPlane,
    undulation_m: f64,
    area: LatLonBox,
    written: RefCell<BTreeMap<[u64; 2], LatLon>>,
}

impl Chart {
    /// The chart for the document's `frame`.
    pub(super) fn of(
        fields: &Fields<'_>,
        dataset: Option<&Named<'_>>,
        faults: &mut Faults,
    ) -> Self {
        let frame = fields.or("frame", "local", faults, |at, faults| {
            let choice = at.choice(&["local", "wgs84"], faults)?;
            Some(if choice == "wgs84" { "wgs84" } else { "local" })
        });
        match frame {
            None => {
                datum(fields, faults);
                Self::Unknown
            }
            Some("wgs84") => Earth::of(fields, dataset, faults)
                .map_or(Self::Degrees, |earth| Self::Wgs84(Box::new(earth))),
            Some(_) => {
                if fields.has("altitude_datum") {
                    faults.add(
                        &Path::Key(fields.path, "altitude_datum"),
                        "not-applicable",
                        || "altitude_datum is given, must be left out where frame is local",
                    );
                }
                Self::Local
            }
        }
    }

    /// The frame, with all places written in it; `None` where it is unknown or has no plane.
    pub(super) fn finish(self) -> Option<Frame> {
        match self {
            Self::Local => Some(Frame::Local),
            Self::Wgs84(earth) => Some(Frame::Wgs84(Arc::new(Wgs84::new(
                earth.datum,
                earth.plane,
                earth.undulation_m,
                earth.area,
                earth.written.into_inner(),
            )))),
            Self::Degrees | Self::Unknown => None,
        }
    }

    /// `{"x", "y", "z"}` or `{"lat", "lon", "alt"}`; skipped where the frame is unknown.
    pub(super) fn point3(&self, at: At<'_>, faults: &mut Faults) -> Option<Point3> {
        match self {
            Self::Local => {
                let fields = at.fields(&["x", "y", "z"], faults)?;
                let x = fields.number("x", COORDINATE, faults);
                let y = fields.number("y", COORDINATE, faults);
                let z = fields.number("z", COORDINATE, faults);
                Some(Point3::new(x?, y?, z?))
            }
            Self::Wgs84(_) | Self::Degrees => {
                let fields = at.fields(&["lat", "lon", "alt"], faults)?;
                let place = lat_lon(&fields, faults);
                let alt = fields.number("alt", COORDINATE, faults);
                let point = self.laid(place?, at.path, faults);
                let (point, alt) = (point?, alt?);
                Some(Point3::new(point.x, point.y, alt))
            }
            Self::Unknown => None,
        }
    }

    /// `{"x", "y"}` or `{"lat", "lon"}`.
    pub(super) fn point2(&self, at: At<'_>, faults: &mut Faults) -> Option<Point2> {
        match self {
            Self::Local => super::point::pair(at, COORDINATE, faults),
            Self::Wgs84(_) | Self::Degrees => {
                let fields = at.fields(&["lat", "lon"], faults)?;
                let place = lat_lon(&fields, faults)?;
                self.laid(place, at.path, faults)
            }
            Self::Unknown => None,
        }
    }

    fn laid(&self, place: LatLon, path: &Path<'_>, faults: &mut Faults) -> Option<Point2> {
        match self {
            Self::Wgs84(earth) => earth.laid(place, path, faults),
            _ => None,
        }
    }

    /// The area for free waypoints, if the document or its frame gives one; an outer `None` has added a fault.
    #[expect(
        clippy::option_option,
        reason = "the outer one tells whether it could be read"
    )]
    pub(super) fn area(
        &self,
        fields: &Fields<'_>,
        ends: [Option<Point3>; 2],
        faults: &mut Faults,
    ) -> Option<Option<Rect>> {
        match self {
            Self::Local => fields.or("area", None, faults, |at, faults| {
                super::point::area(at, faults).map(Some)
            }),
            Self::Wgs84(earth) => Some(earth.area_with(ends)),
            Self::Degrees | Self::Unknown => None,
        }
    }

    /// Name of the height field in this frame.
    pub(super) fn height(&self) -> &'static str {
        match self {
            Self::Local | Self::Unknown => "z",
            Self::Wgs84(_) | Self::Degrees => "alt",
        }
    }

    /// `point` in messages, in the coordinates of the document; as it was written there, if it was.
    pub(super) fn say(&self, point: Point2) -> String {
        let Self::Wgs84(earth) = self else {
            return format!("({}, {})", figure(point.x), figure(point.y));
        };
        if let Some(place) = earth.written(point) {
            return exactly(place);
        }
        let LatLon { lat, lon } = earth.plane.geodetic(point);
        format!("lat {lat:.6}, lon {lon:.6}")
    }

    /// The corners of the area in messages. In degrees they are those of the document, of which `area` covers only the
    /// largest part.
    pub(super) fn say_area(&self, area: Rect) -> [String; 2] {
        match self {
            Self::Wgs84(earth) => [earth.area.min, earth.area.max].map(exactly),
            _ => [area.min, area.max].map(|corner| self.say(corner)),
        }
    }

    /// Whether the start or the target lies in the requested area; the plane's rectangle covers only the largest part
    /// of it.
    pub(super) fn is_in_area(&self, end: Point2, area: Rect) -> bool {
        match self {
            Self::Wgs84(earth) => earth.area.contains(earth.place(end)),
            _ => area.contains(end),
        }
    }
}

impl Earth {
    /// The earth of a document in degrees; `None` has added a fault.
    fn of(fields: &Fields<'_>, dataset: Option<&Named<'_>>, faults: &mut Faults) -> Option<Self> {
        let datum = datum(fields, faults);
        let given = fields.or("area", None, faults, |at, faults| {
            area(at, faults).map(Some)
        });
        let (datum, given) = (datum?, given?);
        let sketch = sketch::Sketch::of(fields);
        let earth = |area| Self::over(area, datum, sketch.mean_alt);
        let area = given.unwrap_or_else(|| match dataset {
            Some(named) => over_dataset(named, sketch.area(), &sketch.ends, earth),
            None => over_grid(fields, &sketch.ends, earth).unwrap_or_else(|| sketch.area()),
        });
        let earth = earth(area);
        earth.check(fields, faults).then_some(earth)
    }

    /// The earth with its plane at the middle of `area`.
    fn over(area: LatLonBox, datum: Datum, mean_alt: f64) -> Self {
        let middle = area.middle();
        let undulation_m = undulation_m(middle);
        let height_m = match datum {
            Datum::Msl => mean_alt + undulation_m,
            Datum::Ellipsoid => mean_alt,
        };
        Self {
            datum,
            plane: TangentPlane::at(middle, height_m),
            undulation_m,
            area,
            written: RefCell::default(),
        }
    }

    /// Check that the plane fits the earth over the whole area; returns whether it does.
    fn check(&self, fields: &Fields<'_>, faults: &mut Faults) -> bool {
        let area = self.area;
        let what = if fields.has("area") {
            "the area"
        } else {
            "the area, by default the box round everything,"
        };
        let farthest = area.min.lat.abs().max(area.max.lat.abs());
        if farthest > sketch::MAX_LATITUDE {
            let detail = format!(
                "{what} reaches latitude {farthest:.6}, must stay within {} degrees of the equator: \
                 beyond, degrees of longitude tell too little",
                sketch::MAX_LATITUDE
            );
            blame(
                fields,
                sketch::nearest_to_a_pole,
                "near-pole",
                detail,
                faults,
            );
            return false;
        }
        let rect = self.rect();
        let (width, height) = (rect.max.x - rect.min.x, rect.max.y - rect.min.y);
        let has_inside = width > 0.0 && height > 0.0;
        if !has_inside || width.max(height) > sketch::MAX_WIDTH_M {
            let size = if has_inside {
                format!("{what} is {width:.0} m by {height:.0} m")
            } else {
                // Over much of a hemisphere the curved parallels overlap on the plane.
                format!(
                    "{what} reaches over {:.6} degrees of longitude",
                    area.width()
                )
            };
            let detail = format!(
                "{size}, must be at most {} m either way: a plane fits the earth no farther",
                sketch::MAX_WIDTH_M
            );
            blame(fields, sketch::farthest, "area-too-wide", detail, faults);
            return false;
        }
        true
    }

    /// The plane used for planning.
    pub(super) fn plane(&self) -> &TangentPlane {
        &self.plane
    }

    /// The datum of altitudes.
    pub(super) fn datum(&self) -> Datum {
        self.datum
    }

    /// The largest rectangle of the plane inside the area, whose parallels and meridians are curved on the plane.
    pub(super) fn rect(&self) -> Rect {
        let LatLonBox { min, max } = self.area;
        let middle = self.plane.origin().lon;
        let at = |lat: f64, lon: f64| self.plane.local(LatLon { lat, lon });
        let highest = |values: [f64; 3]| values.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let side = |lon: f64| {
            [min.lat, max.lat, 0.0_f64.clamp(min.lat, max.lat)].map(|lat| at(lat, lon).x)
        };
        let edge = |lat: f64| [min.lon, middle, max.lon].map(|lon| at(lat, lon).y);
        Rect {
            min: Point2::new(highest(side(min.lon)), highest(edge(min.lat))),
            max: Point2::new(
                -highest(side(max.lon).map(|x| -x)),
                -highest(edge(max.lat).map(|y| -y)),
            ),
        }
    }

    /// The area for free waypoints: the largest rectangle of the plane inside the area, extended to `ends`, which may
    /// lie in the curved parts of the area beyond that.
    fn area_with(&self, ends: [Option<Point3>; 2]) -> Option<Rect> {
        let rect = self.rect();
        let ends = ends.into_iter().flatten().map(|end| end.xy());
        let ends = ends.filter(|end| self.area.contains(self.place(*end)));
        Rect::around(ends.chain([rect.min, rect.max]))
    }

    /// The place as written for `point`.
    pub(super) fn place(&self, point: Point2) -> LatLon {
        let written = self.written(point);
        written.unwrap_or_else(|| self.plane.geodetic(point))
    }

    fn written(&self, point: Point2) -> Option<LatLon> {
        self.written.borrow().get(&frame::key(point)).copied()
    }

    /// `place` on the plane; a fault if it is too far away for the plane to fit.
    fn laid(&self, place: LatLon, path: &Path<'_>, faults: &mut Faults) -> Option<Point2> {
        let point = self.plane.local(place);
        let away = self.plane.origin().distance_m(place);
        if away > MAX_REACH_M {
            faults.add(path, "too-far", || {
                format!(
                    "{} is {:.0} km from the middle of the area, must be at most {} km",
                    path.label(),
                    away / 1e3,
                    MAX_REACH_M / 1e3
                )
            });
            return None;
        }
        self.written.borrow_mut().insert(frame::key(point), place);
        Some(point)
    }
}

/// Report an area that no plane fits: at `area` if given, otherwise at the `part` that the default area had to reach.
fn blame(
    fields: &Fields<'_>,
    part: impl FnOnce(&Fields<'_>) -> Option<sketch::Part>,
    code: &'static str,
    detail: String,
    faults: &mut Faults,
) {
    let part = if fields.has("area") {
        None
    } else {
        part(fields)
    };
    let (name, item) = part.unwrap_or(("area", None));
    let path = Path::Key(fields.path, name);
    match item {
        Some(index) => faults.add(&Path::Index(&path, index), code, || detail),
        None => faults.add(&path, code, || detail),
    }
}

/// The datum of altitudes.
fn datum(fields: &Fields<'_>, faults: &mut Faults) -> Option<Datum> {
    fields.or("altitude_datum", Datum::Msl, faults, |at, faults| {
        at.named(Datum::ALL, Datum::name, faults)
    })
}

fn lat_lon(fields: &Fields<'_>, faults: &mut Faults) -> Option<LatLon> {
    let lat = fields.number("lat", LATITUDE, faults);
    let lon = fields.number("lon", LONGITUDE, faults);
    Some(LatLon {
        lat: lat?,
        lon: lon?,
    })
}

/// `{"min", "max"}` in degrees. `min` is the western corner, also across the antimeridian.
fn area(at: At<'_>, faults: &mut Faults) -> Option<LatLonBox> {
    let fields = at.fields(&["min", "max"], faults)?;
    let corner = |at: At<'_>, faults: &mut Faults| {
        let fields = at.fields(&["lat", "lon"], faults)?;
        lat_lon(&fields, faults)
    };
    let min = fields.required("min", faults, corner);
    let max = fields.required("max", faults, corner);
    let area = LatLonBox {
        min: min?,
        max: max?,
    };
    if area.min.lat < area.max.lat && area.min.lon.to_bits() != area.max.lon.to_bits() {
        return Some(area);
    }
    faults.add(at.path, "empty-area", || {
        let [min, max] = [area.min, area.max].map(exactly);
        format!("area runs from {min} to {max}, must have min < max in lat, and min west of max")
    });
    None
}

/// A place in messages, with all the digits that it was given with.
fn exactly(place: LatLon) -> String {
    format!("lat {}, lon {}", figure(place.lat), figure(place.lon))
}
