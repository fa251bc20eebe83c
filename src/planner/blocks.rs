//! Positions priced side by side, a block of [`LANES`] at a time.
//!
//! Above hills most of the time goes into the heights of legs. Where a position matters only if it beats
//! a rival, it is first priced as if it kept them. Of the few that may win against a rival that breaks no
//! limit, only those legs are measured that are not known to keep their heights; the others are gathered into
//! blocks of their own and priced in full. No price depends on which other positions are in a block.

use super::coding::Coding;
use super::kept::Kept;
use crate::cost::batch::{LANES, PointRow, Price, Pricer};
use crate::geometry::Point3;
use crate::optimizer::Fitness;

/// Prices positions of one coding.
pub(super) struct Blocks<'a, 's> {
    coding: &'a Coding<'s>,
    pricers: &'a Pricers<'s>,
    kept: &'a mut Kept,
    points: Vec<PointRow>,
    waiting: Waiting,
    unmeasured: Unmeasured,
}

/// Routes that may beat rivals that break limits, not yet priced in full.
#[derive(Default)]
struct Waiting {
    points: Vec<PointRow>,
    /// Numbers of their positions.
    owners: Vec<usize>,
}

/// Legs of routes that beat rivals that break no limit, if these legs keep their heights.
#[derive(Default)]
struct Unmeasured {
    legs: Vec<(Point3, Point3)>,
    /// Numbers of the positions.
    owners: Vec<usize>,
    from: Vec<PointRow>,
    to: Vec<PointRow>,
    prices: Vec<Price>,
}

/// So many are measured at once.
const LEGS_AT_ONCE: usize = 16 * LANES;

/// What prices routes.
pub(super) struct Pricers<'s> {
    /// In full.
    full: Pricer<'s>,
    /// Where a route that breaks a limit is worth nothing.
    verdicts: Pricer<'s>,
}

impl<'s> Pricers<'s> {
    pub(super) fn new(full: Pricer<'s>) -> Self {
        Self {
            verdicts: full.clone().verdicts(),
            full,
        }
    }
}

impl<'a, 's> Blocks<'a, 's> {
    pub(super) fn new(
        coding: &'a Coding<'s>,
        pricers: &'a Pricers<'s>,
        kept: &'a mut Kept,
    ) -> Self {
        Self {
            coding,
            pricers,
            kept,
            points: Vec::new(),
            waiting: Waiting::default(),
            unmeasured: Unmeasured::default(),
        }
    }

    /// Price `fitness.len()` positions, as [`Objective::evaluate_against`] says where there are `rivals`.
    /// `may_go_on` is asked before each block, of so many; what it refuses is [`Fitness::WORST`].
    ///
    /// [`Objective::evaluate_against`]: crate::optimizer::Objective::evaluate_against
    pub(super) fn price(
        &mut self,
        positions: &[f64],
        rivals: Option<&[Fitness]>,
        fitness: &mut [Fitness],
        mut may_go_on: impl FnMut(usize) -> bool,
    ) {
        let block = LANES * self.coding.bounds().dimension();
        for (idx, positions) in positions.chunks(block).enumerate() {
            let first = idx * LANES;
            let count = LANES.min(fitness.len() - first);
            if !may_go_on(count) {
                fitness[first..first + count].fill(Fitness::WORST);
                continue;
            }
            self.decode(positions, count);
            let Some(rivals) = rivals else {
                let price = self.pricers.full.first_routes(&self.points, count);
                for lane in 0..count {
                    fitness[first + lane] = of_lane(&price, lane);
                }
                continue;
            };
            let price = self.pricers.full.routes_at_best(&self.points);
            for lane in 0..count {
                let (owner, at_best) = (first + lane, of_lane(&price, lane));
                fitness[owner] = at_best;
                if !at_best.beats(&rivals[owner]) {
                    continue;
                }
                if rivals[owner].is_feasible() {
                    self.unmeasured.push(&self.points, lane, owner, self.kept);
                } else {
                    self.waiting.push(&self.points, lane, owner);
                    if self.waiting.owners.len() == LANES {
                        self.waiting.settle(&self.pricers.full, fitness);
                    }
                }
            }
            if self.unmeasured.legs.len() >= LEGS_AT_ONCE {
                self.unmeasured
                    .settle(&self.pricers.verdicts, self.kept, fitness);
            }
        }
        self.unmeasured
            .settle(&self.pricers.verdicts, self.kept, fitness);
        self.waiting.settle(&self.pricers.full, fitness);
    }

    /// The routes of up to [`LANES`] positions.
    fn decode(&mut self, positions: &[f64], count: usize) {
        let dimension = self.coding.bounds().dimension();
        // Spare lanes repeat the last position.
        let lanes = std::array::from_fn(|lane| {
            let from = lane.min(count - 1) * dimension;
            &positions[from..from + dimension]
        });
        self.coding
            .decode_lanes(lanes, &self.pricers.full, &mut self.points);
    }
}

impl Waiting {
    /// Add the route of lane `lane` of `points`.
    fn push(&mut self, points: &[PointRow], lane: usize, owner: usize) {
        let own = self.owners.len();
        self.points
            .resize(points.len(), PointRow::splat(Point3::origin()));
        for (row, points) in self.points.iter_mut().zip(points) {
            row.set(own, points.get(lane));
        }
        self.owners.push(owner);
    }

    /// Price them all in full.
    fn settle(&mut self, pricer: &Pricer, fitness: &mut [Fitness]) {
        if self.owners.is_empty() {
            return;
        }
        let price = pricer.first_routes(&self.points, self.owners.len());
        for (lane, owner) in self.owners.drain(..).enumerate() {
            fitness[owner] = of_lane(&price, lane);
        }
    }
}

impl Unmeasured {
    /// Add those legs of the route in lane `lane` of `points` that are not `kept`.
    fn push(&mut self, points: &[PointRow], lane: usize, owner: usize, kept: &Kept) {
        for ends in points.windows(2) {
            let (a, b) = (ends[0].get(lane), ends[1].get(lane));
            if !kept.knows(a, b) {
                self.legs.push((a, b));
                self.owners.push(owner);
            }
        }
    }

    /// Measure them all; a route one of whose legs does not keep its heights breaks a limit.
    fn settle(&mut self, pricer: &Pricer, kept: &mut Kept, fitness: &mut [Fitness]) {
        self.from.clear();
        self.to.clear();
        for legs in self.legs.chunks(LANES) {
            let (mut from, mut to) = (PointRow::splat(legs[0].0), PointRow::splat(legs[0].1));
            for (lane, &(a, b)) in legs.iter().enumerate() {
                from.set(lane, a);
                to.set(lane, b);
            }
            self.from.push(from);
            self.to.push(to);
        }
        self.prices.clear();
        self.prices.resize(self.from.len(), Price::ZERO);
        pricer.heights_of_legs(&self.from, &self.to, self.legs.len(), &mut self.prices);
        for (idx, ((a, b), owner)) in self.legs.drain(..).zip(self.owners.drain(..)).enumerate() {
            let violation = self.prices[idx / LANES].violation[idx % LANES];
            if violation > 0.0 {
                fitness[owner].violation += violation;
            } else {
                kept.note(a, b);
            }
        }
    }
}

fn of_lane(price: &Price, lane: usize) -> Fitness {
    Fitness {
        violation: price.violation[lane],
        cost: price.cost[lane],
    }
}
