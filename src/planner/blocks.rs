//! Positions priced side by side, a block of [`LANES`] at a time.
//!
//! Where a position matters only if it beats a rival, fuel and heights alone show that most do not; only the others are
//! priced, in blocks of their own. Above hills most of the time goes into the heights of legs, so routes are first
//! priced as if they kept them; of those that may still win, only legs with unknown heights are measured. No price
//! depends on which other positions are in a block.

use std::ops::Range;

use super::coding::Coding;
use super::kept::{End, Kept};
use crate::cost::batch::{LANES, PointRow, Price, Pricer, Row};
use crate::optimizer::Fitness;

/// Prices positions of one coding.
pub(super) struct Blocks<'a, 's> {
    coding: &'a Coding<'s>,
    pricers: &'a Pricers<'s>,
    kept: &'a mut Kept,
    hilly: bool,
    points: Vec<PointRow>,
    /// Elevation below free waypoints.
    ground: Vec<Row>,
    waiting: Waiting,
    /// Legs that keep their heights for certain, of the routes that have just been priced.
    proven: Vec<Row>,
    /// Legs of positions whose rivals break no limit, and of others.
    unmeasured: [Unmeasured; 2],
}

/// Routes that may be good enough, a block of them at most.
#[derive(Default)]
struct Waiting {
    points: Vec<PointRow>,
    /// Elevation below free waypoints.
    ground: Vec<Row>,
    /// The numbers of their positions.
    owners: Vec<usize>,
}

/// Legs of routes that may be good enough, in order.
#[derive(Default)]
struct Unmeasured {
    legs: Vec<Leg>,
    from: Vec<PointRow>,
    to: Vec<PointRow>,
    prices: Vec<Price>,
    /// Number of `legs` whose violation is not known.
    unknown: usize,
}

struct Leg {
    from: End,
    to: End,
    /// The number of its position.
    owner: usize,
    /// Its violation, where that is known.
    known: Option<f64>,
}

/// Number of legs measured at once.
const LEGS_AT_ONCE: usize = 16 * LANES;

/// What prices routes.
pub(super) struct Pricers<'s> {
    /// Prices in full.
    full: Pricer<'s>,
    /// For cases in which a route that breaks a limit is worth nothing.
    verdicts: Pricer<'s>,
}

impl<'s> Pricers<'s> {
    pub(super) fn new(full: Pricer<'s>) -> Self {
        Self {
            verdicts: full.clone().verdicts(),
            full,
        }
    }

