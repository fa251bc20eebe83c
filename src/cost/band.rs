//! The altitude band and the ground, along the whole route; the terminal zones round start and
//! target, where a vehicle may leave the band to take off and land.

use super::{Breach, Constraint, Model, Tolerance};
use crate::geometry::{Point2, Point3, Segment};
use crate::scenario::Scenario;
use crate::terrain::HeightRange;

/// The discs round start and target in which only the ground and the higher ceiling count.
#[derive(Debug, Clone, Copy)]
pub(super) struct TerminalZones {
    zones: [TerminalZone; 2],
}

#[derive(Debug, Clone, Copy)]
pub(super) struct TerminalZone {
    pub(super) center: Point2,
    /// Horizontal, metres; 0 where the band needs no ramp.
    pub(super) radius: f64,
    /// Lowest height above ground in the zone.
    pub(super) floor: f64,
    /// Highest height above ground in the zone.
    ceiling: f64,
}

/// A part of a leg over which the same heights above ground are allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Where it begins on the leg.
    pub t0: f64,
    /// Where it ends.
    pub t1: f64,
    /// Whether it lies in a terminal zone.
    pub terminal: bool,
    /// Lowest height above ground allowed.
    pub floor: f64,
    /// Highest height above ground allowed.
    pub ceiling: f64,
}

impl TerminalZones {
    pub(super) fn of(scenario: &Scenario) -> Self {
        let band = scenario.altitude;
        let steepest = scenario.vehicle.steepest();
        let zone = |point: Point3| {
            let height = scenario.terrain.height_of(point);
            TerminalZone {
                center: point.xy(),
                radius: 2.0 * (band.min - height).max(height - band.max).max(0.0) / steepest,
                floor: height.min(0.0),
                ceiling: height.max(band.max),
            }
        };
        Self {
            zones: [zone(scenario.start), zone(scenario.target)],
        }
    }

    pub(super) fn iter(&self) -> std::slice::Iter<'_, TerminalZone> {
        self.zones.iter()
    }

    /// Cut `leg` where it enters or leaves a zone, and pass each part on.
    fn sections(&self, leg: &Segment, floor: f64, ceiling: f64, mut each: impl FnMut(Section)) {
        let inside = self.zones.map(|zone| {
            if zone.radius > 0.0 {
                leg.within(zone.center, zone.radius)
            } else {
                None
            }
        });
        let [(s0, s1), (t0, t1)] = inside.map(|part| part.unwrap_or((0.0, 1.0)));
        let mut cuts = [0.0, 1.0, s0, s1, t0, t1];
        cuts.sort_by(f64::total_cmp);
        for pair in cuts.windows(2).filter(|pair| pair[0] < pair[1]) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let mut section = Section {
                t0: pair[0],
                t1: pair[1],
                terminal: false,
                floor,
                ceiling,
            };
            for (zone, part) in self.zones.iter().zip(inside) {
                if part.is_some_and(|(t0, t1)| t0 <= middle && middle <= t1) {
                    let first = !section.terminal;
                    section.terminal = true;
                    // Where both zones overlap the more permissive applies.
                    section.floor = if first {
                        zone.floor
                    } else {
                        zone.floor.min(section.floor)
                    };
                    section.ceiling = section.ceiling.max(zone.ceiling);
                }
            }
            each(section);
        }
    }
}

impl Model<'_> {
    /// The parts of `leg` over which the same heights are allowed, in order.
    pub fn sections(&self, leg: &Segment, each: impl FnMut(Section)) {
        let band = self.scenario.altitude;
        self.zones.sections(leg, band.min, band.max, each);
    }

    /// The whole of a leg that meets no terminal zone.
    pub(super) fn outside(&self) -> Section {
        let band = self.scenario.altitude;
        Section {
            t0: 0.0,
            t1: 1.0,
            terminal: false,
            floor: band.min,
            ceiling: band.max,
        }
    }

    /// The heights above ground that are allowed over `at`: those of the band, or of the zones round start and
    /// target.
    #[must_use]
    pub fn heights_over(&self, at: Point2) -> (f64, f64) {
        let allowed = |zone: &&TerminalZone| {
            zone.radius > 0.0 && (at - zone.center).norm_squared() <= zone.radius * zone.radius
        };
        self.join_heights(self.zones.iter().filter(allowed))
    }

    /// The lowest and highest height above ground allowed anywhere.
    #[must_use]
    pub fn heights_anywhere(&self) -> (f64, f64) {
        self.join_heights(self.zones.iter().filter(|zone| zone.radius > 0.0))
    }

    fn join_heights<'z>(&self, zones: impl Iterator<Item = &'z TerminalZone>) -> (f64, f64) {
        let band = self.scenario.altitude;
        zones.fold((band.min, band.max), |(floor, ceiling), zone| {
            (floor.min(zone.floor), ceiling.max(zone.ceiling))
        })
    }

    /// Least and greatest height above ground of `leg` outside the terminal zones; `None` when it
    /// never leaves them.
    #[must_use]
    pub fn free_heights(&self, leg: &Segment) -> Option<HeightRange> {
        let mut range = None;
        self.sections(leg, |section| {
            if !section.terminal {
                let part = self
                    .scenario
                    .terrain
                    .height_range(leg, (section.t0, section.t1));
                range = Some(range.unwrap_or(HeightRange::EMPTY).join(part));
            }
        });
        range
    }

    /// Report a leg that leaves the band or meets the ground.
    pub(super) fn heights(
        &self,
        leg_idx: usize,
        leg: &Segment,
        tolerance: Tolerance,
        report: &mut impl FnMut(Breach),
    ) {
        let mut excess = Excess::default();
        self.sections(leg, |section| {
            let window = (section.t0, section.t1);
            let terrain = &self.scenario.terrain;
            let beyond = terrain.excess(leg, window, section.floor, section.ceiling);
            excess.join(section.terminal, section.floor, beyond);
        });
        if excess.off_band > tolerance.height_m {
            let amount = excess.off_band;
            report(Breach::on_leg(Constraint::Altitude, leg_idx, amount));
        }
        if excess.underground > tolerance.height_m {
            let amount = excess.underground;
            report(Breach::on_leg(Constraint::Terrain, leg_idx, amount));
        }
    }
}

/// How far a leg leaves the band and dips below the ground, metres, each >= 0.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Excess {
    off_band: f64,
    underground: f64,
}

impl Excess {
    /// Note a part of the leg that reaches `below` its floor and `above` its ceiling.
    pub(super) fn join(&mut self, terminal: bool, floor: f64, (below, above): (f64, f64)) {
        self.off_band = self.off_band.max(above);
        if terminal {
            self.underground = self.underground.max(below);
        } else {
            self.off_band = self.off_band.max(below);
            self.underground = self.underground.max(below - floor);
        }
    }

    /// The sum of what [`Model::heights`] reports.
    pub(super) fn violation(self, tolerance: Tolerance) -> f64 {
        let counted = |amount: f64| {
            if amount > tolerance.height_m {
                amount
            } else {
                0.0
            }
        };
        counted(self.off_band) + counted(self.underground)
    }
}
