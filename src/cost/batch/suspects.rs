//! Legs that are not proven to keep their heights, until they are measured side by side.

use pulp::Simd;

use super::Pricer;
use super::leg::Point;
use super::peaks::Massif;
use super::stretch::{Course, Stretch, WIDEST};
use crate::cost::Section;
use crate::cost::band::Excess;
use crate::geometry::lane::{LANES, Lane, Row, parts};
use crate::geometry::{Point3, Segment};

/// A leg is cut in no more stretches; narrower peaks are left to the scalar code.
const MOST_CUTS: f64 = 32.0;

/// Rows that there is room for from the first stretch on.
const USUAL: usize = 16;

/// Stretches of suspect legs, in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct Suspects {
    rows: Vec<StretchRow>,
    stretches: Vec<Owner>,
    legs: usize,
}

/// [`LANES`] stretches side by side.
#[derive(Debug, Clone, Copy)]
struct StretchRow {
    from: [Row; 3],
    way: [Row; 3],
    floor: Row,
    ceiling: Row,
}

/// What a stretch belongs to.
#[derive(Debug, Clone, Copy)]
struct Owner {
    /// Whose violation it counts to.
    slot: usize,
    leg: usize,
    floor: f64,
    terminal: bool,
}

impl Suspects {
    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.stretches.clear();
    }

    pub(super) fn next_leg(&mut self) {
        self.legs += 1;
    }

    /// Add the part `section` of `leg`, of whose squared length in spreads of the narrowest peak is
    /// `widest`, to `slot`.
    pub(super) fn push(&mut self, slot: usize, leg: &Segment, section: &Section, widest: f64) {
        let share = section.t1 - section.t0;
        let cuts = (share * (widest * (1.0 / WIDEST)).sqrt()).ceil();
        let cuts = cuts.clamp(1.0, MOST_CUTS);
        let mut from = leg.at(section.t0);
        let mut cut = 0.0;
        while cut < cuts {
            cut += 1.0;
            let to = leg.at(if cut < cuts {
                section.t0 + share * (cut / cuts)
            } else {
                section.t1
            });
            self.push_stretch(slot, from, to, section);
            from = to;
        }
    }

    fn push_stretch(&mut self, slot: usize, from: Point3, to: Point3, section: &Section) {
        let lane = self.stretches.len() % LANES;
        if self.rows.capacity() == 0 {
            self.rows.reserve(USUAL);
            self.stretches.reserve(USUAL * LANES);
        }
        let row = if lane == 0 {
            // Lanes that are left over repeat the first.
            let splat = |point: [f64; 3]| point.map(|value| [value; LANES]);
            self.rows.push(StretchRow {
                from: splat(from.coords.into()),
                way: splat((to - from).into()),
                floor: [section.floor; LANES],
                ceiling: [section.ceiling; LANES],
            });
            self.rows.last_mut()
        } else {
            self.rows.last_mut()
        };
        let row = row.expect("the first stretch of a row begins it");
        for axis in 0..3 {
            row.from[axis][lane] = from[axis];
            row.way[axis][lane] = to[axis] - from[axis];
        }
        row.floor[lane] = section.floor;
        row.ceiling[lane] = section.ceiling;
        self.stretches.push(Owner {
            slot,
            leg: self.legs,
            floor: section.floor,
            terminal: section.terminal,
        });
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, rows: &[Row; 3], part: usize) -> Point<S> {
    Point {
        x: Lane::load(simd, &rows[0], part),
        y: Lane::load(simd, &rows[1], part),
        z: Lane::load(simd, &rows[2], part),
    }
}

impl StretchRow {
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, part: usize) -> Stretch<S> {
        Stretch {
            from: load(simd, &self.from, part),
            way: load(simd, &self.way, part),
            floor: Lane::load(simd, &self.floor, part),
            ceiling: Lane::load(simd, &self.ceiling, part),
        }
    }

    fn segment(&self, lane: usize) -> Segment {
        let point = |axis: usize| self.from[axis][lane];
        let from = Point3::new(point(0), point(1), point(2));
        let way = |axis: usize| self.way[axis][lane];
        Segment {
            a: from,
            b: from + nalgebra::Vector3::new(way(0), way(1), way(2)),
        }
    }
}

impl Pricer<'_> {
    /// Measure all suspects above `massif` and pass the violation of each leg on with its slot.
    #[inline(always)]
    pub(super) fn measure<S: Simd>(
        &self,
        simd: S,
        massif: &Massif,
        suspects: &Suspects,
        mut each: impl FnMut(usize, f64),
    ) {
        let mut courses: Vec<Course<S>> = Vec::with_capacity(massif.peaks.len());
        let mut excess = Excess::default();
        let mut before: Option<&Owner> = None;
        for (row, owners) in suspects.rows.iter().zip(suspects.stretches.chunks(LANES)) {
            let (mut below, mut above) = ([0.0; LANES], [0.0; LANES]);
            for part in 0..parts::<S>() {
                let first = part * S::F64_LANES;
                if first >= owners.len() {
                    break;
                }
                let stretch = row.load(simd, part);
                let beyond = massif.beyond(&stretch, self.heights.overlooked, &mut courses);
                beyond.below.store(&mut below, part);
                beyond.above.store(&mut above, part);
                if beyond.unknown.any() {
                    beyond.unknown.each(|lane| {
                        let lane = first + lane;
                        (below[lane], above[lane]) = self.model.scenario.terrain.excess(
                            &row.segment(lane),
                            (0.0, 1.0),
                            row.floor[lane],
                            row.ceiling[lane],
                        );
                    });
                }
            }
            for (lane, owner) in owners.iter().enumerate() {
                if let Some(last) = before.filter(|last| last.leg != owner.leg) {
                    each(last.slot, excess.violation(self.tolerance));
                    excess = Excess::default();
                }
                excess.join(owner.terminal, owner.floor, (below[lane], above[lane]));
                before = Some(owner);
            }
        }
        if let Some(last) = before {
            each(last.slot, excess.violation(self.tolerance));
        }
    }
}
