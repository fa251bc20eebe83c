//! Where the samples of a dataset lie: on a lattice in its reference system.

use super::raster::Span;
use super::{Crs, DemError};
use crate::geometry::Point2;
use crate::geometry::geodesy::{LatLon, TangentPlane};

/// Points checked along each edge of a region.
pub(super) const LOOKS: usize = 32;

/// Rounding tolerance: positions outside by at most this count as inside, cells.
const HAIR: f64 = 1e-9;

/// Nodes, one for each sample, at `first + [column * step[0], row * step[1]]`.
///
/// A node is where its sample applies: the centre of a pixel where pixels are areas, the pixel itself where they are
/// points. Between nodes the ground is bilinear; beyond the outermost it is unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// Reference system of `first` and `step`.
    pub crs: Crs,
    /// Counted from the left.
    pub columns: usize,
    /// Counted from the top.
    pub rows: usize,
    /// The first node of the first row, east and north.
    pub first: [f64; 2],
    /// To the next column, > 0, and to the next row, nearly always < 0.
    pub step: [f64; 2],
}

/// A rectangle in degrees; `east` is greater than 180 where it crosses the antimeridian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Degrees {
    /// Least longitude.
    pub west: f64,
    /// Least latitude.
    pub south: f64,
    /// Greatest longitude.
    pub east: f64,
    /// Greatest latitude.
    pub north: f64,
}

impl Lattice {
    /// Bounds of the outermost nodes: least and greatest east, then north, in the reference system's unit.
    #[must_use]
    pub fn extent(&self) -> [[f64; 2]; 2] {
        let last = self.east_north([(self.columns - 1) as f64, (self.rows - 1) as f64]);
        [0, 1].map(|axis| {
            let (a, b) = (self.first[axis], last[axis]);
            [a.min(b), a.max(b)]
        })
    }

    /// The same in degrees; `None` outside the domain of the reference system.
    #[must_use]
    pub fn degrees(&self) -> Option<Degrees> {
        let mut found: Option<Degrees> = None;
        for cells in self.edge() {
            let at = self.geodetic(cells)?;
            if !(-90.0..=90.0).contains(&at.lat) {
                return None;
            }
            // Neighbours on the edge are close, so each longitude is unwrapped towards those found so far.
            let lon = found.map_or(at.lon, |found| {
                near(at.lon, 0.5 * (found.west + found.east))
            });
            let found = found.get_or_insert(Degrees {
                west: lon,
                south: at.lat,
                east: lon,
                north: at.lat,
            });
            *found = Degrees {
                west: found.west.min(lon),
                south: found.south.min(at.lat),
                east: found.east.max(lon),
                north: found.north.max(at.lat),
            };
        }
        found
    }

    /// `place` in columns and rows; `None` outside the domain of the reference system.
    pub(super) fn cells(&self, place: LatLon) -> Option<[f64; 2]> {
        let mut at = self.crs.east_north(place)?;
        if self.crs.is_geographic() {
            let [[west, east], _] = self.extent();
            at[0] = near(at[0], 0.5 * (west + east));
        }
        Some([0, 1].map(|axis| (at[axis] - self.first[axis]) / self.step[axis]))
    }

    /// The first node of the cell around `[column, row]` and the position within; `None` outside the nodes.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "it lies between 0 and the number of nodes"
    )]
    pub(super) fn cell(&self, cells: [f64; 2]) -> Option<([usize; 2], [f64; 2])> {
        let counts = [self.columns, self.rows];
        let inside =
            |axis: usize| (-HAIR..=(counts[axis] - 1) as f64 + HAIR).contains(&cells[axis]);
        (inside(0) && inside(1)).then(|| {
            let cell = [0, 1].map(|axis| (cells[axis] as usize).min(counts[axis] - 2));
            (
                cell,
                [0, 1].map(|axis| (cells[axis] - cell[axis] as f64).clamp(0.0, 1.0)),
            )
        })
    }

    /// All rows and columns.
    pub(super) fn span(&self) -> Span {
        Span {
            rows: 0..self.rows,
            columns: 0..self.columns,
        }
    }

    /// The place at the given column and row.
    pub(super) fn geodetic(&self, cells: [f64; 2]) -> Option<LatLon> {
        self.crs.geodetic(self.east_north(cells))
    }

    fn east_north(&self, cells: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.first[axis] + cells[axis] * self.step[axis])
    }

    /// Points along the outermost nodes, in columns and rows, all the way around.
    fn edge(&self) -> impl Iterator<Item = [f64; 2]> {
        let (right, bottom) = ((self.columns - 1) as f64, (self.rows - 1) as f64);
        let corners = [[0.0, 0.0], [right, 0.0], [right, bottom], [0.0, bottom]];
        (0..4 * LOOKS).map(move |look| {
            let (a, b) = (corners[look / LOOKS], corners[(look / LOOKS + 1) % 4]);
            let share = (look % LOOKS) as f64 / LOOKS as f64;
            [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * share)
        })
    }

    /// The error for a place that is not among the elevations.
    pub(super) fn outside(&self, at: LatLon) -> DemError {
        let reach = self.degrees().unwrap_or(Degrees {
            west: -180.0,
            south: -90.0,
            east: 180.0,
            north: 90.0,
        });
        DemError::Outside {
            at,
            south_west: LatLon {
                lat: reach.south,
                lon: reach.west,
            },
            north_east: LatLon {
                lat: reach.north,
                lon: reach.east,
            },
        }
    }

    /// A point of `plane` in columns and rows.
    pub(super) fn below(&self, plane: &TangentPlane, point: Point2) -> Option<[f64; 2]> {
        self.cells(plane.geodetic(point))
    }
}

/// `lon` plus the whole turns that bring it nearest to `middle`.
fn near(lon: f64, middle: f64) -> f64 {
    lon + 360.0 * ((middle - lon) / 360.0).round()
}
