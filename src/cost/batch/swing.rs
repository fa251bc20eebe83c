//! How far mountains stray from the straight line between two points of them: with the heights above ground at
//! both ends of a leg, which a route knows of its waypoints, that proves most short legs clear in no time.

use pulp::Simd;

use super::leg::Leg;
use crate::geometry::Point2;
use crate::geometry::lane::Lane;
use crate::terrain::Peaks;

/// `4 e^-1.5`, rounded up: the greatest of `(4 x - 2) e^-x`.
const CONVEX: f64 = 0.893;

/// How far the ground may rise above, and fall below, the line that joins it at both ends of a leg, per square metre of
/// the squares of the leg's extents east and north.
#[derive(Debug, Clone, Copy)]
pub(super) struct Swing {
    rises: Point2,
    falls: Point2,
}

impl Swing {
    /// Along a leg of `s` squared spreads the second derivative of `height e^-x` lies between -2 and `4 e^-1.5`
    /// times `height s`; and what has at most so much strays from its chord by no more than an eighth of it.
    pub(super) fn of(peaks: &Peaks) -> Self {
        let (mut rises, mut falls) = (Point2::origin(), Point2::origin());
        for peak in &peaks.peaks {
            let most = |bend: f64| bend * peak.height.abs() / 8.0;
            let (mut rise, mut fall) = (most(2.0), most(CONVEX));
            if peak.height < 0.0 {
                std::mem::swap(&mut rise, &mut fall);
            }
            for axis in 0..2 {
                let square = peak.spread[axis] * peak.spread[axis];
                rises[axis] += rise / square;
                falls[axis] += fall / square;
            }
        }
        Self { rises, falls }
    }

    /// How far the height above ground along `leg` sags below the line that joins it at both ends, and how far
    /// it rises above that, at most.
    #[inline(always)]
    pub(super) fn along<S: Simd>(&self, leg: &Leg<S>) -> [Lane<S>; 2] {
        let (east, north) = (leg.dx * leg.dx, leg.dy * leg.dy);
        let stray = |by: Point2| east * by.x + north * by.y;
        [stray(self.rises), stray(self.falls)]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::terrain::{Peak, Terrain};

    fn massif(choices: &[f64]) -> Peaks {
        let peak = |choice: &[f64]| Peak {
            center: Point2::new(100.0 * choice[0], 100.0 * choice[1]),
            height: 200.0 * choice[2] - 60.0,
            spread: Point2::new(10.0 + 90.0 * choice[3], 10.0 + 90.0 * choice[4]),
        };
        Peaks {
            base: 3.0,
            peaks: choices.chunks_exact(5).map(peak).collect(),
        }
    }

    /// The greatest height of the ground above, and below, the line between two points on it.
    fn strays(terrain: &Terrain, a: Point2, b: Point2) -> [f64; 2] {
        let at = |t: f64| terrain.elevation(a + (b - a) * t);
        let (from, to) = (at(0.0), at(1.0));
        let mut most = [0.0_f64; 2];
        for sample in 1..200 {
            let t = f64::from(sample) / 200.0;
            let above = at(t) - (from + (to - from) * t);
            most = [most[0].max(above), most[1].max(-above)];
        }
        most
    }

    proptest! {
        #[test]
        fn the_ground_never_strays_beyond_the_bound(
            choices in prop::collection::vec(0.0..1.0f64, 15),
            (x, y) in (0.0..100.0f64, 0.0..100.0f64),
            (dx, dy) in (-60.0..60.0f64, -60.0..60.0f64),
        ) {
            let peaks = massif(&choices);
            let swing = Swing::of(&peaks);
            let terrain = Terrain::Peaks(peaks);
            let a = Point2::new(x, y);
            let [above, below] = strays(&terrain, a, Point2::new(x + dx, y + dy));
            let most = |by: Point2| dx * dx * by.x + dy * dy * by.y;
            prop_assert!(above <= most(swing.rises) + 1e-9, "{above} {}", most(swing.rises));
            prop_assert!(below <= most(swing.falls) + 1e-9, "{below} {}", most(swing.falls));
        }
    }

    /// Over a summit, and where a slope curves upwards most, short legs come close to the bound.
    #[test]
    fn the_bound_is_nearly_reached() {
        let peaks = massif(&[0.5, 0.5, 0.8, 0.3, 0.3]);
        let (spread, swing) = (peaks.peaks[0].spread.x, Swing::of(&peaks));
        let terrain = Terrain::Peaks(peaks);
        let across = |x: f64| {
            let end = |dx: f64| Point2::new(50.0 + x + dx, 50.0);
            strays(&terrain, end(-1.0), end(1.0))
        };
        let [above, _] = across(0.0);
        let [_, below] = across(1.5_f64.sqrt() * spread);
        assert!(above > 0.99 * 4.0 * swing.rises.x, "{above} {swing:?}");
        assert!(below > 0.99 * 4.0 * swing.falls.x, "{below} {swing:?}");
    }
}
