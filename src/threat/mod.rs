//! What a route must keep clear of: the shapes, how far a leg stays from them, and how much of
//! their soft zone it crosses.
//!
//! Adding a shape is one file beside `cylinder.rs` and one variant of [`Shape`].

mod cylinder;
mod polygon;

pub use cylinder::Cylinder;
pub use polygon::Polygon;
pub(crate) use polygon::Zone;

use crate::geometry::{Point2, Point3, Rect, Segment};

/// A threat of the scenario: a horizontal shape between two optional heights.
#[derive(Debug, Clone, PartialEq)]
pub struct Threat {
    /// The caller's own name for it.
    pub name: Option<String>,
    /// Outline seen from above.
    pub shape: Shape,
    /// Below this height (frame `z`) the threat does not reach; `None` is unbounded.
    pub base: Option<f64>,
    /// From this height up the threat does not reach; `None` is unbounded.
    pub top: Option<f64>,
}

/// The outline of a threat.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A disc with a soft zone round it, Eq. 5.
    Cylinder(Cylinder),
    /// A simple ring with a soft zone outside it.
    Polygon(Polygon),
}

/// How one leg fares with one threat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encounter {
    /// How far the leg goes beyond the boundary, horizontally, metres; not above 0 where it does not.
    pub depth: f64,
    /// Integral of `T(d)` along the leg, Eq. 4-5, square metres.
    pub exposure: f64,
}

impl Encounter {
    /// With a threat whose soft zone the leg never reaches.
    const FAR: Self = Self {
        depth: 0.0,
        exposure: 0.0,
    };
}

impl Threat {
    /// Whether `point` is strictly inside, between base and top.
    #[must_use]
    pub fn contains(&self, point: Point3) -> bool {
        self.reaches(point.z)
            && match &self.shape {
                Shape::Cylinder(cylinder) => cylinder.distance(point.xy()) < 0.0,
                Shape::Polygon(polygon) => polygon.contains(point.xy()),
            }
    }

    /// Horizontal distance of `point` to the boundary, metres, negative inside, whatever its height.
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

    /// Least horizontal distance of `leg` to the boundary, metres, negative inside; `None` when the
    /// leg is never between base and top.
    #[must_use]
    pub fn clearance(&self, leg: &Segment) -> Option<f64> {
        let window = leg.between_heights(self.base, self.top)?;
        Some(match &self.shape {
            Shape::Cylinder(cylinder) => cylinder.clearance(leg, window),
            Shape::Polygon(polygon) => polygon.clearance(leg, window),
        })
    }

    /// Depth and exposure at once, cheaply nothing when `leg` is beyond the soft zone.
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

    /// The box round the shape and its soft zone.
    #[must_use]
    pub fn extent(&self) -> Rect {
        match &self.shape {
            Shape::Cylinder(cylinder) => cylinder.extent(),
            Shape::Polygon(polygon) => polygon.extent(),
        }
    }

    /// Whether it is there at that height.
    #[must_use]
    pub fn reaches(&self, z: f64) -> bool {
        self.base.is_none_or(|base| z >= base) && self.top.is_none_or(|top| z < top)
    }
}

/// `distance` from a shape's own edge of the soft zone inwards: `T(d)` of Eq. 5.
fn intensity(influence: f64, distance: f64) -> f64 {
    (influence - distance).max(0.0)
}

/// Exposure of a leg that has no horizontal extent: `T` is the same all along.
fn hover_exposure(
    leg: &Segment,
    (t0, t1): (f64, f64),
    intensity_at: impl Fn(Point2) -> f64,
) -> f64 {
    intensity_at(leg.at(0.5 * (t0 + t1)).xy()) * leg.length() * (t1 - t0)
}
