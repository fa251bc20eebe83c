//! The last metres of a route whose shape the vehicle's limits decide: Newton's method.
//!
//! Where turns, climbs or short legs are at their limit, waypoints cannot be moved one by one, nor each by one of a few
//! steps: to turn a bend as a whole, each of its waypoints has to go another way. Here all of them move at once, along
//! the solution of the linear equations that the second derivatives of cost and limits make. Limits that are
//! broken or felt are priced by an augmented Lagrangian; the matrix is banded, so that a step costs as much as
//! pricing a few dozen routes.
//!
//! Sources: M. Powell (1969) and M. Hestenes (1969) for the multipliers; H. Nielsen, "Damping parameter in
//! Marquardt's method" (1999), for the damping.

mod banded;
mod deals;
mod descent;
mod effort;
mod equations;
mod legs;
mod limits;
mod mend;
mod merit;
#[cfg(test)]
mod tests;

use super::price::{price, search_tolerance};
use super::{Stop, why_stop};
use crate::cost::batch::Pricer;
use crate::cost::{Model, metre};
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use deals::deals;
pub(super) use deals::dealt;
use effort::Effort;
use legs::Legs;
use limits::{Limit, Limits};
use merit::Prices;

/// A waypoint: east, north and height above ground; start and target are where they are.
#[derive(Clone, Copy)]
struct Place {
    at: Point3,
    /// Slope of the ground below, east and north.
    slope: [f64; 2],
}

/// Maximum number of updates of the multipliers.
const ROUNDS: usize = 14;

/// A route that costs more than another by this share is given up as too expensive.
const HOPE: f64 = 0.003;

/// Damping at the start of a search, as a share of how much the cost bends with each coordinate.
const DAMPING: f64 = 0.1;

/// Greatest damping that a round begins with.
const MOST_DAMPING: f64 = 1e2;

/// If breaches repeatedly shrink to no less than this share, no way within the limits is near.
const LOST: f64 = 0.7;

/// Differences are taken over this share of the way.
const STEP: f64 = 2e-5;

/// A limit within this share of being reached is felt.
const FELT: f64 = 2e-3;

/// A route this near to its limits, as a share of the way, is mended and finished.
const KEPT: f64 = 1e-6;

/// Initial price of a breach of the hundredth of the way, a metre of it in metres flown: usual, low so that a route may
/// first bend as if limits were wider, and high for routes that get lost with the others.
const USUAL: f64 = 5.0;
const LOW: f64 = 1.0;
const HIGH: f64 = 500.0;

/// Waypoints are not redistributed where a metre more of any leg would save less than this many metres flown.
const SLIGHT: f64 = 0.2;

/// Least weight of a metre flown relative to the other weights, in the scales of the method.
const FREE: f64 = 0.01;

/// Factor by which breaches become more expensive when they have not shrunk to a quarter.
const DEARER: f64 = 3.0;

/// Gain of a round that is worth another, as a share of the cost.
const WORTH: f64 = 3e-6;

/// Searches for the best route near one.
pub(super) struct Newton<'m, 's> {
    model: &'m Model<'s>,
    pricer: Pricer<'s>,
    stop: &'m dyn Stop,
    effort: &'static Effort,
    /// Approximate number of routes priced.
    pub(super) evaluations: u64,
}

impl<'m, 's> Newton<'m, 's> {
    pub(super) fn new(model: &'m Model<'s>, stop: &'m dyn Stop) -> Self {
        // Climbs are limits of the vehicle, handled separately.
        let mut blind = search_tolerance(model);
        blind.angle_deg = 360.0;
        Self {
            pricer: Pricer::new(model, model.scenario.planner.quadrature, blind),
            model,
            stop,
            effort: Effort::of(model),
            evaluations: 0,
        }
    }

    /// Improve `route`, or replace it by what one of `others` becomes; it stays as it is where nothing better that
    /// keeps the limits is found.
    pub(super) fn improve(&mut self, route: &mut Vec<Point3>, others: &[Vec<Point3>]) -> Fitness {
        let mut best = price(self.model, route);
        let (original, mut forces) = (route.clone(), Vec::new());
        let mut better = false;
        for &rate in self.effort.rates {
            if self.is_stopped() {
                break;
            }
            let found = self.search(&original, rate, f64::INFINITY);
            better |= self.take(found, route, &mut best, &mut forces);
        }
        if !better && !self.is_stopped() {
            let found = self.search(&original, HIGH, f64::INFINITY);
            self.take(found, route, &mut best, &mut forces);
        }
        for other in others {
            if self.is_over() {
                break;
            }
            let found = self.search(other, USUAL, known(best));
            self.take(found, route, &mut best, &mut forces);
        }
        for &rate in self.effort.rates {
            self.deal(rate, route, &mut best, &mut forces);
        }
        best
    }

    /// Bring `route` within the limits; it stays as it is where that does not come nearer to them.
    pub(super) fn reach(&mut self, route: &mut Vec<Point3>) -> Fitness {
        let mut best = price(self.model, route);
        let original = route.clone();
        for rate in [USUAL, HIGH] {
            if self.is_stopped() {
                break;
            }
            let found = self.search(&original, rate, f64::INFINITY);
            self.take(found, route, &mut best, &mut Vec::new());
            if best.is_feasible() {
                break;
            }
        }
        best
    }

