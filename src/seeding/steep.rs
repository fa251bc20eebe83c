//! Where the ground rises faster than the aircraft climbs.
//!
//! Coarse on purpose: it tells seeds which mountains to go round. What a route may really do is measured by `cost`, and
//! no bound depends on this.

use nalgebra::Vector2;

use super::{Outline, OutlineShape};
use crate::geometry::Point2;
use crate::scenario::Scenario;

/// Cells along the longer side of the area.
const CELLS: usize = 32;

/// Half extents, in half cells, over which a rise is measured.
const EXTENTS: [usize; 4] = [1, 2, 4, 8];

/// The greatest of them: the ground is examined this far beyond the area too.
const MARGIN: usize = EXTENTS[EXTENTS.len() - 1];

/// A disc over each cell at the rim of what cannot be crossed uphill: over some extent around it the ground rises by
/// more than the steepest climb and the height of the altitude band together. The cells of a coarse lattice within the
/// rim cannot be reached, and are left out.
#[must_use]
pub fn steep_ground(scenario: &Scenario) -> Vec<Outline> {
    if scenario.terrain.is_flat() {
        return Vec::new();
    }
    let area = scenario.area;
    let size = area.max - area.min;
    let cell = size.x.max(size.y) / CELLS as f64;
    if cell <= 0.0 {
        return Vec::new();
    }
    let cells = |length: f64| {
        let covers = |count: &usize| *count as f64 * cell >= length;
        (1..CELLS).find(covers).unwrap_or(CELLS)
    };
    let (columns, rows) = (cells(size.x), cells(size.y));
    let ground = Ground::new(scenario, 0.5 * cell, [columns, rows]);
    let steep: Vec<Vec<bool>> = (0..rows)
        .map(|row| {
            (0..columns)
                .map(|column| ground.is_steep(column, row))
                .collect()
        })
        .collect();
    let mut outlines = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            if steep[row][column] && !is_enclosed(&steep, row, column) {
                outlines.push(Outline {
                    shape: OutlineShape::Disc(ground.center(column, row)),
                    // As wide as the diagonal of the cell, so that there is no gap between two.
                    radius: 0.5 * cell * std::f64::consts::SQRT_2,
                    core: 0.0,
                });
            }
        }
    }
    outlines
}

/// The elevation at all corners, middles of sides and centers of cells.
struct Ground<'s> {
    scenario: &'s Scenario,
    /// Distance from one of them to the next, metres.
    step: f64,
    /// Row by row, [`MARGIN`] on each side.
    elevations: Vec<Vec<f64>>,
}

impl<'s> Ground<'s> {
    fn new(scenario: &'s Scenario, step: f64, [columns, rows]: [usize; 2]) -> Self {
        let along = |cells: usize| (0..=2 * (cells + MARGIN)).map(|idx| idx as f64 - MARGIN as f64);
        let elevation = |column: f64, row: f64| {
            let at = scenario.area.min + Vector2::new(column, row) * step;
            scenario.terrain.elevation(at)
        };
        let row = |row: f64| {
            along(columns)
                .map(|column| elevation(column, row))
                .collect()
        };
        Self {
            scenario,
            step,
            elevations: along(rows).map(row).collect(),
        }
    }

    fn center(&self, column: usize, row: usize) -> Point2 {
        self.scenario.area.min
            + Vector2::new(column as f64 + 0.5, row as f64 + 0.5) * (2.0 * self.step)
    }

    /// Whether a cell lies on ground that rises faster than can be climbed.
    fn is_steep(&self, column: usize, row: usize) -> bool {
        let climb = self.scenario.vehicle.steepest();
        let band = self.scenario.altitude;
        let center = self.center(column, row);
        let (column, row) = (MARGIN + 2 * column + 1, MARGIN + 2 * row + 1);
        EXTENTS.iter().any(|&extent| {
            let east =
                self.elevations[row][column + extent] - self.elevations[row][column - extent];
            let north =
                self.elevations[row + extent][column] - self.elevations[row - extent][column];
            let half = extent as f64 * self.step;
            let uphill = Vector2::new(east, north);
            let steepness = uphill.norm();
            let impassable = 2.0 * half * climb + (band.max - band.min);
            // Straight uphill the rise is not much more than along both axes together.
            if steepness <= 0.5 * impassable {
                return false;
            }
            let way = uphill * (half / steepness);
            let elevation = |away: Vector2<f64>| self.scenario.terrain.elevation(center + away);
            elevation(way) - elevation(-way) > impassable
        })
    }
}

/// Whether all eight neighbours of a cell are steep.
fn is_enclosed(steep: &[Vec<bool>], row: usize, column: usize) -> bool {
    let around = |idx: usize| idx.checked_sub(1).map(|first| first..idx + 2);
    let is_steep =
        |row: usize, column: usize| steep.get(row).and_then(|row| row.get(column)) == Some(&true);
    around(row).is_some_and(|mut rows| {
        rows.all(|row| {
            around(column).is_some_and(|mut columns| columns.all(|column| is_steep(row, column)))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seeding::taut_strings;
    use crate::seeding::{Obstacles, tests::scenario};

    fn mountain(height: f64) -> Scenario {
        scenario(&format!(
            r#""terrain": {{ "kind": "peaks", "base": 0, "peaks": [
                {{ "center": {{ "x": 500, "y": 450 }}, "height": {height}, "spread": {{ "x": 120, "y": 120 }} }} ] }}"#,
        ))
    }

    #[test]
    fn a_string_goes_around_a_mountain_that_is_too_steep() {
        assert!(steep_ground(&mountain(150.0)).is_empty());
        let steep = mountain(2000.0);
        let outlines = steep_ground(&steep);
        assert!(!outlines.is_empty());
        for outline in &outlines {
            assert!(outline.distance(Point2::new(500.0, 450.0)) < 400.0);
        }
        // A ring of discs, at most two cells deep where it runs diagonally.
        let around = |at: Point2| {
            let near = |outline: &&Outline| outline.distance(at) < 40.0;
            outlines.iter().filter(near).count()
        };
        let widest = outlines.iter().map(|outline| match outline.shape {
            OutlineShape::Disc(center) => around(center),
            OutlineShape::Ring(_) => 0,
        });
        assert!(widest.max() < Some(9));
        let ends = [steep.start.xy(), steep.target.xy()];
        let scene = Obstacles::new(outlines.into_iter().map(Some), ends, Some(steep.area));
        let round = &taut_strings(&scene, 1).strings[0];
        assert!(round.length > 1.01 * (ends[1] - ends[0]).norm());
    }
}
