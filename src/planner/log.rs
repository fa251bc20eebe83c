//! The curve of a run and its best route so far.

use super::price::price;
use super::{ConvergencePoint, Incumbent, Observer, Stop};
use crate::cost::Model;
use crate::geometry::Point3;
use crate::optimizer::{Fitness, Swarm};

/// What a run reports, and what it will deliver.
pub(super) struct Log<'o> {
    model: &'o Model<'o>,
    observer: &'o mut dyn Observer,
    pub(super) stop: &'o dyn Stop,
    pub(super) convergence: Vec<ConvergencePoint>,
    /// Start, free waypoints, target.
    pub(super) route: Vec<Point3>,
    pub(super) best: Fitness,
    /// The last route passed to the observer.
    reported: Option<Vec<Point3>>,
    /// Routes priced so far.
    pub(super) evaluations: u64,
    /// Whether something came after the last iteration, which its last point shows.
    pub(super) is_polished: bool,
    /// Whether it is proven that there is no way, so that nothing else need be tried.
    pub(super) is_closed: bool,
    /// Proven lower bound of a route's cost. Known only where the search makes use of it.
    pub(super) lower: Option<f64>,
}

impl<'o> Log<'o> {
    pub(super) fn new(
        model: &'o Model<'o>,
        observer: &'o mut dyn Observer,
        stop: &'o dyn Stop,
    ) -> Self {
        Self {
            model,
            observer,
            stop,
            convergence: Vec::new(),
            route: Vec::new(),
            best: Fitness::WORST,
            reported: None,
            evaluations: 0,
            is_polished: false,
            is_closed: false,
            lower: None,
        }
    }

    /// Whether the best so far is proven to be as near to the optimum as requested.
    pub(super) fn has_converged(&self) -> bool {
        let gap = self.model.scenario.planner.gap;
        let near = |lower: f64| self.best.cost <= lower * (1.0 + gap);
        gap > 0.0 && self.best.is_feasible() && self.lower.is_some_and(near)
    }

    /// Keep `route`, whose fitness was found in lanes, if it is the best so far; returns whether it is.
    pub(super) fn offer(&mut self, route: &[Point3], fitness: Fitness) -> bool {
        // What is reported and delivered is the scalar figure, to the last digit.
        (self.route.is_empty() || fitness.beats(&self.best))
            && self.keep_better(route, price(self.model, route))
    }

    fn keep_better(&mut self, route: &[Point3], fitness: Fitness) -> bool {
        let better = self.route.is_empty() || fitness.beats(&self.best);
        if better {
            self.route = route.to_vec();
            self.best = fitness;
        }
        better
    }

    /// As [`Log::offer`], for a route that is not priced yet.
    pub(super) fn offer_unpriced(&mut self, route: &[Point3]) -> bool {
        self.evaluations += 1;
        self.keep_better(route, price(self.model, route))
    }

    /// A point of the curve: the best so far, and how `swarm` fares.
    pub(super) fn point(&mut self, iteration: usize, swarm: &Swarm) {
        let members = swarm
            .fitness()
            .iter()
            .filter(|fitness| fitness.cost.is_finite());
        let count = members.clone().count() as f64;
        let mean_cost = members.clone().map(|fitness| fitness.cost).sum::<f64>() / count;
        let feasible = members.filter(|fitness| fitness.is_feasible()).count() as f64;
        self.record(iteration, mean_cost, feasible / count);
    }

    /// One more point for the last iteration, if something came after it: the curve ends with what is delivered.
    pub(super) fn last_point(&mut self) {
        if let Some(&last) = self.convergence.last()
            && self.is_polished
        {
            self.record(last.iteration, last.mean_cost, last.feasible_fraction);
        }
    }

    /// Tell the observer of a better route between two points of the curve.
    pub(super) fn tell(&mut self) {
        let iteration = self.convergence.last().map_or(0, |last| last.iteration);
        let elapsed_ms = self.stop.elapsed_ms();
        self.show(iteration, elapsed_ms);
    }

    /// A point of the curve whose swarm is known by its figures.
    pub(super) fn record(&mut self, iteration: usize, mean_cost: f64, feasible_fraction: f64) {
        let elapsed_ms = self.stop.elapsed_ms();
        let best = self.best;
        self.show(iteration, elapsed_ms);
        let point = ConvergencePoint {
            iteration,
            evaluations: self.evaluations,
            elapsed_ms,
            best_cost: best.is_feasible().then_some(best.cost),
            best_violation: best.violation,
            mean_cost,
            feasible_fraction,
        };
        self.observer.iteration(&point);
        self.convergence.push(point);
    }

    /// Pass the best route to the observer, unless it knows it.
    pub(super) fn show(&mut self, iteration: usize, elapsed_ms: f64) {
        if self.reported.as_ref() == Some(&self.route) {
            return;
        }
        self.observer.incumbent(&Incumbent {
            frame: self.model.scenario.frame.clone(),
            iteration,
            elapsed_ms,
            cost: self.best.cost,
            feasible: self.best.is_feasible(),
            waypoints: self.route.clone(),
        });
        self.reported = Some(self.route.clone());
    }
}