    /// Put waypoints of `route` where limits are felt, for as long as that makes it better.
    fn deal(
        &mut self,
        rate: f64,
        route: &mut Vec<Point3>,
        best: &mut Fitness,
        forces: &mut Vec<f64>,
    ) {
        let slight = SLIGHT * metre(self.model.scenario);
        let mut better = true;
        while better && forces.iter().any(|force| *force > slight) {
            better = false;
            for deal in deals(self.effort, forces, route) {
                if better || self.is_over() {
                    break;
                }
                let found = self.search(&deal, rate, known(*best));
                better = self.take(found, route, best, forces);
            }
        }
    }

    /// Whether nothing more may begin: as many routes were priced as the effort allows, or the run is to end.
    fn is_over(&self) -> bool {
        let settings = &self.model.scenario.planner;
        let budget = self.effort.budgets * (settings.population * settings.iterations) as u64;
        self.evaluations >= budget || self.is_stopped()
    }

    /// Whether the run is to end.
    fn is_stopped(&self) -> bool {
        why_stop(self.model.scenario, self.stop).is_some()
    }

    /// Keep what a search `found` if it is better than the best so far, the `route`.
    fn take(
        &mut self,
        (found, forces): (Vec<Point3>, Vec<f64>),
        route: &mut Vec<Point3>,
        best: &mut Fitness,
        kept: &mut Vec<f64>,
    ) -> bool {
        let is_finite = |point: &Point3| point.coords.iter().all(|value| value.is_finite());
        if !found.iter().all(is_finite) {
            return false;
        }
        let fitness = price(self.model, &found);
        self.evaluations += 1;
        let better = fitness.cost.is_finite() && fitness.beats(best);
        if better {
            (*route, *best, *kept) = (found, fitness, forces);
        }
        better
    }

    /// The best route near `route`, and the forces of limits along each of its legs; given up where it would cost more
    /// than `known`.
    fn search(&mut self, route: &[Point3], rate: f64, known: f64) -> (Vec<Point3>, Vec<f64>) {
        let way = self.way();
        let limits = Limits::of(self.model, route.len() - 2);
        let mut prices = Prices::new(route.len(), rate * self.dear());
        let mut places = self.places(route);
        let mut damping = DAMPING;
        let (mut worst, mut cost, mut lost) = (f64::INFINITY, f64::INFINITY, 0);
        let legs = route.len() - 1;
        let mut forces = vec![0.0; legs];
        for round in 0..ROUNDS {
            let merit = self.descend(&mut places, &limits, &prices, &mut damping);
            // What is still beyond limits makes a route cheap, and costs more from round to round.
            let is_dear = round >= self.effort.patience && merit.value > known * (1.0 + HOPE);
            if is_dear || self.is_stopped() {
                break;
            }
            self.feel(&limits, &places, &mut prices);
            let felt = prices.felt(legs);
            // In the end, when breaches are dear, a hair to the inside is enough for no limit to be felt any more.
            if felt.iter().any(|force| *force > 0.0) {
                forces = felt;
            }
            damping = damping.min(MOST_DAMPING);
            let gained = (cost - merit.value).abs();
            if merit.worst < KEPT * way && gained < WORTH * merit.value.abs() {
                break;
            }
            if merit.worst > 0.25 * worst {
                prices.rate *= DEARER;
                lost = if merit.worst > LOST * worst {
                    lost + 1
                } else {
                    0
                };
                if lost == 3 {
                    break;
                }
            }
            (worst, cost) = (merit.worst, merit.value);
        }
        self.settle(&mut places, &prices.lifts);
        self.mend(&mut places, &limits, &prices.limits);
        (self.route(&places), forces)
    }

    fn legs(&self) -> Legs<'_, 's> {
        Legs {
            pricer: &self.pricer,
            step: STEP * self.way(),
            min_leg: self.model.scenario.vehicle.min_leg,
            tolerance: search_tolerance(self.model).length_m,
        }
    }

    /// Cost of a metre flown, over the hundredth of the way; where fuel is free, a little of the other weights.
    fn dear(&self) -> f64 {
        let weights = &self.model.scenario.weights;
        let least = FREE * weights.threat.max(weights.altitude);
        metre(self.model.scenario).max(least) / (1e-2 * self.way())
    }

    fn way(&self) -> f64 {
        self.model.scenario.direct()
    }

    fn places(&self, route: &[Point3]) -> Vec<Place> {
        let last = route.len() - 1;
        let ground = legs::ground(&self.pricer, &route[1..last]);
        let mut places: Vec<Place> = route
            .iter()
            .map(|&at| Place {
                at,
                slope: [0.0; 2],
            })
            .collect();
        for (place, ground) in places[1..last].iter_mut().zip(ground) {
            place.at.z -= ground;
        }
        places
    }

    fn route(&self, places: &[Place]) -> Vec<Point3> {
        let last = places.len() - 1;
        let mut route: Vec<Point3> = places.iter().map(|place| place.at).collect();
        let ground = legs::ground(&self.pricer, &route[1..last]);
        for (point, ground) in route[1..last].iter_mut().zip(ground) {
            point.z += ground;
        }
        route
    }
}

/// Whether the limits of turning and climbing influence the shape of `route`.
pub(super) fn is_felt(model: &Model, route: &[Point3]) -> bool {
    let limits = Limits::of(model, route.len() - 2);
    let way = model.scenario.direct();
    let reach = -FELT * way / (route.len() - 1) as f64;
    limits::all(route.len()).into_iter().any(|limit| {
        // Neither needs heights above ground.
        matches!(limit, Limit::Climb { .. } | Limit::Turn { .. })
            && limits.beyond(limit, &[], route) > reach
    })
}

/// Maximum cost of a route that may still become better than the best.
fn known(best: Fitness) -> f64 {
    if best.is_feasible() {
        best.cost
    } else {
        f64::INFINITY
    }
}
