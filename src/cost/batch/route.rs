//! The walk along the routes, Eq. 1, 2, 8 and 9.

use pulp::Simd;

use super::leg::{Leg, Point};
use super::threats::Candidates;
use super::{PointRow, Pricer};
use crate::cost::fuel;
use crate::cost::threat::SHARE;
use crate::geometry::lane::Lane;
use crate::scenario::Scenario;

/// Angles are compared by their tangents and cosines; from this share of the limit up they are
/// worked out.
const NEAR_LIMIT: f64 = 0.999;

/// Rounding of a cosine that is the quotient of products, rounded up.
const COSINE_ROUNDING: f64 = 1e-15;

/// What a vehicle can do, made ready for comparison.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    turn_deg: f64,
    /// A turn whose cosine is not below this is within the limit.
    turn_cosine: f64,
    climb_deg: f64,
    /// A slope not above this is within the limit.
    climb_slope: f64,
    min_leg: f64,
}

impl Limits {
    pub(super) fn of(scenario: &Scenario) -> Self {
        let vehicle = &scenario.vehicle;
        let near = |degrees: f64| (NEAR_LIMIT * degrees).to_radians();
        Self {
            turn_deg: vehicle.max_turn_deg,
            turn_cosine: libm::cos(near(vehicle.max_turn_deg)) + COSINE_ROUNDING,
            climb_deg: vehicle.max_climb_deg,
            climb_slope: libm::tan(near(vehicle.max_climb_deg)),
            min_leg: vehicle.min_leg,
        }
    }
}

/// The direction in which a route was last seen moving: not at all, before it does.
#[derive(Clone, Copy)]
struct Heading<S: Simd> {
    dx: Lane<S>,
    dy: Lane<S>,
    level: Lane<S>,
}

impl Pricer<'_> {
    /// Violation and cost of one part of the routes.
    #[inline(always)]
    pub(super) fn route<S: Simd>(
        &self,
        simd: S,
        part: usize,
        points: &[PointRow],
    ) -> (Lane<S>, Lane<S>) {
        let zero = Lane::splat(simd, 0.0);
        let (mut length, mut exposure, mut violation, mut off_middle) = (zero, zero, zero, zero);
        let mut heading = Heading {
            dx: zero,
            dy: zero,
            level: zero,
        };
        let mut candidates = Candidates::default();
        for (leg_idx, rows) in points.windows(2).enumerate() {
            let leg = Leg::new(simd, part, [&rows[0], &rows[1]]);
            length = length + leg.length;
            self.threats(&leg, &mut candidates, &mut exposure, &mut violation);
            violation = violation + self.heights(&leg) + self.leg_limits(&leg);
            violation = violation + self.turn(&leg, &mut heading);
            if leg_idx + 2 < points.len() {
                violation = violation + self.area(leg.b);
                off_middle = off_middle + self.off_middle(&leg);
            }
        }
        let altitude = off_middle * self.model.scenario.weights.altitude;
        (violation, self.flown(length, exposure) + altitude)
    }

    /// Violation and cost of one leg by itself.
    #[inline(always)]
    pub(super) fn single_leg<S: Simd>(
        &self,
        simd: S,
        part: usize,
        a: &PointRow,
        b: &PointRow,
    ) -> (Lane<S>, Lane<S>) {
        let leg = Leg::new(simd, part, [a, b]);
        let (mut exposure, mut violation) = (leg.splat(0.0), leg.splat(0.0));
        self.threats(
            &leg,
            &mut Candidates::default(),
            &mut exposure,
            &mut violation,
        );
        violation = violation + self.heights(&leg) + self.leg_limits(&leg);
        (violation, self.flown(leg.length, exposure))
    }

    /// Fuel and exposure, weighted.
    #[inline(always)]
    fn flown<S: Simd>(&self, length: Lane<S>, exposure: Lane<S>) -> Lane<S> {
        let scenario = self.model.scenario;
        let metre = scenario.weights.fuel * fuel::fuel(&scenario.vehicle, 1.0);
        length * metre + exposure * (scenario.weights.threat * SHARE)
    }

    /// Beyond the limits of climbing and of shortness.
    #[inline(always)]
    fn leg_limits<S: Simd>(&self, leg: &Leg<S>) -> Lane<S> {
        let limits = &self.limits;
        let short = leg.splat(limits.min_leg) - leg.length;
        let mut violation = leg.splat(self.tolerance.length_m).lt(short).keep(short);
        let rise = leg.dz.abs();
        if (leg.level * limits.climb_slope).lt(rise).any() {
            let steep = rise.atan2(leg.level) * DEGREES - limits.climb_deg;
            violation = violation + leg.splat(self.tolerance.angle_deg).lt(steep).keep(steep);
        }
        violation
    }

    /// Beyond the limit of turning; a leg that only climbs keeps the heading before it.
    #[inline(always)]
    fn turn<S: Simd>(&self, leg: &Leg<S>, heading: &mut Heading<S>) -> Lane<S> {
        let before = *heading;
        heading.dx = leg.moves.select(leg.dx, before.dx);
        heading.dy = leg.moves.select(leg.dy, before.dy);
        heading.level = leg.moves.select(leg.level, before.level);
        let along = before.dx * leg.dx + before.dy * leg.dy;
        let both = before.level * leg.level;
        if !(along.lt(both * self.limits.turn_cosine) & leg.moves).any() {
            return leg.splat(0.0);
        }
        let across = before.dx * leg.dy - before.dy * leg.dx;
        let sharp = across.abs().atan2(along) * DEGREES - self.limits.turn_deg;
        // Where the route has not moved yet, both products are 0, and the angle is.
        (leg.splat(self.tolerance.angle_deg).lt(sharp) & leg.moves).keep(sharp)
    }

    /// How far a waypoint lies outside the area.
    #[inline(always)]
    fn area<S: Simd>(&self, point: Point<S>) -> Lane<S> {
        let area = &self.model.scenario.area;
        let zero = point.x.with(0.0);
        let dx = beyond(point.x, area.min.x, area.max.x);
        let dy = beyond(point.y, area.min.y, area.max.y);
        if !zero.lt(dx + dy).any() {
            return zero;
        }
        let amount = (dx * dx + dy * dy).sqrt();
        zero.with(self.tolerance.length_m).lt(amount).keep(amount)
    }
}

/// How far `value` lies outside `[min, max]`.
#[inline(always)]
fn beyond<S: Simd>(value: Lane<S>, min: f64, max: f64) -> Lane<S> {
    let outside = (value.with(min) - value).max(value - max);
    outside.max(value.with(0.0))
}

/// Of a radian.
const DEGREES: f64 = 180.0 / std::f64::consts::PI;
