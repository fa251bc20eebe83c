//! Maps metres to pixels, and chooses round numbers along an axis.

use super::canvas::{Area, Spot};
use crate::geometry::{Point2, Rect};

/// A map with the same scale in both directions, north up.
#[derive(Debug, Clone, Copy)]
pub(super) struct MapScale {
    /// The part of the plane shown, metres.
    pub(super) view: Rect,
    /// Position on the sheet.
    pub(super) frame: Area,
}

impl MapScale {
    pub(super) fn pixels_per_metre(&self) -> f64 {
        self.frame.width / (self.view.max.x - self.view.min.x)
    }

    pub(super) fn spot(&self, point: Point2) -> Spot {
        let scale = self.pixels_per_metre();
        (
            self.frame.left + (point.x - self.view.min.x) * scale,
            self.frame.bottom() - (point.y - self.view.min.y) * scale,
        )
    }
}

/// Steps of 1, 2 or 5 times a power of ten.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Steps {
    pub(super) step: f64,
    decimals: usize,
}

impl Steps {
    /// At most `count` steps in `span` > 0.
    pub(super) fn of(span: f64, count: f64) -> Self {
        let rough = (span / count).max(1e-6);
        // By products, not logarithms: these round the same on every platform.
        let mut decade: f64 = 1e-6;
        while decade * 10.0 <= rough {
            decade *= 10.0;
        }
        let factor = [1.0, 2.0, 5.0, 10.0]
            .into_iter()
            .find(|factor| factor * decade >= rough * (1.0 - 1e-9))
            .unwrap_or(10.0);
        let step = factor * decade;
        let mut decimals = 0;
        let mut unit = 1.0;
        while unit > step * (1.0 + 1e-9) && decimals < 6 {
            unit /= 10.0;
            decimals += 1;
        }
        Self { step, decimals }
    }

    /// The multiples of the step in `[min, max]`.
    pub(super) fn within(&self, min: f64, max: f64) -> Vec<f64> {
        let first = (min / self.step - 1e-9).ceil();
        let last = (max / self.step + 1e-9).floor();
        let mut ticks = Vec::new();
        let mut tick = first;
        while tick <= last {
            // Adding 0 turns -0 into 0.
            ticks.push(tick * self.step + 0.0);
            tick += 1.0;
        }
        ticks
    }

    pub(super) fn label(&self, value: f64) -> String {
        format!("{value:.*}", self.decimals)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        for (span, count, expected) in [
            (1000.0, 6.0, "200"),
            (9500.0, 8.0, "2000"),
            (1.0, 5.0, "0.2"),
            (3.0, 10.0, "0.5"),
            (2e8, 7.0, "50000000"),
            (100.0, 10.0, "10"),
        ] {
            let steps = Steps::of(span, count);
            assert_eq!(steps.label(steps.step), expected);
        }
    }

    #[test]
    fn ticks_stay_within() {
        let labels = |steps: Steps, min, max| -> Vec<String> {
            let ticks = steps.within(min, max);
            ticks.into_iter().map(|tick| steps.label(tick)).collect()
        };
        assert_eq!(
            labels(Steps::of(0.6, 3.0), -0.25, 0.35),
            ["-0.2", "0.0", "0.2"]
        );
        assert_eq!(labels(Steps::of(10.0, 2.0), 10.0, 20.0), ["10", "15", "20"]);
    }
}
