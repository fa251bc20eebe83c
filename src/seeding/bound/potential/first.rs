//! The mesh to begin with.

use super::Scene;
use super::mesh::{HEIGHT, Mesh, REACH};
use crate::geometry::Point2;

/// Vertices of the first mesh, about; more where the area is wide for the way, twice as many at most.
const FIRST: f64 = 1700.0;

/// Sides from start to target in the first mesh, at least.
const FEWEST_STEPS: f64 = 10.0;

/// As many at most.
const MOST_STEPS: f64 = 2000.0;

/// Sides of the longest way that keeps to the first mesh, unless that of the straight one is not much less.
const LONGEST: f64 = 600.0;

impl Scene<'_> {
    /// The first mesh: all of the area, or where that is too wide, what of it routes can make use of
    /// that do not cost as much as the cap.
    pub(super) fn first(&mut self) -> Mesh {
        let ends = self.prices.ends.map(|end| end.xy());
        let direct = self.prices.direct();
        let [low, high] = [self.area.min, self.area.max];
        let size = (high.x - low.x) * (high.y - low.y);
        let steps = direct / (size / (FIRST * HEIGHT)).sqrt();
        let steps = steps.ceil().clamp(FEWEST_STEPS, MOST_STEPS);
        let side = direct / steps;
        // The sum of the distances from both ends: on the edge of the ellipse that they are the foci of.
        let sum = |point: Point2| ends.iter().map(|end| (point - end).norm()).sum::<f64>();
        let corners = [
            low,
            Point2::new(high.x, low.y),
            high,
            Point2::new(low.x, high.y),
        ];
        let mut widest = corners.into_iter().map(sum).fold(0.0, f64::max);
        let most = 2.0 * FIRST * HEIGHT * side * side;
        let ellipse = if size > most {
            (4.0 * most / std::f64::consts::PI).sqrt() * side
        } else {
            LONGEST * side
        };
        let ellipse = ellipse.max(1.5 * direct);
        if ellipse < widest {
            widest = ellipse;
            self.cap = self.prices.fuel * widest;
        }
        // No point whose cell meets a triangle is further than twice the reach from the triangle's middle.
        let margin = 2.0 * REACH * side * (1.0 + 1e-9);
        let along = (ends[1] - ends[0]).normalize();
        let frame = corners.map(|corner| {
            let offset = corner - ends[0];
            [offset.dot(&along), along.perp(&offset)]
        });
        let over = [0.5 * (widest - direct), 0.5 * widest].map(|over| over + margin);
        let lowest = |axis: usize| {
            frame
                .iter()
                .map(|at| at[axis])
                .fold(f64::INFINITY, f64::min)
        };
        let highest = |axis: usize| {
            frame
                .iter()
                .map(|at| at[axis])
                .fold(-f64::INFINITY, f64::max)
        };
        Mesh::between(
            ends,
            steps,
            [0, 1].map(|axis| (lowest(axis) - margin).max(-over[axis])),
            [
                (highest(0) + margin).min(direct + over[0]),
                (highest(1) + margin).min(over[1]),
            ],
            |middle| {
                sum(middle) <= widest + 2.0 * margin && Mesh::is_within(&self.area, middle, side)
            },
        )
    }
}
