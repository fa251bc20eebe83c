//! Where the ground rises faster than the aircraft climbs.
//!
//! Coarse on purpose: it tells seeds which mountains to go round. What a route may really do is
//! measured by `cost`, and no bound rests on this.

use nalgebra::Vector2;

use super::{Outline, OutlineShape};
use crate::geometry::Point2;
use crate::scenario::Scenario;

/// Cells along the longer side of the area.
const CELLS: f64 = 32.0;

/// Half extents, in cells, over which a rise is measured.
const EXTENTS: [f64; 4] = [0.5, 1.0, 2.0, 4.0];

/// A disc over each cell at the rim of what cannot be crossed uphill: over some extent round it the
/// ground rises by more than the steepest climb and the height of the altitude band together. The
/// cells of a coarse lattice within the rim cannot be reached, and are left out.
#[must_use]
pub fn steep_ground(scenario: &Scenario) -> Vec<Outline> {
    if scenario.terrain.is_flat() {
        return Vec::new();
    }
    let area = scenario.area;
    let size = area.max - area.min;
    let cell = size.x.max(size.y) / CELLS;
    if cell <= 0.0 {
        return Vec::new();
    }
    let along = |length: f64| {
        (0..)
            .map(f64::from)
            .take_while(move |&idx| idx < (length / cell).ceil().max(1.0))
    };
    let center = |column: f64, row: f64| area.min + Vector2::new(column + 0.5, row + 0.5) * cell;
    let steep: Vec<Vec<bool>> = along(size.y)
        .map(|row| {
            along(size.x)
                .map(|column| is_steep(scenario, center(column, row), cell))
                .collect()
        })
        .collect();
    let mut outlines = Vec::new();
    for (row, y) in along(size.y).enumerate() {
        for (column, x) in along(size.x).enumerate() {
            if steep[row][column] && !is_enclosed(&steep, row, column) {
                outlines.push(Outline {
                    shape: OutlineShape::Disc(center(x, y)),
                    // As wide as the cell is from corner to corner: no gap is left between two.
                    radius: 0.5 * cell * std::f64::consts::SQRT_2,
                    core: 0.0,
                });
            }
        }
    }
    outlines
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

fn is_steep(scenario: &Scenario, center: Point2, cell: f64) -> bool {
    let ground = |away: Vector2<f64>| scenario.terrain.elevation(center + away);
    let climb = libm::tan(scenario.vehicle.max_climb_deg.to_radians());
    let slack = scenario.altitude.max - scenario.altitude.min;
    EXTENTS.iter().any(|extent| {
        let half = extent * cell;
        let (east, north) = (Vector2::x() * half, Vector2::y() * half);
        let uphill = Vector2::new(ground(east) - ground(-east), ground(north) - ground(-north));
        let steepness = uphill.norm();
        let impassable = 2.0 * half * climb + slack;
        // Straight uphill the rise is not much more than along both axes together.
        if steepness <= 0.5 * impassable {
            return false;
        }
        let way = uphill * (half / steepness);
        ground(way) - ground(-way) > impassable
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
    fn a_string_goes_round_a_mountain_that_is_too_steep() {
        assert!(steep_ground(&mountain(150.0)).is_empty());
        let steep = mountain(2000.0);
        let outlines = steep_ground(&steep);
        assert!(!outlines.is_empty());
        for outline in &outlines {
            assert!(outline.distance(Point2::new(500.0, 450.0)) < 400.0);
        }
        // A ring of discs, two cells deep at most where it runs aslant.
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
