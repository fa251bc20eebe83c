//! Where the ground rises faster than the aircraft climbs.
//!
//! Coarse on purpose: it tells seeds which mountains to go round. What a route may really do is
//! measured by `cost`, and no bound rests on this.

use nalgebra::Vector2;

use super::{Outline, OutlineShape};
use crate::geometry::Point2;
use crate::scenario::Scenario;
use crate::terrain::Terrain;

/// Cells along the longer side of the area.
const CELLS: f64 = 48.0;

/// Half extents, in cells, over which a rise is measured.
const EXTENTS: [f64; 4] = [0.5, 1.0, 2.0, 4.0];

/// A disc over each cell of a coarse lattice that cannot be crossed uphill: over some extent round
/// it the ground rises by more than the steepest climb and the height of the altitude band together.
#[must_use]
pub fn steep_ground(scenario: &Scenario) -> Vec<Outline> {
    if let Terrain::Flat(_) = scenario.terrain {
        return Vec::new();
    }
    let area = scenario.area;
    let size = area.max - area.min;
    let cell = size.x.max(size.y) / CELLS;
    if cell <= 0.0 {
        return Vec::new();
    }
    let count = |length: f64| (length / cell).ceil().max(1.0);
    let mut outlines = Vec::new();
    let mut row = 0.0;
    while row < count(size.y) {
        let mut column = 0.0;
        while column < count(size.x) {
            let center = area.min + Vector2::new(column + 0.5, row + 0.5) * cell;
            if is_steep(scenario, center, cell) {
                outlines.push(Outline {
                    shape: OutlineShape::Disc(center),
                    // As wide as the cell is from corner to corner: no gap is left between two.
                    radius: 0.5 * cell * std::f64::consts::SQRT_2,
                    core: 0.0,
                });
            }
            column += 1.0;
        }
        row += 1.0;
    }
    outlines
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
        if steepness <= 0.0 {
            return false;
        }
        let way = uphill * (half / steepness);
        ground(way) - ground(-way) > 2.0 * half * climb + slack
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
        let ends = [steep.start.xy(), steep.target.xy()];
        let scene = Obstacles::new(outlines.into_iter().map(Some), ends, Some(steep.area));
        let round = &taut_strings(&scene, 1).strings[0];
        assert!(round.length > 1.01 * (ends[1] - ends[0]).norm());
    }
}
