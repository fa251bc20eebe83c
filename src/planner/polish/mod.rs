//! Makes a good route better, to the last metre: descent on a lattice that shrinks.

mod clear;
mod lattice;
mod turns;
mod ways;

use super::price::price;
use super::{Stop, same, why_stop};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use lattice::Lattice;

/// How far a descent goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps {
    /// Greatest step, as a share of the way.
    pub(super) from: f64,
    /// Least.
    pub(super) to: f64,
    /// A gain below this share of the cost is none.
    pub(super) gain: f64,
}

/// Polishes routes of one scenario.
pub(super) struct Polish<'m, 's> {
    lattice: Lattice<'m, 's>,
    model: &'m Model<'s>,
    stop: &'m dyn Stop,
}

impl<'m, 's> Polish<'m, 's> {
    pub(super) fn new(model: &'m Model<'s>, stop: &'m dyn Stop) -> Self {
        Self {
            lattice: Lattice::new(model),
            model,
            stop,
        }
    }

    /// What was priced, in routes of so many free waypoints.
    pub(super) fn evaluations(&self, waypoints: usize) -> u64 {
        self.lattice.legs_priced.div_ceil(waypoints as u64 + 1)
    }

    /// Improve `route` by `steps` that shrink.
    pub(super) fn descend(&mut self, route: &mut Vec<Point3>, steps: Steps) -> Fitness {
        self.descend_unless_known(route, steps, &[])
            .expect("no route is known")
    }

    /// As [`Polish::descend`]; `None` as soon as the route has become the same as one of `known` that
    /// it does not beat.
    pub(super) fn descend_unless_known(
        &mut self,
        route: &mut Vec<Point3>,
        Steps { from, to, gain }: Steps,
        known: &[(Fitness, Vec<Point3>)],
    ) -> Option<Fitness> {
        let scenario = self.model.scenario;
        let way = (scenario.target - scenario.start).norm();
        let mut best = price(self.model, route);
        let (mut step, mut kind, mut failed) = (from * way, 0, 0);
        while step > to * way && why_stop(scenario, self.stop).is_none() {
            let mut trial = route.clone();
            let mut better = false;
            if self
                .lattice
                .sweep(&mut trial, best.is_feasible(), step, kind)
            {
                let exact = price(self.model, &trial);
                if exact.beats(&best) {
                    better = exact.violation < best.violation
                        || best.cost - exact.cost > gain * best.cost;
                    best = exact;
                    *route = trial;
                    let is_known = |(fitness, other): &(Fitness, Vec<Point3>)| {
                        !best.beats(fitness) && same(scenario, route, other)
                    };
                    if known.iter().any(is_known) {
                        return None;
                    }
                }
            }
            kind += 1;
            failed = if better { 0 } else { failed + 1 };
            if failed >= 2 {
                step *= 0.5;
                failed = 0;
            }
        }
        Some(best)
    }
}
