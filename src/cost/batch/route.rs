//! The walk along the routes, Eq. 1, 2, 8 and 9.

use pulp::Simd;

use super::leg::{Leg, Point};
use super::suspects::Suspects;
use super::{PointRow, Pricer, Row};
use crate::cost::metre;
use crate::cost::threat::SHARE;
use crate::geometry::lane::{Lane, Mask};
use crate::scenario::Scenario;

/// Angles are compared by their tangents and cosines; from this share of the limit on they are computed.
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
    /// Violation and cost of one part of the routes, but for the violation of `suspects`; without
    /// `HEIGHTS` no leg is asked for those that it keeps, and the `ground` below free waypoints is known.
    #[inline(always)]
    pub(super) fn route<S: Simd, const HEIGHTS: bool>(
        &self,
        simd: S,
        part: usize,
        points: &[PointRow],
        ground: &[Row],
        suspects: &mut Suspects,
        proven: &mut [Row],
    ) -> (Lane<S>, Lane<S>) {
        let zero = Lane::splat(simd, 0.0);
        let (mut length, mut exposure, mut violation, mut off_middle) = (zero, zero, zero, zero);
        let mut heading = Heading {
            dx: zero,
            dy: zero,
            level: zero,
        };
        let [start, target] = self.heights.below_ends;
        let mut below = if HEIGHTS {
            self.elevation(simd, part, &points[0])
        } else {
            zero.with(start)
        };
        for (leg_idx, rows) in points.windows(2).enumerate() {
            let leg = Leg::new(simd, part, [&rows[0], &rows[1]]);
            length = length + leg.length;
            self.threats(&leg, &mut exposure, &mut violation);
            let free = leg_idx + 2 < points.len();
            let below_a = below;
            below = if HEIGHTS {
                self.elevation(simd, part, &rows[1])
            } else if free {
                Lane::load(simd, &ground[leg_idx], part)
            } else {
                zero.with(target)
            };
            let ends = [leg.a.z - below_a, leg.b.z - below];
            if HEIGHTS {
                let slot = part * S::F64_LANES;
                violation = violation + self.heights(&leg, Some(ends), slot, suspects);
            } else {
                let proven = &mut proven[leg_idx];
                self.proven(&leg, ends)
                    .keep(zero.with(1.0))
                    .store(proven, part);
            }
            let (near, sharp) = self.turn(&leg, &mut heading);
            let mut suspect = near | self.may_break_limits(&leg);
            if free {
                suspect = suspect | self.outside(leg.b);
                off_middle = off_middle + self.off_middle(&leg, below);
            }
            if suspect.any() {
                violation = violation + self.leg_limits(&leg) + self.turn_limit(near, sharp);
                if free {
                    violation = violation + self.area(leg.b);
                }
            }
        }
        let altitude = off_middle * self.model.scenario.weights.altitude;
        (violation, self.flown(length, exposure) + altitude)
    }

    /// Cost of one part of the routes but for their exposure, summed as by `route`.
    #[inline(always)]
    pub(super) fn least_cost<S: Simd>(
        &self,
        simd: S,
        part: usize,
        points: &[PointRow],
        ground: &[Row],
    ) -> Lane<S> {
        let zero = Lane::splat(simd, 0.0);
        let (mut length, mut off_middle) = (zero, zero);
        for (leg_idx, rows) in points.windows(2).enumerate() {
            let leg = Leg::new(simd, part, [&rows[0], &rows[1]]);
            length = length + leg.length;
            if let Some(ground) = ground.get(leg_idx) {
                off_middle = off_middle + self.off_middle(&leg, Lane::load(simd, ground, part));
            }
        }
        let altitude = off_middle * self.model.scenario.weights.altitude;
        self.flown(length, zero) + altitude
    }

    /// Violation and cost of one leg by itself, but for the violation of `suspects`; its lanes have
    /// the slots from `slot` on. Without `HEIGHTS` the heights that it must keep are left out, without
    /// `FLIGHT` everything else.
    #[inline(always)]
    pub(super) fn single_leg<S: Simd, const FLIGHT: bool, const HEIGHTS: bool>(
        &self,
        simd: S,
        part: usize,
        [a, b]: [&PointRow; 2],
        slot: usize,
        suspects: &mut Suspects,
    ) -> (Lane<S>, Lane<S>) {
        let leg = Leg::new(simd, part, [a, b]);
        let (mut exposure, mut violation) = (leg.splat(0.0), leg.splat(0.0));
        if FLIGHT {
            self.threats(&leg, &mut exposure, &mut violation);
        }
        if HEIGHTS {
            violation = violation + self.heights(&leg, None, slot, suspects);
        }
        if !FLIGHT {
            return (violation, exposure);
        }
        if self.may_break_limits(&leg).any() {
            violation = violation + self.leg_limits(&leg);
        }
        (violation, self.flown(leg.length, exposure))
    }

    /// Fuel and exposure, weighted.
    #[inline(always)]
    fn flown<S: Simd>(&self, length: Lane<S>, exposure: Lane<S>) -> Lane<S> {
        let scenario = self.model.scenario;
        length * metre(scenario) + exposure * (scenario.weights.threat * SHARE)
    }

    /// Where a leg may be too short or too steep.
    #[inline(always)]
    fn may_break_limits<S: Simd>(&self, leg: &Leg<S>) -> Mask<S> {
        leg.length.lt(leg.splat(self.limits.min_leg))
            | (leg.level * self.limits.climb_slope).lt(leg.dz.abs())
    }

    /// Beyond the limits of climbing and of shortness.
    #[inline(always)]
    fn leg_limits<S: Simd>(&self, leg: &Leg<S>) -> Lane<S> {
        let limits = &self.limits;
        let short = leg.splat(limits.min_leg) - leg.length;
        let steep = leg.dz.abs().atan2(leg.level) * DEGREES - limits.climb_deg;
        leg.splat(self.tolerance.length_m).lt(short).keep(short)
            + leg.splat(self.tolerance.angle_deg).lt(steep).keep(steep)
    }

    /// Where the route may turn too sharply into a leg, and the cosine and sine of how sharply, both
    /// times the same. A leg that only climbs keeps the heading before it.
    #[inline(always)]
    fn turn<S: Simd>(&self, leg: &Leg<S>, heading: &mut Heading<S>) -> (Mask<S>, [Lane<S>; 2]) {
        let before = *heading;
        heading.dx = leg.moves.select(leg.dx, before.dx);
        heading.dy = leg.moves.select(leg.dy, before.dy);
        heading.level = leg.moves.select(leg.level, before.level);
        let along = before.dx * leg.dx + before.dy * leg.dy;
        let across = before.dx * leg.dy - before.dy * leg.dx;
        let both = before.level * leg.level;
        // Where the route has not moved yet, all three are 0.
        let near = along.lt(both * self.limits.turn_cosine) & leg.moves;
        (near, [along, across])
    }

    /// Beyond the limit of turning.
    #[inline(always)]
    fn turn_limit<S: Simd>(&self, near: Mask<S>, [along, across]: [Lane<S>; 2]) -> Lane<S> {
        let sharp = across.abs().atan2(along) * DEGREES - self.limits.turn_deg;
        (near & along.with(self.tolerance.angle_deg).lt(sharp)).keep(sharp)
    }

    /// Where a waypoint lies outside the area.
    #[inline(always)]
    fn outside<S: Simd>(&self, point: Point<S>) -> Mask<S> {
        let area = &self.model.scenario.area;
        point.x.lt(point.x.with(area.min.x))
            | point.x.with(area.max.x).lt(point.x)
            | point.y.lt(point.y.with(area.min.y))
            | point.y.with(area.max.y).lt(point.y)
    }

    /// How far it lies outside.
    #[inline(always)]
    fn area<S: Simd>(&self, point: Point<S>) -> Lane<S> {
        let area = &self.model.scenario.area;
        let dx = beyond(point.x, area.min.x, area.max.x);
        let dy = beyond(point.y, area.min.y, area.max.y);
        let amount = (dx * dx + dy * dy).sqrt();
        (amount.with(self.tolerance.length_m).lt(amount)).keep(amount)
    }
}

/// How far `value` lies outside `[min, max]`.
#[inline(always)]
fn beyond<S: Simd>(value: Lane<S>, min: f64, max: f64) -> Lane<S> {
    let outside = (value.with(min) - value).max(value - max);
    outside.max(value.with(0.0))
}

/// Degrees per radian.
const DEGREES: f64 = 180.0 / std::f64::consts::PI;
