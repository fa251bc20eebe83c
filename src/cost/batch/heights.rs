//! The band and the ground in lanes: most legs are proven to keep within them; the rest are measured, above peaks also
//! in lanes, above grids and files by the scalar code.

use pulp::Simd;

use super::leg::{Leg, Point};
use super::scene::Surface;
use super::suspects::{Suspect, Suspects};
use super::{PointRow, Price, Pricer};
use crate::cost::band::{Excess, TerminalZone};
use crate::cost::{Model, Section, Tolerance};
use crate::geometry::Segment;
use crate::geometry::lane::{Lane, Mask};

/// What a proof may overlook, as a share of what counts as a breach.
const OVERLOOKED: f64 = 0.5;

/// The heights that routes must keep, made ready for proofs.
#[derive(Debug, Clone)]
pub(super) struct Heights {
    zones: Vec<TerminalZone>,
    /// Lowest height above ground outside the terminal zones, less what may be overlooked.
    floor: f64,
    /// What is high enough in all terminal zones: the greatest of their floors, likewise.
    ground: f64,
    /// Highest height above ground anywhere, likewise.
    ceiling: f64,
    /// What may be overlooked, metres.
    pub(super) overlooked: f64,
    /// The elevation below the start and below the target.
    pub(super) below_ends: [f64; 2],
}

/// Points of a section, as shares of it, at which a breach may be noticed.
const GLANCES: [f64; 3] = [0.5, 0.25, 0.75];

/// More than this at a point, metres, certainly is a breach.
pub(super) const SURELY: f64 = 0.05;

/// The part of each leg in a terminal zone: `[enter, leave]`, 1 to 1 where there is none.
pub(super) struct Inside<S: Simd> {
    enter: Lane<S>,
    leave: Lane<S>,
    /// Whether any does.
    any: bool,
    /// Where a leg meets two zones, or only climbs in one; not proven here.
    unclear: Mask<S>,
}

impl<S: Simd> Inside<S> {
    /// Where a leg meets any zone.
    #[inline(always)]
    fn met(&self) -> Mask<S> {
        self.unclear | self.enter.lt(self.leave)
    }
}

impl Heights {
    pub(super) fn of(model: &Model, tolerance: Tolerance) -> Self {
        let band = model.scenario.altitude;
        let slack = OVERLOOKED * tolerance.height_m;
        let ends = [model.scenario.start, model.scenario.target];
        // An end that lies in the band has no zone to be measured by.
        let wide = model.zones.iter().filter(|zone| zone.radius > 0.0);
        let floors = wide.clone().map(|zone| zone.floor);
        Self {
            zones: wide.copied().collect(),
            floor: band.min - slack,
            ground: floors.fold(f64::NEG_INFINITY, f64::max) - slack,
            ceiling: band.max + slack,
            overlooked: slack,
            below_ends: ends.map(|end| model.scenario.terrain.elevation(end.xy())),
        }
    }
}

impl Heights {
    /// Where a leg keeps its heights over its part `[t0, t1]`, being `from` and `to` at the ends of
    /// it and the curve between them, with a second derivative of so much that it sags at most by
    /// `dip` below and rises by `rise` above the line that joins these.
    #[inline(always)]
    pub(super) fn within<S: Simd>(
        &self,
        [from, to]: [Lane<S>; 2],
        [dip, rise]: [Lane<S>; 2],
        inside: &Inside<S>,
        [t0, t1]: [f64; 2],
    ) -> Mask<S> {
        // Below the lower end a parabola sags by (k - d)^2 / 4k, k four times its sag in the middle and d
        // its way, so by no more than a quarter of k - d.
        let quarter_way = (to - from).abs() * 0.25;
        let low = from.min(to) - (dip - quarter_way).max(dip.with(0.0));
        let high = from.max(to) + (rise - quarter_way).max(dip.with(0.0));
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

    /// How far a leg is seen to leave the band, being at those `heights`, where no zone is.
    #[inline(always)]
    fn seen<S: Simd>(&self, inside: &Inside<S>, heights: &[Lane<S>]) -> Lane<S> {
        let (mut least, mut most) = (heights[0], heights[0]);
        for &height in &heights[1..] {
            (least, most) = (least.min(height), most.max(height));
        }
        let off = (least.with(self.floor) - least).max(most - self.ceiling);
        (inside.leave.le(inside.enter) & !inside.unclear).keep(off)
    }
}

impl Pricer<'_> {
    /// Where its heights above ground at both `ends` are enough to prove that a leg keeps what is asked of it.
    #[inline(always)]
    pub(super) fn proven<S: Simd>(&self, leg: &Leg<S>, ends: [Lane<S>; 2]) -> Mask<S> {
        self.proven_by(leg, ends, &self.inside(leg))
    }

    #[inline(always)]
    fn proven_by<S: Simd>(&self, leg: &Leg<S>, ends: [Lane<S>; 2], inside: &Inside<S>) -> Mask<S> {
        match &self.scene.surface {
            Surface::Peaks(massif) => {
                let strays = massif.swing.along(leg);
                self.heights.within(ends, strays, inside, [0.0, 1.0]) & !inside.unclear
            }
            Surface::Flat(_) | Surface::Grid(_) | Surface::Dem => leg.level.lt(leg.level),
        }
    }

