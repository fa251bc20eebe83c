//! Sine, cosine, arc tangent, exponential and logarithm in lanes, by polynomials.
//!
//! Each function states its valid range and its greatest error there.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, LN_2, LOG2_E, PI, SQRT_2};

use pulp::Simd;

use super::Lane;

/// Adding and subtracting this rounds values below 2^51 to whole numbers, ties to even.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Pi / 2 in three parts; all but the last end in zeros, so that their products with whole numbers up to 2^20 are
/// exact.
const HALF_PI: [f64; 3] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_795_950_6e-21,
];

/// Ln 2 in two parts, the first ending in zeros.
const LN_2_PARTS: [f64; 2] = [0.693_147_180_485_539_1, 7.440_617_110_012_397e-11];

/// Coefficients of (atan x) / x in powers of x^2, for |x| <= tan(pi / 8): a Chebyshev fit, error 1.3e-18.
const ATAN: [f64; 12] = [
    1.0,
    -0.333_333_333_333_331_2,
    0.199_999_999_999_408_37,
    -0.142_857_142_792_449_68,
    0.111_111_107_446_570_99,
    -0.090_908_968_014_728_13,
    0.076_920_451_945_614_81,
    -0.066_629_502_460_367_92,
    0.058_468_667_522_751_39,
    -0.050_350_497_953_124_39,
    0.037_963_903_161_110_83,
    -0.017_803_896_394_812_564,
];

/// Taylor coefficients of (sin x) / x and cos x, in powers of x^2.
const SIN: [f64; 8] = [
    1.0,
    -1.0 / 6.0,
    1.0 / 120.0,
    -1.0 / 5_040.0,
    1.0 / 362_880.0,
    -1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 1_307_674_368_000.0,
];
const COS: [f64; 9] = [
    1.0,
    -0.5,
    1.0 / 24.0,
    -1.0 / 720.0,
    1.0 / 40_320.0,
    -1.0 / 3_628_800.0,
    1.0 / 479_001_600.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 20_922_789_888_000.0,
];

/// Coefficients of e^x in powers of x, for |x| <= ln 2 / 2: a Chebyshev fit, error 3.2e-18.
const EXP: [f64; 12] = [
    1.0,
    1.0,
    0.500_000_000_000_001_9,
    0.166_666_666_666_666_8,
    0.041_666_666_666_487_95,
    0.008_333_333_333_319_589,
    0.001_388_888_895_235_286_3,
    0.000_198_412_698_900_703_76,
    2.480_148_544_156_131e-5,
    2.755_724_088_722_987e-6,
    2.763_265_472_252_779e-7,
    2.511_004_920_481_865_8e-8,
];

/// Coefficients of (artanh x) / x in powers of x^2, for |x| <= 1/3: a Chebyshev fit, error 1.3e-18.
const ARTANH: [f64; 11] = [
    1.0,
    0.333_333_333_333_330_76,
    0.200_000_000_000_929_63,
    0.142_857_142_727_158_77,
    0.111_111_120_410_802_48,
    0.090_908_703_907_578_03,
    0.076_933_075_786_181_14,
    0.066_501_795_036_087_73,
    0.060_551_453_216_251_896,
    0.041_619_803_216_855_066,
    0.085_225_996_322_789,
];

/// 2^52: its lowest bit is 1.
const COUNTER: f64 = 4_503_599_627_370_496.0;

/// The exponent bits, and those of 1.
const EXPONENT: u64 = 0x7ff << 52;
const ONE: u64 = 0x3ff << 52;

impl<S: Simd> Lane<S> {
    /// Sine and cosine, to 2 units in the last place of 1 for |x| <= 10^5.
    #[inline(always)]
    pub(crate) fn sin_cos(self) -> (Self, Self) {
        let quarters = self.rounded_product(FRAC_2_PI);
        let x = self - quarters * HALF_PI[0] - quarters * HALF_PI[1] - quarters * HALF_PI[2];
        let square = x * x;
        let (sin, cos) = (x * square.polynomial(&SIN), square.polynomial(&COS));
        // -2 to 2: the quadrant, modulo 4.
        let quarter = quarters - quarters.rounded_product(0.25) * 4.0;
        let odd = (quarter.abs() - 1.0).abs().lt(self.with(0.5));
        let sin_falls = quarter.lt(self.with(-0.5)) | self.with(1.5).lt(quarter);
        let cos_falls = quarter.lt(self.with(-1.5)) | self.with(0.5).lt(quarter);
        let (sin, cos) = (odd.select(cos, sin), odd.select(sin, cos));
        (sin_falls.select(-sin, sin), cos_falls.select(-cos, cos))
    }

