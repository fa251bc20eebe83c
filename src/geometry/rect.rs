//! An axis-aligned rectangle.

use super::Point2;

/// An axis-aligned rectangle of the horizontal plane, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    /// South-west corner.
    pub min: Point2,
    /// North-east corner.
    pub max: Point2,
}

impl Rect {
    /// The smallest rectangle around `points`; `None` without points.
    #[must_use]
    pub fn around(points: impl IntoIterator<Item = Point2>) -> Option<Self> {
        points.into_iter().fold(None, |rect: Option<Self>, point| {
            let rect = rect.unwrap_or(Self {
                min: point,
                max: point,
            });
            Some(Self {
                min: Point2::new(rect.min.x.min(point.x), rect.min.y.min(point.y)),
                max: Point2::new(rect.max.x.max(point.x), rect.max.y.max(point.y)),
            })
        })
    }

    /// The rectangle with `margin` added on every side.
    #[must_use]
    pub fn grown(&self, margin: f64) -> Self {
        Self {
            min: Point2::new(self.min.x - margin, self.min.y - margin),
            max: Point2::new(self.max.x + margin, self.max.y + margin),
        }
    }

    /// Whether `point` lies inside or on the edge.
    #[must_use]
    pub fn contains(&self, point: Point2) -> bool {
        (self.min.x <= point.x && point.x <= self.max.x)
            && (self.min.y <= point.y && point.y <= self.max.y)
    }

    /// Whether the two rectangles have a point in common.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        self.min.x <= other.max.x
            && self.max.x >= other.min.x
            && self.min.y <= other.max.y
            && self.max.y >= other.min.y
    }

    /// The corners, counter-clockwise from the south-west.
    #[must_use]
    pub fn corners(&self) -> [Point2; 4] {
        let [low, high] = [self.min, self.max];
        [
            low,
            Point2::new(high.x, low.y),
            high,
            Point2::new(low.x, high.y),
        ]
    }

    /// The point inside nearest to `point`.
    #[must_use]
    pub fn nearest(&self, point: Point2) -> Point2 {
        Point2::new(
            point.x.clamp(self.min.x, self.max.x),
            point.y.clamp(self.min.y, self.max.y),
        )
    }

    /// Distance of `point` outside the rectangle, metres; 0 inside.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_edge_belongs_to_it_and_nowhere_does_not() {
        let rect = Rect {
            min: Point2::new(-1.0, 0.0),
            max: Point2::new(1.0, 2.0),
        };
        for (x, y, expected) in [
            (0.0, 1.0, true),
            (-1.0, 0.0, true),
            (1.0, 2.0, true),
            (1.0 + 1e-15, 2.0, false),
            (0.0, -5e-324, false),
            (f64::NAN, 1.0, false),
            (0.0, f64::INFINITY, false),
        ] {
            assert_eq!(rect.contains(Point2::new(x, y)), expected, "{x} {y}");
        }
    }
}
