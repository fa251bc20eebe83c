//! The band and the ground in lanes: most legs are proven to keep within them; the rest are left
//! to the scalar code, which measures by how much they do not.

use pulp::Simd;

use super::leg::{Leg, Point};
use super::peaks::{Massif, Panorama};
use super::pyramid::Pyramid;
use super::{PointRow, Pricer};
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
    surface: Surface,
}

/// What lies below.
#[derive(Debug, Clone)]
enum Surface {
    Flat(f64),
    Peaks(Massif),
    Grid(Pyramid),
}

#[derive(Debug, Clone, Copy)]
struct Zone {
    center: Point2,
    radius: f64,
}

/// The part of each leg in a terminal zone: `[enter, leave]`, 1 to 1 where there is none.
pub(super) struct Inside<S: Simd> {
    enter: Lane<S>,
    leave: Lane<S>,
    /// Whether any does.
    any: bool,
    /// Where a leg meets two zones, or only climbs in one; not proven here.
    unclear: Mask<S>,
}

/// The greatest breaches of the band and of the ground at points of a leg.
#[derive(Clone, Copy)]
pub(super) struct Breach<S: Simd> {
    band: Lane<S>,
    ground: Lane<S>,
}

impl<S: Simd> Breach<S> {
    #[inline(always)]
    pub(super) fn none(zero: Lane<S>) -> Self {
        Self {
            band: zero,
            ground: zero,
        }
    }

    #[inline(always)]
    pub(super) fn sum(self) -> Lane<S> {
        self.band + self.ground
    }
}

/// Points of a leg at which a rough pricer looks at a grid.
const GLANCES: usize = 8;

/// A breach at a point of a leg, of more metres than this, spares a rough pricer the exact one.
const SURELY: f64 = 0.05;

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
            surface: match &model.scenario.terrain {
                Terrain::Flat(flat) => Surface::Flat(flat.elevation),
                Terrain::Peaks(peaks) => Surface::Peaks(Massif::of(peaks)),
                Terrain::Grid(grid) => Surface::Grid(Pyramid::of(grid)),
            },
        }
    }
}

impl Heights {
    /// The breach of a leg that is `height` above ground at `t`, or the one before if greater.
    #[inline(always)]
    pub(super) fn breach<S: Simd>(
        &self,
        height: Lane<S>,
        inside: &Inside<S>,
        t: f64,
        before: Breach<S>,
    ) -> Breach<S> {
        let (zero, at) = (height.with(0.0), height.with(t));
        let off = (height.with(self.floor) - height).max(height - self.ceiling);
        let in_zone = inside.enter.le(at) & at.le(inside.leave);
        Breach {
            band: before.band.max((!in_zone).keep(off.max(zero))),
            ground: before.ground.max(height.with(self.ground) - height),
        }
    }

    /// Where a leg keeps its heights over its part `[t0, t1]`, being `from` and `to` at the ends of
    /// it and between them at most `dip` below and `rise` above the line that joins these.
    #[inline(always)]
    pub(super) fn within<S: Simd>(
        &self,
        [from, to]: [Lane<S>; 2],
        [dip, rise]: [Lane<S>; 2],
        inside: &Inside<S>,
        [t0, t1]: [f64; 2],
    ) -> Mask<S> {
        let (low, high) = (from.min(to) - dip, from.max(to) + rise);
        let below_ceiling = high.le(high.with(self.ceiling));
        if !inside.any {
            return below_ceiling & low.with(self.floor).le(low);
        }
        // Lines are lowest where parts of them end; without a zone, a leg is outside from 0 to 1.
        let (start, end) = (low.with(t0), low.with(t1));
        let (enter, leave) = (
            inside.enter.clamp(start, end),
            inside.leave.clamp(start, end),
        );
        let slope = (to - from) * (1.0 / (t1 - t0));
        let first = from.min(from + slope * (enter - start));
        let last = to.min(from + slope * (leave - start));
        let none = low.with(f64::INFINITY);
        let outside = start.lt(enter).select(first, none);
        let outside = outside.min(leave.lt(end).select(last, none)) - dip;
        below_ceiling & low.with(self.ground).le(low) & low.with(self.floor).le(outside)
    }
}