    /// The angle in `[0, pi]` of the direction `(x, self)`, `self` >= 0, to 3 units in the last place; 0 if both are
    /// 0.
    #[inline(always)]
    pub(crate) fn atan2(self, x: Self) -> Self {
        let (y, zero) = (self, self.with(0.0));
        let away = x.abs();
        let steep = away.lt(y);
        let (least, greatest) = (y.min(away), y.max(away));
        // Beyond pi / 8, atan q = pi / 4 + atan((q - 1) / (q + 1)).
        let wide = (greatest * (SQRT_2 - 1.0)).lt(least);
        let over = wide.select(least - greatest, least);
        let under = wide.select(least + greatest, greatest);
        let q = over / zero.lt(under).select(under, self.with(1.0));
        let angle = q * (q * q).polynomial(&ATAN) + wide.keep(self.with(FRAC_PI_4));
        let angle = steep.select(self.with(FRAC_PI_2) - angle, angle);
        x.lt(zero).select(self.with(PI) - angle, angle)
    }

    /// e^x, to 2 units in the last place for |x| <= 700.
    #[inline(always)]
    pub(crate) fn exp(self) -> Self {
        let doublings = self.rounded_product(LOG2_E);
        let x = self - doublings * LN_2_PARTS[0] - doublings * LN_2_PARTS[1];
        // The whole number is in the last bits of its sum with the rounder.
        let scale = (doublings + ROUNDER)
            .map(|_, sum| f64::from_bits((sum.to_bits() << 52).wrapping_add(ONE)));
        x.polynomial(&EXP) * scale
    }

    /// e^x for -36 <= x <= 0, to 1.2e-8: e^(x / 64), squared six times.
    #[inline(always)]
    pub(crate) fn exp_roughly(self) -> Self {
        let part = self * (1.0 / 64.0);
        let mut power = part * (1.0 / 24.0) + 1.0 / 6.0;
        power = power * part + 0.5;
        power = power * part + 1.0;
        power = power * part + 1.0;
        let mut squarings = 0;
        while squarings < 6 {
            power = power * power;
            squarings += 1;
        }
        power
    }

    /// The logarithm of `self / divisor`, both > 0 and the quotient >= 1 and finite, to 3 units in the last place of
    /// the result or of 1, whichever is greater. For other operands the result is undefined.
    #[inline(always)]
    pub(crate) fn ln_over(self, divisor: Self) -> Self {
        // The quotient of both powers of two; the rest lies between 1/2 and 2.
        let power = self.zip(divisor, |over, under| {
            // In an unused lane the quotient may be anything.
            let power = (over.to_bits() & EXPONENT).wrapping_add(ONE);
            f64::from_bits(power.wrapping_sub(under.to_bits() & EXPONENT))
        });
        let exponent = power
            .map(|_, value| f64::from_bits((value.to_bits() >> 52) | COUNTER.to_bits()))
            - (COUNTER + 1023.0);
        let reduced = divisor * power;
        let f = (self - reduced) / (self + reduced);
        exponent * LN_2 + f * 2.0 * (f * f).polynomial(&ARTANH)
    }

    /// The whole number nearest to `self * factor`.
    #[inline(always)]
    fn rounded_product(self, factor: f64) -> Self {
        self * factor + ROUNDER - ROUNDER
    }

    /// The polynomial of `self` with `coefficients`, constant first. Even and odd powers are summed separately, so
    /// that the processor evaluates them in parallel.
    #[inline(always)]
    fn polynomial<const N: usize>(self, coefficients: &[f64; N]) -> Self {
        let square = self * self;
        let (mut sums, mut idx) = ([self.with(0.0); 2], N);
        while idx > 0 {
            idx -= 1;
            sums[idx % 2] = sums[idx % 2] * square + coefficients[idx];
        }
        sums[0] + self * sums[1]
    }
}

