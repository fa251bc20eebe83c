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
mod legs;
mod limits;

use super::price::{PRICED_FROM, price};
use super::{Stop, why_stop};
use crate::cost::batch::Pricer;
use crate::cost::{Model, metre};
use crate::geometry::Point3;
use crate::optimizer::Fitness;
use banded::Banded;
use legs::Legs;
use limits::{Limit, Limits, NEAR};

/// A waypoint: east, north and height above ground; start and target are where they are.
#[derive(Clone, Copy)]
struct Place {
    at: Point3,
    /// Of the ground below, east and north.
    slope: [f64; 2],
}

/// Multipliers are set so many times at most.
const ROUNDS: usize = 14;

/// A route that costs more than another by this share is given up as dear, after so many rounds.
const HOPE: f64 = 0.01;
const SURE: usize = 2;

/// Where breaches shrink to no less than this share, time after time, no way within the limits is near.
const LOST: f64 = 0.7;

/// Steps between, at most.
const STEPS: usize = 12;

/// Differences are taken over this share of the way.
const STEP: f64 = 2e-5;

/// A limit that is this near, as a share of it, is felt.
const FELT: f64 = 2e-3;

/// A route this near to its limits, as a share of the way, is mended and done.
const KEPT: f64 = 1e-6;

/// Limits that a route is brought back within are kept by this share of the way.
const MARGIN: f64 = 5e-9;

/// How dear a breach of the hundredth of the way is to begin with, a metre of it in metres flown. Where too little,
/// a route may lose its way among hills; with more, it bends no more than it has to.
const RATES: [f64; 2] = [5.0, 500.0];

/// Steps that bring a route within its limits, at most.
const MENDS: usize = 8;

/// Of a square metre beyond a limit the share that a square metre of moving counts as.
const LEAST: f64 = 1e-9;

/// Searches with a waypoint put elsewhere, at most.
const DEALS: usize = 20;

/// Legs that it may be put on.
const PLACES: usize = 4;

/// What is gained in a round that is worth another, as a share of the cost.
const WORTH: f64 = 1e-6;

/// Searches for the best route near one.
pub(super) struct Newton<'m, 's> {
    model: &'m Model<'s>,
    pricer: Pricer<'s>,
    stop: &'m dyn Stop,
    /// Routes priced, about.
    pub(super) evaluations: u64,
}

/// Linear equations for a step of all free waypoints.
struct Equations {
    free: usize,
    /// Second derivatives.
    matrix: Banded,
    /// Negative first ones.
    down: Vec<f64>,
}

/// What the method makes smaller, at one place.
struct Merit {
    value: f64,
    /// Greatest breach, metres.
    worst: f64,
}

/// Multipliers, and how dear breaches are, a unit of cost for a square metre.
struct Prices {
    limits: Vec<Limit>,
    multipliers: Vec<f64>,
    rate: f64,
    /// Kinks of the altitude cost are rounded off so far about, metres.
    rounding: f64,
}

impl<'m, 's> Newton<'m, 's> {
    pub(super) fn new(model: &'m Model<'s>, stop: &'m dyn Stop) -> Self {
        let tolerance = model.tolerance.scaled(PRICED_FROM);
        // Climbs are limits of the vehicle, looked at apart.
        let mut blind = tolerance;
        blind.angle_deg = 360.0;
        Self {
            pricer: Pricer::new(model, model.scenario.planner.quadrature, blind),
            model,
            stop,
            evaluations: 0,
        }
    }

    /// Whether a limit of the vehicle has a say in the shape of `route`.
    pub(super) fn is_felt(&self, route: &[Point3]) -> bool {
        let limits = Limits::of(self.model, route.len() - 2);
        let places = self.places(route);
        let reach = -FELT * self.way() / (route.len() - 1) as f64;
        limits.all(route.len()).into_iter().any(|limit| {
            matches!(limit, Limit::Climb { .. } | Limit::Turn { .. })
                && limits.beyond(limit, &places, route) > reach
        })
    }

    /// Improve `route`; as it is, where nothing better that keeps the limits is found.
    pub(super) fn improve(&mut self, route: &mut Vec<Point3>) -> Fitness {
        let mut best = price(self.model, route);
        let mut forces = Vec::new();
        for rate in RATES {
            let found = self.search(route, rate, f64::INFINITY);
            if self.take(found, route, &mut best, &mut forces) {
                break;
            }
        }
        let mut left = DEALS;
        while left > 0 && !forces.is_empty() {
            let mut better = false;
            for deal in deals(&forces, route) {
                left -= 1;
                let found = self.search(&deal, RATES[0], best.cost);
                better = self.take(found, route, &mut best, &mut forces);
                if better || left == 0 {
                    break;
                }
            }
            if !better {
                break;
            }
        }
        best
    }

