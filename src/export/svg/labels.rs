//! Placement of labels: inside the frame, without overlap.

use super::canvas::{Area, Spot};

/// The occupied areas of a frame.
pub(super) struct Labels {
    frame: Area,
    taken: Vec<Area>,
}

impl Labels {
    pub(super) fn within(frame: Area) -> Self {
        Self {
            frame,
            taken: Vec::new(),
        }
    }

    /// Keep labels off `area`.
    pub(super) fn reserve(&mut self, area: Area) {
        self.taken.push(area);
    }

    /// Keep labels off a line.
    pub(super) fn reserve_line(&mut self, line: &[Spot]) {
        const SIDE: f64 = 6.0;
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
                let new = self.taken.last() != Some(&area);
                if new && self.frame.overlaps(&area) {
                    self.taken.push(area);
                }
                step += 1.0;
            }
        }
    }

    pub(super) fn is_free(&self, area: &Area) -> bool {
        self.frame.encloses(area) && !self.taken.iter().any(|taken| taken.overlaps(area))
    }

    /// Occupy the first candidate that is free.
    pub(super) fn place(&mut self, candidates: impl IntoIterator<Item = Area>) -> Option<Area> {
        let found = candidates.into_iter().find(|area| self.is_free(area))?;
        self.taken.push(found);
        Some(found)
    }
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

    #[test]
    fn nothing_stands_on_a_line() {
        let mut labels = Labels::within(Area::about((50.0, 50.0), (100.0, 100.0)));
        labels.reserve_line(&[(0.0, 0.0), (100.0, 100.0)]);
        assert!(!labels.is_free(&Area::about((50.0, 50.0), (10.0, 10.0))));
        assert!(labels.is_free(&Area::about((70.0, 30.0), (10.0, 10.0))));
    }
}
