//! What a route must keep clear of: the shapes, how far a leg stays from them, and how much of
//! their soft zone it crosses.
//!
//! Adding a shape is one file beside `cylinder.rs` and one variant of [`Shape`].

use crate::geometry::Point2;

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

/// A disc that is never entered, and a soft zone that costs, Eq. 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// Of the axis.
    pub center: Point2,
    /// Never entered, metres; `d_min` of the paper.
    pub radius: f64,
    /// End of the soft zone, metres from the axis, >= `radius`; `d_max` of the paper.
    pub influence: f64,
}

/// A simple ring that is never entered, and a soft zone outside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    /// Three or more, no repeated closing vertex, either orientation.
    pub vertices: Vec<Point2>,
    /// Width of the soft zone, metres.
    pub margin: f64,
}
