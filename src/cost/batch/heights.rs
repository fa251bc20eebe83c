//! The band and the ground in lanes: most legs are proven to keep within them; the rest are left
//! to the scalar code, which measures by how much they do not.

use pulp::Simd;

use super::Pricer;
use super::leg::Leg;
use crate::cost::{Model, Tolerance};
use crate::geometry::Point2;
use crate::geometry::lane::{Lane, Mask};
use crate::terrain::Terrain;

/// What a proof may overlook: less than what counts as a breach.
const OVERLOOKED: f64 = 0.5;

/// The heights that routes must keep, made ready for proofs.
#[derive(Debug, Clone)]
pub(super) struct Heights {
    zones: Vec<Zone>,
    /// Lowest height above ground outside the terminal zones, less what may be overlooked.
    floor: f64,
    /// Lowest in any of them, likewise.
    ground: f64,
    /// Highest anywhere, likewise.
    ceiling: f64,
}

#[derive(Debug, Clone, Copy)]
struct Zone {
    center: Point2,
    radius: f64,
}

/// The part of each leg in a terminal zone: `[enter, leave]`, 1 to 1 where there is none.
struct Inside<S: Simd> {
    enter: Lane<S>,
    leave: Lane<S>,
    /// Where a leg meets two zones, or climbs in one; not proven here.
    unclear: Mask<S>,
}

impl Heights {
    pub(super) fn of(model: &Model, tolerance: Tolerance) -> Self {
        let band = model.scenario.altitude;
        let slack = OVERLOOKED * tolerance.height_m;
        let floors = model.zones.iter().map(|zone| zone.floor);
        let wide = model.zones.iter().filter(|zone| zone.radius > 0.0);
        Self {
            zones: wide
                .map(|zone| Zone {
                    center: zone.center,
                    radius: zone.radius,
                })
                .collect(),
            floor: band.min - slack,
            ground: floors.fold(f64::NEG_INFINITY, f64::max) - slack,
            ceiling: band.max + slack,
        }
    }
}

impl Pricer<'_> {
    /// Beyond the band or below the ground.
    #[inline(always)]
    pub(super) fn heights<S: Simd>(&self, leg: &Leg<S>) -> Lane<S> {
        let clear = match &self.model.scenario.terrain {
            Terrain::Flat(flat) => {
                let inside = self.inside(leg);
                self.clear_of_flat(leg, &inside, flat.elevation) & !inside.unclear
            }
            Terrain::Peaks(_) | Terrain::Grid(_) => leg.splat(1.0).lt(leg.splat(0.0)),
        };
        if !(!clear).any() {
            return leg.splat(0.0);
        }
        (!clear).map(|lane| {
            let mut violation = 0.0;
            self.model
                .heights(0, &leg.segment(lane), self.tolerance, &mut |breach| {
                    violation += breach.amount;
                });
            violation
        })
    }

    /// How far the end of each leg lies from the middle of the band, Eq. 6.
    #[inline(always)]
    pub(super) fn off_middle<S: Simd>(&self, leg: &Leg<S>) -> Lane<S> {
        let band = self.model.scenario.altitude;
        let middle = 0.5 * (band.max + band.min);
        let ground = match &self.model.scenario.terrain {
            Terrain::Flat(flat) => leg.splat(flat.elevation),
            terrain => leg
                .b
                .z
                .map(|lane, _| terrain.elevation(leg.segment(lane).b.xy())),
        };
        (leg.b.z - ground - middle).abs()
    }

    /// Where each leg lies in a terminal zone.
    #[inline(always)]
    fn inside<S: Simd>(&self, leg: &Leg<S>) -> Inside<S> {
        let (zero, one) = (leg.splat(0.0), leg.splat(1.0));
        let mut inside = Inside {
            enter: one,
            leave: one,
            unclear: one.lt(zero),
        };
        let mut met_before = one.lt(zero);
        for zone in &self.heights.zones {
            let sight = leg.seen_from(zone.center);
            let reach = leg.splat(zone.radius * zone.radius);
            let met = sight.least_squared_distance(zero, one).le(reach);
            if !met.any() {
                continue;
            }
            let foot = sight.foot;
            let past = (reach - sight.squared_distance(foot)).max(zero);
            let half = (past * leg.inverse_square).sqrt();
            inside.enter = met.select((foot - half).clamp(zero, one), inside.enter);
            inside.leave = met.select((foot + half).clamp(zero, one), inside.leave);
            inside.unclear = inside.unclear | (met & (met_before | !leg.moves));
            met_before = met_before | met;
        }
        inside
    }

    /// Where a leg keeps its heights above level ground: they are greatest and least where parts of
    /// it end.
    #[inline(always)]
    fn clear_of_flat<S: Simd>(&self, leg: &Leg<S>, inside: &Inside<S>, elevation: f64) -> Mask<S> {
        let (zero, one) = (leg.splat(0.0), leg.splat(1.0));
        let (h0, h1) = (leg.a.z - elevation, leg.b.z - elevation);
        let (low, high) = (h0.min(h1), h0.max(h1));
        let heights = &self.heights;
        let below_ceiling = high.le(leg.splat(heights.ceiling));
        if self.heights.zones.is_empty() {
            return below_ceiling & leg.splat(heights.floor).le(low);
        }
        // Without a zone to enter, a leg is outside from 0 to 1.
        let first = h0.min(h0 + leg.dz * inside.enter);
        let last = h1.min(h0 + leg.dz * inside.leave);
        let none = leg.splat(f64::INFINITY);
        let outside = zero.lt(inside.enter).select(first, none);
        let outside = outside.min(inside.leave.lt(one).select(last, none));
        below_ceiling & leg.splat(heights.ground).le(low) & leg.splat(heights.floor).le(outside)
    }
}
