//! Routes as an optimizer sees them: positions in, fitness out.

use super::encoding::Encoding;
use crate::cost::{Model, Tolerance};
use crate::geometry::Point3;
use crate::optimizer::{Bounds, Fitness, Objective};

/// The routes of one scenario.
pub(super) struct Routes<'s> {
    pub(super) encoding: Encoding<'s>,
    pub(super) model: Model<'s>,
    /// Half of what feasible means, so that a delivered route is feasible for others' rounding too.
    tolerance: Tolerance,
    route: Vec<Point3>,
}

impl<'s> Routes<'s> {
    pub(super) fn new(encoding: Encoding<'s>, model: Model<'s>) -> Self {
        let tolerance = model.tolerance.scaled(0.5);
        Self {
            encoding,
            model,
            tolerance,
            route: Vec::new(),
        }
    }

    fn price(&self, route: &[Point3]) -> Fitness {
        let mut violation = 0.0;
        let quadrature = self.model.scenario.planner.quadrature;
        let figures = self.model.assess(route, quadrature, self.tolerance, |breach| {
            violation += breach.amount;
        });
        Fitness {
            violation,
            cost: figures.total,
        }
    }
}

impl Objective for Routes<'_> {
    fn bounds(&self) -> &Bounds {
        self.encoding.bounds()
    }

    fn evaluate(&mut self, positions: &[f64], fitness: &mut [Fitness]) {
        let dimension = self.encoding.bounds().dimension();
        let mut route = std::mem::take(&mut self.route);
        for (position, fitness) in positions.chunks_exact(dimension).zip(fitness) {
            self.encoding.decode(position, &mut route);
            *fitness = self.price(&route);
        }
        self.route = route;
    }
}
