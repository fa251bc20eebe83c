//! Routes as an optimizer sees them: positions in, fitness out.

use std::thread;

use parking_lot::Mutex;

use super::Stop;
use super::blocks::{Blocks, Pricers};
use super::coding::{Cartesian, Coding};
use super::guide::Guide;
use super::kept::Kept;
use super::price::pricer;
use super::watch::Watch;
use crate::cost::Model;
use crate::cost::batch::LANES;
use crate::geometry::Point3;
use crate::optimizer::{Bounds, Fitness, Objective, Random};

/// The routes of one scenario.
pub(super) struct Routes<'s> {
    pub(super) coding: Coding<'s>,
    /// Guide of a guided search.
    guide: Option<Guide<'s>>,
    pricers: Pricers<'s>,
    /// Known legs, for each pricing thread.
    kept: Vec<Kept>,
    pub(super) watch: Watch<'s>,
}

/// Fewer routes than this are not worth starting a thread.
const WORTH_THREADS: usize = 64;

impl<'s> Routes<'s> {
    /// For a plain search in the coding of its algorithm.
    pub(super) fn plain(model: &Model<'s>, stop: &'s dyn Stop) -> Self {
        let scenario = model.scenario;
        let coding = Coding::of(scenario, scenario.planner.waypoints);
        Self::new(coding, None, model, stop)
    }

    /// For a search in space that starts from `seeds`, all with the same number of waypoints, and whose local walk is a
    /// move of the route.
    pub(super) fn guided(model: &Model<'s>, stop: &'s dyn Stop, seeds: &[Vec<Point3>]) -> Self {
        let waypoints = seeds[0].len() - 2;
        let coding = Coding::Cartesian(Cartesian::with_ends(model, waypoints));
        let guide = Guide::new(model, seeds);
        Self::new(coding, Some(guide), model, stop)
    }

    fn new(
        coding: Coding<'s>,
        guide: Option<Guide<'s>>,
        model: &Model<'s>,
        stop: &'s dyn Stop,
    ) -> Self {
        let settings = &model.scenario.planner;
        let pricers = Pricers::new(pricer(model));
        let legs = if pricers.is_hilly() {
            settings.population * (settings.waypoints + 1)
        } else {
            0
        };
        // More threads would have nothing to do.
        let blocks = settings.population.div_ceil(LANES);
        let threads = settings.threads.clamp(1, blocks.max(1));
        Self {
            coding,
            guide,
            pricers,
            kept: (0..threads).map(|_| Kept::of(legs / threads)).collect(),
            watch: Watch::new(model.scenario, stop),
        }
    }

    fn price(&mut self, positions: &[f64], rivals: Option<&[Fitness]>, fitness: &mut [Fitness]) {
        if self.kept.len() > 1 && fitness.len() >= WORTH_THREADS {
            return self.side_by_side(positions, rivals, fitness);
        }
        let watch = &mut self.watch;
        Blocks::new(&self.coding, &self.pricers, &mut self.kept[0]).price(
            positions,
            rivals,
            fitness,
            |count| watch.may_price(count),
        );
    }

    /// Price all positions on several threads, as many at once as are allowed between two looks at the clock.
    fn side_by_side(
        &mut self,
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
                self.share_out(positions, rivals, fitness);
            } else {
                fitness.fill(Fitness::WORST);
            }
        }
    }

    /// Each thread, including this one, prices runs of whole blocks while there are any; no price depends on which
    /// thread it is. Where no more threads can be had, the others do the work.
    fn share_out(
        &mut self,
        positions: &[f64],
        rivals: Option<&[Fitness]>,
        fitness: &mut [Fitness],
    ) {
        let (coding, pricers) = (&self.coding, &self.pricers);
        let dimension = coding.bounds().dimension();
        let threads = self.kept.len();
        let share = fitness.len().div_ceil(threads).next_multiple_of(LANES);
        let shares = positions.chunks(share * dimension).zip(&mut self.kept);
        let shares = Mutex::new(shares.zip(fitness.chunks_mut(share)).enumerate());
        let next = || shares.lock().next();
        let price = || {
            while let Some((idx, ((positions, kept), fitness))) = next() {
                let first = idx * share;
                let rivals = rivals.map(|all| &all[first..first + fitness.len()]);
                Blocks::new(coding, pricers, kept).price(positions, rivals, fitness, |_| true);
            }
        };
        thread::scope(|scope| {
            for _ in 1..threads {
                let more = thread::Builder::new().spawn_scoped(scope, price);
                if more.is_err() {
                    break;
                }
            }
            price();
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
