//! Makes a good route better, to the last metre: descent on a lattice that shrinks.

mod clear;
mod lattice;
mod turns;
mod ways;

use super::price::Priced;
use super::{Stop, same, why_stop};
use crate::cost::{Model, metre};
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use lattice::Lattice;
use ways::paid;

/// How far a descent goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps {
    /// Greatest step, as a share of the way.
    pub(super) from: f64,
    /// Least step.
    pub(super) to: f64,
    /// A gain below this share of the cost does not count.
    pub(super) gain: f64,
    /// Cost of a metre or degree beyond a limit at the greatest step, in metres flown. It grows as the step shrinks,
    /// and at the least step no cost makes up for it: so a short way that breaks limits is repaired where it is, not
    /// led round everything that gets in its way.
    pub(super) violation_m: f64,
}

/// By what share a route may still become cheaper when the greatest step gains no more; at half that step half as much.
const HOPE: f64 = 0.12;

/// Violation must shrink by this share for a sweep to be worth another: otherwise what cannot be repaired would shrink
/// by less and less for ever.
const MENDED: f64 = 1e-3;

/// As many sweeps in a row that all gain show that the step is short for the way that is left to go: then it is doubled.
const AFOOT: usize = 64;

/// Factor by which a violation becomes more expensive as the step is halved.
const DEARER: f64 = 8.0;

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

    /// Routes priced, for routes of `waypoints` free waypoints.
    pub(super) fn evaluations(&self, waypoints: usize) -> u64 {
        self.lattice.legs_priced.div_ceil(waypoints as u64 + 1)
    }

    /// Improve `route` by `steps` that shrink.
    pub(super) fn descend(&mut self, route: &mut Vec<Point3>, steps: Steps) -> Fitness {
        self.descend_unless_known(route, steps, &[])
            .expect("no route is known")
    }

    /// As [`Polish::descend`]; `None` as soon as the route has become the same as one of `known` that
    /// it does not beat, or is too dear to become as good as one.
    pub(super) fn descend_unless_known(
        &mut self,
        route: &mut Vec<Point3>,
        steps: Steps,
        known: &[Priced],
    ) -> Option<Fitness> {
        let scenario = self.model.scenario;
        let way = scenario.direct();
        let mut best = self.lattice.price(route);
        let mut rate = steps.violation_m * metre(scenario);
        let (mut step, mut kind, mut gained, mut failed) = (steps.from * way, 0, 0, 0);
        while step > steps.to * way && why_stop(scenario, self.stop).is_none() {
            let is_last = 0.5 * step <= steps.to * way;
            if is_last || rate <= 0.0 || best.is_feasible() {
                rate = f64::INFINITY;
            }
            let mut trial = route.clone();
            let mut better = false;
            if self
                .lattice
                .sweep(&mut trial, best.is_feasible(), rate, step, kind)
            {
                let next = self.lattice.price(&trial);
                let (new, old) = (paid(next, rate), paid(best, rate));
                if new.beats(&old) {
                    better = if new.violation < old.violation {
                        old.violation - new.violation > MENDED * old.violation
                    } else {
                        old.cost - new.cost > steps.gain * old.cost
                    };
                    best = next;
                    *route = trial;
                    let is_known = |(fitness, other): &Priced| {
                        !best.beats(fitness) && same(scenario, route, other)
                    };
                    if known.iter().any(is_known) {
                        return None;
                    }
                }
            }
            kind += 1;
            (gained, failed) = if better {
                (gained + 1, 0)
            } else {
                (0, failed + 1)
            };
            if gained >= AFOOT {
                step *= 2.0;
                gained = 0;
            }
            if failed >= 2 {
                let hope = 1.0 + HOPE * step / (steps.from * way);
                let is_out_of_reach = |(fitness, _): &Priced| {
                    fitness.is_feasible() && best.cost > fitness.cost * hope
                };
                if known.iter().any(is_out_of_reach) {
                    return None;
                }
                step *= 0.5;
                rate *= DEARER;
                failed = 0;
            }
        }
        Some(best)
    }
}
