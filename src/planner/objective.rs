//! Routes as an optimizer sees them: positions in, fitness out.

use super::Stop;
use super::blocks::{Blocks, Pricers};
use super::coding::{Cartesian, Coding};
use super::guide::Guide;
use super::kept::Kept;
use super::price::PRICED_FROM;
use super::watch::Watch;
use crate::cost::Model;
use crate::cost::batch::{LANES, Pricer};
use crate::geometry::Point3;
use crate::optimizer::{Bounds, Fitness, Objective, Random};

/// The routes of one scenario.
pub(super) struct Routes<'s> {
    pub(super) coding: Coding<'s>,
    /// Of a guided search.
    guide: Option<Guide<'s>>,
    pub(super) model: Model<'s>,
    pricers: Pricers<'s>,
    /// Of each thread.
    kept: Vec<Kept>,
    pub(super) watch: Watch<'s>,
}

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
        let coding = Coding::Cartesian(Cartesian::with_ends(model, waypoints));
        let guide = Guide::new(model, waypoints, seeds);
        Self::new(coding, Some(guide), model, stop)
    }

    fn new(
        coding: Coding<'s>,
        guide: Option<Guide<'s>>,
        model: &Model<'s>,
        stop: &'s dyn Stop,
    ) -> Self {
        let tolerance = model.tolerance.scaled(PRICED_FROM);
        let settings = &model.scenario.planner;
        let quadrature = settings.quadrature;
        let pricers = Pricers::new(Pricer::new(model, quadrature, tolerance));
        let legs = if pricers.is_hilly() {
            settings.population * (settings.waypoints + 1)
        } else {
            0
        };
        let threads = settings.threads.max(1);
        Self {
            coding,
            guide,
            pricers,
            model: model.clone(),
            kept: (0..threads).map(|_| Kept::of(legs)).collect(),
            watch: Watch::new(model.scenario, stop),
        }
    }

    fn price(&mut self, positions: &[f64], rivals: Option<&[Fitness]>, fitness: &mut [Fitness]) {
        let threads = self.model.scenario.planner.threads;
        if threads > 1 && fitness.len() >= WORTH_THREADS {
            return self.side_by_side(threads, positions, rivals, fitness);
        }
        let watch = &mut self.watch;
        Blocks::new(&self.coding, &self.pricers, &mut self.kept[0]).price(
            positions,
            rivals,
            fitness,
            |count| watch.may_price(count),
        );
    }

    /// Price all positions on several threads, as many at once as may be between two looks at the clock.
    fn side_by_side(
        &mut self,
        threads: usize,
        positions: &[f64],
        rivals: Option<&[Fitness]>,
        fitness: &mut [Fitness],
    ) {
        let dimension = self.coding.bounds().dimension();
        let at_once = usize::try_from(self.watch.stride).unwrap_or(usize::MAX);
        let at_once = at_once
            .clamp(WORTH_THREADS, fitness.len())
            .next_multiple_of(LANES);
        let batches = positions.chunks(at_once * dimension);
        for (idx, (positions, fitness)) in batches.zip(fitness.chunks_mut(at_once)).enumerate() {
            if self.watch.may_price(fitness.len()) {
                let first = idx * at_once;
                let rivals = rivals.map(|all| &all[first..first + fitness.len()]);
                self.share_out(threads, positions, rivals, fitness);
            } else {
                fitness.fill(Fitness::WORST);
            }
        }
    }

    /// Each thread prices a run of whole blocks; no price depends on which.
    fn share_out(
        &mut self,
        threads: usize,
        positions: &[f64],
        rivals: Option<&[Fitness]>,
        fitness: &mut [Fitness],
    ) {
        let (coding, pricers) = (&self.coding, &self.pricers);
        let dimension = coding.bounds().dimension();
        let share = fitness.len().div_ceil(threads).next_multiple_of(LANES);
        std::thread::scope(|scope| {
            let shares = positions.chunks(share * dimension).zip(&mut self.kept);
            for (idx, ((positions, kept), fitness)) in
                shares.zip(fitness.chunks_mut(share)).enumerate()
            {
                let rivals = rivals.map(|all| &all[idx * share..idx * share + fitness.len()]);
                scope.spawn(move || {
                    Blocks::new(coding, pricers, kept).price(positions, rivals, fitness, |_| true);
                });
            }
        });
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
        self.price(positions, None, fitness);
    }

    fn evaluate_against(&mut self, positions: &[f64], rivals: &[Fitness], fitness: &mut [Fitness]) {
        self.price(positions, Some(rivals), fitness);
    }
}
