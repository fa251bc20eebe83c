//! Where the samples of a dataset lie: on a lattice in its reference system.

use super::raster::Span;
use super::{Crs, DemError};
use crate::geometry::Point2;
use crate::geometry::geodesy::{LatLon, TangentPlane};

/// Points checked along each edge of a region.
pub(super) const LOOKS: usize = 32;

/// Rounding tolerance: positions outside by at most this count as inside, cells.
const HAIR: f64 = 1e-9;

/// Rounding tolerance of a pole's position, cells.
const HAIR_OF_POLE: f64 = 1e-3;

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

    /// The same in degrees, with the west from -180 to below 180; `None` outside the domain of the reference system.
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
                near(at.lon, 0.5 * (found.west + found.east), 360.0)
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
        let mut found = found?;
        for lat in [-90.0, 90.0] {
            if self.surrounds_pole(lat) {
                // Every meridian ends there.
                (found.west, found.east) = (-180.0, 180.0);
                (found.south, found.north) = (found.south.min(lat), found.north.max(lat));
            }
        }
        let turns = 360.0 * ((found.west + 180.0) / 360.0).floor();
        Some(Degrees {
            west: found.west - turns,
            east: found.east - turns,
            ..found
        })
    }

    /// Whether the pole at `lat` lies within the outermost nodes, on a map on which it is a point.
    fn surrounds_pole(&self, lat: f64) -> bool {
        if self.crs.is_geographic() {
            return false;
        }
        let last = [self.columns - 1, self.rows - 1].map(|last| last as f64);
        let cells = [-120.0, 0.0, 120.0].map(|lon| self.cells(LatLon { lat, lon }));
        let [Some(a), Some(b), Some(c)] = cells else {
            return false;
        };
        let together = |axis: usize| {
            (a[axis] - b[axis]).abs() < HAIR_OF_POLE && (c[axis] - b[axis]).abs() < HAIR_OF_POLE
        };
        let inside = |axis: usize| 0.0 < b[axis] && b[axis] < last[axis];
        // Some formulas give any place a position, however far it is from where they hold.
        let returns = self
            .geodetic(b)
            .is_some_and(|place| (place.lat - lat).abs() < 1e-6);
        (0..2).all(|axis| together(axis) && inside(axis)) && returns
    }

    /// `place` in columns and rows; `None` outside the domain of the reference system.
    pub(super) fn cells(&self, place: LatLon) -> Option<[f64; 2]> {
        let mut at = self.crs.east_north(place)?;
        if let Some(turn) = self.crs.turn() {
            let [[west, east], _] = self.extent();
            at[0] = near(at[0], 0.5 * (west + east), turn);
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

/// `east` plus the whole turns that bring it nearest to `middle`.
fn near(east: f64, middle: f64, turn: f64) -> f64 {
    east + turn * ((middle - east) / turn).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hundred cells from `first` to the opposite of it across `middle`.
    fn around(code: u16, middle: [f64; 2], half: f64) -> Lattice {
        Lattice {
            crs: Crs::epsg(code).expect("it is known"),
            columns: 101,
            rows: 101,
            first: [middle[0] - half, middle[1] + half],
            step: [half / 50.0, -half / 50.0],
        }
    }

    /// West, south, east and north.
    fn check(lattice: &Lattice, expected: [f64; 4]) {
        let found = lattice.degrees().expect("it lies on the earth");
        let found = [found.west, found.south, found.east, found.north];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 0.01, "{found} {expected}");
        }
    }

    #[test]
    fn a_pole_within_reaches_all_around() {
        // A square of 1000 km around either pole: its corners are 707 km away.
        check(
            &around(3031, [0.0, 0.0], 500_000.0),
            [-180.0, -90.0, 180.0, -83.50],
        );
        check(
            &around(3413, [0.0, 0.0], 500_000.0),
            [-180.0, 83.48, 180.0, 90.0],
        );
        // Beside it, towards 45 degrees west.
        let beside = around(3413, [0.0, -1_000_000.0], 500_000.0);
        check(&beside, [-90.0, 75.48, 0.0, 85.39]);
        // The pole of the other hemisphere and those of upright maps are not points within.
        check(
            &around(32_632, [500_000.0, 5_000_000.0], 1000.0),
            [8.987, 45.144, 9.013, 45.162],
        );
    }

    #[test]
    fn the_west_is_a_longitude() {
        // The edge of this one runs twice across the antimeridian.
        let found = around(3413, [-700_000.0, 700_000.0], 300_000.0)
            .degrees()
            .expect("it lies on the earth");
        assert!(
            (-180.0..180.0).contains(&found.west) && found.east > found.west,
            "{found:?}"
        );
        check(
            &around(4326, [190.5, 10.0], 0.5),
            [-170.0, 9.5, -169.0, 10.5],
        );
    }

    #[test]
    fn a_map_goes_on_beyond_the_antimeridian() {
        for code in [3857, 3395, 4087, 6933, 3832] {
            let crs = Crs::epsg(code).expect("it is known");
            let lon = if code == 3832 { -30.0 } else { 180.0 };
            let [east, north] = crs
                .east_north(LatLon {
                    lat: 10.0,
                    lon: lon - 1e-9,
                })
                .expect("it is on the map");
            let lattice = around(code, [east, north], 20_000.0);
            let reach = lattice.degrees().expect("it lies on the earth");
            assert!(
                reach.west < lon && lon < reach.east,
                "EPSG:{code}: {reach:?}"
            );
            for lon in [
                reach.west,
                reach.east,
                reach.east - 360.0,
                reach.west + 360.0,
            ] {
                let place = LatLon { lat: 10.0, lon };
                let cells = lattice.cells(place).expect("it is on the map");
                assert!(
                    (-1e-6..=100.000_001).contains(&cells[0]),
                    "EPSG:{code}: {lon} at {cells:?}"
                );
            }
        }
        // Meridians that meet, and those that are bent.
        for code in [3031, 3413, 2154, 32_632, 3035, 27_700] {
            assert_eq!(
                Crs::epsg(code).expect("it is known").turn(),
                None,
                "EPSG:{code}"
            );
        }
    }
}
