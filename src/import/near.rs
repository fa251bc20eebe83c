//! What lies near a flight: a map of zones may be that of a whole country.
//!
//! The flight is kept within a box of degrees, its `area`, and what lies outside that can be left out: waypoints, and
//! so the legs between them, stay inside. Deliberately absent: heights. A zone above the flight is out of its way for
//! the planner to say.

use serde_json::{Value, json};

use super::place::Place;
use super::threat::Shape;
use crate::geometry::geodesy::{LatLon, LatLonBox, TangentPlane, wrapped};
use crate::geometry::{Point2, Rect};

/// Least default distance beyond the box of both ends, metres.
const LEAST_M: f64 = 1000.0;

/// Farther away than this, metres, a shape of many degrees is beside no flight.
const FARTHEST_M: f64 = 5e6;

/// More degrees of longitude than this are many.
const MANY: f64 = 60.0;

/// Nearer to a pole than this latitude, everything is near: degrees of longitude tell nothing.
const POLAR: f64 = 85.0;

/// Metres of a degree of latitude, rounded down.
const DEGREE_M: f64 = 110_500.0;

/// Shapes count as near from so much farther off, as a share of the area: the planner keeps a flight within a
/// rectangle of its plane.
const SLACK: f64 = 0.02;

/// Degrees are written to this share of one, outwards.
const GRAIN: f64 = 1e6;

/// The surroundings of a flight.
#[derive(Debug)]
pub(super) struct Near {
    middle: LatLon,
    beyond_m: f64,
    area: LatLonBox,
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
        Self {
            middle,
            beyond_m,
            area: in_degrees(&plane, &flown),
        }
    }

    /// Whether a part of `shape`, or of its soft zone, may lie in the area. Only degrees are compared, as shapes may be
    /// many.
    pub(super) fn meets(&self, shape: &Shape) -> bool {
        match shape {
            Shape::Cylinder {
                center, influence, ..
            } => self.may_hold([*center], *influence),
            Shape::Polygon { vertices, margin } => self.may_hold(vertices.iter().copied(), *margin),
        }
    }

    /// Whether anything within `reach_m` of the ring of these places may lie in the area.
    pub(super) fn may_hold(
        &self,
        places: impl IntoIterator<Item = Place> + Clone,
        reach_m: f64,
    ) -> bool {
        let east = |lon: f64| wrapped(lon - self.middle.lon);
        let at = |place: Place| Point2::new(east(place.lon), place.lat);
        let Some(Rect { min, max }) = Rect::around(places.clone().into_iter().map(at)) else {
            return false;
        };
        let farthest = min.y.abs().max(max.y.abs());
        if farthest > POLAR || max.x - min.x > MANY {
            let is_far = |place: Place| self.middle.distance_m(place.into()) > FARTHEST_M + reach_m;
            return !places.into_iter().all(is_far);
        }
        // An edge that is straight on a plane leaves the box of its ends, northward or southward and to both sides.
        let [wide, high] = [max.x - min.x, max.y - min.y].map(f64::to_radians);
        let shrink = libm::cos(farthest.to_radians());
        let bow = Point2::new(wide * high / shrink, wide * wide).map(f64::to_degrees);
        let area = Rect {
            min: Point2::new(east(self.area.min.lon), self.area.min.lat),
            max: Point2::new(east(self.area.max.lon), self.area.max.lat),
        };
        let slack = SLACK * (area.max - area.min);
        let reach = reach_m / DEGREE_M;
        let more = Point2::new(reach / shrink + bow.x + slack.x, reach + bow.y + slack.y);
        min.x - more.x <= area.max.x
            && area.min.x <= max.x + more.x
            && min.y - more.y <= area.max.y
            && area.min.y <= max.y + more.y
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// An edge is straight on the plane, or in degrees: neither may pass through the area of a flight whose shape was
        /// left out.
        #[test]
        fn no_shape_is_left_out_that_an_edge_of_brings_into_the_area(
            start in (-75.0..75.0, -180.0..180.0), way in (-0.5..0.5, -0.5..0.5),
            aside in (-3.0..3.0, -3.0..3.0), corners in prop::collection::vec((-2.5..2.5, -2.5..2.5), 3..7),
        ) {
            let place = |(lat, lon): (f64, f64)| Place::new(wrapped(lon), lat).expect("on earth");
            let off = |(lat, lon): (f64, f64), (north, east): (f64, f64)| (lat + north, lon + east);
            let near = Near::of([place(start), place(off(start, way))], None);
            let vertices: Vec<Place> = corners
                .iter()
                .map(|corner| place(off(off(start, aside), *corner)))
                .collect();
            let plane = TangentPlane::at(near.middle, 0.0);
            let mut is_inside = false;
            for (index, from) in vertices.iter().enumerate() {
                let to = vertices[(index + 1) % vertices.len()];
                let [a, b] = [*from, to].map(|end| plane.local(end.into()));
                for step in 0..=60 {
                    let share = f64::from(step) / 60.0;
                    let straight = plane.geodetic(a + (b - a) * share);
                    let degrees = LatLon {
                        lat: from.lat + (to.lat - from.lat) * share,
                        lon: wrapped(from.lon + wrapped(to.lon - from.lon) * share),
                    };
                    is_inside |= near.area.contains(straight) || near.area.contains(degrees);
                }
            }
            let shape = Shape::polygon(vertices);
            prop_assert!(!is_inside || near.meets(&shape));
        }
    }

    #[test]
    fn what_is_beyond_the_slack_is_elsewhere() {
        let [start, target] =
            [(8.0, 47.0), (8.1, 47.05)].map(|(lon, lat)| Place::new(lon, lat).expect("on earth"));
        let near = Near::of([start, target], Some(2000.0));
        let meets = |lon: f64, lat: f64, radius: f64| {
            let center = Place::new(lon, lat).expect("on earth");
            near.meets(&Shape::circle(center, radius).expect("a circle"))
        };
        assert!(meets(8.05, 47.02, 10.0));
        assert!(meets(8.05, 47.2, 15_000.0));
        assert!(!meets(8.05, 47.2, 10_000.0));
        assert!(!meets(8.3, 47.02, 5000.0));
        assert!(!meets(-171.95, -47.02, 5000.0));
    }
}