impl Pricer<'_> {
    /// Look round from `point`, an end of a leg.
    #[inline(always)]
    pub(super) fn look<S: Simd>(&self, point: Point<S>, panorama: &mut Panorama<S>) {
        if let Surface::Peaks(massif) = &self.heights.surface {
            massif.look(point, panorama);
        }
    }

    /// Beyond the band or below the ground; `panorama` is that of the leg's ends.
    #[inline(always)]
    pub(super) fn heights<S: Simd>(&self, leg: &Leg<S>, panorama: &Panorama<S>) -> Lane<S> {
        let inside = self.inside(leg);
        let none = leg.splat(0.0);
        let (clear, seen) = match &self.heights.surface {
            Surface::Flat(elevation) => {
                let ends = [leg.a.z - *elevation, leg.b.z - *elevation];
                let slack = [none; 2];
                (self.heights.within(ends, slack, &inside, [0.0, 1.0]), none)
            }
            Surface::Peaks(massif) => massif.clear(leg, panorama, &inside, &self.heights),
            Surface::Grid(pyramid) => (self.clear_of_grid(leg, &inside, pyramid), none),
        };
        let clear = clear & !inside.unclear;
        if !(!clear).any() {
            return none;
        }
        let seen = if self.rough > 0.0 { seen } else { none };
        let sure = leg.splat(SURELY).lt(seen) & !clear & !inside.unclear;
        let seen = sure.keep(seen);
        let open = !(clear | sure);
        if !open.any() {
            return seen;
        }
        seen + open.map(|lane| {
            if self.rough > 0.0
                && let Surface::Grid(_) = self.heights.surface
                && let breach = self.model.sampled_heights(&leg.segment(lane), GLANCES)
                && breach > SURELY
            {
                return breach;
            }
            let mut violation = 0.0;
            self.model.heights(
                0,
                &leg.segment(lane),
                self.tolerance,
                self.rough,
                &mut |breach| {
                    violation += breach.amount;
                },
            );
            violation
        })
    }

    /// The elevation of the ground below each point of a part of `row`.
    #[inline(always)]
    pub(super) fn elevation<S: Simd>(&self, simd: S, part: usize, row: &PointRow) -> Lane<S> {
        let point = Point::load(simd, row, part);
        match &self.heights.surface {
            Surface::Flat(elevation) => point.x.with(*elevation),
            Surface::Peaks(massif) => massif.elevation(point),
            Surface::Grid(_) => point.x.map(|lane, _| {
                let below = row.get(part * S::F64_LANES + lane).xy();
                self.model.scenario.terrain.elevation(below)
            }),
        }
    }

    /// How far the end of each leg lies from the middle of the band, Eq. 6.
    #[inline(always)]
    pub(super) fn off_middle<S: Simd>(&self, leg: &Leg<S>, panorama: &Panorama<S>) -> Lane<S> {
        let band = self.model.scenario.altitude;
        let middle = 0.5 * (band.max + band.min);
        let ground = match &self.heights.surface {
            Surface::Flat(elevation) => leg.splat(*elevation),
            Surface::Peaks(_) => panorama.ground(),
            Surface::Grid(_) => leg.b.z.map(|lane, _| {
                let below = leg.segment(lane).b.xy();
                self.model.scenario.terrain.elevation(below)
            }),
        };
        (leg.b.z - ground - middle).abs()
    }

    /// Where a leg is proven to keep its heights above a grid.
    #[inline(always)]
    fn clear_of_grid<S: Simd>(
        &self,
        leg: &Leg<S>,
        inside: &Inside<S>,
        pyramid: &Pyramid,
    ) -> Mask<S> {
        let (zero, one) = (leg.splat(0.0), leg.splat(1.0));
        let heights = &self.heights;
        let wholly = inside.enter.le(zero) & one.le(inside.leave);
        let floor = wholly.select(leg.splat(heights.ground), leg.splat(heights.floor));
        let proven = floor.map(|lane, floor| {
            let clear = pyramid.clears(&leg.segment(lane), floor, heights.ceiling);
            f64::from(u8::from(clear))
        });
        zero.lt(proven)
    }

    /// Where each leg lies in a terminal zone.
    #[inline(always)]
    fn inside<S: Simd>(&self, leg: &Leg<S>) -> Inside<S> {
        let (zero, one) = (leg.splat(0.0), leg.splat(1.0));
        let mut inside = Inside {
            enter: one,
            leave: one,
            any: false,
            unclear: one.lt(zero),
        };
        let mut met_before = one.lt(zero);
        for zone in &self.heights.zones {
            if !leg.may_reach(zone.center, zone.radius) {
                continue;
            }
            let sight = leg.seen_from(zone.center);
            let reach = leg.splat(zone.radius * zone.radius);
            let met = sight.least_squared_distance(zero, one).le(reach);
            if !met.any() {
                continue;
            }
            inside.any = true;
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
}
