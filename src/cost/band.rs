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
        let steepest = libm::tan(scenario.vehicle.max_climb_deg.to_radians());
        let zone = |point: Point3| {
            let height = point.z - scenario.terrain.elevation(point.xy());
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

    pub(super) fn iter(&self) -> impl Iterator<Item = &TerminalZone> {
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
        let mut cuts = [0.0, 1.0, 0.0, 1.0, 0.0, 1.0];
        for (zone_idx, (t0, t1)) in inside
            .iter()
            .enumerate()
            .filter_map(|(idx, part)| part.map(|p| (idx, p)))
        {
            cuts[2 + 2 * zone_idx] = t0;
            cuts[3 + 2 * zone_idx] = t1;
        }
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
                    // In both zones the more permissive counts.
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

    /// How far a leg leaves the band and dips below the ground at some points, as many as `samples`,
    /// metres: no more than by [`Model::heights`].
    pub(super) fn sampled_heights(&self, leg: &Segment, samples: usize) -> f64 {
        let (mut underground, mut off_band) = (0.0_f64, 0.0_f64);
        let step = 1.0 / samples as f64;
        self.sections(leg, |section| {
            let mut t = ((section.t0 / step - 0.5).ceil() + 0.5) * step;
            while t < section.t1 {
                let point = leg.at(t);
                let height = point.z - self.scenario.terrain.elevation(point.xy());
                let below = section.floor - height;
                off_band = off_band.max(height - section.ceiling);
                if section.terminal {
                    underground = underground.max(below);
                } else {
                    off_band = off_band.max(below);
                    underground = underground.max(-height);
                }
                t += step;
            }
        });
        off_band + underground
    }

    /// Report a leg that leaves the band or meets the ground, by how much to within the share
    /// `rough` of it.
    pub(super) fn heights(
        &self,
        leg_idx: usize,
        leg: &Segment,
        tolerance: Tolerance,
        rough: f64,
        report: &mut impl FnMut(Breach),
    ) {
        let (mut underground, mut off_band) = (0.0_f64, 0.0_f64);
        self.sections(leg, |section| {
            let window = (section.t0, section.t1);
            let (below, above) =
                self.scenario
                    .terrain
                    .excess(leg, window, section.floor, section.ceiling, rough);
            off_band = off_band.max(above);
            if section.terminal {
                underground = underground.max(below);
            } else {
                off_band = off_band.max(below);
                underground = underground.max(below - section.floor);
            }
        });
        if off_band > tolerance.height_m {
            report(Breach::on_leg(Constraint::Altitude, leg_idx, off_band));
        }
        if underground > tolerance.height_m {
            report(Breach::on_leg(Constraint::Terrain, leg_idx, underground));
        }
    }
}
