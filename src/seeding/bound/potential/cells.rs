//! A rectangle divided into square cells.

use crate::geometry::{Point2, Rect, Vector2};

/// Square cells that cover a rectangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cells {
    pub(super) rect: Rect,
    /// Side of a cell, metres.
    pub(super) side: f64,
    columns: usize,
    rows: usize,
}

impl Cells {
    /// Cells with this side.
    pub(super) fn new(rect: Rect, side: f64) -> Self {
        let count = |length: f64| floor((length / side).ceil().max(1.0));
        let extent = rect.max - rect.min;
        Self {
            rect,
            side,
            columns: count(extent.x),
            rows: count(extent.y),
        }
    }

    /// About `count` cells.
    pub(super) fn about(rect: Rect, count: usize) -> Self {
        let extent = rect.max - rect.min;
        let even = (extent.x * extent.y / count as f64).sqrt();
        // For a rectangle that is nearly a line, one row.
        let side = even.max((extent.x + extent.y) / count as f64);
        Self::new(rect, side)
    }

    pub(super) fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// The cell in which a place is, or that is nearest to it.
    pub(super) fn of(&self, place: Point2) -> usize {
        let [column, row] = self.at(place);
        row * self.columns + column
    }

    fn at(&self, place: Point2) -> [usize; 2] {
        let offset = (place - self.rect.min) / self.side;
        [
            floor(offset.x).min(self.columns - 1),
            floor(offset.y).min(self.rows - 1),
        ]
    }

    /// All cells that overlap the bounding rectangle of these places.
    pub(super) fn round(&self, places: [Point2; 3]) -> impl Iterator<Item = usize> + use<> {
        let rect = Rect::around(places).unwrap_or(self.rect);
        self.between([self.at(rect.min), self.at(rect.max)])
    }

    /// All cells that come within `reach` of a place in both directions.
    pub(super) fn within(&self, place: Point2, reach: f64) -> impl Iterator<Item = usize> + use<> {
        let reach = Vector2::new(reach, reach);
        self.between([self.at(place - reach), self.at(place + reach)])
    }

    fn between(&self, [low, high]: [[usize; 2]; 2]) -> impl Iterator<Item = usize> + use<> {
        let columns = self.columns;
        (low[1]..=high[1])
            .flat_map(move |row| (low[0]..=high[0]).map(move |column| row * columns + column))
    }

    /// The square of a cell.
    pub(super) fn square(&self, cell: usize) -> Rect {
        let [column, row] = [cell % self.columns, cell / self.columns].map(|at| at as f64);
        let min = self.rect.min + Vector2::new(column, row) * self.side;
        Rect {
            min,
            max: min + Vector2::new(self.side, self.side),
        }
    }
}

/// The whole number below `number`, 0 for one below 0.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "what is beyond is cut to the last by all who ask"
)]
pub(super) fn floor(number: f64) -> usize {
    number.max(0.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_lies_in_the_square_of_its_cell() {
        let rect = Rect {
            min: Point2::new(-5.0, 3.0),
            max: Point2::new(7.0, 10.5),
        };
        let cells = Cells::new(rect, 2.0);
        assert_eq!(cells.count(), 6 * 4);
        for place in [[-5.0, 3.0], [6.9, 10.4], [0.0, 7.0]].map(Point2::from) {
            let cell = cells.of(place);
            assert!(cells.square(cell).contains(place));
            assert!(cells.within(place, 0.0).eq([cell]));
            assert!(cells.within(place, 2.0).any(|near| near == cell));
        }
        assert_eq!(cells.within(Point2::new(0.0, 7.0), 2.0).count(), 9);
        assert_eq!(cells.within(Point2::new(-5.0, 3.0), 2.0).count(), 4);
        assert!((90..130).contains(&Cells::about(rect, 100).count()));
    }
}
