//! Something to go round: a disc or a ring, widened by a radius.

use crate::geometry::{Point2, ring};
use crate::threat::{Shape, Threat};

/// Something to go round.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Its shape seen from above.
    pub shape: OutlineShape,
    /// Metres by which the shape is widened: the radius of a disc.
    pub radius: f64,
    /// Never shrunk below this where an end of the way lies within; if an end lies within the core itself, there is no
    /// obstacle at that height, and it is left out.
    pub core: f64,
}

/// The shape of an [`Outline`] before it is widened.
#[derive(Debug, Clone, PartialEq)]
pub enum OutlineShape {
    /// A disc round this point.
    Disc(Point2),
    /// A simple ring, inside included.
    Ring(Vec<Point2>),
}

impl Outline {
    /// The hard part of `threat`.
    #[must_use]
    pub fn hard(threat: &Threat) -> Self {
        match &threat.shape {
            Shape::Cylinder(cylinder) => Self {
                shape: OutlineShape::Disc(cylinder.center),
                radius: cylinder.radius,
                core: cylinder.radius,
            },
            Shape::Polygon(polygon) => Self {
                shape: OutlineShape::Ring(polygon.vertices().to_vec()),
                radius: 0.0,
                core: 0.0,
            },
        }
    }

    /// `threat` with its whole soft zone.
    #[must_use]
    pub fn soft(threat: &Threat) -> Self {
        let radius = match &threat.shape {
            Shape::Cylinder(cylinder) => cylinder.influence,
            Shape::Polygon(polygon) => polygon.margin(),
        };
        Self {
            radius,
            ..Self::hard(threat)
        }
    }

    /// Distance of `point` to the shape before it is widened, metres; 0 within a ring.
    #[must_use]
    pub fn distance(&self, point: Point2) -> f64 {
        self.shape.distance(point)
    }
}

impl OutlineShape {
    /// Number of points that it is given by.
    #[must_use]
    pub fn corners(&self) -> usize {
        match self {
            Self::Disc(_) => 1,
            Self::Ring(ring) => ring.len(),
        }
    }

    /// Distance of `point`, metres; 0 within a ring.
    #[must_use]
    pub fn distance(&self, point: Point2) -> f64 {
        match self {
            Self::Disc(center) => (point - center).norm(),
            Self::Ring(ring) if ring::contains(ring, point) => 0.0,
            Self::Ring(ring) => ring::distance(ring, point),
        }
    }
}
