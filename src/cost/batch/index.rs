//! Which threats a leg may meet, among many.
//!
//! Along each axis, every cell has two sets of threats: those that begin in it or before, and those that end in it or
//! after. A box meets the threats that begin before its end and end after its beginning along both axes. Sets are bits.
//! Where there are many words, neighbours share one, and sets of words tell which of them matter.

use pulp::Simd;

use super::leg::Leg;
use crate::geometry::Rect;
use crate::geometry::lane::{LANES, Lane};

/// Cells along an axis, a power of two.
const CELLS: usize = 256;

/// Added to a number from 0 to `CELLS`, leaves the nearest whole number in the last bits.
const WHOLE: f64 = (1_u64 << 52) as f64;

/// Threats to a word of a set.
const WORD: usize = 64;

/// So many words are all looked at.
const FEW_WORDS: usize = 2;

/// The threats by what their boxes cover of either axis.
#[derive(Debug)]
pub(super) enum Index {
    /// Each bit is a threat.
    Few(Sets),
    Many(Many),
}

/// Threats in an order in which neighbours share a word.
#[derive(Debug)]
pub(super) struct Many {
    /// The threat that each bit stands for. Sums are made in this order.
    pub(super) order: Vec<usize>,
    pub(super) threats: Sets,
    /// The words by what their threats cover.
    pub(super) words: Sets,
}

/// The sets of some boxes.
#[derive(Debug)]
pub(super) struct Sets {
    axes: [Axis; 2],
    pub(super) n_words: usize,
}

#[derive(Debug)]
struct Axis {
    origin: f64,
    per_metre: f64,
    /// For each cell, the words of its set.
    begun: Vec<u64>,
    not_ended: Vec<u64>,
}

/// Where the sets of some boxes begin along an axis, one box for each lane: those begun at their ends, and those not
/// ended at their beginnings.
pub(super) struct Places {
    begun: [usize; LANES],
    not_ended: [usize; LANES],
}

/// The members of a word of a set, in order.
pub(super) struct Near {
    bits: u64,
    first: usize,
}

impl Index {
    /// For the boxes round threats and their soft zones, at least one.
    pub(super) fn of(boxes: impl Iterator<Item = Rect>) -> Self {
        // Rounding errs on the side of including a threat.
        let boxes: Vec<Rect> = boxes
            .map(|extent| extent.grown(1e-6 * (1.0 + extent.diagonal())))
            .collect();
        let sets = Sets::of(&boxes);
        if sets.n_words <= FEW_WORDS {
            return Self::Few(sets);
        }
        let mut order: Vec<usize> = (0..boxes.len()).collect();
        order.sort_by_key(|threat_idx| sets.along_a_curve(&boxes[*threat_idx]));
        let boxes: Vec<Rect> = order.iter().map(|threat_idx| boxes[*threat_idx]).collect();
        let words = boxes.chunks(WORD).map(|word| {
            let corners = word.iter().flat_map(|extent| [extent.min, extent.max]);
            Rect::around(corners).expect("a chunk is not empty")
        });
        Self::Many(Many {
            words: Sets::of(&words.collect::<Vec<_>>()),
            threats: Sets::of(&boxes),
            order,
        })
    }
}

impl Iterator for Near {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.bits == 0 {
            return None;
        }
        let member = self.first + self.bits.trailing_zeros() as usize;
        self.bits &= self.bits - 1;
        Some(member)
    }
}

impl Sets {
    fn of(boxes: &[Rect]) -> Self {
        let n_words = boxes.len().div_ceil(WORD);
        let x = boxes.iter().map(|extent| [extent.min.x, extent.max.x]);
        let y = boxes.iter().map(|extent| [extent.min.y, extent.max.y]);
        Self {
            axes: [x.collect(), y.collect()].map(|spans| Axis::of(spans, n_words)),
            n_words,
        }
    }

    /// How far along a curve the middle of a box lies that leads from each cell to its neighbours first: the bits of
    /// column and row in turns, after Morton (1966).
    fn along_a_curve(&self, extent: &Rect) -> u32 {
        let middle = nalgebra::center(&extent.min, &extent.max);
        let [x, y] = [middle.x, middle.y];
        let [column, row] = [self.axes[0].cell(x), self.axes[1].cell(y)];
        (0..CELLS.ilog2()).fold(0, |along, bit| {
            let bit_of = |cell: usize| u32::from(cell >> bit & 1 == 1);
            along | bit_of(column) << (2 * bit) | bit_of(row) << (2 * bit + 1)
        })
    }

    /// Where the sets of the legs begin.
    #[inline(always)]
    pub(super) fn places<S: Simd>(&self, leg: &Leg<S>) -> [Places; 2] {
        let [x, y] = &self.axes;
        [
            x.places(leg.a.x.min(leg.b.x), leg.a.x.max(leg.b.x), self.n_words),
            y.places(leg.a.y.min(leg.b.y), leg.a.y.max(leg.b.y), self.n_words),
        ]
    }

    /// The members of a word whose boxes meet that of any lane's leg, and maybe some more.
    #[inline(always)]
    pub(super) fn near<S: Simd>(&self, [columns, rows]: &[Places; 2], word: usize) -> Near {
        let [x, y] = &self.axes;
        let mut bits = 0;
        for lane in 0..S::F64_LANES {
            bits |= x.begun[columns.begun[lane] + word]
                & x.not_ended[columns.not_ended[lane] + word]
                & y.begun[rows.begun[lane] + word]
                & y.not_ended[rows.not_ended[lane] + word];
        }
        Near {
            bits,
            first: word * WORD,
        }
    }
}

