//! Eq. 6-7: free waypoints should be in the middle of the altitude band.

use super::Model;
use crate::geometry::Point3;

impl Model<'_> {
    /// F3: the sum over the free waypoints of the distance of their height above ground from the
    /// middle of the band, metres.
    pub(super) fn altitude(&self, free: &[Point3]) -> f64 {
        let ground = |point: &Point3| self.scenario.terrain.elevation(point.xy());
        free.iter()
            .map(|point| self.off_middle(*point, ground(point)))
            .sum()
    }

    /// The share of one waypoint, above `ground`.
    pub(super) fn off_middle(&self, point: Point3, ground: f64) -> f64 {
        (point.z - ground - self.scenario.altitude.middle()).abs()
    }
}
