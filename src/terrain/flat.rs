//! Level ground.

use super::HeightRange;
use crate::geometry::Segment;

/// Level ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flat {
    /// Metres in the frame.
    pub elevation: f64,
}

impl Flat {
    pub(super) fn height_range(self, leg: &Segment, (t0, t1): (f64, f64)) -> HeightRange {
        let (h0, h1) = (leg.at(t0).z - self.elevation, leg.at(t1).z - self.elevation);
        HeightRange {
            min: h0.min(h1),
            max: h0.max(h1),
        }
    }
}
