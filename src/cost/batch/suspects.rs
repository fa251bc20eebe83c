//! Legs that are not proven to keep their heights, until they are measured side by side.

use pulp::Simd;

use super::heights::SURELY;
use super::leg::Point;
use super::peaks::Massif;
use super::stretch::{Course, Stretch, WIDEST};
use super::{Price, Pricer};
use crate::cost::Section;
use crate::cost::band::Excess;
use crate::geometry::lane::{LANES, Lane, Row};
use crate::geometry::{Point3, Segment};

/// Maximum number of stretches of a leg; narrower peaks are left to the scalar code.
const MOST_CUTS: f64 = 32.0;

/// Suspect legs, in the order in which they came.
#[derive(Debug)]
pub(super) struct Suspects {
    legs: Vec<Suspect>,
    /// Slots from this one on are unused.
    slots: usize,
}

/// A leg to be measured.
#[derive(Debug, Clone, Copy)]
pub(super) struct Suspect {
    /// The slot to which its violation is added.
    pub(super) slot: usize,
    pub(super) leg: Segment,
    /// Its squared length in spreads of the narrowest peak near it.
    pub(super) widest: f64,
    /// Whether it meets a terminal zone.
    pub(super) in_zone: bool,
}

/// A part of a leg over which the same heights are allowed, or a part of that.
#[derive(Debug, Clone, Copy)]
struct Cut {
    slot: usize,
    /// Number of the leg among the suspects.
    leg_idx: usize,
    from: Point3,
    way: nalgebra::Vector3<f64>,
    floor: f64,
    ceiling: f64,
    terminal: bool,
}

/// What is known of the leg that is being measured.
#[derive(Default)]
struct Tally {
    excess: Excess,
    /// Its slot and its number.
    leg: Option<(usize, usize)>,
}

impl Suspects {
    /// For slots below `slots`.
    pub(super) fn of(slots: usize) -> Self {
        Self {
            legs: Vec::new(),
            slots,
        }
    }

    /// Whether `slot` is used.
    pub(super) fn wants(&self, slot: usize) -> bool {
        slot < self.slots
    }

    /// Forget all, for slots below `slots`.
    pub(super) fn clear(&mut self, slots: usize) {
        self.slots = slots;
        self.legs.clear();
    }

    pub(super) fn push(&mut self, suspect: Suspect) {
        self.legs.push(suspect);
    }
}

impl Suspect {
    /// Cut the part `section` of the leg into stretches.
    fn cut(&self, leg_idx: usize, section: &Section, cuts: &mut Vec<Cut>) {
        let share = section.t1 - section.t0;
        let count = (share * (self.widest * (1.0 / WIDEST)).sqrt()).ceil();
        let count = count.clamp(1.0, MOST_CUTS);
        let mut from = self.leg.at(section.t0);
        let mut cut = 0.0;
        while cut < count {
            cut += 1.0;
            let to = self.leg.at(if cut < count {
                section.t0 + share * (cut / count)
            } else {
                section.t1
            });
            cuts.push(Cut {
                slot: self.slot,
                leg_idx,
                from,
                way: to - from,
                floor: section.floor,
                ceiling: section.ceiling,
                terminal: section.terminal,
            });
            from = to;
        }
    }
}

impl Cut {
    fn segment(&self) -> Segment {
        Segment {
            a: self.from,
            b: self.from + self.way,
        }
    }

