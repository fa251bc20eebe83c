//! Eq. 6-7: free waypoints like the middle of the altitude band.

use super::Model;
use crate::geometry::Point3;

impl Model<'_> {
    /// F3: the sum over the free waypoints of the distance of their height above ground from the
    /// middle of the band, metres.
    pub(super) fn altitude(&self, free: &[Point3]) -> f64 {
        let band = self.scenario.altitude;
        let middle = 0.5 * (band.max + band.min);
        free.iter()
            .map(|point| (point.z - self.scenario.terrain.elevation(point.xy()) - middle).abs())
            .sum()
    }
}
