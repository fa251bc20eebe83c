//! What the method makes smaller: the cost, and what limits that are broken or felt add to it.

use super::equations::Equations;
use super::legs::LEGS_EACH;
use super::limits::{self, Limit, Limits, NEAR};
use super::{Newton, Place};
use crate::geometry::Point3;

/// What the method makes smaller, at one place.
pub(super) struct Merit {
    pub(super) value: f64,
    /// Greatest breach, metres.
    pub(super) worst: f64,
}

/// Multipliers, and how dear breaches are, a unit of cost for a square metre.
pub(super) struct Prices {
    pub(super) limits: Vec<Limit>,
    pub(super) multipliers: Vec<f64>,
    pub(super) rate: f64,
    /// Kinks of the altitude cost are rounded off so far about, metres.
    pub(super) rounding: f64,
}

impl Prices {
    /// Of a route of so many points, ends included, before any limit is felt.
    pub(super) fn new(points: usize, rate: f64, rounding: f64) -> Self {
        let limits = limits::all(points);
        Self {
            multipliers: vec![0.0; limits.len()],
            limits,
            rate,
            rounding,
        }
    }

    /// Feel each limit by as much as `route` is beyond it.
    pub(super) fn feel(&mut self, limits: &Limits, places: &[Place], route: &[Point3]) {
        for (limit, multiplier) in self.limits.iter().zip(&mut self.multipliers) {
            let beyond = limits.beyond(*limit, places, route);
            *multiplier = (*multiplier + self.rate * beyond).max(0.0);
        }
    }

    /// What a metre more would save along each leg by the limits that hold it.
    pub(super) fn felt(&self, legs: usize) -> Vec<f64> {
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

impl Newton<'_, '_> {
    pub(super) fn merit(&mut self, places: &[Place], limits: &Limits, prices: &Prices) -> Merit {
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
    pub(super) fn equations(
        &mut self,
        places: &mut [Place],
        limits: &Limits,
        prices: &Prices,
    ) -> Equations {
        let free = places.len() - 2;
        let mut equations = Equations::new(free);
        let slopes = self.legs().slopes(places);
        self.evaluations += LEGS_EACH;
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
}