#[cfg(test)]
mod tests {
    use super::super::{LANES, Row};
    use super::*;
    use proptest::prelude::*;
    use pulp::{Arch, Scalar, WithSimd};

    #[derive(Clone, Copy)]
    enum Function {
        Sin,
        Cos,
        Atan2,
        Exp,
        ExpRoughly,
        LnOver,
    }
    use Function::{Atan2, Cos, Exp, ExpRoughly, LnOver, Sin};

    /// `function` applied to each pair of numbers of two rows.
    struct Apply(Function, Row, Row);

    impl WithSimd for Apply {
        type Output = Row;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Row {
            let mut result = [0.0; LANES];
            for part in 0..super::super::parts::<S>() {
                let x = Lane::load(simd, &self.1, part);
                let y = Lane::load(simd, &self.2, part);
                let value = match self.0 {
                    Sin => x.sin_cos().0,
                    Cos => x.sin_cos().1,
                    Atan2 => x.atan2(y),
                    Exp => x.exp(),
                    ExpRoughly => x.exp_roughly(),
                    LnOver => x.ln_over(y),
                };
                value.store(&mut result, part);
            }
            result
        }
    }

    /// The values, which are the same at every vector width.
    fn apply(function: Function, x: Row, y: Row) -> Row {
        let wide = Arch::new().dispatch(Apply(function, x, y));
        let scalar = Apply(function, x, y).with_simd(Scalar::new());
        assert_eq!(wide.map(f64::to_bits), scalar.map(f64::to_bits));
        wide
    }

    #[track_caller]
    fn check(function: Function, x: f64, y: f64, expected: f64, bound: f64) {
        let value = apply(function, [x; LANES], [y; LANES])[0];
        assert!(
            (value - expected).abs() <= bound * f64::EPSILON,
            "{x} {y}: {value} {expected}, {} eps",
            (value - expected).abs() / f64::EPSILON
        );
    }

    #[test]
    fn corners() {
        for quarter in -9..=9 {
            let x = f64::from(quarter) * FRAC_PI_2;
            check(Sin, x, 0.0, libm::sin(x), 2.0);
            check(Cos, x, 0.0, libm::cos(x), 2.0);
        }
        check(Atan2, 0.0, 0.0, 0.0, 0.0);
        check(Atan2, 0.0, -1.0, PI, 0.0);
        check(Atan2, 1.0, 0.0, FRAC_PI_2, 0.0);
        check(Atan2, 1e-300, 1.0, 1e-300, 0.0);
        check(Exp, 0.0, 0.0, 1.0, 0.0);
        check(LnOver, 3.0, 3.0, 0.0, 0.0);
        check(LnOver, 1e18, 1.0, libm::log(1e18), 64.0);
    }

    #[test]
    fn lanes_that_do_not_count_may_hold_anything() {
        let [mut over, mut under] = [[3.0; LANES]; 2];
        (over[1], under[1]) = (0.0, 1e300);
        (over[2], under[2]) = (-2.0, 5.0);
        let logarithms = apply(LnOver, over, under);
        for lane in [0, 3, 4, 5, 6, 7] {
            assert!(logarithms[lane].abs() < 1e-15);
        }
    }

    proptest! {
        #[test]
        fn close_to_the_library(
            angle in -1e5..1e5f64, small in -7.0..7.0f64, y in 0.0..1e4f64, x in -1e4..1e4f64,
            exponent in -700.0..700.0f64, divisor in 1e-3..1e3f64, ratio in 0.0..40.0f64,
        ) {
            for angle in [angle, small] {
                check(Sin, angle, 0.0, libm::sin(angle), 2.0);
                check(Cos, angle, 0.0, libm::cos(angle), 2.0);
            }
            let direction = libm::atan2(y, x);
            check(Atan2, y, x, direction, 3.0 * direction.max(1e-3));
            let power = libm::exp(exponent);
            check(Exp, exponent, 0.0, power, 2.0 * power);
            let gentle = -ratio.min(36.0);
            check(ExpRoughly, gentle, 0.0, libm::exp(gentle), 1.2e-8 / f64::EPSILON);
            let dividend = divisor * libm::exp(ratio);
            let logarithm = libm::log(dividend / divisor);
            check(LnOver, dividend.max(divisor), divisor, logarithm.max(0.0), 3.0 * logarithm.abs().max(0.7));
        }
    }
}
