//! What the method minimises: the cost, and what broken or felt limits add to it.

use super::equations::Equations;
use super::legs::LEGS_EACH;
use super::limits::{self, Limit, Limits, NEAR};
use super::{Newton, Place};

/// The value minimised, at one place.
pub(super) struct Merit {
    pub(super) value: f64,
    /// Greatest breach, metres.
    pub(super) worst: f64,
}

/// Multipliers, and the price of breaches, a unit of cost for a square metre.
pub(super) struct Prices {
    pub(super) limits: Vec<Limit>,
    pub(super) multipliers: Vec<f64>,
    pub(super) rate: f64,
    /// What being off the middle of the band is felt to cost at each point, a metre: at the kink, anything up to its weight
    /// to either side.
    pub(super) lifts: Vec<f64>,
}

impl Prices {
    /// For a route of this many points, ends included, before any limit is felt.
    pub(super) fn new(points: usize, rate: f64) -> Self {
        let limits = limits::all(points);
        Self {
            multipliers: vec![0.0; limits.len()],
            limits,
            rate,
            lifts: vec![0.0; points],
        }
    }

    /// How much one more metre would save along each leg, according to the limits that hold it.
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
    /// Update each limit's multiplier by how far `places` are beyond it, and the heights' by how far they are off the
    /// middle of the band.
    pub(super) fn feel(&self, limits: &Limits, places: &[Place], prices: &mut Prices) {
        let route = self.route(places);
        for (limit, multiplier) in prices.limits.iter().zip(&mut prices.multipliers) {
            let beyond = limits.beyond(*limit, places, &route);
            *multiplier = (*multiplier + prices.rate * beyond).max(0.0);
        }
        for (place, lift) in places.iter().zip(&mut prices.lifts) {
            [_, *lift, _] = self.altitude(place, *lift, prices.rate);
        }
    }

    /// Put heights in the middle of the band that its kink holds there.
    pub(super) fn settle(&self, places: &mut [Place], lifts: &[f64]) {
        let last = places.len() - 1;
        for (place, lift) in places[1..last].iter_mut().zip(free(lifts)) {
            let [off, weight] = self.off(place);
            if lift.abs() < weight {
                place.at.z -= off;
            }
        }
    }

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
        for (place, lift) in free(places).iter().zip(free(&prices.lifts)) {
            let [value, _, stiffness] = self.altitude(place, *lift, prices.rate);
            merit.value += value;
            if stiffness > 0.0 {
                merit.worst = merit.worst.max(self.off(place)[0].abs());
            }
        }
        for (limit, multiplier) in prices.limits.iter().zip(&prices.multipliers) {
            let beyond = limits.beyond(*limit, places, &route);
            let felt = (multiplier + prices.rate * beyond).max(0.0);
            merit.value += (felt * felt - multiplier * multiplier) / (2.0 * prices.rate);
            merit.worst = merit.worst.max(beyond);
        }
        merit
    }

    /// Second derivatives of the merit, and the negative first ones.
    pub(super) fn equations(
        &mut self,
        places: &mut [Place],
        limits: &Limits,
        prices: &Prices,
    ) -> Equations {
        let mut equations = Equations::new(places.len() - 2);
        let slopes = self.legs().slopes(places);
        self.evaluations += LEGS_EACH;
        for (leg, slopes) in slopes.iter().enumerate() {
            equations.add(leg, &slopes.gradient, &slopes.curvature);
            if slopes.beyond > 0.0 {
                equations.press(leg, &slopes.away, prices.rate * slopes.beyond, prices.rate);
            }
        }
        for (idx, (place, lift)) in free(places).iter().zip(free(&prices.lifts)).enumerate() {
            let [_, slope, curvature] = self.altitude(place, *lift, prices.rate);
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

    /// What the height of a waypoint costs, and its derivatives by it. The kink in the middle of the band is felt like
    /// limits to both sides, but for no more than the weight.
    fn altitude(&self, place: &Place, lift: f64, rate: f64) -> [f64; 3] {
        let [off, weight] = self.off(place);
        let felt = lift + rate * off;
        let force = felt.clamp(-weight, weight);
        let more = force - lift;
        let value = force * off - more * more / (2.0 * rate);
        [value, force, if felt.abs() < weight { rate } else { 0.0 }]
    }

    /// How far a waypoint is above the middle of the band, and what a metre of that costs.
    fn off(&self, place: &Place) -> [f64; 2] {
        let scenario = self.model.scenario;
        let middle = scenario.altitude.middle();
        [place.at.z - middle, scenario.weights.altitude]
    }
}

/// All but the first and the last.
fn free<T>(of: &[T]) -> &[T] {
    &of[1..of.len() - 1]
}
