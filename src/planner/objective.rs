//! Routes as an optimizer sees them: positions in, fitness out.

use super::coding::{Cartesian, Coding};
use super::guide::Guide;
use super::price::{PRICED_FROM, price};
use super::{Stop, why_stop};
use crate::cost::Model;
use crate::cost::batch::{LANES, PointRow, Pricer};
use crate::geometry::Point3;
use crate::optimizer::{Bounds, Fitness, Objective, Random};
use crate::scenario::Scenario;
use crate::terrain::Terrain;
use crate::threat::Shape;

/// The routes of one scenario.
pub(super) struct Routes<'s> {
    pub(super) coding: Coding<'s>,
    /// Of a guided search.
    guide: Option<Guide<'s>>,
    pub(super) model: Model<'s>,
    pricer: Pricer<'s>,
    route: Vec<Point3>,
    points: Vec<PointRow>,
    stop: &'s dyn Stop,
    /// Evaluations between two looks at the clock.
    stride: u64,
    /// Routes priced so far.
    pub(super) evaluations: u64,
    /// Whether the run was stopped within an iteration: what was left of it is [`Fitness::WORST`].
    pub(super) interrupted: bool,
}

/// So many steps, each some nanoseconds, may pass between two looks at the clock.
const STEPS_UNWATCHED: usize = 1_000_000;

/// Fewer routes are not worth the start of a thread.
const WORTH_THREADS: usize = 64;

impl<'s> Routes<'s> {
    /// Of a plain search in the coding of its algorithm.
    pub(super) fn plain(model: &Model<'s>, stop: &'s dyn Stop) -> Self {
        let scenario = model.scenario;
        let coding = Coding::of(scenario, scenario.planner.waypoints);
        Self::new(coding, None, model, stop)
    }

    /// Of a search in space that starts from `seeds`, all with as many waypoints, and whose local
    /// walk is a move of the route.
    pub(super) fn guided(model: &Model<'s>, stop: &'s dyn Stop, seeds: &[Vec<Point3>]) -> Self {
        let waypoints = seeds[0].len() - 2;
        let coding = Coding::Cartesian(Cartesian::new(model.scenario, waypoints));
        let guide = Guide::new(model.scenario, waypoints, seeds);
        Self::new(coding, Some(guide), model, stop)
    }

    fn new(
        coding: Coding<'s>,
        guide: Option<Guide<'s>>,
        model: &Model<'s>,
        stop: &'s dyn Stop,
    ) -> Self {
        let tolerance = model.tolerance.scaled(PRICED_FROM);
        let quadrature = model.scenario.planner.quadrature;
        let stride = (STEPS_UNWATCHED / steps(model.scenario)).max(1) as u64;
        Self {
            coding,
            guide,
            pricer: Pricer::new(model, quadrature, tolerance),
            model: model.clone(),
            route: Vec::new(),
            points: Vec::new(),
            stop,
            stride,
            evaluations: 0,
            interrupted: false,
        }
    }

    /// Whether the next `count` routes may be priced; looks at the clock now and then.
    fn may_go_on(&mut self, count: usize) -> bool {
        let since = self.evaluations % self.stride;
        // There is always one route to deliver.
        let due = self.evaluations > 0 && (since == 0 || since + count as u64 > self.stride);
        if due && !self.interrupted {
            self.interrupted = why_stop(self.model.scenario, self.stop).is_some();
        }
        !self.interrupted
    }

    /// Price all positions on several threads, each a run of whole blocks; no price depends on which.
    fn side_by_side(&mut self, threads: usize, positions: &[f64], fitness: &mut [Fitness]) {
        if !self.may_go_on(fitness.len()) {
            return fitness.fill(Fitness::WORST);
        }
        self.evaluations += fitness.len() as u64;
        let (coding, pricer) = (&self.coding, &self.pricer);
        let dimension = coding.bounds().dimension();
        let share = fitness.len().div_ceil(threads).next_multiple_of(LANES);
        std::thread::scope(|scope| {
            let shares = positions.chunks(share * dimension);
            for (positions, fitness) in shares.zip(fitness.chunks_mut(share)) {
                scope.spawn(move || {
                    let mut points = Vec::new();
                    let blocks = positions.chunks(LANES * dimension);
                    for (positions, fitness) in blocks.zip(fitness.chunks_mut(LANES)) {
                        price_block(coding, pricer, positions, &mut points, fitness);
                    }
                });
            }
        });
    }