    /// Whether heights take long to measure, so that remembering legs pays.
    pub(super) fn is_hilly(&self) -> bool {
        self.full.is_hilly()
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
            hilly: pricers.is_hilly(),
            points: Vec::new(),
            ground: Vec::new(),
            waiting: Waiting::default(),
            proven: Vec::new(),
            unmeasured: [Unmeasured::default(), Unmeasured::default()],
        }
    }

    /// Price `fitness.len()` positions, as [`Objective::evaluate_against`] says where there are `rivals`. `may_go_on`
    /// is asked before each block, with its size; a block that it refuses gets [`Fitness::WORST`].
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
            if let Some(rivals) = rivals {
                self.sift(first, count, rivals, fitness);
            } else {
                let owners = first..first + count;
                self.waiting
                    .take(&mut self.points, &mut self.ground, owners);
                self.price_waiting(None, fitness);
            }
            self.settle(LEGS_AT_ONCE, fitness);
        }
        self.price_waiting(rivals, fitness);
        self.settle(1, fitness);
    }

    /// Let those of the decoded routes wait that may beat their rivals; `first` is the number of the first position.
    fn sift(&mut self, first: usize, count: usize, rivals: &[Fitness], fitness: &mut [Fitness]) {
        let least = self.pricers.full.least_costs(&self.points, &self.ground);
        for (lane, &cost) in least.iter().enumerate().take(count) {
            let owner = first + lane;
            fitness[owner] = Fitness {
                violation: 0.0,
                cost,
            };
            if fitness[owner].beats(&rivals[owner]) {
                self.waiting.push(&self.points, &self.ground, lane, owner);
            }
            if self.waiting.owners.len() == LANES {
                self.price_waiting(Some(rivals), fitness);
            }
        }
    }

    /// Price the routes that wait, above hills as if they kept their heights.
    fn price_waiting(&mut self, rivals: Option<&[Fitness]>, fitness: &mut [Fitness]) {
        let Waiting {
            points,
            ground,
            owners,
        } = &mut self.waiting;
        if owners.is_empty() {
            return;
        }
        // Where a violation is worth nothing, it is not worth knowing exactly.
        let is_clear = |owner: &usize| rivals.is_some_and(|rivals| rivals[*owner].is_feasible());
        let pricer = if owners.iter().all(is_clear) {
            &self.pricers.verdicts
        } else {
            &self.pricers.full
        };
        let price = if self.hilly {
            pricer.routes_at_best(points, ground, owners.len(), &mut self.proven)
        } else {
            pricer.first_routes(points, owners.len())
        };
        for (lane, owner) in owners.drain(..).enumerate() {
            fitness[owner] = of_lane(&price, lane);
            let rival = rivals.map_or(Fitness::WORST, |rivals| rivals[owner]);
            if self.hilly && fitness[owner].beats(&rival) {
                let unmeasured = &mut self.unmeasured[usize::from(!rival.is_feasible())];
                unmeasured.push(points, lane, owner, &self.proven, self.kept);
            }
        }
    }

    /// Measure the waiting legs, if there are at least `count`.
    fn settle(&mut self, count: usize, fitness: &mut [Fitness]) {
        // Where a violation is worth nothing, it is not known exactly and not worth knowing.
        let ways = [(&self.pricers.verdicts, false), (&self.pricers.full, true)];
        for (unmeasured, (pricer, exact)) in self.unmeasured.iter_mut().zip(ways) {
            if unmeasured.legs.len() >= count {
                unmeasured.settle(pricer, exact, self.kept, fitness);
            }
        }
    }

    /// The routes of up to [`LANES`] positions.
    fn decode(&mut self, positions: &[f64], count: usize) {
        let dimension = self.coding.bounds().dimension();
        // Unused lanes repeat the last position.
        let lanes = std::array::from_fn(|lane| {
            let from = lane.min(count - 1) * dimension;
            &positions[from..from + dimension]
        });
        self.coding.decode_lanes(
            lanes,
            &self.pricers.full,
            &mut self.points,
            &mut self.ground,
        );
    }
}

impl Waiting {
    /// Take all of a block as it is, when none is waiting. What is left in its place is of no use.
    fn take(&mut self, points: &mut Vec<PointRow>, ground: &mut Vec<Row>, owners: Range<usize>) {
        std::mem::swap(&mut self.points, points);
        std::mem::swap(&mut self.ground, ground);
        self.owners.extend(owners);
    }

    /// Add the route in lane `lane` of `points`.
    fn push(&mut self, points: &[PointRow], ground: &[Row], lane: usize, owner: usize) {
        let place = self.owners.len();
        self.points.resize(points.len(), points[0]);
        self.ground.resize(ground.len(), [0.0; LANES]);
        for (own, row) in self.points.iter_mut().zip(points) {
            own.set(place, row.get(lane));
        }
        for (own, row) in self.ground.iter_mut().zip(ground) {
            own[place] = row[lane];
        }
        self.owners.push(owner);
    }
}

impl Unmeasured {
    /// Add the legs of the route in lane `lane` of `points`, except those that are `proven` or `kept`.
    fn push(
        &mut self,
        points: &[PointRow],
        lane: usize,
        owner: usize,
        proven: &[Row],
        kept: &Kept,
    ) {
        // The end of the leg before, where that was looked at.
        let mut before = None;
        for (rows, proven) in points.windows(2).zip(proven) {
            if proven[lane] > 0.0 {
                before = None;
                continue;
            }
            let [a, b] = [rows[0].get(lane), rows[1].get(lane)];
            let from = before.unwrap_or_else(|| End::at(a));
            let to = End::at(b);
            before = Some(to);
            let known = kept.violation(from, to);
            if known.is_some_and(|violation| violation <= 0.0) {
                continue;
            }
            if known.is_none() {
                let lane = self.unknown % LANES;
                if lane == 0 {
                    self.from.push(PointRow::splat(a));
                    self.to.push(PointRow::splat(b));
                } else {
                    let row = self.from.len() - 1;
                    self.from[row].set(lane, a);
                    self.to[row].set(lane, b);
                }
                self.unknown += 1;
            }
            self.legs.push(Leg {
                from,
                to,
                owner,
                known,
            });
        }
    }

