//! Arcs of an outline, as corners that leave nothing of the zone out.

use std::f64::consts::TAU;

use super::super::place::Place;
use crate::geometry::Point2;
use crate::geometry::geodesy::{LatLon, TangentPlane};

/// Steps of a whole circle: between two of them an arc strays from its corners by a thousandth of its radius.
const STEPS: f64 = 72.0;

/// No arc of a real zone is as wide, metres, and the plane it is worked out in is exact no further.
const WIDEST_M: f64 = 1e6;

/// A part of a circle, or of a spiral where the ends are not equally far from the centre.
#[derive(Debug)]
pub(super) struct Arc {
    plane: TangentPlane,
    /// Bearing in radians, clockwise from north, and distance in metres.
    from: [f64; 2],
    /// How far it turns, radians, above 0 where clockwise.
    turn: f64,
    to_radius: f64,
}

impl Arc {
    /// Round `center` from one bearing and distance to another.
    pub(super) fn new(
        center: Place,
        from: [f64; 2],
        to: [f64; 2],
        is_clockwise: bool,
    ) -> Result<Self, String> {
        if let Some(radius) = [from[1], to[1]]
            .into_iter()
            .find(|radius| !(*radius > 0.0 && *radius <= WIDEST_M))
        {
            return Err(format!(
                "an arc with a radius of {radius} m, must be > 0 and at most {WIDEST_M}"
            ));
        }
        if !(from[0].is_finite() && to[0].is_finite()) {
            return Err("an arc with an angle that is no number".to_owned());
        }
        let turn = (to[0] - from[0]).rem_euclid(TAU);
        // From a bearing to itself it is a whole circle.
        let turn = match (is_clockwise, turn > 0.0) {
            (true, true) => turn,
            (false, true) => turn - TAU,
            (true, false) => TAU,
            (false, false) => -TAU,
        };
        Ok(Self {
            plane: TangentPlane::at(LatLon::from(center), 0.0),
            from,
            turn,
            to_radius: to[1],
        })
    }

    /// Round `center` from one place to another.
    pub(super) fn between(
        center: Place,
        from: Place,
        to: Place,
        is_clockwise: bool,
    ) -> Result<Self, String> {
        let plane = TangentPlane::at(LatLon::from(center), 0.0);
        let [from, to] = [from, to].map(|place| {
            let at = plane.local(LatLon::from(place)).coords;
            [libm::atan2(at.x, at.y), at.norm()]
        });
        Self::new(center, from, to, is_clockwise)
    }

    pub(super) fn is_clockwise(&self) -> bool {
        self.turn > 0.0
    }

    pub(super) fn center(&self) -> Place {
        self.plane.origin().into()
    }

    /// How far from its centre it may lie, metres.
    pub(super) fn reach_m(&self) -> f64 {
        self.from[1].max(self.to_radius)
    }

    /// How many corners it has at most.
    pub(super) fn count(&self) -> usize {
        self.steps() + 2
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "no more than a whole circle has"
    )]
    fn steps(&self) -> usize {
        (self.turn.abs() / TAU * STEPS).ceil() as usize
    }

    /// Its ends, and corners between them: on it, or where `outside` as far outside as keeps all of it within.
    pub(super) fn corners(&self, outside: bool) -> Vec<Place> {
        let steps = self.steps();
        let share = |step: f64| step / steps as f64;
        let at = |share: f64, out: f64| {
            let [bearing, radius] = self.from;
            let (sin, cos) = libm::sincos(bearing + self.turn * share);
            let radius = (radius + (self.to_radius - radius) * share) * out;
            Place::from(self.plane.geodetic(Point2::new(radius * sin, radius * cos)))
        };
        let mut corners = vec![at(0.0, 1.0)];
        let out = 1.0 / libm::cos(self.turn / steps as f64 / 2.0);
        for step in 1..=steps {
            let end = step as f64;
            if outside {
                corners.push(at(share(end - 0.5), out));
            }
            if !outside || step == steps {
                corners.push(at(share(end), 1.0));
            }
        }
        corners
    }
}