    /// Measures them side by side; unused lanes repeat the first.
    #[inline(always)]
    fn load<S: Simd>(simd: S, cuts: &[Self]) -> Stretch<S> {
        let (mut from, mut way) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        let mut limits = [[0.0; LANES]; 2];
        for lane in 0..S::F64_LANES {
            let cut = cuts.get(lane).unwrap_or(&cuts[0]);
            for axis in 0..3 {
                (from[axis][lane], way[axis][lane]) = (cut.from[axis], cut.way[axis]);
            }
            (limits[0][lane], limits[1][lane]) = (cut.floor, cut.ceiling);
        }
        let lane = |row: &Row| Lane::load(simd, row, 0);
        let point = |rows: &[Row; 3]| Point {
            x: lane(&rows[0]),
            y: lane(&rows[1]),
            z: lane(&rows[2]),
        };
        Stretch {
            from: point(&from),
            way: point(&way),
            floor: lane(&limits[0]),
            ceiling: lane(&limits[1]),
        }
    }
}

impl Tally {
    /// Note that a part of a leg reaches `beyond` its limits.
    fn note(&mut self, pricer: &Pricer, cut: &Cut, beyond: (f64, f64), prices: &mut [Price]) {
        if self.leg != Some((cut.slot, cut.leg_idx)) {
            self.settle(pricer, prices);
            self.leg = Some((cut.slot, cut.leg_idx));
        }
        self.excess.join(cut.terminal, cut.floor, beyond);
    }

    /// Add the violation of the leg to that of its slot.
    fn settle(&mut self, pricer: &Pricer, prices: &mut [Price]) {
        if let Some((slot, _)) = self.leg.take() {
            prices[slot / LANES].violation[slot % LANES] +=
                std::mem::take(&mut self.excess).violation(pricer.tolerance);
        }
    }
}

impl Pricer<'_> {
    /// Measure all `suspects` above `massif`, of which slot `k` has lane `k` of `prices` laid end to end.
    #[inline(always)]
    pub(super) fn measure<S: Simd>(
        &self,
        simd: S,
        massif: &Massif,
        suspects: &Suspects,
        prices: &mut [Price],
    ) {
        let mut courses: Vec<Course<S>> = Vec::with_capacity(massif.peaks.len());
        let mut tally = Tally::default();
        let mut cuts = Vec::with_capacity(2 * LANES);
        let mut legs = suspects.legs.iter().enumerate();
        loop {
            let next = legs.next();
            if let Some((leg_idx, suspect)) = next {
                self.cut(leg_idx, suspect, prices, &mut cuts);
            }
            // Whole parts, until the last.
            let mut measured = 0;
            while cuts.len() - measured >= S::F64_LANES || (next.is_none() && measured < cuts.len())
            {
                let part = &cuts[measured..cuts.len().min(measured + S::F64_LANES)];
                let stretch = Cut::load(simd, part);
                let surely = if self.verdict { SURELY } else { f64::INFINITY };
                let beyond = massif.beyond(&stretch, self.heights.overlooked, surely, &mut courses);
                let (below, above) = (beyond.below.row(), beyond.above.row());
                let any_unknown = beyond.unknown.any();
                let unknown = beyond.unknown.row();
                for (lane, cut) in part.iter().enumerate() {
                    let mut amounts = (below[lane], above[lane]);
                    if any_unknown && unknown[lane] {
                        amounts = self.model.scenario.terrain.excess(
                            &cut.segment(),
                            (0.0, 1.0),
                            cut.floor,
                            cut.ceiling,
                        );
                    }
                    tally.note(self, cut, amounts, prices);
                }
                measured += part.len();
            }
            cuts.drain(..measured);
            if next.is_none() {
                break;
            }
        }
        tally.settle(self, prices);
    }

    /// The stretches of `suspect`; none, where its slot is known to break a limit and that is enough.
    fn cut(&self, leg_idx: usize, suspect: &Suspect, prices: &[Price], cuts: &mut Vec<Cut>) {
        let slot = suspect.slot;
        if self.verdict && prices[slot / LANES].violation[slot % LANES] > 0.0 {
            return;
        }
        if suspect.in_zone {
            self.model.sections(&suspect.leg, |section| {
                suspect.cut(leg_idx, &section, cuts);
            });
        } else {
            suspect.cut(leg_idx, &self.model.outside(), cuts);
        }
    }
}