    /// Beyond the band or below the ground; `ends` are the heights above it at both ends, where they are known.
    /// What takes longer to find is left to `suspects`, for the slots from `slot` on.
    #[inline(always)]
    pub(super) fn heights<S: Simd>(
        &self,
        leg: &Leg<S>,
        ends: Option<[Lane<S>; 2]>,
        slot: usize,
        suspects: &mut Suspects,
    ) -> Lane<S> {
        let inside = self.inside(leg);
        let none = leg.splat(0.0);
        if let Some(ends) = ends
            && self.proven_by(leg, ends, &inside).all()
        {
            return none;
        }
        let outlook = match &self.scene.surface {
            Surface::Flat(elevation) => {
                let ends = [leg.a.z - *elevation, leg.b.z - *elevation];
                let clear = self.heights.within(ends, [none; 2], &inside, [0.0, 1.0]);
                let open = !(clear & !inside.unclear);
                if !open.any() {
                    return none;
                }
                let in_zone = inside.met().row();
                return open.map(|lane| {
                    self.measured(&leg.segment(lane), in_zone[lane], |leg, section| {
                        self.beyond(leg, (section.t0, section.t1), section)
                    })
                });
            }
            Surface::Grid(_) | Surface::Dem => {
                let in_zone = inside.met().row();
                return none.map(|lane, _| {
                    if !suspects.wants(slot + lane) {
                        return 0.0;
                    }
                    self.measured(&leg.segment(lane), in_zone[lane], |leg, section| {
                        self.beyond_cells(leg, section)
                    })
                });
            }
            Surface::Peaks(massif) => massif.outlook(leg, &inside, &self.heights),
        };
        let open = !(outlook.clear & !inside.unclear);
        if !open.any() {
            return none;
        }
        let seen = self.heights.seen(&inside, &outlook.heights);
        let counts = if self.verdict {
            SURELY + outlook.allowed
        } else {
            f64::INFINITY
        };
        let sure = open & leg.splat(counts).lt(seen);
        let open = open & !sure;
        if open.any() {
            let (widest, in_zone) = (outlook.widest.row(), inside.met().row());
            open.each(|lane| {
                if suspects.wants(slot + lane) {
                    suspects.push(Suspect {
                        slot: slot + lane,
                        leg: leg.segment(lane),
                        widest: widest[lane],
                        in_zone: in_zone[lane],
                    });
                }
            });
        }
        sure.keep(seen - outlook.allowed)
    }

    /// The violation of a leg that reaches `beyond` the limits of its sections.
    fn measured(
        &self,
        leg: &Segment,
        in_zone: bool,
        beyond: impl Fn(&Segment, &Section) -> (f64, f64),
    ) -> f64 {
        let mut excess = Excess::default();
        let mut measure = |section: Section| {
            let amounts = beyond(leg, &section);
            excess.join(section.terminal, section.floor, amounts);
        };
        if in_zone {
            self.model.sections(leg, measure);
        } else {
            measure(self.model.outside());
        }
        excess.violation(self.tolerance)
    }

    /// How far the part `window` of a leg reaches below and above the limits of `section`.
    fn beyond(&self, leg: &Segment, window: (f64, f64), section: &Section) -> (f64, f64) {
        let terrain = &self.model.scenario.terrain;
        terrain.excess(leg, window, section.floor, section.ceiling)
    }

    /// As `beyond`, of a whole section above the cells of a grid or a file.
    fn beyond_cells(&self, leg: &Segment, section: &Section) -> (f64, f64) {
        let overlooked = self.heights.overlooked;
        let limits = (section.floor - overlooked, section.ceiling + overlooked);
        let window = (section.t0, section.t1);
        if let Surface::Grid(pyramid) = &self.scene.surface
            && pyramid.clears(leg, window, limits)
        {
            return (0.0, 0.0);
        }
        if self.verdict {
            for share in GLANCES {
                let point = leg.at(window.0 + share * (window.1 - window.0));
                let height = self.model.scenario.terrain.height_of(point);
                if section.floor - height > SURELY || height - section.ceiling > SURELY {
                    let below = (section.floor - height).max(0.0);
                    return (below, (height - section.ceiling).max(0.0));
                }
            }
        }
        self.beyond(leg, window, section)
    }

    /// Measure all `suspects`, of which slot `k` has lane `k` of `prices` laid end to end.
    #[inline(always)]
    pub(super) fn settle<S: Simd>(&self, simd: S, suspects: &Suspects, prices: &mut [Price]) {
        if let Surface::Peaks(massif) = &self.scene.surface {
            self.measure(simd, massif, suspects, prices);
        }
    }

    /// The elevation of the ground below each point of a part of `row`.
    #[inline(always)]
    pub(super) fn elevation<S: Simd>(&self, simd: S, part: usize, row: &PointRow) -> Lane<S> {
        let point = Point::load(simd, row, part);
        match &self.scene.surface {
            Surface::Flat(elevation) => point.x.with(*elevation),
            Surface::Peaks(massif) => massif.elevation(point),
            Surface::Grid(_) | Surface::Dem => point.x.map(|lane, _| {
                let below = row.get(part * S::F64_LANES + lane).xy();
                self.model.scenario.terrain.elevation(below)
            }),
        }
    }

    /// How far the end of each leg, above `ground`, lies from the middle of the band, Eq. 6.
    #[inline(always)]
    pub(super) fn off_middle<S: Simd>(&self, leg: &Leg<S>, ground: Lane<S>) -> Lane<S> {
        (leg.b.z - ground - self.model.scenario.altitude.middle()).abs()
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
