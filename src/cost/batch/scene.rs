//! What the pricers of a model share, however much they tolerate: its threats and its ground, made ready for lanes.

use super::peaks::Massif;
use super::pyramid::Pyramid;
use super::threats::Threats;
use crate::scenario::Scenario;
use crate::terrain::Terrain;

/// The threats and the ground of a scenario.
#[derive(Debug)]
pub(in crate::cost) struct Scene {
    pub(super) threats: Threats,
    pub(super) surface: Surface,
}

/// The ground below.
#[derive(Debug)]
pub(super) enum Surface {
    Flat(f64),
    Peaks(Massif),
    Grid(Pyramid),
    /// A file, which first examines blocks of itself.
    Dem,
}

impl Scene {
    pub(super) fn of(scenario: &Scenario) -> Self {
        Self {
            threats: Threats::of(scenario),
            surface: match &scenario.terrain {
                Terrain::Flat(flat) => Surface::Flat(flat.elevation),
                Terrain::Peaks(peaks) => Surface::Peaks(Massif::of(peaks)),
                Terrain::Grid(grid) => Surface::Grid(Pyramid::of(grid)),
                Terrain::Dem(_) => Surface::Dem,
            },
        }
    }
}
