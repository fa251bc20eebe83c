//! Placement of labels: inside the frame, without overlap.

use super::canvas::{Area, Spot};

/// Side of a cell, pixels.
const CELL: f64 = 16.0;

/// The occupied areas of a frame, by the square cells that they meet: of thousands, a label meets few.
pub(super) struct Labels {
    frame: Area,
    columns: usize,
    rows: usize,
    /// Row by row.
    cells: Vec<Vec<Area>>,
}

impl Labels {
    pub(super) fn within(frame: Area) -> Self {
        let [columns, rows] = [frame.width, frame.height].map(|side| cell(side) + 1);
        Self {
            frame,
            columns,
            rows,
            cells: vec![Vec::new(); columns * rows],
        }
    }

    /// Keep labels off `area`.
    pub(super) fn reserve(&mut self, area: Area) {
        // No label may stand beyond the frame.
        if self.frame.overlaps(&area) {
            for cell in self.met(&area) {
                self.cells[cell].push(area);
            }
        }
    }

    /// The cells of the frame that `area` meets.
    fn met(&self, area: &Area) -> impl Iterator<Item = usize> + use<> {
        let along =
            |from: f64, to: f64, count: usize| cell(from).min(count - 1)..=cell(to).min(count - 1);
        let (left, top) = (self.frame.left, self.frame.top);
        let columns = along(area.left - left, area.right() - left, self.columns);
        let rows = along(area.top - top, area.bottom() - top, self.rows);
        let across = self.columns;
        rows.flat_map(move |row| columns.clone().map(move |column| row * across + column))
    }

    /// Keep labels off a line.
    pub(super) fn reserve_line(&mut self, line: &[Spot]) {
        const SIDE: f64 = 6.0;
        let mut last = None;
        for ends in line.windows(2) {
            let (dx, dy) = (ends[1].0 - ends[0].0, ends[1].1 - ends[0].1);
            // However far a line runs beyond the frame, this many boxes cover its visible part.
            let steps = ((dx * dx + dy * dy).sqrt() / SIDE)
                .ceil()
                .clamp(1.0, 1000.0);
            let mut step = 0.0;
            while step <= steps {
                let t = step / steps;
                let area = Area::about((ends[0].0 + t * dx, ends[0].1 + t * dy), (SIDE, SIDE));
                if last != Some(area) {
                    self.reserve(area);
                    last = Some(area);
                }
                step += 1.0;
            }
        }
    }

    pub(super) fn is_free(&self, area: &Area) -> bool {
        let is_taken = |cell: usize| self.cells[cell].iter().any(|taken| taken.overlaps(area));
        self.frame.encloses(area) && !self.met(area).any(is_taken)
    }

    /// Occupy the first candidate that is free.
    pub(super) fn place(&mut self, candidates: impl IntoIterator<Item = Area>) -> Option<Area> {
        let found = candidates.into_iter().find(|area| self.is_free(area))?;
        self.reserve(found);
        Some(found)
    }
}

/// The cell at so many pixels from the first; the first for anything before it.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a negative distance is in the first cell, and a frame has few"
)]
fn cell(pixels: f64) -> usize {
    (pixels / CELL) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_free_place_is_taken_once() {
        let frame = Area::about((50.0, 50.0), (100.0, 100.0));
        let mut labels = Labels::within(frame);
        let word = (20.0, 10.0);
        let candidates = [(0.0, 0.0), (30.0, 30.0), (70.0, 70.0)].map(|at| Area::about(at, word));
        assert_eq!(
            labels.place(candidates),
            Some(candidates[1]),
            "the first leaves the frame"
        );
        assert_eq!(labels.place(candidates), Some(candidates[2]));
        assert_eq!(labels.place(candidates), None);
    }

    /// A list of all that is taken would be compared ten billion times.
    #[test]
    fn places_on_a_busy_line_are_found_taken_at_once() {
        let mut labels = Labels::within(Area::about((500.0, 500.0), (1000.0, 1000.0)));
        let line: Vec<Spot> = (0..100_000)
            .map(|x| (f64::from(x) / 100.0, 500.0))
            .collect();
        labels.reserve_line(&line);
        for place in 0..100_000 {
            let x = 10.0 + f64::from(place % 980);
            assert!(labels.is_free(&Area::about((x, 400.0), (20.0, 10.0))));
        }
    }

    /// Whatever their size, and wherever they lie.
    #[test]
    fn areas_are_taken_as_if_each_were_looked_at() {
        let frame = Area::about((130.0, 90.0), (200.0, 100.0));
        let mut labels = Labels::within(frame);
        let mut taken = Vec::new();
        for look in 0..2000_u32 {
            let part = |prime: u32, most: u32| f64::from(look * prime % most);
            let at = (part(7919, 320), part(6361, 200));
            let area = Area::about(at, (1.0 + part(31, 40), 1.0 + part(17, 23)));
            let free =
                frame.encloses(&area) && !taken.iter().any(|other: &Area| other.overlaps(&area));
            assert_eq!(labels.is_free(&area), free, "{area:?}");
            if look % 3 == 0 || free {
                labels.reserve(area);
                taken.push(area);
            }
        }
    }

    #[test]
    fn nothing_stands_on_a_line() {
        let mut labels = Labels::within(Area::about((50.0, 50.0), (100.0, 100.0)));
        labels.reserve_line(&[(0.0, 0.0), (100.0, 100.0)]);
        assert!(!labels.is_free(&Area::about((50.0, 50.0), (10.0, 10.0))));
        assert!(labels.is_free(&Area::about((70.0, 30.0), (10.0, 10.0))));
    }
}