    /// As `price_block`, where a single route takes long: between two of them a run may end.
    fn one_by_one(&mut self, positions: &[f64], fitness: &mut [Fitness]) {
        let dimension = self.coding.bounds().dimension();
        let mut route = std::mem::take(&mut self.route);
        for (position, fitness) in positions.chunks_exact(dimension).zip(fitness) {
            if self.may_go_on(1) {
                self.coding.decode(position, &mut route);
                *fitness = price(&self.model, &route);
                self.evaluations += 1;
            } else {
                *fitness = Fitness::WORST;
            }
        }
        self.route = route;
    }
}

impl Objective for Routes<'_> {
    fn bounds(&self) -> &Bounds {
        self.coding.bounds()
    }

    fn draw(&mut self, random: &mut Random, position: &mut [f64]) {
        match &mut self.guide {
            Some(guide) => guide.draw(random, position),
            None => self.coding.bounds().draw(random, position),
        }
    }

    fn walks(&self) -> bool {
        self.guide.is_some()
    }

    fn walk(&mut self, random: &mut Random, base: &[f64], size: f64, candidate: &mut [f64]) {
        if let Some(guide) = &self.guide {
            guide.walk(random, base, size, candidate);
        }
    }

    fn evaluate(&mut self, positions: &[f64], fitness: &mut [Fitness]) {
        let dimension = self.coding.bounds().dimension();
        let threads = self.model.scenario.planner.threads;
        if threads > 1 && fitness.len() >= WORTH_THREADS && self.stride >= fitness.len() as u64 {
            return self.side_by_side(threads, positions, fitness);
        }
        let blocks = positions.chunks(LANES * dimension);
        let mut points = std::mem::take(&mut self.points);
        for (positions, fitness) in blocks.zip(fitness.chunks_mut(LANES)) {
            if self.stride < LANES as u64 {
                self.one_by_one(positions, fitness);
                continue;
            }
            if self.may_go_on(fitness.len()) {
                price_block(&self.coding, &self.pricer, positions, &mut points, fitness);
                self.evaluations += fitness.len() as u64;
            } else {
                fitness.fill(Fitness::WORST);
            }
        }
        self.points = points;
    }
}

/// Price the routes of up to [`LANES`] positions side by side. It depends on each position alone.
fn price_block(
    coding: &Coding,
    pricer: &Pricer,
    positions: &[f64],
    points: &mut Vec<PointRow>,
    fitness: &mut [Fitness],
) {
    let dimension = coding.bounds().dimension();
    // Spare lanes repeat the last position.
    let own = |lane: usize| {
        let from = lane.min(fitness.len() - 1) * dimension;
        &positions[from..from + dimension]
    };
    let lanes = std::array::from_fn(own);
    coding.decode_lanes(lanes, pricer, points);
    let price = pricer.routes(points);
    for (lane, fitness) in fitness.iter_mut().enumerate() {
        *fitness = Fitness {
            violation: price.violation[lane],
            cost: price.cost[lane],
        };
    }
}

/// About how many steps the pricing of one route takes.
fn steps(scenario: &Scenario) -> usize {
    let vertices = |shape: &Shape| match shape {
        Shape::Cylinder(_) => 1,
        Shape::Polygon(polygon) => 10 * polygon.vertices().len(),
    };
    let threats: usize = scenario
        .threats
        .iter()
        .map(|threat| vertices(&threat.shape))
        .sum();
    let ground = match &scenario.terrain {
        Terrain::Flat(_) => 1,
        Terrain::Peaks(peaks) => 100 * (1 + peaks.peaks.len()),
        Terrain::Grid(grid) => grid.columns + grid.rows,
        Terrain::Dem(dem) => dem.raster().lattice.columns + dem.raster().lattice.rows,
    };
    (scenario.planner.waypoints + 1) * (1 + threats + ground)
}
