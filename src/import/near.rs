//! What lies near a flight: a map of zones may be that of a whole country.
//!
//! The flight is kept within a box of degrees, its `area`, and what lies outside that can be left out: waypoints, and
//! so the legs between them, stay inside. Deliberately absent: heights. A zone above the flight is out of its way for
//! the planner to say.

use serde_json::{Value, json};

use super::place::Place;
use super::threat::{Shape, Threat};
use crate::geometry::geodesy::{LatLon, LatLonBox, TangentPlane, wrapped};
use crate::geometry::{Point2, Rect};

/// Least default distance beyond the box of both ends, metres.
const LEAST_M: f64 = 1000.0;

/// Farther away than this, metres, a place is beside no flight, and a plane would soon fold over.
const FARTHEST_M: f64 = 5e6;

/// Threats count as near from so much farther off, as a share of the diagonal: the planner's plane is another one.
const SLACK: f64 = 0.01;

/// Degrees are written to this share of one, outwards.
const GRAIN: f64 = 1e6;

/// The surroundings of a flight.
#[derive(Debug)]
pub(super) struct Near {
    plane: TangentPlane,
    beyond_m: f64,
    area: LatLonBox,
    /// The area on the plane, and a little more.
    reach: Rect,
}

impl Near {
    /// Within `within_m` of the box of both `ends`.
    pub(super) fn of(ends: [Place; 2], within_m: Option<f64>) -> Self {
        let [start, target] = ends.map(LatLon::from);
        let way = TangentPlane::at(start, 0.0);
        let middle = way.geodetic(Point2::from(way.local(target).coords / 2.0));
        let plane = TangentPlane::at(middle, 0.0);
        let ends = [start, target].map(|end| plane.local(end));
        let beyond_m = within_m.unwrap_or_else(|| LEAST_M.max((ends[1] - ends[0]).norm() / 2.0));
        let flown = Rect::around(ends).expect("two points").grown(beyond_m);
        let area = in_degrees(&plane, &flown);
        let LatLonBox { min, max } = area;
        let corner = |lat, lon| LatLon { lat, lon };
        let [south_east, north_west] = [corner(min.lat, max.lon), corner(max.lat, min.lon)];
        let sides = [corner(min.lat, middle.lon), corner(max.lat, middle.lon)];
        let around = [min, max, south_east, north_west].into_iter().chain(sides);
        let reach = Rect::around(around.map(|place| plane.local(place))).expect("six points");
        Self {
            reach: reach.grown(SLACK * reach.diagonal()),
            plane,
            beyond_m,
            area,
        }
    }

    /// Whether a part of `threat`, or of its soft zone, may lie in the area.
    pub(super) fn meets(&self, threat: &Threat) -> bool {
        let (places, soft_m) = match &threat.shape {
            Shape::Cylinder {
                center, influence, ..
            } => (std::slice::from_ref(center), *influence),
            Shape::Polygon { vertices, margin } => (vertices.as_slice(), *margin),
        };
        let places = || places.iter().copied().map(LatLon::from);
        let is_far = |place: LatLon| self.plane.origin().distance_m(place) > FARTHEST_M;
        if places().all(is_far) {
            return false;
        }
        let extent = Rect::around(places().map(|place| self.plane.local(place)));
        extent.is_some_and(|extent| extent.grown(soft_m).meets(&self.reach))
    }

    /// How far the area reaches beyond both ends, metres.
    pub(super) fn beyond_m(&self) -> f64 {
        self.beyond_m
    }

    /// The area, as in a document.
    pub(super) fn json(&self) -> Value {
        let [min, max] = [self.area.min, self.area.max].map(|corner| Place::from(corner).json());
        json!({"min": min, "max": max})
    }
}

/// The box of degrees round `rect`.
fn in_degrees(plane: &TangentPlane, rect: &Rect) -> LatLonBox {
    let middle = plane.origin();
    let sides = rect.corners();
    let halves = (0..4).map(|side| nalgebra::center(&sides[side], &sides[(side + 1) % 4]));
    let degrees = sides.into_iter().chain(halves).map(|at| {
        let place = plane.geodetic(at);
        Point2::new(wrapped(place.lon - middle.lon), place.lat)
    });
    let Rect { min, max } = Rect::around(degrees).expect("eight points");
    let down = |degrees: f64| (degrees * GRAIN).floor() / GRAIN;
    let up = |degrees: f64| (degrees * GRAIN).ceil() / GRAIN;
    LatLonBox {
        min: LatLon {
            lat: down(min.y).max(-90.0),
            lon: wrapped(down(middle.lon + min.x)),
        },
        max: LatLon {
            lat: up(max.y).min(90.0),
            lon: wrapped(up(middle.lon + max.x)),
        },
    }
}
