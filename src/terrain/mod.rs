//! The ground: its elevation anywhere, and the least and greatest height of a leg above it.
//!
//! Adding a kind is one file beside `flat.rs` and one variant of [`Terrain`].

use crate::geometry::Point2;

/// The ground of a scenario.
#[derive(Debug, Clone, PartialEq)]
pub enum Terrain {
    /// One elevation everywhere.
    Flat(Flat),
    /// Analytic mountains.
    Peaks(Peaks),
    /// Elevations at the nodes of a grid, bilinear between.
    Grid(Grid),
}

/// Level ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flat {
    /// Metres in the frame.
    pub elevation: f64,
}

/// Mountains `base + sum height * exp(-(dx/sx)^2 - (dy/sy)^2)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Peaks {
    /// Elevation far from every peak, metres.
    pub base: f64,
    /// In the order of the request.
    pub peaks: Vec<Peak>,
}

/// One mountain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Of the summit.
    pub center: Point2,
    /// Above the base, metres.
    pub height: f64,
    /// `(sx, sy)`, metres, each > 0.
    pub spread: Point2,
}

/// Elevations at nodes, row-major from south to north; the ground between them is bilinear.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// The first (south-west) node.
    pub origin: Point2,
    /// Distance between nodes, metres, > 0.
    pub cell: f64,
    /// Nodes from west to east, >= 2.
    pub columns: usize,
    /// Nodes from south to north, >= 2.
    pub rows: usize,
    /// `rows * columns` metres.
    pub elevations: Vec<f64>,
}