    /// Keep what a search `found` if it is better than the best so far, the `route`.
    fn take(
        &mut self,
        (found, forces): (Vec<Point3>, Vec<f64>),
        route: &mut Vec<Point3>,
        best: &mut Fitness,
        kept: &mut Vec<f64>,
    ) -> bool {
        let fitness = price(self.model, &found);
        self.evaluations += 1;
        let better = fitness.beats(best);
        if better {
            (*route, *best, *kept) = (found, fitness, forces);
        }
        better
    }

    /// The best route near `route`, and what is felt of limits along each of its legs; given up where it would cost
    /// more than `known`.
    fn search(&mut self, route: &[Point3], rate: f64, known: f64) -> (Vec<Point3>, Vec<f64>) {
        let way = self.way();
        let limits = Limits::of(self.model, route.len() - 2);
        let all = limits.all(route.len());
        let mut prices = Prices {
            multipliers: vec![0.0; all.len()],
            limits: all,
            rate: rate * metre(self.model.scenario) / (1e-2 * way),
            rounding: 1e-3 * way,
        };
        let mut places = self.places(route);
        let mut damping = metre(self.model.scenario) / (1e-2 * way);
        let (mut worst, mut cost, mut lost) = (f64::INFINITY, f64::INFINITY, 0);
        for round in 0..ROUNDS {
            let merit = self.descend(&mut places, &limits, &prices, &mut damping);
            // What is still beyond limits makes a route cheap, and costs more from round to round.
            let is_dear = round >= SURE && merit.value > known * (1.0 + HOPE);
            if is_dear || why_stop(self.model.scenario, self.stop).is_some() {
                break;
            }
            let route = self.route(&places);
            for (limit, multiplier) in prices.limits.iter().zip(&mut prices.multipliers) {
                let beyond = limits.beyond(*limit, &places, &route);
                *multiplier = (*multiplier + prices.rate * beyond).max(0.0);
            }
            let gained = (cost - merit.value).abs();
            if merit.worst < KEPT * way && gained < WORTH * merit.value.abs() {
                break;
            }
            if merit.worst > 0.25 * worst {
                prices.rate *= 5.0;
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
            prices.rounding = (0.3 * prices.rounding).max(1e-7 * way);
        }
        self.settle(&mut places, 20.0 * prices.rounding);
        self.mend(&mut places, &limits, &prices.limits);
        (self.route(&places), prices.felt(route.len() - 1))
    }

    /// Put heights that are `near` the middle of the band there: its kink was rounded off.
    fn settle(&self, places: &mut [Place], near: f64) {
        let band = self.model.scenario.altitude;
        let middle = 0.5 * (band.min + band.max);
        let last = places.len() - 1;
        for place in &mut places[1..last] {
            if (place.at.z - middle).abs() < near {
                place.at.z = middle;
            }
        }
    }

    /// Move `places` as little as brings them within `all` limits: Gauss and Newton's method on what is beyond.
    fn mend(&mut self, places: &mut [Place], limits: &Limits, all: &[Limit]) {
        let margin = MARGIN * self.way();
        let free = places.len() - 2;
        // What was beyond once must not be again: its limit is kept as it is, to either side.
        let mut held = vec![false; all.len()];
        for _ in 0..MENDS {
            let slopes = self.legs().slopes(places);
            self.evaluations += 28;
            let route = self.route(places);
            let mut equations = Equations::new(free);
            let mut is_beyond = false;
            for (leg, slopes) in slopes.iter().enumerate() {
                if slopes.beyond > 0.0 {
                    is_beyond = true;
                    equations.bring_back(leg, &slopes.away, slopes.beyond + margin);
                }
            }
            for (limit, held) in all.iter().zip(&mut held) {
                let beyond = limits.beyond(*limit, places, &route);
                *held |= beyond > -margin;
                if *held {
                    is_beyond |= beyond > 0.0;
                    let slope = limits.slope(*limit, places, &route);
                    equations.bring_back(slope.first, &slope.gradient, beyond + margin);
                }
            }
            if !is_beyond {
                break;
            }
            let Some(step) = equations.matrix.solve(LEAST, &equations.down) else {
                break;
            };
            advance(places, &step);
        }
    }

    /// Steps until none gains.
    fn descend(
        &mut self,
        places: &mut Vec<Place>,
        limits: &Limits,
        prices: &Prices,
        damping: &mut f64,
    ) -> Merit {
        let mut merit = self.merit(places, limits, prices);
        let mut growth = 2.0;
        for _ in 0..STEPS {
            let Equations { matrix, down, .. } = self.equations(places, limits, prices);
            let mut gained = None;
            for _ in 0..20 {
                let Some(step) = matrix.solve(*damping, &down) else {
                    *damping *= growth;
                    growth *= 2.0;
                    continue;
                };
                let expected: f64 = step
                    .iter()
                    .zip(&down)
                    .map(|(step, down)| 0.5 * step * (*damping * step + down))
                    .sum();
                if expected < 1e-10 * merit.value.abs() {
                    return merit;
                }
                let mut trial = places.clone();
                advance(&mut trial, &step);
                let next = self.merit(&trial, limits, prices);
                let ratio = (merit.value - next.value) / expected;
                if ratio > 1e-3 {
                    gained = Some(ratio);
                    *places = trial;
                    merit = next;
                    break;
                }
                *damping *= growth;
                growth *= 2.0;
            }
            let Some(ratio) = gained else {
                break;
            };
            let cube = 2.0 * ratio - 1.0;
            *damping *= (1.0 - cube * cube * cube).clamp(0.2, 2.0);
            growth = 2.0;
        }
        merit
    }

    fn merit(&mut self, places: &[Place], limits: &Limits, prices: &Prices) -> Merit {
        self.evaluations += 1;
        let route = self.route(places);
        let mut merit = Merit {
            value: 0.0,
            worst: 0.0,
        };
        for (cost, beyond) in self.legs().prices(&route) {
            merit.value += cost + 0.5 * prices.rate * beyond * beyond;
            merit.worst = merit.worst.max(beyond);
        }
        for place in &places[1..places.len() - 1] {
            merit.value += self.altitude(place, prices)[0];
        }
        for (limit, multiplier) in prices.limits.iter().zip(&prices.multipliers) {
            let beyond = limits.beyond(*limit, places, &route);
            let felt = (multiplier + prices.rate * beyond).max(0.0);
            merit.value += (felt * felt - multiplier * multiplier) / (2.0 * prices.rate);
            merit.worst = merit.worst.max(beyond);
        }
        merit
    }

    /// Second derivatives of what the method makes smaller, and the negative first ones.
    fn equations(&mut self, places: &mut [Place], limits: &Limits, prices: &Prices) -> Equations {
        let free = places.len() - 2;
        let mut equations = Equations::new(free);
        let slopes = self.legs().slopes(places);
        // As many legs for each.
        self.evaluations += 28;
        for (leg, slopes) in slopes.iter().enumerate() {
            equations.add(leg, &slopes.gradient, &slopes.curvature);
            if slopes.beyond > 0.0 {
                equations.press(leg, &slopes.away, prices.rate * slopes.beyond, prices.rate);
            }
        }
        for (idx, place) in places[1..=free].iter().enumerate() {
            let [_, slope, curvature] = self.altitude(place, prices);
            equations.down[3 * idx + 2] -= slope;
            equations.matrix.add(3 * idx + 2, 3 * idx + 2, curvature);
        }
        let route = self.route(places);
        for (limit, multiplier) in prices.limits.iter().zip(&prices.multipliers) {
            let beyond = limits.beyond(*limit, places, &route);
            let felt = multiplier + prices.rate * beyond;
            if felt > 0.0 {
                let slope = limits.slope(*limit, places, &route);
                let curvature = slope.curvature.map(|row| row.map(|value| felt * value));
                equations.add(slope.first, &[0.0; NEAR], &curvature);
                equations.press(slope.first, &slope.gradient, felt, prices.rate);
            }
        }
        equations
    }

    /// The altitude cost of a waypoint, its kink rounded off, and its derivatives by the height.
    fn altitude(&self, place: &Place, prices: &Prices) -> [f64; 3] {
        let scenario = self.model.scenario;
        let off = place.at.z - 0.5 * (scenario.altitude.min + scenario.altitude.max);
        let round = prices.rounding;
        let far = (off * off + round * round).sqrt();
        let weight = scenario.weights.altitude;
        [
            weight * far,
            weight * off / far,
            weight * round * round / (far * far * far),
        ]
    }

    fn legs(&self) -> Legs<'_, 's> {
        Legs {
            pricer: &self.pricer,
            step: STEP * self.way(),
            min_leg: self.model.scenario.vehicle.min_leg,
            tolerance: self.model.tolerance.scaled(PRICED_FROM).length_m,
        }
    }

    fn way(&self) -> f64 {
        (self.model.scenario.target - self.model.scenario.start).norm()
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

impl Prices {
    /// What a metre more would save along each leg by the limits that hold it.
    fn felt(&self, legs: usize) -> Vec<f64> {
        let mut felt = vec![0.0; legs];
        for (limit, multiplier) in self.limits.iter().zip(&self.multipliers) {
            match *limit {
                Limit::Climb { leg, .. } => felt[leg] += multiplier,
                Limit::Turn { at, .. } => {
                    felt[at - 1] += multiplier;
                    felt[at] += multiplier;
                }
                Limit::Short { .. } | Limit::Height { .. } | Limit::Edge { .. } => {}
            }
        }
        felt
    }
}

impl Equations {
    fn new(free: usize) -> Self {
        Self {
            free,
            matrix: Banded::zero(3 * free),
            down: vec![0.0; 3 * free],
        }
    }

    /// The unknown that coordinate `idx` from those of waypoint `first` on is; none of start and target.
    fn unknown(&self, first: usize, idx: usize) -> Option<usize> {
        let at = first + idx / 3;
        (at >= 1 && at <= self.free).then(|| 3 * (at - 1) + idx % 3)
    }

    /// Add a figure that depends on waypoints from `first` on, by its derivatives.
    fn add<const SIZE: usize>(
        &mut self,
        first: usize,
        gradient: &[f64; SIZE],
        curvature: &[[f64; SIZE]; SIZE],
    ) {
        for i in 0..SIZE {
            let Some(row) = self.unknown(first, i) else {
                continue;
            };
            self.down[row] -= gradient[i];
            for j in 0..SIZE {
                if let Some(column) = self.unknown(first, j) {
                    self.matrix.add(row, column, curvature[i][j]);
                }
            }
        }
    }

    /// Add a penalty by the `gradient` of what it is for: so great a `force`, which grows by `rate` a metre.
    fn press<const SIZE: usize>(
        &mut self,
        first: usize,
        gradient: &[f64; SIZE],
        force: f64,
        rate: f64,
    ) {
        let push = gradient.map(|slope| force * slope);
        let stiff = gradient.map(|one| gradient.map(|other| rate * one * other));
        self.add(first, &push, &stiff);
    }

    /// Ask for a figure to become so much less.
    fn bring_back<const SIZE: usize>(&mut self, first: usize, gradient: &[f64; SIZE], by: f64) {
        self.press(first, gradient, by, 1.0);
    }
}

/// `route` with its least waypoint put where limits are felt most: one for each of a few legs.
fn deals(felt: &[f64], route: &[Point3]) -> Vec<Vec<Point3>> {
    let detour = |idx: &usize| {
        let [before, at, after] = [route[idx - 1], route[*idx], route[idx + 1]];
        (at - before).norm() + (after - at).norm() - (after - before).norm()
    };
    let Some(spare) = (1..route.len() - 1).min_by(|a, b| detour(a).total_cmp(&detour(b))) else {
        return Vec::new();
    };
    let mut legs: Vec<usize> = (0..felt.len())
        .filter(|&leg| leg != spare && leg + 1 != spare && felt[leg] > 0.0)
        .collect();
    legs.sort_by(|&a, &b| felt[b].total_cmp(&felt[a]).then(a.cmp(&b)));
    let dealt = |&leg: &usize| {
        let mut dealt = route.to_vec();
        dealt.insert(leg + 1, nalgebra::center(&route[leg], &route[leg + 1]));
        dealt.remove(if spare > leg { spare + 1 } else { spare });
        dealt
    };
    legs.iter().take(PLACES).map(dealt).collect()
}

/// Move all free `places` by `step`.
fn advance(places: &mut [Place], step: &[f64]) {
    let last = places.len() - 1;
    for (place, step) in places[1..last].iter_mut().zip(step.chunks(3)) {
        for (axis, step) in step.iter().enumerate() {
            place.at[axis] += step;
        }
    }
}
