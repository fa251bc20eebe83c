//! The heights at which a route may be, over a grid of places.

use crate::cost::Model;
use crate::geometry::{Point2, Rect};
use crate::planner::starts::over;
use crate::scenario::Scenario;
use crate::seeding::Outline;

/// Cells along the longer side of the grid.
const CELLS: f64 = 160.0;

/// The grid reaches as far beyond start and target as this multiple of the distance between them.
const DETOUR: f64 = 1.0;

/// Corners of threats whose distance is measured, cell by cell, at most.
const MOST_CORNERS: usize = 20_000_000;

/// Lowest and highest height; the first is above the second where there is none.
pub(super) type Range = [f64; 2];

const NOWHERE: Range = [f64::INFINITY, f64::NEG_INFINITY];

pub(super) fn common(one: Range, other: Range) -> Range {
    [one[0].max(other[0]), one[1].min(other[1])]
}

pub(super) fn is_empty(range: Range) -> bool {
    range[0] > range[1]
}

/// Whether all of `inner` is within `outer`.
pub(super) fn holds(outer: Range, inner: Range) -> bool {
    outer[0] <= inner[0] && inner[1] <= outer[1]
}

pub(super) fn wider(range: Range, by: f64) -> Range {
    [range[0] - by, range[1] + by]
}

/// The heights at which a route may be over the cells of a grid and halfway between them.
pub(super) struct Ground {
    pub(super) corner: Point2,
    /// Distance between cells, metres.
    pub(super) step: f64,
    /// Cells along x and y.
    pub(super) size: [usize; 2],
    /// By twice the index of a cell along x and y.
    allowed: Vec<Range>,
}

impl Ground {
    /// `None` where threats have too many corners to look at, or once `is_over`.
    pub(super) fn new(model: &Model, is_over: &dyn Fn() -> bool) -> Option<Self> {
        let mut ground = Self::about(model.scenario);
        ground.measure(model, is_over)?;
        ground.close_threats(model.scenario, is_over)?;
        Some(ground)
    }

    /// Where the grid lies; no height is known yet.
    fn about(scenario: &Scenario) -> Self {
        let ends = [scenario.start.xy(), scenario.target.xy()];
        let direct = (ends[1] - ends[0]).norm();
        let near = Rect::around(ends)
            .expect("two points")
            .grown(DETOUR * direct);
        let corner = scenario.area.nearest(near.min);
        let across = scenario.area.nearest(near.max) - corner;
        let step = across.x.max(across.y) / CELLS;
        Self {
            corner,
            step,
            size: [across.x, across.y].map(|side| cells(side / step) + 1),
            allowed: Vec::new(),
        }
    }

    /// The band over each half step.
    fn measure(&mut self, model: &Model, is_over: &dyn Fn() -> bool) -> Option<()> {
        let [columns, rows] = self.halves();
        for row in 0..rows {
            if is_over() {
                return None;
            }
            for column in 0..columns {
                let at = self.at(column, row);
                let below = model.scenario.terrain.elevation(at);
                let (floor, ceiling) = model.heights_over(at);
                self.allowed.push([below + floor, below + ceiling]);
            }
        }
        Some(())
    }

    /// Nothing passes the threats that reach across the band.
    fn close_threats(&mut self, scenario: &Scenario, is_over: &dyn Fn() -> bool) -> Option<()> {
        let threats = scenario.threats.iter();
        let mut corners = 0;
        for threat in threats.filter(|threat| !over::passable(scenario, threat)) {
            let outline = Outline::hard(threat);
            let near = self.within(threat.extent());
            corners += near[0].len() * near[1].len() * outline.shape.corners();
            if corners > MOST_CORNERS || is_over() {
                return None;
            }
            self.close(&outline, near);
        }
        Some(())
    }

    /// Half steps along x and y.
    fn halves(&self) -> [usize; 2] {
        self.size.map(|cells| 2 * cells - 1)
    }

    pub(super) fn at(&self, column: usize, row: usize) -> Point2 {
        let half = 0.5 * self.step;
        self.corner + nalgebra::Vector2::new(column as f64, row as f64) * half
    }

    /// The half steps along x and y within `extent`.
    fn within(&self, extent: Rect) -> [std::ops::Range<usize>; 2] {
        let half = 0.5 * self.step;
        let (low, high) = (extent.min - self.corner, extent.max - self.corner);
        let [columns, rows] = self.halves();
        let steps = |low: f64, high: f64, count: usize| {
            cells(low / half)..(cells(high / half) + 2).min(count)
        };
        [steps(low.x, high.x, columns), steps(low.y, high.y, rows)]
    }

    /// Nothing passes `outline`, which reaches over these `columns` and `rows`.
    fn close(&mut self, outline: &Outline, [columns, rows]: [std::ops::Range<usize>; 2]) {
        let width = self.halves()[0];
        for row in rows {
            for column in columns.clone() {
                if outline.distance(self.at(column, row)) <= outline.radius {
                    self.allowed[row * width + column] = NOWHERE;
                }
            }
        }
    }

    pub(super) fn allowed(&self, column: usize, row: usize) -> Range {
        self.allowed[row * self.halves()[0] + column]
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a count of cells; below zero there are none"
)]
pub(super) fn cells(count: f64) -> usize {
    count.max(0.0).floor() as usize
}
