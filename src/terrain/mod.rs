//! The ground: its elevation at any point, and the least and greatest height of a leg above it.
//!
//! To add a kind, add one file beside `flat.rs` and one variant of [`Terrain`]; the compiler then names the places that
//! read, write, price or draw each kind.

mod cells;
mod datasets;
pub mod dem;
mod flat;
mod grid;
mod peaks;

pub use datasets::{DatasetError, Datasets, Found, NoDatasets, is_dataset_name};
pub use dem::Dem;
pub use flat::Flat;
pub use grid::Grid;
pub(crate) use peaks::NEGLIGIBLE;
pub use peaks::{Peak, Peaks};

use std::sync::Arc;

use crate::geometry::{Point2, Point3, Rect, Segment};

/// The ground of a scenario.
#[derive(Debug, Clone, PartialEq)]
pub enum Terrain {
    /// One elevation everywhere.
    Flat(Flat),
    /// Analytic mountains.
    Peaks(Peaks),
    /// Elevations at the nodes of a grid, bilinear between.
    Grid(Grid),
    /// Elevations from a file.
    Dem(Arc<Dem>),
}

/// Least and greatest height above ground along a part of a leg, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightRange {
    /// Least.
    pub min: f64,
    /// Greatest.
    pub max: f64,
}

impl HeightRange {
    /// The empty range: joining it with another gives the other.
    pub const EMPTY: Self = Self {
        min: f64::INFINITY,
        max: f64::NEG_INFINITY,
    };

    /// The range of a single height.
    #[must_use]
    pub fn of(height: f64) -> Self {
        Self {
            min: height,
            max: height,
        }
    }

    /// The smallest range that contains both.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }
}

impl Terrain {
    /// Whether the ground is level everywhere, so that heights above it need no search.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        matches!(self, Self::Flat(_))
    }

    /// Elevation of the ground at `point`, metres in the frame. Beyond the edge of a grid or a file, the elevation at
    /// the edge; no waypoint may lie there.
    #[must_use]
    pub fn elevation(&self, point: Point2) -> f64 {
        match self {
            Self::Flat(flat) => flat.elevation,
            Self::Peaks(peaks) => peaks.elevation(point),
            Self::Grid(grid) => grid.elevation(point),
            Self::Dem(dem) => dem.elevation(point),
        }
    }

    /// Height of `point` above the ground, metres.
    #[must_use]
    pub fn height_of(&self, point: Point3) -> f64 {
        point.z - self.elevation(point.xy())
    }

    /// Least and greatest height above ground over the part `window` of `leg`: exact on flat ground and grids, to a
    /// nanometre over peaks, to half a millimetre over files.
    #[must_use]
    pub fn height_range(&self, leg: &Segment, window: (f64, f64)) -> HeightRange {
        match self {
            Self::Flat(flat) => flat.height_range(leg, window),
            Self::Peaks(peaks) => peaks.height_range(leg, window),
            Self::Grid(grid) => grid.height_range(leg, window),
            Self::Dem(dem) => dem.height_range(leg, window),
        }
    }

    /// How far the part `window` of `leg` dips below `floor` and rises above `ceiling` (heights above ground),
    /// metres, each >= 0. Gives the same result as [`Terrain::height_range`], but is cheap where the leg keeps well
    /// within them.
    #[must_use]
    pub fn excess(
        &self,
        leg: &Segment,
        window: (f64, f64),
        floor: f64,
        ceiling: f64,
    ) -> (f64, f64) {
        let band = HeightRange {
            min: floor,
            max: ceiling,
        };
        let range = match self {
            Self::Peaks(peaks) => peaks.height_range_beyond(leg, window, band),
            Self::Dem(dem) => dem.height_range_beyond(leg, window, band),
            Self::Flat(_) | Self::Grid(_) => self.height_range(leg, window),
        };
        ((floor - range.min).max(0.0), (range.max - ceiling).max(0.0))
    }

    /// The dataset that it comes from, if any.
    #[must_use]
    pub fn dataset(&self) -> Option<&Dem> {
        match self {
            Self::Flat(_) | Self::Peaks(_) | Self::Grid(_) => None,
            Self::Dem(dem) => Some(dem),
        }
    }

    /// Where the ground is known; `None` means everywhere.
    #[must_use]
    pub fn extent(&self) -> Option<Rect> {
        match self {
            Self::Flat(_) | Self::Peaks(_) => None,
            Self::Grid(grid) => Some(grid.extent()),
            Self::Dem(dem) => Some(dem.extent()),
        }
    }

    /// Accuracy of heights above this ground, metres: the tolerance for constraints on them.
    #[must_use]
    pub fn tolerance(&self) -> f64 {
        match self {
            // For a file, a quarter of it is for chords, the rest for the mapping between cells and plane.
            Self::Peaks(_) | Self::Dem(_) => 1e-3,
            Self::Flat(_) | Self::Grid(_) => 0.0,
        }
    }
}