    /// Measure them all, and add their violations to those of their positions, leg by leg.
    fn settle(&mut self, pricer: &Pricer, exact: bool, kept: &mut Kept, fitness: &mut [Fitness]) {
        self.prices.clear();
        self.prices.resize(self.from.len(), Price::ZERO);
        pricer.heights_of_legs(&self.from, &self.to, self.unknown, &mut self.prices);
        let mut measured = 0;
        for Leg {
            from,
            to,
            owner,
            known,
        } in self.legs.drain(..)
        {
            let violation = known.unwrap_or_else(|| {
                let violation = self.prices[measured / LANES].violation[measured % LANES];
                measured += 1;
                if exact || violation <= 0.0 {
                    kept.note(from, to, violation);
                }
                violation
            });
            fitness[owner].violation += violation;
        }
        self.from.clear();
        self.to.clear();
        self.unknown = 0;
    }
}

fn of_lane(price: &Price, lane: usize) -> Fitness {
    Fitness {
        violation: price.violation[lane],
        cost: price.cost[lane],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Model;
    use crate::optimizer::Random;
    use crate::planner::coding::Cartesian;
    use crate::planner::moves::Moves;
    use crate::planner::price::pricer;
    use crate::planner::tests::{hilly_scenario, scenario};
    use crate::planner::{Nobody, plan};
    use crate::scenario::Scenario;

    /// Whatever is known about legs, and whatever the rivals: a position that beats its rival has exactly the
    /// fitness it has when priced alone in full, and no other position beats its rival.
    #[test]
    fn a_position_that_beats_its_rival_is_priced_exactly() {
        for scenario in [hilly_scenario(), scenario()] {
            hold_to_prices_alone(&scenario);
        }
    }

    fn hold_to_prices_alone(scenario: &Scenario) {
        let model = Model::new(scenario);
        let pricer = pricer(&model);
        let pricers = Pricers::new(pricer.clone());
        let space = Cartesian::new(scenario, 6);
        let coding = Coding::Cartesian(space.clone());
        let dimension = coding.bounds().dimension();
        let in_full = |position: &[f64]| {
            let (mut points, mut ground) = (Vec::new(), Vec::new());
            coding.decode_lanes([position; LANES], &pricer, &mut points, &mut ground);
            of_lane(&pricer.routes(&points), 0)
        };
        let (mut kept, mut random) = (Kept::of(1), Random::new(5));
        let moves = Moves::new(&model);
        let mut positions = vec![0.0; 37 * dimension];
        let mut known = scenario.clone();
        known.planner.waypoints = 6;
        let known = plan(&known, &mut Nobody, &Nobody).waypoints;
        for (idx, position) in positions.chunks_exact_mut(dimension).enumerate() {
            if idx % 3 == 0 {
                coding.bounds().draw(&mut random, position);
            } else {
                space.encode(&known, position);
            }
        }
        let mut fitness = vec![Fitness::WORST; 37];
        let (mut won, mut lost) = (0, 0);
        for round in 0..30 {
            let rivals = fitness.clone();
            let mut found = rivals.clone();
            let against = (round > 0).then_some(&rivals[..]);
            Blocks::new(&coding, &pricers, &mut kept).price(
                &positions,
                against,
                &mut found,
                |_| true,
            );
            for (idx, position) in positions.chunks_exact(dimension).enumerate() {
                let own = in_full(position);
                if own.beats(&rivals[idx]) {
                    let bits =
                        |fitness: Fitness| [fitness.violation, fitness.cost].map(f64::to_bits);
                    assert_eq!(bits(found[idx]), bits(own));
                    fitness[idx] = own;
                    won += 1;
                } else {
                    assert!(!found[idx].beats(&rivals[idx]));
                    lost += 1;
                }
            }
            for position in positions.chunks_exact_mut(dimension) {
                moves.move_a_part(position, &mut random, 0.2);
                coding.bounds().clamp(position);
            }
        }
        assert!(won > 50 && lost > 50, "{won} {lost}");
    }
}