impl Axis {
    /// For spans from the first to the second.
    fn of(spans: Vec<[f64; 2]>, n_words: usize) -> Self {
        let ends = || spans.iter().flatten().copied();
        let origin = ends().fold(f64::INFINITY, f64::min);
        let extent = ends().fold(f64::NEG_INFINITY, f64::max) - origin;
        let mut axis = Self {
            origin,
            per_metre: (CELLS - 1) as f64 / extent,
            begun: vec![0; CELLS * n_words],
            not_ended: vec![0; CELLS * n_words],
        };
        for (threat_idx, [from, to]) in spans.into_iter().enumerate() {
            let (word, bit) = (threat_idx / WORD, 1 << (threat_idx % WORD));
            for cell in axis.cell(from)..CELLS {
                axis.begun[cell * n_words + word] |= bit;
            }
            for cell in 0..=axis.cell(to) {
                axis.not_ended[cell * n_words + word] |= bit;
            }
        }
        axis
    }

    /// The cell of a coordinate: the nearest one beyond the ends.
    fn cell(&self, at: f64) -> usize {
        let cells = (at - self.origin) * self.per_metre;
        cell(cells.clamp(0.0, (CELLS - 1) as f64) + WHOLE)
    }

    /// As `cell`, of the ends of boxes from `low` to `high`.
    #[inline(always)]
    fn places<S: Simd>(&self, low: Lane<S>, high: Lane<S>, n_words: usize) -> Places {
        Places {
            begun: self.place(high, n_words),
            not_ended: self.place(low, n_words),
        }
    }

    #[inline(always)]
    fn place<S: Simd>(&self, at: Lane<S>, n_words: usize) -> [usize; LANES] {
        let cells = (at - self.origin) * self.per_metre;
        let last = at.with((CELLS - 1) as f64);
        let row = (cells.clamp(at.with(0.0), last) + WHOLE).row();
        let mut places = [0; LANES];
        for lane in 0..S::F64_LANES {
            places[lane] = cell(row[lane]) * n_words;
        }
        places
    }
}

/// The whole number below `CELLS` that `WHOLE` was added to.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the last bits are enough")]
fn cell(whole: f64) -> usize {
    whole.to_bits() as usize % CELLS
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use proptest::prelude::*;
    use pulp::Scalar;

    use super::super::PointRow;
    use super::*;
    use crate::geometry::{Point2, Point3};

    fn rect() -> impl Strategy<Value = Rect> {
        let side = || (-2000.0..2000.0_f64, 0.0..500.0_f64);
        (side(), side()).prop_map(|((x, width), (y, height))| Rect {
            min: Point2::new(x, y),
            max: Point2::new(x + width, y + height),
        })
    }

    fn found(index: &Index, leg: &Leg<Scalar>) -> Vec<usize> {
        let members = |sets: &Sets, words: &[usize]| -> Vec<usize> {
            let (places, words) = (sets.places(leg), words.iter());
            words
                .flat_map(|word| sets.near::<Scalar>(&places, *word))
                .collect()
        };
        let all = |sets: &Sets| members(sets, &(0..sets.n_words).collect::<Vec<_>>());
        match index {
            Index::Few(threats) => all(threats),
            Index::Many(many) => {
                let bits = members(&many.threats, &all(&many.words)).into_iter();
                bits.map(|bit| many.order[bit]).collect()
            }
        }
    }

    proptest! {
        #[test]
        fn whoever_a_leg_may_meet_is_found_once(
            boxes in prop::collection::vec(rect(), 1..400),
            own in rect(),
            far in prop::bool::ANY,
        ) {
            let index = Index::of(boxes.iter().copied());
            // Beyond all of them, too.
            let scale = if far { 10.0 } else { 1.0 };
            let end = |at: Point2| Point3::new(scale * at.x, scale * at.y, 0.0);
            let [a, b] = [own.min, own.max].map(|at| PointRow::splat(end(at)));
            let leg = Leg::new(Scalar::new(), 0, [&a, &b]);
            let found = found(&index, &leg);
            let distinct: HashSet<_> = found.iter().collect();
            prop_assert_eq!(distinct.len(), found.len());
            let own = Rect { min: end(own.min).xy(), max: end(own.max).xy() };
            for (threat, extent) in boxes.iter().enumerate() {
                prop_assert!(!own.meets(extent) || found.contains(&threat), "{threat}");
            }
        }
    }

    #[test]
    fn what_is_far_is_left_out() {
        let boxes = (0..100).map(|i| {
            let min = Point2::new(f64::from(i % 10) * 100.0, f64::from(i / 10) * 100.0);
            Rect {
                min,
                max: Point2::new(min.x + 40.0, min.y + 40.0),
            }
        });
        let index = Index::of(boxes);
        let [a, b] =
            [[210.0, 310.0], [330.0, 410.0]].map(|[x, y]| PointRow::splat(Point3::new(x, y, 0.0)));
        let leg = Leg::new(Scalar::new(), 0, [&a, &b]);
        let mut found = found(&index, &leg);
        found.sort_unstable();
        assert_eq!(found, [32, 33, 42, 43]);
    }
}
