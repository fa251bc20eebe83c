//! SIMD lanes: the same arithmetic on as many numbers as the processor handles at once.
//!
//! Every operation is exactly defined by IEEE 754 (`+ - * /`, square root, comparison, selection), so that a lane has
//! the same bits at any vector width. Deliberately absent: fused multiplication, approximate reciprocals, and
//! operations that mix lanes.

mod elementary;

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use pulp::Simd;

/// Numbers in a [`Row`]; every vector width divides it.
pub const LANES: usize = 8;

/// The same quantity of [`LANES`] items, in memory.
pub type Row = [f64; LANES];

/// As many numbers as `S` handles at once: a part of a [`Row`], in registers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lane<S: Simd> {
    simd: S,
    values: S::f64s,
}

/// A condition for each number of a [`Lane`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mask<S: Simd> {
    simd: S,
    values: S::m64s,
}

/// Number of parts into which `S` divides a [`Row`].
#[inline(always)]
pub(crate) fn parts<S: Simd>() -> usize {
    LANES / S::F64_LANES
}

impl<S: Simd> Lane<S> {
    /// `value` in every lane.
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        Self {
            simd,
            values: simd.splat_f64s(value),
        }
    }

    /// Part `part` of `row`.
    #[inline(always)]
    pub(crate) fn load(simd: S, row: &Row, part: usize) -> Self {
        Self {
            simd,
            values: S::as_simd_f64s(row).0[part],
        }
    }

    /// Write the lane to part `part` of `row`.
    #[inline(always)]
    pub(crate) fn store(self, row: &mut Row, part: usize) {
        S::as_mut_simd_f64s(row).0[part] = self.values;
    }

    /// The lane in memory, padded with 0.
    #[inline(always)]
    pub(crate) fn row(self) -> Row {
        let mut row = [0.0; LANES];
        self.store(&mut row, 0);
        row
    }

    /// `value` in every lane of the same width.
    #[inline(always)]
    pub(crate) fn with(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    /// Apply `each` to one number at a time; for operations without a vector form.
    #[inline(always)]
    pub(crate) fn map(self, mut each: impl FnMut(usize, f64) -> f64) -> Self {
        let mut row = self.row();
        for (lane, value) in row[..S::F64_LANES].iter_mut().enumerate() {
            *value = each(lane, *value);
        }
        Self::load(self.simd, &row, 0)
    }

    /// As `map`, for two operands.
    #[inline(always)]
    pub(crate) fn zip(self, other: Self, mut each: impl FnMut(f64, f64) -> f64) -> Self {
        let others = other.row();
        self.map(|lane, value| each(value, others[lane]))
    }

    /// The same with `value` in one lane.
    #[inline(always)]
    pub(crate) fn set(self, lane: usize, value: f64) -> Self {
        self.map(|own, old| if own == lane { value } else { old })
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self {
            values: self.simd.sqrt_f64s(self.values),
            ..self
        }
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        Self {
            values: self.simd.abs_f64s(self.values),
            ..self
        }
    }

    #[inline(always)]
    pub(crate) fn lt(self, other: Self) -> Mask<S> {
        Mask {
            simd: self.simd,
            values: self.simd.less_than_f64s(self.values, other.values),
        }
    }

    #[inline(always)]
    pub(crate) fn le(self, other: Self) -> Mask<S> {
        Mask {
            simd: self.simd,
            values: self.simd.less_than_or_equal_f64s(self.values, other.values),
        }
    }

    /// The lesser; `other` if either is NaN.
    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        self.lt(other).select(self, other)
    }

    /// The greater; `other` if either is NaN.
    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        other.lt(self).select(self, other)
    }

    /// Clamped to `[low, high]`; `low` for NaN.
    #[inline(always)]
    pub(crate) fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
}

impl<S: Simd> Mask<S> {
    /// `yes` where the condition holds, elsewhere `no`.
    #[inline(always)]
    pub(crate) fn select(self, yes: Lane<S>, no: Lane<S>) -> Lane<S> {
        Lane {
            simd: self.simd,
            values: self.simd.select_f64s(self.values, yes.values, no.values),
        }
    }

    /// `yes` where the condition holds, elsewhere 0.
    #[inline(always)]
    pub(crate) fn keep(self, yes: Lane<S>) -> Lane<S> {
        self.select(yes, yes.with(0.0))
    }

    /// Whether the condition holds in any lane.
    #[inline(always)]
    pub(crate) fn any(self) -> bool {
        self.simd.first_true_m64s(self.values) < S::F64_LANES
    }

    /// Whether the condition holds in every lane.
    #[inline(always)]
    pub(crate) fn all(self) -> bool {
        !(!self).any()
    }

    /// The mask in memory, padded with false.
    #[inline(always)]
    pub(crate) fn row(self) -> [bool; LANES] {
        let one = Lane::splat(self.simd, 1.0);
        self.keep(one).row().map(|holds| holds > 0.0)
    }

    /// Call `each` for the lanes in which the condition holds.
    #[inline(always)]
    pub(crate) fn each(self, mut each: impl FnMut(usize)) {
        let _ = self.map(|lane| {
            each(lane);
            0.0
        });
    }

    /// `each` for the lanes in which the condition holds, elsewhere 0.
    #[inline(always)]
    pub(crate) fn map(self, mut each: impl FnMut(usize) -> f64) -> Lane<S> {
        let one = Lane::splat(self.simd, 1.0);
        self.keep(one)
            .map(|lane, holds| if holds > 0.0 { each(lane) } else { 0.0 })
    }
}

impl<S: Simd> BitAnd for Mask<S> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self {
            values: self.simd.and_m64s(self.values, other.values),
            ..self
        }
    }
}

impl<S: Simd> BitOr for Mask<S> {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self {
            values: self.simd.or_m64s(self.values, other.values),
            ..self
        }
    }
}

impl<S: Simd> Not for Mask<S> {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self {
            values: self.simd.not_m64s(self.values),
            ..self
        }
    }
}

impl<S: Simd> Neg for Lane<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            values: self.simd.neg_f64s(self.values),
            ..self
        }
    }
}

macro_rules! operator {
    ($operator:ident, $method:ident, $simd_method:ident) => {
        impl<S: Simd> $operator for Lane<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self {
                    values: self.simd.$simd_method(self.values, other.values),
                    ..self
                }
            }
        }

        impl<S: Simd> $operator<f64> for Lane<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                self.$method(self.with(other))
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);
