//! What a route must avoid: the shapes of threats, the distance of a leg from them, and its exposure in their soft
//! zones.
//!
//! A new shape needs one file beside `cylinder.rs` and one variant of [`Shape`]; the compiler then names the places
//! that draw, write or bound each shape.

mod cylinder;
mod polygon;

pub use cylinder::Cylinder;
pub use polygon::Polygon;
pub(crate) use polygon::{HAIR, Zone};

use crate::geometry::{Point2, Point3, Rect, Segment};

/// A threat of the scenario: a horizontal shape between two optional heights.
#[derive(Debug, Clone, PartialEq)]
pub struct Threat {
    /// The caller's name for it.
    pub name: Option<String>,
    /// Outline seen from above.
    pub shape: Shape,
    /// Lower limit (frame `z`), included; `None` means unbounded.
    pub base: Option<f64>,
    /// Upper limit (frame `z`), excluded; `None` means unbounded.
    pub top: Option<f64>,
}

/// The outline of a threat.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A disc with a soft zone around it, Eq. 5.
    Cylinder(Cylinder),
    /// A simple ring with a soft zone outside it.
    Polygon(Polygon),
}

/// One leg against one threat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encounter {
    /// Horizontal depth of the leg inside the boundary, metres; not above 0 if it does not enter.
    pub depth: f64,
    /// Integral of `T(d)` along the leg, Eq. 4-5, square metres.
    pub exposure: f64,
}

impl Encounter {
    /// The leg does not reach the soft zone.
    const FAR: Self = Self {
        depth: 0.0,
        exposure: 0.0,
    };
}

/// A leg past the corners of a jagged ring takes so many times as long to price as one past as many discs.
const A_CORNER: usize = 10;

impl Threat {
    /// About how long a leg past it takes to price, in discs.
    pub(crate) fn effort(&self) -> usize {
        match &self.shape {
            Shape::Cylinder(_) => 1,
            Shape::Polygon(_) => A_CORNER * self.bends(),
        }
    }

    /// Number of circles that a string may bend round.
    pub(crate) fn bends(&self) -> usize {
        match &self.shape {
            Shape::Cylinder(_) => 1,
            Shape::Polygon(polygon) => polygon.vertices().len(),
        }
    }

    /// Horizontal distance of `point` from the boundary, metres, negative inside, at any height.
    #[must_use]
    pub fn distance(&self, point: Point2) -> f64 {
        match &self.shape {
            Shape::Cylinder(cylinder) => cylinder.distance(point),
            Shape::Polygon(polygon) => polygon.distance(point),
        }
    }

    /// `T(d)` of Eq. 5 at `point`, metres.
    #[must_use]
    pub fn intensity(&self, point: Point3) -> f64 {
        if !self.reaches(point.z) {
            return 0.0;
        }
        match &self.shape {
            Shape::Cylinder(cylinder) => cylinder.intensity(point.xy()),
            Shape::Polygon(polygon) => polygon.intensity(point.xy()),
        }
    }

    /// Least horizontal distance of `leg` from the boundary, metres, negative inside; `None` if the leg is never
    /// between base and top.
    #[must_use]
    pub fn clearance(&self, leg: &Segment) -> Option<f64> {
        let window = leg.between_heights(self.base, self.top)?;
        Some(match &self.shape {
            Shape::Cylinder(cylinder) => cylinder.clearance(leg, window),
            Shape::Polygon(polygon) => polygon.clearance(leg, window),
        })
    }

    /// The shares of `leg` between which lies all of it that is within the boundary, at any height; `None` if it stays
    /// outside.
    pub(crate) fn span(&self, leg: &Segment) -> Option<(f64, f64)> {
        match &self.shape {
            Shape::Cylinder(cylinder) => leg.within(cylinder.center, cylinder.radius),
            Shape::Polygon(polygon) => polygon.span(leg),
        }
    }

    /// Depth and exposure together; returns zeros quickly if `leg` is outside the soft zone.
    #[must_use]
    pub fn encounter(&self, leg: &Segment) -> Encounter {
        let reached = match &self.shape {
            Shape::Cylinder(cylinder) => cylinder.may_reach(leg),
            Shape::Polygon(polygon) => polygon.may_reach(leg),
        };
        let Some(window) = reached
            .then(|| leg.between_heights(self.base, self.top))
            .flatten()
        else {
            return Encounter::FAR;
        };
        match &self.shape {
            Shape::Cylinder(cylinder) => Encounter {
                depth: -cylinder.clearance(leg, window),
                exposure: cylinder.exposure(leg, window),
            },
            Shape::Polygon(polygon) => {
                let (depth, exposure) = polygon.encounter(leg, window);
                Encounter { depth, exposure }
            }
        }
    }

    /// The box around the shape and its soft zone.
    #[must_use]
    pub fn extent(&self) -> Rect {
        match &self.shape {
            Shape::Cylinder(cylinder) => cylinder.extent(),
            Shape::Polygon(polygon) => polygon.extent(),
        }
    }

    /// Whether the threat extends to height `z`.
    #[must_use]
    pub fn reaches(&self, z: f64) -> bool {
        self.base.is_none_or(|base| z >= base) && self.top.is_none_or(|top| z < top)
    }
}

/// `T(d)` of Eq. 5; `distance` and `influence` have the same origin, a cylinder's axis or a polygon's ring.
fn intensity(influence: f64, distance: f64) -> f64 {
    (influence - distance).max(0.0)
}

/// Exposure of a leg without horizontal extent: `T` is constant along it.
fn hover_exposure(
    leg: &Segment,
    (t0, t1): (f64, f64),
    intensity_at: impl Fn(Point2) -> f64,
) -> f64 {
    intensity_at(leg.at(0.5 * (t0 + t1)).xy()) * leg.length() * (t1 - t0)
}
