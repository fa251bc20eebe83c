//! Points, legs and distances in a local frame: metres, `x` east, `y` north, `z` up.
//!
//! Deliberately absent: anything that knows what a threat, a terrain or a vehicle is.

/// A point of the horizontal plane, metres.
pub type Point2 = nalgebra::Point2<f64>;

/// A point in space, metres.
pub type Point3 = nalgebra::Point3<f64>;

/// An axis-aligned rectangle of the horizontal plane, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    /// South-west corner.
    pub min: Point2,
    /// North-east corner.
    pub max: Point2,
}

impl Rect {
    /// Whether `point` lies inside or on the edge.
    #[must_use]
    pub fn contains(&self, point: Point2) -> bool {
        self.excess(point) <= 0.0
    }

    /// How far `point` lies outside, metres; 0 inside.
    #[must_use]
    pub fn excess(&self, point: Point2) -> f64 {
        let dx = (self.min.x - point.x).max(point.x - self.max.x).max(0.0);
        let dy = (self.min.y - point.y).max(point.y - self.max.y).max(0.0);
        (dx * dx + dy * dy).sqrt()
    }

    /// Length of the diagonal, metres.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        (self.max - self.min).norm()
    }
}
